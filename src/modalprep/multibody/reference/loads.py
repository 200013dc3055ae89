"""The reference implementation of loads: generalised forces of all loads by partial velocities, in numpy."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

from modalprep.multibody.evaluation.state import Frame, State, callback_loads
from modalprep.multibody.kernels.data import FREE, SPEEDS, SPHERICAL
from modalprep.multibody.model.depletion import ExpelledGas
from modalprep.multibody.model.environment import CentralGravity, Conductor
from modalprep.multibody.model.hydrodynamics import ImmersedRod
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.model.loads import AxialSpring, Bushing, DistributedForce, PointForce
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import Packed, pack
from modalprep.multibody.reference.equations import BodyState, body_states, mass_and_force, seen_states
from modalprep.multibody.reference.fields import central_gravity, conductor_force, gravity_in_orbit
from modalprep.multibody.reference.points import (
    DenseLoads,
    Point,
    end_point,
    interface_point,
    plus,
    value_at,
    wrench_at,
)
from modalprep.vectors import skew

STRIPS = 5  # of a rod in water: Gauss points


def dense_loads(system: System, packed: Packed, y: np.ndarray, motion: np.ndarray, t: float) -> DenseLoads:
    """Return what all loads, and gravity in an orbit, do at a state; arguments as `dense.link_states`.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> spring = HingeElement(stiffness=3.0)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=spring)
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> loads = dense_loads(arm, pack(arm), np.array([0.2, 0, 0, 0]), np.zeros((1, 3)), 0.0)
    >>> loads.f.round(9).tolist(), round(float(loads.stored), 9)
    ([-0.6, 0.0], 0.06)
    """
    system = system.at(t)
    states = dict(zip(system.order, seen_states(system, body_states(system, packed, y, motion)), strict=True))
    total = _hinges(system, packed, y, t)
    for load in system.loads:
        total = plus(total, _one(load, system, packed, states, t))
    if system.orbit:
        for s in states.values():
            total = plus(total, gravity_in_orbit(system.orbit, s))

    def frame(body: str, k: int) -> Frame:
        return interface_point(states[body], k).frame

    wrenches, tau = callback_loads(system, packed, t, State(system, packed, y, motion, frame))
    total = plus(total, DenseLoads(tau, float(tau @ y[packed.nx :]), 0.0, 0.0))
    for w in wrenches:
        total = plus(total, wrench_at(interface_point(states[w.body], w.interface), w.force, w.torque))
    return total


def loaded_accelerations(system: System, y: np.ndarray, motion: np.ndarray, t: float) -> np.ndarray:
    """Solve for the accelerations ``u' (nu,)`` under all loads with the whole mass matrix."""
    M, f = mass_and_force(system.at(t), y, motion)
    loads = dense_loads(system, pack(system), y, motion, t)
    return np.linalg.solve(M + loads.mass, f + loads.f)


def _one(load, system: System, packed: Packed, states: dict[str, BodyState], t: float) -> DenseLoads:
    if isinstance(load, PointForce):
        return _point_force(load, end_point(system, states, load.at, None), t)
    if isinstance(load, DistributedForce):
        return _distributed(load, states[load.body], t)
    if isinstance(load, AxialSpring):
        ends = [end_point(system, states, end, load) for end in load.between]
        return _spring(load, *ends, t)
    if isinstance(load, Bushing):
        return _bushing(load, *(end_point(system, states, end, load) for end in load.between))
    if isinstance(load, Conductor):
        return conductor_force(load, system, states, t)
    if isinstance(load, ExpelledGas):
        return _gas(load, [end_point(system, states, point, load) for point in load.flow_points], t)
    if isinstance(load, ImmersedRod):
        return _rod(load, system.gravity, states[load.body])
    none = DenseLoads(np.zeros(packed.nu), 0.0, 0.0, 0.0)
    if isinstance(load, CentralGravity):
        for state in states.values():
            none = plus(none, central_gravity(load, state))
    return none


def _point_force(load: PointForce, point: Point, t: float) -> DenseLoads:
    turn = point.frame.rotation if load.axes == "body" else np.eye(3)
    force, torque = ([value_at(function, t) for function in three] for three in (load.force, load.torque))
    return wrench_at(point, turn @ force, turn @ torque)


def _gas(load: ExpelledGas, way: list[Point], t: float) -> DenseLoads:
    """Thrust, and on each stretch ``-int 2 m' (w x t).v_r ds``, velocities and partial velocities linear along it."""
    exit_ = way[-1]
    total = wrench_at(exit_, -load.thrust(t) * (exit_.frame.rotation @ load.axis), np.zeros(3))
    for a, b in pairwise(way):
        coriolis = -2 * load.flow(t) * (b.frame.velocity - a.frame.velocity)
        power = coriolis @ (a.frame.velocity + b.frame.velocity) / 2
        total = plus(total, DenseLoads((a.J + b.J)[:3].T @ coriolis / 2, power, 0.0, 0.0))
    return total


def _distributed(load: DistributedForce, s: BodyState, t: float) -> DenseLoads:
    """Sum of the mesh points, each with its own partial velocities."""
    f, power = np.zeros(s.J.shape[1]), 0.0
    for x, shape, force in zip(s.body.points, s.body.shape, load.force, strict=True):
        own = value_at(load.factor, t) * (force if load.axes == "body" else s.R.T @ force)
        r = x + shape @ s.q
        J = s.J[:3] - skew(r) @ s.J[3:]
        J[:, s.rows] += shape
        f += J.T @ own
        power += own @ (s.V[:3] + np.cross(s.V[3:], r) + shape @ s.qd)
    return DenseLoads(f, power, 0.0, 0.0)


def _spring(load: AxialSpring, a: Point, b: Point, t: float) -> DenseLoads:
    apart = b.frame.position - a.frame.position
    length = np.linalg.norm(apart)
    along = apart / length if length > 0 else apart
    rate = along @ (b.frame.velocity - a.frame.velocity)
    other = load.damping * rate + value_at(load.actuator_force, t)
    stretch = length - load.free_length
    tension = load.stiffness * stretch + other
    if load.tension_only:
        stretch, tension = max(stretch, 0.0), max(tension, 0.0) if stretch > 0 else 0.0
        other = tension - load.stiffness * stretch
    stored = load.stiffness * stretch**2 / 2
    return DenseLoads((a.J - b.J)[:3].T @ (tension * along), -other * rate, stored, 0.0)


def _bushing(load: Bushing, a: Point, b: Point) -> DenseLoads:
    """Virtual work of the relative displacement and rotation vector, the latter by its left Jacobian."""
    Ra = a.frame.rotation
    r = Ra.T @ (b.frame.position - a.frame.position)
    d = r - load.free_position
    x = Rotation.from_matrix(Ra.T @ b.frame.rotation @ load.free_rotation.T).as_rotvec()
    left = expm(np.block([[skew(x), np.eye(3)], [np.zeros((3, 6))]]))[:3, 3:]
    linear = Ra.T @ (b.J[:3] - a.J[:3]) + skew(r) @ Ra.T @ a.J[3:]
    angular = Ra.T @ (b.J[3:] - a.J[3:])
    v = Ra.T @ (b.frame.velocity - a.frame.velocity) + np.cross(r, Ra.T @ a.frame.angular_velocity)
    w = Ra.T @ (b.frame.angular_velocity - a.frame.angular_velocity)
    k, c = load.stiffness, load.damping
    f = -linear.T @ (k[:3] * d + c[:3] * v) - angular.T @ (np.linalg.solve(left.T, k[3:] * x) + c[3:] * w)
    return DenseLoads(f, -(c[:3] @ v**2 + c[3:] @ w**2), (k[:3] @ d**2 + k[3:] @ x**2) / 2, 0.0)


def _rod(load: ImmersedRod, gravity: np.ndarray, s: BodyState) -> DenseLoads:
    """Sum of strips, each with its own partial velocities."""
    first, last = (s.body.interface_position[s.body.interface_name.index(end)] for end in load.ends)
    length = np.linalg.norm(last - first)
    axis, w, g = (last - first) / length, s.V[3:], s.R.T @ gravity
    P, turn = np.eye(3) - np.outer(axis, axis), np.cross(w, axis)
    nu, water = s.J.shape[1], load.water
    f, mass, power, stored, potential = np.zeros(nu), np.zeros((nu, nu)), 0.0, 0.0, 0.0
    for x, weight in zip(*np.polynomial.legendre.leggauss(STRIPS), strict=True):
        r, ds = first + (1 + x) / 2 * (last - first), weight * length / 2
        J, v = s.J[:3] - skew(r) @ s.J[3:], s.V[:3] + np.cross(w, r)
        place = s.p + s.R @ r
        slip = v - s.R.T @ water.at(water.surface - water.up @ place)
        along, across = (axis @ slip) * axis, P @ slip
        drag = -load.normal * np.linalg.norm(across) * across - load.tangential * np.linalg.norm(along) * along
        fall = s.c[:3] + np.cross(s.c[3:], r) + np.cross(w, np.cross(w, r)) + g  # acceleration without u'
        f += ds * J.T @ (drag - load.added * P @ fall - load.displaced * g)
        mass += ds * load.added * J.T @ P @ J
        power += ds * (drag @ v - load.added * (turn @ v) * (axis @ v))
        stored += ds * load.added * v @ P @ v / 2
        potential += ds * load.displaced * gravity @ place
    return DenseLoads(f, power, stored, potential, mass)


def _hinges(system: System, packed: Packed, y: np.ndarray, t: float) -> DenseLoads:
    f, power, stored = np.zeros(packed.nu), 0.0, 0.0
    for joint in system.joints:
        places = [
            (int(packed.model.links["x"][i]) if packed.types[i] not in (SPHERICAL, FREE) else None, u)
            for i in packed.links_of(joint.name)
            for u in range(packed.model.links["u"][i], packed.model.links["u"][i] + SPEEDS[packed.types[i]])
        ]
        for element, (x, u) in zip(joint.elements, places, strict=bool(joint.elements)):
            rate = y[packed.nx + u]
            spring, other, energy = _element(element, 0.0 if x is None else y[x], rate, t)
            f[u] += spring + other
            power, stored = power + other * rate, stored + energy
    return DenseLoads(f, power, stored, 0.0)


def _element(e: HingeElement, x: float, rate: float, t: float) -> tuple[float, float, float]:
    """Return the force of the springs, the force of all else, and the energy in the springs."""
    outside = x - min(max(x, e.lower), e.upper)  # positive above the upper limit
    stop = -e.limit_stiffness * outside
    push = stop * max(0.0, 1 + e.limit_damping * rate * np.sign(outside))
    other = value_at(e.drive, t) - e.damping * rate - e.friction * np.tanh(rate / e.transition_velocity) + push - stop
    energy = (e.stiffness * (x - e.free_position) ** 2 + e.limit_stiffness * outside**2) / 2
    return -e.stiffness * (x - e.free_position) + stop, other, energy
