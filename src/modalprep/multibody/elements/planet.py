"""Gravity of a planet on all bodies: a central field (`CentralGravity`), or that of an `Orbit`."""

from __future__ import annotations

import numpy as np

from modalprep.body.mass import affine_part, deflected
from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.compiler.lanes import WIDTH, get_lanes, put_lanes
from modalprep.multibody.elements.dense import BodyState, DenseLoads, Scene, plus
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


def dense(scene: Scene) -> DenseLoads:
    """Return what a planet does to all bodies: the reference implementation."""
    total = scene.nothing
    for state in scene.states.values():
        for load in scene.system.loads:
            if isinstance(load, CentralGravity):
                total = plus(total, _central(load, state))
        if scene.system.orbit:
            total = plus(total, _in_orbit(scene.system.orbit, state))
    return total


def _central(load: CentralGravity, s: BodyState) -> DenseLoads:
    """Return what a field of central gravity does to a body."""
    d = s.R.T @ (s.p - load.centre)
    R = float(np.linalg.norm(d))
    return _in_field(s, d / R, 1 / R, load.mu / R**3, -load.mu * d / R**3, -load.mu / R)


def _in_orbit(orbit: Orbit, s: BodyState) -> DenseLoads:
    """Return gravity less that of the origin, and the potential of the turn, whose force the kinematics have."""
    x = s.R.T @ s.p
    k = 1 / orbit.radius
    w = s.R[2] * orbit.rate
    one = np.eye(3)
    to = s.R[0] + k * x  # from the planet, by the radius
    far = float(np.linalg.norm(to))
    q = (orbit.rate / far**1.5) ** 2
    a = (2 * s.R[0] + k * x) @ x / (far + 1)
    g = -q * (x - a * (1 + far + far**2) * s.R[0])
    U = orbit.rate**2 * (x @ x - a**2 * (far + 2) / far) / 2
    found = _in_field(s, to / far, k / far, q, g, U)
    at = deflected(affine_part(s.body), s.q)
    E = at.E + np.outer(x, at.s) + np.outer(at.s, x) + s.body.m * np.outer(x, x)
    turn = -np.sum((w @ w * one - np.outer(w, w)) * E) / 2
    return found._replace(gravity=found.gravity + turn)


def _in_field(s: BodyState, n: np.ndarray, k: float, q: float, g: np.ndarray, U: float) -> DenseLoads:
    """Field, gradient and second gradient at the root, with the body's own moments: direction and 1 / R, mu / R^3."""
    body = s.body
    one = np.eye(3)
    Gamma = -q * (one - 3 * np.outer(n, n))
    symmetric = sum(np.einsum(f"{index}->abc", one, n) for index in ("ab,c", "ac,b", "bc,a"))
    second = k * q * (3 * symmetric - 15 * np.einsum("a,b,c->abc", n, n, n))
    at = deflected(affine_part(body), s.q)
    force = body.m * g + Gamma @ at.s + np.einsum("abc,ab->c", second, at.E) / 2
    torque = np.cross(at.s, g) + np.einsum("cab,ad,bd->c", EPSILON, at.E, Gamma)
    f = s.J.T @ np.concatenate([force, torque])
    f[s.rows] += g @ at.S + np.einsum("ab,abn->n", Gamma, at.L)
    return DenseLoads(f, 0.0, 0.0, float(body.m * U - g @ at.s - np.sum(Gamma * at.E) / 2))
