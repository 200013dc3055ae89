"""Gravity of a planet on all bodies: a central field (`CentralGravity`), or that of an `Orbit`."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import Deflected, affine_part, deflected
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, get_lanes, put_lanes
from modalprep.multibody.elements.dense import BodyState, DenseLoads, Scene, plus
from modalprep.multibody.elements.slopes import BodySlopes
from modalprep.multibody.kernels.algebra.matrices import times
from modalprep.multibody.kernels.algebra.tuples import dot3
from modalprep.multibody.kernels.data import EPSILON, GROWS
from modalprep.multibody.kernels.interfaces import add_at_origin
from modalprep.multibody.kernels.loads.gravity import PLANET, planet_load
from modalprep.multibody.kernels.modal_inertia import deflect, mode_moments
from modalprep.multibody.kernels.modal_mass import apply_slopes
from modalprep.multibody.model.environment import CentralGravity, Orbit
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import blank
from modalprep.multibody.tangents.bodies import field_slopes
from modalprep.vectors import skew


def pack(system: System) -> np.recarray:
    """Return one row, of zeros where there is no planet."""
    row = blank(PLANET, 1)
    for load in system.loads:
        if isinstance(load, CentralGravity):
            row["mu"], row["centre"] = load.mu, load.centre
    if system.orbit is not None:
        orbit, dipole = system.orbit, system.orbit.dipole
        for name in ("rate", "inclination", "argument_of_latitude", "planet_spin"):
            row[name] = getattr(orbit, name)
        row["curvature"] = 1 / orbit.radius
        if dipole is not None:
            row["field"] = dipole.strength * (dipole.radius / orbit.radius) ** 3
            row["tilt"], row["longitude"] = dipole.tilt, dipole.longitude
    return row


@compile_kernel
def apply(planet, model, data):
    """Add gravity to all bodies, with the inertia that `outward` left; returns 0, 0, the potential."""
    potential = 0.0
    for i in range(len(model.links)):
        if model.links[i].body >= 0:
            f, torque, U, field = planet_load(planet, model, data, i)
            add_at_origin(data.links[i], f, torque)
            _on_modes(data.modal, model, i, field)
            potential += U
    return 0.0, 0.0, potential


@compile_inline
def _on_modes(modal, model, i, field):
    """Add gravity to the modal loads of link i's body."""
    if modal is not None:
        s = model.links[i].slot
        if s >= 0:
            g, _, n, q, _ = field
            deflect(modal, model, i)
            if model.links[i].modal_mass == GROWS:
                apply_slopes(modal, model, i)
            load = modal.load[s]
            for b in range(0, model.links[i].modes, WIDTH):
                S, L = mode_moments(modal, model, i, b)
                own = dot3(g, S) + q * (3.0 * dot3(n, times(L, n)) - L[0] - L[4] - L[8])
                put_lanes(load, b, get_lanes(load, b) + own)


class Field(NamedTuple):
    """Field of a planet at the root of a body, in its axes; its gradient is ``-q (1 - 3 n n')``."""

    n: np.ndarray  # (3,) direction from the centre
    k: float  # 1 / R
    q: float  # mu / R^3
    g: np.ndarray  # (3,) without that of the origin in an orbit
    U: float  # potential


def _fields(scene: Scene) -> Iterator[tuple[str, BodyState, Field]]:
    """Yield what acts on each body."""
    for name, s in scene.states.items():
        for load in scene.system.loads:
            if isinstance(load, CentralGravity):
                yield name, s, _central(load, s)
        if scene.system.orbit:
            yield name, s, _in_orbit(scene.system.orbit, s)


def _central(load: CentralGravity, s: BodyState) -> Field:
    d = s.R.T @ (s.p - load.centre)
    R = float(np.linalg.norm(d))
    return Field(d / R, 1 / R, load.mu / R**3, -load.mu * d / R**3, -load.mu / R)


def _in_orbit(orbit: Orbit, s: BodyState) -> Field:
    """Return gravity less that of the origin."""
    x = s.R.T @ s.p
    k = 1 / orbit.radius
    to = s.R[0] + k * x  # from the planet, by the radius
    far = float(np.linalg.norm(to))
    q = (orbit.rate / far**1.5) ** 2
    a = (2 * s.R[0] + k * x) @ x / (far + 1)
    g = -q * (x - a * (1 + far + far**2) * s.R[0])
    U = orbit.rate**2 * (x @ x - a**2 * (far + 2) / far) / 2
    return Field(to / far, k / far, q, g, U)


def dense(scene: Scene) -> DenseLoads:
    """Return what a planet does to all bodies: the reference implementation."""
    total = scene.nothing
    for _, state, field in _fields(scene):
        total = plus(total, _in_field(state, field))
    orbit = scene.system.orbit
    turns = sum(_turn_potential(orbit, state) for state in scene.states.values()) if orbit else 0.0
    return total._replace(gravity=total.gravity + turns)


def _turn_potential(orbit: Orbit, s: BodyState) -> float:
    """Return the potential of the turn of an orbit, whose force the kinematics have."""
    x, w = s.R.T @ s.p, s.R[2] * orbit.rate
    at = deflected(affine_part(s.body), s.q)
    E = at.E + np.outer(x, at.s) + np.outer(at.s, x) + s.body.m * np.outer(x, x)
    return -float(np.sum((w @ w * np.eye(3) - np.outer(w, w)) * E)) / 2


def _gradients(field: Field) -> tuple[np.ndarray, np.ndarray]:
    """Return the first and the second gradient (3, 3), (3, 3, 3)."""
    n, one = field.n, np.eye(3)
    symmetric = sum(np.einsum(f"{index}->abc", one, n) for index in ("ab,c", "ac,b", "bc,a"))
    second = field.k * field.q * (3 * symmetric - 15 * np.einsum("a,b,c->abc", n, n, n))
    return -field.q * (one - 3 * np.outer(n, n)), second


def _on_moments(body: FlexibleBody, at: Deflected, g: np.ndarray, gradient: np.ndarray) -> np.ndarray:
    """Return the force (6 + n,) of a field ``g + gradient x`` on a body."""
    torque = np.cross(at.s, g) + np.einsum("cab,ad,bd->c", EPSILON, at.E, gradient)
    modal = g @ at.S + np.einsum("ab,abn->n", gradient, at.L)
    return np.concatenate([body.m * g + gradient @ at.s, torque, modal])


def _in_field(s: BodyState, field: Field) -> DenseLoads:
    """Field, gradient and second gradient at the root, with the body's own moments."""
    at = deflected(affine_part(s.body), s.q)
    gradient, second = _gradients(field)
    force = _on_moments(s.body, at, field.g, gradient)
    force[:3] += np.einsum("abc,ab->c", second, at.E) / 2
    f = s.J.T @ force[:6]
    f[s.rows] += force[6:]
    potential = s.body.m * field.U - field.g @ at.s - np.sum(gradient * at.E) / 2
    return DenseLoads(f, 0.0, 0.0, float(potential))


def tangent(scene: Scene) -> list[BodySlopes]:
    """Return what a planet does to all bodies, with its derivatives."""
    return [_slopes(name, state, field) for name, state, field in _fields(scene)]


def _slopes(name: str, s: BodyState, field: Field) -> BodySlopes:
    at = deflected(affine_part(s.body), s.q)
    gradient, second = _gradients(field)
    moves = [(gradient[:, c], second[c]) for c in range(3)]
    moves += [(field.g @ axis, gradient @ axis - axis @ gradient) for axis in skew(np.eye(3))]
    by_pose = np.column_stack([_on_moments(s.body, at, *change) for change in moves])
    by_q = np.zeros((6 + s.body.n, s.body.n))
    force = _on_moments(s.body, at, field.g, gradient)
    force[:3] += _second_order(field, at.E)
    by_pose[:3] += _second_order_by_pose(field, at.E)
    if s.body.n:
        by_q = field_slopes(s.body, field.g, gradient, s.q)
        by_q[:3] += _second_order(field, at.L + at.L.transpose(1, 0, 2))
    return BodySlopes(name, force, by_pose, by_q=by_q)


def _second_order(field: Field, E: np.ndarray) -> np.ndarray:
    """Return the force of the second gradient on moments ``E (3, 3, ...)``."""
    n, along = field.n, np.tensordot(field.n, E, 1)
    trace, stretch = np.trace(E), np.tensordot(field.n, along, 1)
    return field.k * field.q * (np.multiply.outer(n, 1.5 * trace - 7.5 * stretch) + 3 * along)


def _second_order_by_pose(field: Field, E: np.ndarray) -> np.ndarray:
    """Return the derivatives (3, 6) of `_second_order` by displacement and rotation of the body."""
    n, force, along = field.n, _second_order(field, E), E @ field.n
    size, one = field.k * field.q, np.eye(3)
    by_n = (1.5 * np.trace(E) - 7.5 * (n @ along)) * one + 3 * E - 15 * np.outer(n, along)
    by_place = field.k * (size * by_n @ (one - np.outer(n, n)) - 4 * np.outer(force, n))
    turned = E @ skew(n) - skew(along)
    by_turn = skew(force) + size * (3 * turned - 7.5 * np.outer(n, n @ turned))
    return np.hstack([by_place, by_turn])
