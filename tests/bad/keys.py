"""Small systems, and values for the keys of their tables that show: for the hunt of keys without effect."""

import copy

import numpy as np

import modalprep as mp
from modalprep.multibody.deploying.simulate import simulate_deployment
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.model.joint import CONSTANTS
from modalprep.multibody.model.joint_types import JOINT_TYPES
from modalprep.pipeline.building.build import read_bodies
from modalprep.pipeline.schema import chain, changing, environment, force_elements
from modalprep.pipeline.schema import system as system_tables
from modalprep.pipeline.schema.changing import read_events
from modalprep.pipeline.schema.load import load
from modalprep.pipeline.systems.read import system_of

BODY = {"mass": 2.0, "centre": [0.4, 0.1, 0.05], "inertia": [0.2, 0.5, 0.6, 0.02, -0.03, 0.01]}
ENDS = {"root": [0.0, 0.0, 0.0], "tip": [1.0, 0.2, -0.1]}
TURN = {"axis": [1.0, 2.0, -1.0], "angle": 0.4}


FLIGHT = {"velocity": [0.3, 0.5, -0.2], "angular_velocity": [1, 2, -1]}


def base():
    """Two rigid bodies that move in all directions, the second one on the first."""
    bodies = {name: BODY | {"interfaces": ENDS} for name in "abc"}
    joints = {
        "p": {"type": "free", "child": "a.root", "start": FLIGHT},
        "q": {"type": "universal", "parent": "a.tip", "child": "b.root", "axis": [1, 0, 0], "second_axis": [0, 1, 0]},
        "r": {"type": "revolute", "child": "c.root", "start": {"rate": 2.0}},
    }  # fmt: skip
    return {
        "bodies": copy.deepcopy(bodies),
        "joints": joints,
        "environment": {"gravity": [1.3, -9.81, 2.1]},
        "simulation": {"t_end": 0.1, "output_step": 0.02, "method": "explicit"},
    }


def system(path):
    """Return a pipeline file and its system."""
    source = load(path)
    return source, system_of(source, read_bodies(source, None))


class Family:
    """A table of a pipeline file with its variants.

    Parameters
    ----------
    table : class of the schema
    place : (str, str)
        Where it stands in the file.
    variants : dict of str to table
        What each of them needs.
    values : dict of str to list
        For each further key values of which one shows; a dot leads into a table inside.
    around : dict
        Other tables of the file.
    """

    def __init__(self, table, place, variants, values, around=None, start=base):
        self.table, self.place, self.variants = table, place, variants
        self.values, self.around, self.start = values, around or {}, start

    def file(self, variant, given):
        """Return the pipeline file of a variant with further keys."""
        file = self.start()
        for name, tables in self.around.items():
            file[name] = copy.deepcopy(file.get(name, {}) | tables)
        inside = file
        for key in self.place[:-1]:
            inside = inside.setdefault(key, {})
        own = copy.deepcopy(self.variants[variant])
        for key, value in copy.deepcopy(given).items():
            first, _, rest = key.partition(".")
            if rest:
                own.setdefault(first, {})[rest] = value
            else:
                own[first] = value
        inside[self.place[-1]] = own if self.place[-1] != "notch" else [own]
        return file

    def result(self, path):
        """Return the run of a pipeline file."""
        source, made = system(path)
        pipeline = source.pipeline
        s = pipeline.simulation
        given = {"t_end": s.t_end, "output_step": s.output_step, "method": s.method}
        if isinstance(made, DeployingSystem):
            return simulate_deployment(made, **given)
        return mp.simulate(made, events=read_events(pipeline.events), **given)

    def same(self, one, other):
        """Whether two runs show no difference beyond round-off."""
        if (one.notes, one.message, _times(one)) != (other.notes, other.message, _times(other)):
            return False
        if one.channels.keys() != other.channels.keys():
            return False
        return all(
            _same_values(one.channels[key], other.channels[key]) for key in one.channels if key != "energy.error"
        )

    def notes(self, result):
        """Return what was noted."""
        return " ".join(result.notes)


def lists(value, *counts):
    """A value for each coordinate: of one, then of several."""
    return [value, *[[value] * n for n in counts]]


NEEDED = {
    name: {constant.name: 0.1 for constant in steps.constants}
    | ({"second_axis": [0, 1, 0]} if steps.second_axis == "needed" else {})
    for name, steps in JOINT_TYPES.items()
}
HINGE = {
    "axis": [[0.6, 0.2, 0.8]],
    "second_axis": [[0.3, 1.0, 0.2]],
    **{key: [0.2] for key in CONSTANTS},
    "position": [[0.1, 0.2, 0.3]],
    "rotation": [TURN],
    "start.angle": lists(0.3, 2, 3),
    "start.rate": lists(0.7, 2, 3),
    "start.displacement": lists(0.1, 2),
    "start.speed": lists(0.4, 2),
    "start.velocity": [[0.3, -0.2, 0.5]],
    "start.angular_velocity": [[0.3, -0.2, 0.5]],
    "motion": lists("0.2*sin(3*t) + 0.1*t", 2, 3),
    "stiffness": lists(500.0, 2, 3, 6),
    "free_position": lists(0.2, 2, 3, 6),
    "damping": lists(30.0, 2, 3, 6),
    "friction": lists(2.0, 2, 3, 6),
    "limits": lists({"upper": -0.01, "stiffness": 1e4}, 2, 3, 6),
    "force": lists(30.0, 2, 3),
    "torque": lists(30.0, 2, 3),
}
JOINTS = {f"{kind} to {parent}": {"type": kind, "parent": parent, "child": "c.root", **NEEDED[kind]}
          for kind in JOINT_TYPES for parent in ("ground", "a.tip")}  # fmt: skip

CLOSURE_NEEDS = {
    "universal": {"second_axis": [0, 1, 0]},
    "position": {"path": [0.0, "free", "free"]},
}
CLOSURE_TYPES = (
    "weld", "revolute", "prismatic", "cylindrical", "universal", "spherical", "planar", "point_on_line",
    "point_on_plane", "distance", "position",
)  # fmt: skip
CLOSURES = {f"{kind} of {b}": {"type": kind, "a": "a.tip", "b": b, **CLOSURE_NEEDS.get(kind, {})}
            for kind in CLOSURE_TYPES for b in ("ground", "c.root")}  # fmt: skip
CLOSURE = {
    "axis": [[0.6, 0.2, 0.8]],
    "second_axis": [[0.3, 1.0, 0.2]],
    "position": [[1.1, 0.25, -0.15]],
    "rotation": [TURN],
    "length": [1.3],
    "path": [[0.1, "free", "0.2*t"]],
    "friction_coefficient": [0.5],
    "transition_velocity": [0.5],
    "active": [False],
}
LOOSE = {"joints": {"r": {"type": "free", "child": "c.root", "start": {"velocity": [0.1, 0.2, 0.3]}}}}

BETWEEN = {"ground": ["ground", "b.tip"], "bodies": ["a.root", "c.tip"]}  # which part, and which approach
TWO = {name: {"between": ends} for name, ends in BETWEEN.items()}
ORBITS = {"altitude": {"altitude": 4e5}, "radius": {"radius": 7e6}, "rate": {"rate": 1.1e-3}}
ORBIT = {
    "mu": [5e14], "inclination": [0.6], "argument_of_latitude": [0.7], "planet_spin": [1e-3],
    "dipole": [{"strength": 3.5e-5}], "dipole.tilt": [0.2], "dipole.longitude": [0.5], "dipole.radius": [6e6],
    "dipole.strength": [6e-5],
}  # fmt: skip
STILL = {"environment": {"gravity": [0.0, 0.0, 0.0]}}
WIRE = {"conductors": {"wire": {"through": ["b.root", "b.tip"], "current": 1e6}}}
ROD = {"immersed": {"rods": {"bodies": "b", "diameter": 0.1}}}


def exit_only():
    """One rigid body in flight, from which something deploys."""
    return {key: value for key, value in base().items() if key not in ("bodies", "joints")} | {
        "bodies": {"a": BODY | {"interfaces": ENDS}},
        "joints": {"p": {"type": "free", "child": "a.root", "start": FLIGHT}},
    }


SPAR = {"length": 1.0, "segments": 3, "mass_per_length": 1.0}
ROPE = {"length": 2.0, "segments": 4, "mass_per_length": 1.0}
FULL_AND_EMPTY = {"body": "b", "empty": {"mass": 1.0, "inertia": [0.1, 0.2, 0.3]}, "rate": 2.0}

FAMILIES = {
    "segmented beam": Family(
        chain.BeamTable, ("beams", "x"),
        {"plane": SPAR | {"EI": 5.0, "root": {"start": {"rate": 3.0}}},
         "space": SPAR | {"EI": [5.0, 9.0], "root": {"start": {"rate": [3.0, 1.0]}}},
         "soft": SPAR | {"EI": 5.0, "EA": 1e3, "GA": 1e3}},
        {"rotary_inertia": [[0.01, 0.01, 0.01]], "GJ": [4.0], "EA": [2e3], "GA": [2e3], "curvature": [0.3],
         "damping": [0.01], "parent": ["c.tip"], "root": [{"stiffness": 2.0}, {"type": "revolute", "stiffness": 2.0}]},
    ),
    "deployment": Family(
        changing.DeploymentTable, ("deployments", "x"),
        {"boom": ROPE | {"EI": 5.0, "deployed_length": "0.6 + t"}, "cable": ROPE | {"deployed_length": "0.6 + t"},
         "reel": ROPE | {"tension": 2.0, "initial_length": 0.6}},
        {"axis": [[0.0, 1.0, 0.0]], "normal": [[0.5, 1.0, 1.0]], "position": [[0.1, 0.2, 0.3]], "EI": [7.0],
         "damping": [0.02], "brake": [3.0], "initial_length": [0.7], "initial_speed": [1.0], "stop_time": [0.05],
         "spatial": [True], "rotary_inertia": [0.02], "deflection": [0.05], "parent": ["a.tip"]}, start=exit_only,
    ),
    "coupler": Family(
        system_tables.CouplerTable, ("couplers", "x"), {"two": {"factors": {"q.1": 1.0, "r": 2.0}}},
        {"value": ["0.1*t"], "active": [False]},
    ),
    "immersed rod": Family(
        force_elements.ImmersedTable, ("immersed", "x"), {"b": {"bodies": "b", "diameter": 0.1}},
        {"normal_drag": [2.0], "tangential_drag": [0.5], "added_mass": [2.0]}, {"environment": {"water": {}}},
    ),
    "depletion": Family(
        changing.DepletionTable, ("depletions", "x"), {"rate": FULL_AND_EMPTY},
        {"intermediate": [[{"mass": 1.5, "inertia": [0.1, 0.3, 0.35]}]], "mass": ["2 - t"]},
    ),
    "jet": Family(
        changing.JetTable, ("jets", "x"),
        {"of b": {"at": "b.tip", "depletion": "d", "speed": 100.0, "axis": [1, 0, 0]}},
        {"mass_fraction": [0.5], "pressure": [5.0], "flow_path": [["b.root"]]}, {"depletions": {"d": FULL_AND_EMPTY}},
    ),
    "joint": Family(system_tables.JointTable, ("joints", "r"), JOINTS, HINGE | {"keep_start": [True]}),
    "closure": Family(system_tables.ClosureTable, ("closures", "x"), CLOSURES, CLOSURE, LOOSE),
    "force": Family(
        force_elements.ForceTable, ("forces", "x"),
        {"at": {"at": "b.tip"}, "body": {"body": "b", "force": [1.0, 20.0, 3.0]}},
        {"force": [[3.0, 40.0, 5.0]], "torque": [[3.0, 4.0, 5.0]], "factor": [3.0], "axes": ["body"],
         "box": [[[0.5, 0, -1], [2, 1, 1]]]},
    ),
    "spring": Family(
        force_elements.AxialSpringTable, ("springs", "x"), TWO | {"ground": TWO["ground"] | {"position": [2, -3, -6]}},
        {"stiffness": [500.0], "damping": [30.0], "free_length": [0.3], "position": [[0.2, 0.3, 0.4]],
         "actuator_force": [30.0], "tension_only": [True]},
    ),
    "bushing": Family(
        force_elements.BushingTable, ("bushings", "x"), TWO,
        {"stiffness": [[500.0] * 6], "damping": [[30.0, 10.0, 20.0, 3.0, 1.0, 2.0]], "free_position": [[0.1, 0.2, 0.3]],
         "free_rotation": [TURN], "position": [[0.2, 0.3, 0.4]], "rotation": [TURN]},
    ),
    "rotational spring": Family(
        force_elements.RotationalSpringTable, ("rotational_springs", "x"), TWO,
        {"axis": [[0.6, 0.2, 0.8]], "stiffness": [500.0], "damping": [30.0], "free_angle": [0.3], "rotation": [TURN],
         "characteristic": [{"angle": [-1, 1], "torque": [-200, 200]}],
         "damping_characteristic": [{"rate": [-1, 1], "torque": [-20, 20]}]},
    ),
    "control": Family(
        environment.ControlTable, ("controls", "x"),
        {"force": {"at": "b.tip", "force": [1.0, "20*t", 3.0]}, "joint": {"at": "r", "values": ["-3*r.rate"]}},
        {"force": [[3.0, 40.0, 5.0]], "torque": [[3.0, 4.0, 5.0]], "values": [[7.0]], "axes": ["body"]},
    ),
    "orbit": Family(environment.OrbitTable, ("environment", "orbit"), ORBITS, ORBIT, STILL),
    "orbit with a wire": Family(
        environment.OrbitTable, ("environment", "orbit"),
        {name: ORBITS[name] | {"dipole": {"strength": 3.1e-5}} for name in ("altitude", "radius")}, ORBIT, STILL | WIRE,
    ),
    "water": Family(
        environment.WaterTable, ("environment", "water"), {"still": {}, "deep": {"current": [[1, 2, 3], [0, 1, 0]],
                                                                                "depths": [-1.0, 1.0]}},
        {"density": [900.0], "current": [[2.0, 1.0, 0.0], [[2, 1, 0], [0, 1, 1]]], "depths": [[-0.5, 0.5]],
         "up": [[0.0, 1.0, 0.0]], "surface": [0.3]},
        ROD,
    ),
    "event": Family(
        changing.EventTable, ("events", "x"),
        {"seen": {"when": "sin(80*t + 0.1)"}, "opens": {"when": "sin(80*t + 0.1)", "deactivates": ["port"]}},
        {"direction": ["rising"], "terminal": [True], "deactivates": [["port"]], "restitution": [0.5], "once": [True]},
        LOOSE | {"closures": {"port": {"type": "spherical", "a": "a.tip", "b": "c.root"}}},
    ),
}  # fmt: skip


def _times(run):
    return {name: np.round(times, 9).tolist() for name, times in run.events.items()}


def _same_values(a, b):
    a, b = np.asarray(a), np.asarray(b)
    return a.shape == b.shape and np.allclose(
        a, b, rtol=1e-9, atol=1e-9 * max(1.0, np.nan_to_num(np.abs(a)).max(initial=0.0)), equal_nan=True
    )
