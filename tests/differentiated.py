"""Systems whose runs are differentiated, and the derivatives of runs by differences."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from multibody.mechanisms import slider_crank
from multibody.trees import with_dampers

import modalprep as mp
from modalprep.examples import large_cantilever, uniform_beam
from modalprep.multibody.model.constraints import Closure, Coupler
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import AxialSpring, Bushing
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.sensitivity import Objective, Parameter, changed
from modalprep.sensitivity.course import Course, Options
from modalprep.sensitivity.observed import Observer, find_channel
from modalprep.sensitivity.parameters import find

STEP = 5e-3  # of differences of runs, in sizes of the parameter
PLACES, WEIGHTS = np.array([-2, -1, 1, 2]), np.array([1, -8, 8, -1]) / 12  # fourth order
TIGHT = {"rtol": 1e-12, "atol": 1e-15}


@dataclass
class Case:
    """A system, channels, parameters and a duration (s); options of the run."""

    system: mp.System
    channels: list[str]
    parameters: list
    duration: float
    options: dict[str, Any] = field(default_factory=lambda: {"rtol": 1e-10})
    fixed: bool = False  # the steps: then differences are of the same steps, without momenta restored

    @property
    def times(self):
        return {"output_step": self.duration / 2}

    def histories(self, values):
        """Channels (3, nc) of a run with other values of the parameters."""
        system = changed(self.system, self.parameters, values)
        if self.fixed:
            course = Course(system, [], Options(duration=self.duration, **self.times, **self.options))
            return Observer(system, self.channels, self.duration).values(course.moments, course.states)
        others = {name: value for name, value in self.options.items() if name in ("events", "start")}
        run = mp.simulate(system, self.duration, **self.times, **TIGHT, **others, method="explicit")
        where = [find_channel(run.channels, name) for name in self.channels]
        rows = [int(np.argmin(np.abs(run.time - t))) for t in np.linspace(0.0, self.duration, 3)]
        return np.array([run[c.name] if c.component < 0 else run[c.name][:, c.component] for c in where]).T[rows]

    def differences(self):
        """Derivatives (np, 3, nc) of the channels by differences of runs."""
        known = find(self.system, self.parameters)
        at = np.array([each.value for each in known])
        found = []
        for k, each in enumerate(known):
            runs = [self.histories(at + place * STEP * each.step * np.eye(len(at))[k]) for place in PLACES]
            found.append(np.tensordot(WEIGHTS, runs, 1) / (STEP * each.step))
        return np.array(found)

    def forward(self):
        return mp.run_sensitivities(
            self.system, self.channels, self.parameters, self.duration, **self.times, **self.options
        )

    def gradient(self, weights):
        """Gradient of the sum of the channels with weights (3, nc)."""
        total = Objective(channels=tuple(self.channels), value=lambda t, h: (float(np.sum(weights * h)), weights))
        return mp.gradient(self.system, total, self.parameters, self.duration, **self.times, **self.options)


def block(name="block", mass=2.0):
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0.2, 0])}
    inertia = mass * np.diag([0.15, 0.4, 0.45])
    return mp.rigid_body(name, mass=mass, centre=np.array([0.5, 0.1, 0.2]), inertia=inertia, interfaces=ends)


def chain(**options):
    """A sprung block, a beam on a ball joint, whose dampers couple its modes; one parameter is their size."""
    spring = HingeElement(stiffness=20.0, damping=0.3)
    joints = (
        mp.Joint(
            name="root", type="revolute", parent="ground", child="block", axis=(0, 1, 0), angle=0.3, elements=spring
        ),
        mp.Joint(name="ball", type="spherical", parent="block.tip", child="arm", angular_velocity=(0.3, 0.2, -0.5)),
    )
    arm = with_dampers(uniform_beam(modes=2))
    system = mp.System(bodies={"block": block(), "arm": arm}, joints=joints, gravity=(0, 0, -9.81))
    channels = ["root.angle", "arm.modal.1", "ball.quaternion.2", "arm.tip.position.x", "ball.force.z"]
    names = ["root.stiffness", "root.damping", "root.angle", "gravity.z", "block.mass", "arm.mode_stiffness.1"]
    names += ["arm.mode_damping.2", "ball.angular_velocity.x", Parameter(name="dampers", value=1.0, change=_damped)]
    return Case(system, channels, names, 0.1, **options)


def _damped(system, factor):
    """Dampers of the arm of another size."""
    arm = system.bodies["arm"]
    C = factor * (arm.damping_matrix - np.diag(arm.D))
    return system.with_(bodies=system.bodies | {"arm": arm.with_(coupled_damping=np.diag(arm.D) + C)})


def satellite(**options):
    """A free block with a beam on a sprung hinge, whose dampers couple its modes: nothing holds it."""
    spring = HingeElement(stiffness=50.0, damping=1.0)
    joints = (
        mp.Joint(name="hub", type="free", parent="ground", child="block", angular_velocity=(0.3, 2.0, -0.5)),
        mp.Joint(name="wing", type="revolute", parent="block.tip", child="arm", angle=0.2, elements=spring),
    )
    bodies = {"block": block(), "arm": with_dampers(uniform_beam(modes=2))}
    system = mp.System(bodies=bodies, joints=joints)
    channels = ["wing.angle", "arm.modal.1", "hub.displacement.1", "hub.quaternion.3"]
    return Case(
        system, channels, ["wing.stiffness", "wing.angle", "hub.angular_velocity.z", "block.mass"], 0.1, **options
    )


def four_bar(duration=0.2, **options):
    """A four-bar linkage in motion; the place of its second pivot is a parameter."""

    def bar(name, mass, length):
        ends = {"root": np.zeros(3), "end": np.array([length, 0, 0])}
        inertia = mass * length**2 / 12 * np.eye(3)
        return mp.rigid_body(name, mass=mass, centre=np.array([length / 2, 0, 0]), inertia=inertia, interfaces=ends)

    bodies = {"crank": bar("crank", 1.0, 0.5), "coupler": bar("coupler", 2.0, 1.0), "rocker": bar("rocker", 1.5, 0.8)}
    spring = HingeElement(stiffness=3.0, damping=0.1)
    joints = (
        mp.Joint(name="crank", type="revolute", parent="ground", child="crank", angle=1.2, rate=2.0, keep_start=True,
                 elements=spring),
        mp.Joint(name="knee", type="revolute", parent="crank.end", child="coupler", angle=-1.0),
        mp.Joint(name="pivot", type="revolute", parent="ground", child="rocker", position=(1.0, 0, 0), angle=1.9),
    )  # fmt: skip
    pin = Closure(name="pin", type="spherical", a="coupler.end", b="rocker.end")
    system = mp.System(bodies=bodies, joints=joints, closures=(pin,), gravity=(0, -9.81, 0))
    channels = ["crank.angle", "pivot.rate", "pin.force.x", "coupler.end.position.y"]
    names = ["crank.stiffness", "crank.angle", "crank.rate", "pivot.position.x", "coupler.mass", "gravity.y"]
    return Case(system, channels, names, duration, **options)


def continued_four_bar():
    """The linkage from where a run of it ended, closed anew where its second pivot is elsewhere."""
    case = four_bar(0.1)
    end = mp.simulate(case.system, 0.1, method="explicit", rtol=1e-10).state
    case.options["start"] = replace(end, t=0.0, steps={})
    case.parameters = ["crank.stiffness", "pivot.position.x", "coupler.mass"]
    return case


def sprung_four_bar(**options):
    """A four-bar linkage with a spring, a bushing and a rotational spring between its bars."""
    case = four_bar(0.004, **options)
    stiff = {"stiffness": (2e3, 1e3, 3e3, 50.0, 60.0, 70.0), "damping": (20.0, 10.0, 30.0, 1.1, 2.1, 0.1)}
    loads = (
        AxialSpring(name="tie", between=("ground", "coupler.end"), stiffness=300.0, damping=7.0, free_length=0.4),
        Bushing(name="bush", between=("crank.end", "rocker.end"), free_position=(1.0, 0.2, 0), **stiff),
        RotationalSpring(
            name="coil", between=("crank.root", "coupler.end"), axis=(0, 0, 1), stiffness=9.0, damping=0.2
        ),
    )
    case.system = case.system.with_(loads=loads)
    case.parameters = ["tie.stiffness", "tie.free_length", "bush.damping.2", "coil.stiffness", "pivot.position.x"]
    return case


def tied():
    """Blocks and a beam in space, tied by conditions of every kind, a spring between them.

    A universal pair at the tip of the beam, a rod of changing length, a coupler of hinges, and a second rod that says
    what the first one does: its condition is redundant.
    """
    root = HingeElement(stiffness=20.0, damping=0.3)
    joints = (
        mp.Joint(name="root", type="revolute", parent="ground", child="block", axis=(0, 1, 0), rate=0.7, elements=root),
        mp.Joint(name="ball", type="spherical", parent="block.tip", child="arm", angular_velocity=(0.3, 0.2, -0.5)),
        mp.Joint(name="free", type="free", parent="ground", child="end", position=(11.0, 0.2, 0)),
        mp.Joint(name="fin", type="revolute", parent="end.tip", child="fin", axis=(0, 0.6, 0.8), angle=0.2),
        mp.Joint(name="tail", type="revolute", parent="fin.tip", child="tail", axis=(0, 0, 1), angle=-0.3),
    )
    rod = {"type": "distance", "a": "ground", "position": (11.0, 4.0, 2.0)}
    closures = (
        Closure(name="cross", type="universal", a="arm.tip", b="end.root", axis=(0, 1, 0), second_axis=(0, 0, 1)),
        Closure(name="rod", b="end.root", length="sqrt(20 - 0.16) + 0.05*sin(30*t)", **rod),
        Closure(name="stay", b="end.root", length="sqrt(20 - 0.16) + 0.05*sin(30*t)", **rod),
        Coupler(name="gear", factors={"fin": 2.0, "tail": 1.0}),
    )
    tie = AxialSpring(name="tie", between=("block.root", "tail.tip"), stiffness=30.0, damping=0.7, free_length=9.0)
    bodies = {"block": block(), "arm": uniform_beam(modes=2)} | {k: block(k) for k in ("end", "fin", "tail")}
    system = mp.System(bodies=bodies, joints=joints, closures=closures, loads=(tie,), gravity=(0, 0, -9.81))
    names = ["root.stiffness", "tie.stiffness", "cross.axis.x", "end.mass", "fin.angle", "root.rate"]
    return Case(system, ["root.angle", "arm.modal.1", "tail.angle", "free.quaternion.2"], names, 0.03)


def bouncing_rod():
    """A rigid rod falls on its tip and bounces, turning."""
    fall = mp.Joint(
        name="fall", type="planar", parent="ground", child="rod", second_axis=(1, 0, 0), displacement=(0, 0.5),
        rate=0.3, angle=-0.02, speed=(1.0, -1.0),
    )  # fmt: skip
    floor = Closure(name="floor", type="point_on_plane", a="ground", b="rod.tip", axis=(0, 1, 0), active=False)
    system = mp.System(bodies={"rod": block("rod")}, joints=(fall,), gravity=(0, -9.81, 0), closures=(floor,))
    hit = mp.Event(name="hit", when="rod.tip.position.y", direction=-1, impacts=("floor",), restitution=0.6)
    channels = ["fall.displacement.2", "fall.rate", "rod.tip.velocity.y"]
    names = ["fall.displacement.2", "fall.speed.2", "fall.rate", "gravity.y", "rod.mass"]
    return Case(system, channels, names, 0.4, {"rtol": 1e-10, "events": (hit,)})


def driven():
    """A beam whose root is turned as prescribed, with a sprung block at its tip; the law's size is a parameter."""
    drive = mp.Joint(name="drive", type="revolute", parent="ground", child="arm", motion="0.4*sin(8*t)")
    spring = HingeElement(stiffness=500.0, damping=2.0)
    wrist = mp.Joint(name="wrist", type="revolute", parent="arm.tip", child="block", axis=(0, 1, 1), elements=spring)
    system = mp.System(bodies={"arm": uniform_beam(modes=2), "block": block()}, joints=(drive, wrist))
    names = ["drive.amplitude", "wrist.stiffness", "wrist.axis.y", "arm.mode_damping.1"]
    return Case(system, ["wrist.angle", "arm.modal.1", "drive.drive"], names, 0.1)


def crank_slider(duration=0.0004, **options):
    """Simeon's slider crank with elastic rod, driven by a closure at a constant speed."""
    system, _ = slider_crank()
    channels = ["rod.modal.1", "slide.displacement", "rod.modal_rate.2"]
    return Case(system, channels, ["drive.amplitude", "rod.mode_stiffness.1", "slider.mass"], duration, **options)


def hanging():
    """A beam that hangs from its static equilibrium and is pushed; the equilibrium depends on the parameters."""
    spring = HingeElement(stiffness=5000.0, damping=5.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=spring)
    push = mp.PointForce(name="push", at="arm.tip", force=("0", "100*sin(20*t)", "0"))
    system = mp.System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=(0, -9.81, 0), loads=(push,))
    names = ["hinge.stiffness", "gravity.y", "push.amplitude", "arm.mode_stiffness.1"]
    return Case(
        system,
        ["hinge.angle", "arm.modal.1", "hinge.acceleration"],
        names,
        0.1,
        {"rtol": 1e-10, "start": "equilibrium"},
    )


def mounted():
    """A free block on a bushing and a spring, by generalised-alpha."""
    free = mp.Joint(name="free", type="free", parent="ground", child="block", angular_velocity=(0.3, 0.0, 1.0))
    mount = Bushing(
        name="mount", between=("ground", "block.root"), stiffness=(2e3, 1e3, 3e3, 50.0, 60.0, 70.0),
        damping=(2.0, 1.0, 3.0, 0.1, 0.1, 0.1),
    )  # fmt: skip
    stay = AxialSpring(name="stay", between=("ground", "block.tip"), stiffness=500.0, damping=1.0, free_length=0.9)
    system = mp.System(bodies={"block": block()}, joints=(free,), loads=(mount, stay), gravity=(0, 0, -9.81))
    channels = ["free.displacement.3", "free.quaternion.2", "stay.tension"]
    names = ["mount.stiffness.2", "stay.free_length", "stay.stiffness", "block.mass", "free.angular_velocity.z"]
    return Case(system, channels, names, 0.1, **fixed("generalised_alpha"))


def sprung(duration=0.04, **options):
    """A free block with a beam on a hinge and a block at its tip; every kind of force element between them."""
    turning = {"angular_velocity": (0.3, 0.5, 1.0)}
    joints = (
        mp.Joint(name="free", type="free", parent="ground", child="block", **turning),
        mp.Joint(
            name="wrist", type="revolute", parent="block.tip", child="arm", axis=(0, 1, 0), angle=0.3, rate=0.7,
            elements=HingeElement(stiffness=20.0, damping=0.3),
        ),
        mp.Joint(name="ball", type="spherical", parent="arm.tip", child="end", **turning),
    )  # fmt: skip
    stiff = {"stiffness": (2e3, 1e3, 3e3, 50.0, 60.0, 70.0), "damping": (20.0, 10.0, 30.0, 1.1, 2.1, 0.1)}
    tie = {"stiffness": 300.0, "damping": 7.0, "free_length": 0.4, "actuator_force": "3*sin(20*t)"}
    coil = {"stiffness": 30.0, "damping": 2.0}
    loads = (
        AxialSpring(name="tie", between=("block.root", "arm.tip"), **tie),
        Bushing(name="mount", between=("ground", "block.root"), **stiff),
        Bushing(name="bush", between=("arm.tip", "end.tip"), free_position=(1.0, 0.2, 0), **stiff),
        RotationalSpring(name="coil", between=("block.root", "arm.tip"), axis=(0.6, 0, 0.8), **coil),
        RotationalSpring(name="spiral", between=("ground", "end.tip"), axis=(0, 0, 1), **coil),
        mp.PointForce(name="jet", at="arm.tip", force=("0", "30 + 9*t", "5"), torque=("1", "2", "3"), axes="body"),
    )
    bodies = {"block": block(), "arm": uniform_beam(modes=2), "end": block("end")}
    system = mp.System(bodies=bodies, joints=joints, loads=loads, gravity=(0, 0, -9.81))
    names = ["tie.stiffness", "tie.free_length", "bush.damping.5", "coil.stiffness", "jet.amplitude", "wrist.angle"]
    channels = ["wrist.angle", "free.quaternion.2", "arm.modal.1", "tie.tension"]
    return Case(system, channels, names, duration, **options)


def rubbing(**options):
    """A block that rubs in its hinge and is turned back by a stop, with a beam behind it."""
    stop = HingeElement(
        stiffness=20.0, friction=2.0, transition_velocity=0.5, upper=0.1, limit_stiffness=300.0, limit_damping=0.4
    )
    joints = (
        mp.Joint(
            name="root", type="revolute", parent="ground", child="block", axis=(0, 1, 0), angle=0.4, elements=stop
        ),
        mp.Joint(name="wrist", type="revolute", parent="block.tip", child="arm", rate=0.5),
    )
    system = mp.System(bodies={"block": block(), "arm": uniform_beam(modes=2)}, joints=joints)
    names = ["root.friction", "root.limit_stiffness", "root.upper", "root.angle", "wrist.rate", "block.mass"]
    return Case(system, ["root.angle", "root.rate", "arm.modal.1"], names, 0.1, **options)


def bent(**options):
    """A beam with stations on a sprung hinge, whose tip a dead force bends by an eighth of its length."""
    spring = HingeElement(stiffness=4e3, damping=50.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="beam", axis=(0, 0, 1), elements=spring)
    push = mp.PointForce(name="push", at="beam.tip", force=np.array([0, -300.0, 0]))
    bodies = {"beam": large_cantilever(modes=1, stations=4)}
    system = mp.System(bodies=bodies, joints=(hinge,), gravity=np.array([0, -6.0, 0]), loads=(push,))
    channels = ["hinge.angle", "beam.tip.position.x", "beam.tip.position.y", "hinge.force.x"]
    return Case(system, channels, ["hinge.stiffness", "gravity.y", "beam.mode_stiffness.1"], 0.1, **options)


def fixed(method, step=5e-3):
    """Options of a run with fixed steps, the same for the differences."""
    given = {"method": method, "step": step, "rtol": 1e-10, "atol": 1e-15}  # rtol: of the iterations of a step
    return {"options": given, "fixed": True}


CASES = {
    "chain": chain,
    "satellite": satellite,
    "four bar": four_bar,
    "four bar from a state": continued_four_bar,
    "bouncing rod": bouncing_rod,
    "prescribed turn": driven,
    "elastic slider crank": crank_slider,
    "from equilibrium": hanging,
    "bushing by generalised-alpha": mounted,
    "springs between all bodies": sprung,
    "tied by conditions of every kind": tied,
    "chain by rosenbrock": lambda: chain(**fixed("rosenbrock")),
    "satellite by rosenbrock": lambda: satellite(**fixed("rosenbrock")),
    "rubbing stop": rubbing,
    "rubbing stop by rosenbrock": lambda: rubbing(**fixed("rosenbrock")),
    "four bar by rosenbrock": lambda: four_bar(0.05, **fixed("rosenbrock")),
    "four bar by generalised-alpha": lambda: four_bar(0.05, **fixed("generalised_alpha")),
    "elastic slider crank by rosenbrock": lambda: crank_slider(2e-4, **fixed("rosenbrock", 2e-5)),
    "elastic slider crank by generalised-alpha": lambda: crank_slider(2e-4, **fixed("generalised_alpha", 2e-5)),
    "stations": bent,
    "stations by rosenbrock": lambda: bent(**fixed("rosenbrock")),
    "stations by generalised-alpha": lambda: bent(**fixed("generalised_alpha")),
    "springs by rosenbrock": lambda: sprung(0.02, **fixed("rosenbrock")),
    "four bar with springs by rosenbrock": lambda: sprung_four_bar(**fixed("rosenbrock", 5e-4)),
    "chain by generalised-alpha": lambda: chain(**fixed("generalised_alpha")),
    "satellite by generalised-alpha": lambda: satellite(**fixed("generalised_alpha")),
}
