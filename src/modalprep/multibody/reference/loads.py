"""The reference implementation of loads: generalised forces of all loads by partial velocities, in numpy."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from modalprep.multibody.elements import registry
from modalprep.multibody.elements.dense import BodyState, DenseLoads, Frame, Point, Scene, plus, wrench_at
from modalprep.multibody.evaluation.state import State, callback_loads
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import body_states, mass_and_force, node_motion, seen_states
from modalprep.vectors import on_both, skew


def dense_loads(system: System, packed: Packed, y: np.ndarray, motion: np.ndarray, t: float) -> DenseLoads:
    """Return what all loads, and gravity in an orbit, do at a state; arguments as `dense.link_states`.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> spring = HingeElement(stiffness=3.0)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", elements=spring)
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> loads = dense_loads(arm, pack(arm), np.array([0.2, 0, 0, 0]), np.zeros((1, 3)), 0.0)
    >>> loads.f.round(9).tolist(), round(float(loads.stored), 9)
    ([-0.6, 0.0], 0.06)
    """
    system = system.with_masses_at(t)
    states = dict(zip(system.order, seen_states(system, body_states(system, packed, y, motion)), strict=True))

    def interface(body: str, k: int) -> Point:
        return interface_point(states[body], k)

    total = registry.dense(system, packed, Scene(system, states, interface, t), y)
    return plus(total, _called(system, packed, y, motion, t, interface))


def called_forces(system: System, packed: Packed, y: np.ndarray, motion: np.ndarray, t: float) -> np.ndarray:
    """Return the generalised forces (nu,) of all callbacks; arguments as `dense.link_states`.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.loads import Callback
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> motor = Callback(name="motor", function=lambda t, state: {"hinge": 3.0})
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,), loads=(motor,))
    >>> called_forces(arm, pack(arm), np.zeros(4), np.zeros((1, 3)), 0.0)
    array([3., 0.])
    """
    states = dict(zip(system.order, seen_states(system, body_states(system, packed, y, motion)), strict=True))
    return _called(system, packed, y, motion, t, lambda body, k: interface_point(states[body], k)).f


def _called(
    system: System, packed: Packed, y: np.ndarray, motion: np.ndarray, t: float, interface: Callable[[str, int], Point]
) -> DenseLoads:
    state = State(system, packed, y, motion, lambda body, k: interface(body, k).frame)
    wrenches, tau = callback_loads(system, packed, t, state)
    total = DenseLoads(tau, float(tau @ y[packed.nx :]), 0.0, 0.0)
    for w in wrenches:
        total = plus(total, wrench_at(interface(w.body, w.interface), w.force, w.torque))
    return total


def loaded_accelerations(system: System, y: np.ndarray, motion: np.ndarray, t: float) -> np.ndarray:
    """Solve for the accelerations ``u' (nu,)`` under all loads with the whole mass matrix."""
    M, f = mass_and_force(system.with_masses_at(t), y, motion)
    loads = dense_loads(system, pack(system), y, motion, t)
    return np.linalg.solve(M + loads.mass, f + loads.f)


def interface_point(s: BodyState, k: int) -> Point:
    """Return interface k of a body."""
    r, turn, Phi, vel, acc = node_motion(s.body, k, s.V[3:], s.q, s.qd)
    shift = np.block([[np.eye(3), -skew(r)], [np.zeros((3, 3)), np.eye(3)]])
    J = shift @ s.J
    J[:, s.rows] += Phi
    world = on_both(s.R)
    V = world @ (shift @ s.V + vel)
    return Point(Frame(s.p + s.R @ r, s.R @ turn, V[:3], V[3:]), world @ J, world @ (shift @ s.c + acc))
