"""Recorded channels: the compiled observation of random states against the dense equations, and a recorded run."""

import numpy as np
import pytest
from multibody.closed_trees import closed_tree
from multibody.loaded_trees import loaded_tree
from multibody.trees import ROOTS, random_state, random_tree
from scipy.interpolate import PchipInterpolator
from scipy.spatial.transform import Rotation
from size import seeds

import modalprep as mp
from modalprep.multibody.elements.registry import OBSERVED
from modalprep.multibody.evaluation.evaluate import GOOD, build_equations, evaluate
from modalprep.multibody.evaluation.evaluator import start_state
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.joint_types import TRANSLATIONS
from modalprep.multibody.model.loads import AxialSpring, locate
from modalprep.multibody.model.rotational_spring import RotationalSpring
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.constraints import dense_constraints
from modalprep.multibody.reference.equations import body_equations, body_states, energy_and_momentum, node_motion
from modalprep.multibody.reference.loads import dense_loads
from modalprep.multibody.results.channels import Channels
from modalprep.multibody.results.observation import observe
from modalprep.multibody.results.record import Recorder
from modalprep.vectors import skew

T = 0.3
ROUND_OFF = 1e-12  # some thousand operations on numbers of the scale


class Observed:
    """One state of a system: the channels that the compiled code writes, and the parts of the dense equations."""

    def __init__(self, system, y):
        self.system, self.packed, self.y = system, pack(system), y
        loading = Loading(system, self.packed, 1.0)
        self.model, self.loops = build_equations(self.packed, loading), loading.loops
        whole, rates = np.append(y, 0.7), np.zeros(len(y) + 1)
        assert evaluate(self.model, T, whole, rates) == GOOD
        table = Channels(system, self.packed, self.loops)
        row = np.full(table.width, np.nan)
        observe(self.model, table.columns, T, whole, rates, row)
        assert not np.isnan(row).any()  # every number is written
        self.found = {name: row[place] for name, place in table.index.items()}
        self.motion, self.udot = self.model.motion, rates[self.packed.nx : -1]
        bodies = body_states(system, self.packed, y, self.motion)
        self.states = dict(zip(system.order, bodies, strict=True))
        self.size = max(1.0, np.abs(self.udot).max(initial=0.0))

    def agrees(self, expected, size=1.0):
        for name, value in expected.items():
            assert np.shape(self.found[name]) == np.shape(value), name
            scale = max(size, np.abs(value).max())
            np.testing.assert_allclose(self.found[name], value, rtol=0, atol=ROUND_OFF * scale, err_msg=name)

    def rotation(self, body, k):
        """Rotation and angular velocity of an interface, inertial axes."""
        s = self.states[body]
        moved = node_motion(s.body, k, s.V[3:], s.q, s.qd)
        return s.R @ moved[1], s.R @ (s.V[3:] + moved[3][3:])

    def turn(self, body, k):
        """Rotation of an interface, to inertial axes."""
        return self.rotation(body, k)[0]


def body_channels(o):
    """Where bodies and interfaces are, how fast, and their accelerations."""
    places, accelerations = {}, {}
    for name, s in o.states.items():
        if s.body.n:
            places[f"{name}.modal"] = s.q
            places[f"{name}.modal_rate"] = s.qd
        places[f"{name}.origin"] = s.p
        places[f"{name}.orientation"] = Rotation.from_matrix(s.R).as_quat(scalar_first=True)
        A = s.J @ o.udot + s.c
        for k, interface in enumerate(s.body.interface_name):
            r, _, Phi, vel, acc = node_motion(s.body, k, s.V[3:], s.q, s.qd)
            channel = f"{name}.{interface}"
            places[f"{channel}.position"] = s.p + s.R @ r
            places[f"{channel}.velocity"] = s.R @ (s.V[:3] + np.cross(s.V[3:], r) + vel[:3])
            places[f"{channel}.deflection"] = r - s.body.interface_position[k]
            own = A[:3] + np.cross(A[3:], r) + Phi[:3] @ o.udot[s.rows] + acc[:3]
            accelerations[f"{channel}.acceleration"] = s.R @ own + o.system.gravity
    return places, accelerations


def sums(o):
    """Energies and momenta, energy of springs and of a central field with them."""
    found = energy_and_momentum(o.system.gravity, list(o.states.values()))
    loads = dense_loads(o.system, o.packed, o.y, o.motion, T)
    return {
        "energy.kinetic": found["kinetic"],
        "energy.strain": found["strain"],
        "energy.gravity": found["gravity"] + loads.gravity,
        "energy.stored": loads.stored,
        "energy.work": 0.7,
        "momentum.linear": found["linear"],
        "momentum.angular": found["angular"],
    }


def joint_channels(o):
    """Coordinates, speeds, hinge forces; a single one is a number."""
    state, found = State(o.system, o.packed, o.y, o.motion, None), {}
    tau = dense_loads(o.system.with_(loads=()), o.packed, o.y, o.motion, T).f
    for joint in o.system.joints:
        place, rate = state.joint(joint.name)
        if joint.type == "spherical":
            found |= {f"{joint.name}.quaternion": place, f"{joint.name}.angular_velocity": rate}
            found[f"{joint.name}.angular_acceleration"] = o.udot[o.packed.speeds_of(joint.name)]
        elif joint.type == "free":
            found |= {f"{joint.name}.displacement": place[:3], f"{joint.name}.quaternion": place[3:]}
            found |= {f"{joint.name}.speed": rate[:3], f"{joint.name}.angular_velocity": rate[3:]}
            found[f"{joint.name}.angular_acceleration"] = o.udot[o.packed.speeds_of(joint.name)[3:]]
        elif joint.type != "weld":
            n = TRANSLATIONS.get(joint.type, 0)
            found |= {f"{joint.name}.displacement": place[:n], f"{joint.name}.speed": rate[:n]}
            found |= {f"{joint.name}.angle": place[n:], f"{joint.name}.rate": rate[n:]}
            rows = o.packed.speeds_of(joint.name)
            prescribed = o.motion[o.packed.links_of(joint.name), 2]
            found[f"{joint.name}.acceleration"] = prescribed if joint.motions else o.udot[rows]
            found[f"{joint.name}.drive"] = tau[rows] if joint.elements else np.zeros(0)
    return {name: value if len(value) > 1 else value[0] for name, value in found.items() if len(value)}


def wrenches(o):
    """What joints carry, by the balance of each body's subtree (Newton and Euler), loads left out."""
    found, inertial = {}, {}
    for name, s in reversed(o.states.items()):
        M, bias = body_equations(s.body, s.V, s.q, s.qd)
        own = (M @ np.append(s.J @ o.udot + s.c, o.udot[s.rows]) + bias)[:6]
        force, torque = s.R @ own[:3], s.R @ own[3:]
        for joint in o.system.joints:
            parent = o.system.parent(joint)
            if parent and parent[0] == name:
                f, t, p = inertial[o.system.child(joint)]
                force, torque = force + f, torque + t + np.cross(p - s.p, f)
        inertial[name] = force, torque, s.p
        joint = o.system.carrier(name)
        parent = o.system.parent(joint)
        turn = o.turn(*parent) if parent else np.eye(3)
        found |= {f"{joint.name}.force": turn.T @ force, f"{joint.name}.torque": turn.T @ torque}
        if joint.motion is not None:
            kind = "torque" if joint.type == "revolute" else "force"
            found[f"{joint.name}.drive"] = joint.axis @ found[f"{joint.name}.{kind}"]
    return found


def spring_channels(o):
    """Length, and tension by the law of each spring."""
    found = {}
    for load in (load for load in o.system.loads if isinstance(load, AxialSpring)):
        ends = [(load.position, np.zeros(3)) if end == "ground" else end_motion(o, end) for end in load.between]
        apart, rate = ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]
        length = np.linalg.norm(apart)
        tension = load.stiffness * (length - load.free_length) + load.damping * apart @ rate / length
        tension += load.actuator_force(T)[0] if load.actuator_force else 0.0
        slack = load.tension_only and (tension < 0 or length < load.free_length)
        found |= {f"{load.name}.length": length, f"{load.name}.tension": 0.0 if slack else tension}
    return found


def rotational_channels(o):
    """Angle by SciPy's quaternion, its rate by the quaternion's, and the torque by the law."""
    found = {}
    for load in (load for load in o.system.loads if isinstance(load, RotationalSpring)):
        (one, spin), (two, other) = (
            (load.rotation, np.zeros(3)) if end == "ground" else o.rotation(*locate(o.system.bodies, end, ""))
            for end in load.between
        )
        w, *v = Rotation.from_matrix(one.T @ two).as_quat(canonical=True, scalar_first=True)
        turn = one.T @ (other - spin)
        w_rate, s_rate = -np.dot(v, turn) / 2, (w * turn + np.cross(turn, v)) @ load.axis / 2
        s = v @ load.axis
        angle, rate = 2 * np.arctan2(s, w), 2 * (w * s_rate - s * w_rate) / (w**2 + s**2)
        torque = resisting(load.characteristic, load.stiffness, angle - load.free_angle)
        torque += resisting(load.damping_characteristic, load.damping, rate)
        found |= {f"{load.name}.angle": angle, f"{load.name}.torque": torque}
    return found


def resisting(table, constant, x):
    """Torque of a monotone cubic through a table, straight on beyond it; of a constant without."""
    if table is None:
        return constant * x
    law, inside = PchipInterpolator(*table), np.clip(x, table[0][0], table[0][-1])
    return law(inside) + law.derivative()(inside) * (x - inside)


def end_motion(o, end):
    return o.found[f"{end}.position"], o.found[f"{end}.velocity"]


def agrees_with_the_dense_reference(o):
    places, accelerations = body_channels(o)
    o.agrees(places)
    o.agrees(accelerations, o.size)
    total = sums(o)
    # energies and momenta are sums of larger parts
    o.agrees(total, max(1.0, abs(total["energy.kinetic"]), abs(total["energy.gravity"])))
    hinges = joint_channels(o)
    o.agrees(hinges)
    carried = wrenches(o)
    mass = sum(body.m for body in o.system.bodies.values())
    if not (o.system.loads or o.system.closures):
        o.agrees(carried, mass * o.size)
    springs = spring_channels(o) | rotational_channels(o)
    o.agrees(springs, max([1.0, *springs.values()]))
    closures = {n for c in o.system.closures for n in closure_names(c)}
    elements = {name for load in o.system.loads for name in element_names(load)}
    names = {*places, *accelerations, *total, *hinges, *carried, *closures, *elements, "power.input"}
    assert set(springs) <= elements
    assert set(o.found) == names


def element_names(load):
    kinds = [kind for kind in OBSERVED.values() if isinstance(load, kind.record)]
    return [f"{load.name}.{channel}" for kind in kinds for channel in kind.channels]


def closure_names(closure):
    kinds = ("violation", "multiplier") if isinstance(closure, Coupler) else ("violation", "force", "torque")
    return [f"{closure.name}.{kind}" for kind in kinds]


@pytest.mark.parametrize("most", [1, 6])
@pytest.mark.parametrize("seed", seeds(20))
def test_channels_of_random_trees(seed, most):
    """Every joint type, rigid and flexible, with and without geometric stiffness."""
    system = random_tree(seed, root=ROOTS[seed % len(ROOTS)], most=most, geometric=seed % 3 > 0)
    agrees_with_the_dense_reference(Observed(system, random_state(system, seed)))


@pytest.mark.parametrize("seed", range(8))
def test_channels_of_loaded_trees(seed):
    system = loaded_tree(seed)
    system = system.with_(loads=tuple(load for load in system.loads if not isinstance(load, mp.multibody.Callback)))
    o = Observed(system, random_state(system, seed))
    agrees_with_the_dense_reference(o)
    power = dense_loads(system, o.packed, o.y, o.motion, T).power
    damped = sum(s.qd @ s.body.damping_matrix @ s.qd for s in o.states.values())
    driven = sum(  # power of the prescribed hinges
        o.found[f"{j.name}.drive"] * o.found[f"{j.name}.{'rate' if j.type == 'revolute' else 'speed'}"]
        for j in system.joints
        if j.motion is not None
    )
    assert o.found["power.input"] == pytest.approx(power - damped + driven, rel=1e-10)


@pytest.mark.parametrize("seed", range(12))
def test_channels_of_closed_loops(seed):
    """The forces of each closure do the work of its rows in every direction of motion: ``G' multiplier``."""
    system, y, _ = closed_tree(seed)
    o = Observed(system, y)
    agrees_with_the_dense_reference(o)
    closing, multiplier = o.loops.closing, o.model.work.multiplier
    rows = dense_constraints(system, o.packed, o.loops, y, o.motion, T)
    for k, closure in enumerate(system.closures):
        own = closing.of(k)
        largest = np.abs(rows.phi[own]).max()
        assert o.found[f"{closure.name}.violation"] == pytest.approx(largest, rel=1e-11)
        expected = rows.G[own].T @ multiplier[own]
        if isinstance(closure, Coupler):
            assert o.found[f"{closure.name}.multiplier"] == multiplier[own[0]]
            continue
        found, size = generalised(o, closure), np.abs(rows.G[own]).T @ np.abs(multiplier[own])
        # a row that is nearly redundant has a large multiplier, which others oppose
        assert np.abs(found - expected).max() <= 1e-11 * max(1.0, size.max())


def generalised(o, closure):
    """Generalised forces (nu,) of a closure's channels: on b at b, the opposite on a at the same place."""
    one, two = (locate(o.system.bodies, end, closure.name) for end in (closure.a, closure.b))
    turn = o.turn(*one) if one else np.eye(3)
    wrench = np.append(turn @ o.found[f"{closure.name}.force"], turn @ o.found[f"{closure.name}.torque"])
    place = closure.position
    if two:
        s = o.states[two[0]]
        place = s.p + s.R @ node_motion(s.body, two[1], s.V[3:], s.q, s.qd)[0]
    total = np.zeros(o.packed.nu)
    for end, sign in ((one, -1.0), (two, 1.0)):
        if end:
            p, J = partials(o.states[end[0]], end[1])
            lever = np.cross(place - p, wrench[:3])
            total += sign * J.T @ (wrench + np.append(np.zeros(3), lever))
    return total


def partials(s, k):
    """Position of an interface and its partial velocities (6, nu), inertial axes."""
    r, _, Phi, _, _ = node_motion(s.body, k, s.V[3:], s.q, s.qd)
    J = np.block([[np.eye(3), -skew(r)], [np.zeros((3, 3)), np.eye(3)]]) @ s.J
    J[:, s.rows] += Phi
    return s.p + s.R @ r, np.kron(np.eye(2), s.R) @ J


def test_channels_are_views_of_the_recorded_rows():
    system = random_tree(3, root="revolute")
    run = mp.simulate(system, t_end=0.02, output_step=0.01)
    one, other = run["b0.origin"], run["energy.kinetic"]
    assert np.may_share_memory(one.base, other.base)
    assert len(run.time) == len(one) == len(other) == 3


def test_too_many_outputs_for_the_memory_is_one_message():
    system, times = random_tree(3, root="revolute"), np.array([0.0, 1.0])
    packed = pack(system)
    start, size = np.append(start_state(packed), 0.0), np.ones(packed.nx)
    options = dict(method="explicit", rtol=1e-3, atol=1e-3, step=None, rho=0.9, events=(), reference=None)
    run = Integration(system, packed, Loading(system, packed, 1.0), start, times, size, **options)
    with pytest.raises(mp.InputError, match="do not fit into memory; raise output_step or lower t_end"):
        Recorder(run, 10**16)  # more than any address


def test_accelerations_of_a_driven_pendulum():
    """A prescribed slide carries a pendulum: ``I a = -m d (g cos + s'' (-sin))`` about the pivot, in each instant."""
    cart = mp.rigid_body("cart", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    ends = {"root": np.zeros(3)}
    bob = mp.rigid_body("bob", mass=2.0, centre=np.array([0.5, 0, 0]), inertia=0.3 * np.eye(3), interfaces=ends)
    motion = mp.multibody.TimeFunction("0.1*t**3")
    slide = mp.Joint(name="slide", type="prismatic", parent="ground", child="cart", axis=np.eye(3)[0], motion=motion)
    hinge = mp.Joint(name="hinge", type="revolute", parent="cart.root", child="bob")
    system = mp.System(bodies={"cart": cart, "bob": bob}, joints=(slide, hinge), gravity=np.array([0, -9.81, 0]))
    run = mp.simulate(system, 2.0, output_step=0.1)
    np.testing.assert_allclose(run["slide.acceleration"], 0.6 * run.time, atol=1e-9)  # of the spline of the motion
    angle, inertia = run["hinge.angle"], 0.3 + 2.0 * 0.5**2
    expected = 2.0 * 0.5 * (-9.81 * np.cos(angle) + run["slide.acceleration"] * np.sin(angle)) / inertia
    np.testing.assert_allclose(run["hinge.acceleration"], expected, rtol=1e-9, atol=1e-9)
