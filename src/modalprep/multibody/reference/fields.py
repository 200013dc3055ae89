"""The reference implementation of fields: gravity about a point or in an orbit, and the field of a dipole, in numpy."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.body.mass import affine_part, deflected
from modalprep.multibody.kernels.data import EPSILON
from modalprep.multibody.model.environment import CentralGravity, Conductor, Orbit
from modalprep.multibody.model.system import System
from modalprep.multibody.reference.equations import BodyState
from modalprep.multibody.reference.points import DenseLoads, end_point, plus, value_at, wrench_at


def central_gravity(load: CentralGravity, s: BodyState) -> DenseLoads:
    """Return what a field of central gravity does to a body."""
    d = s.R.T @ (s.p - load.centre)
    R = np.linalg.norm(d)
    return _in_field(s, d / R, 1 / R, load.mu / R**3, -load.mu * d / R**3, -load.mu / R)


def gravity_in_orbit(orbit: Orbit, s: BodyState) -> DenseLoads:
    """Return gravity less that of the origin, and the potential of the turn, whose force the kinematics have."""
    x, k, w, one = s.R.T @ s.p, 1 / orbit.radius, s.R[2] * orbit.rate, np.eye(3)
    to = s.R[0] + k * x  # from the planet, by the radius
    far = np.linalg.norm(to)
    q, a = (orbit.rate / far**1.5) ** 2, (2 * s.R[0] + k * x) @ x / (far + 1)
    g = -q * (x - a * (1 + far + far**2) * s.R[0])
    U = orbit.rate**2 * (x @ x - a**2 * (far + 2) / far) / 2
    found = _in_field(s, to / far, k / far, q, g, U)
    at = deflected(affine_part(s.body), s.q)
    E = at.E + np.outer(x, at.s) + np.outer(at.s, x) + s.body.m * np.outer(x, x)
    turn = -np.sum((w @ w * one - np.outer(w, w)) * E) / 2
    return found._replace(gravity=found.gravity + turn)


def _in_field(s: BodyState, n: np.ndarray, k: float, q: float, g: np.ndarray, U: float) -> DenseLoads:
    """Field, gradient and second gradient at the root, with the body's own moments: direction and 1 / R, mu / R^3."""
    body, one = s.body, np.eye(3)
    Gamma = -q * (one - 3 * np.outer(n, n))
    symmetric = sum(np.einsum(f"{index}->abc", one, n) for index in ("ab,c", "ac,b", "bc,a"))
    second = k * q * (3 * symmetric - 15 * np.einsum("a,b,c->abc", n, n, n))
    at = deflected(affine_part(body), s.q)
    force = body.m * g + Gamma @ at.s + np.einsum("abc,ab->c", second, at.E) / 2
    torque = np.cross(at.s, g) + np.einsum("cab,ad,bd->c", EPSILON, at.E, Gamma)
    f = s.J.T @ np.concatenate([force, torque])
    f[s.rows] += g @ at.S + np.einsum("ab,abn->n", Gamma, at.L)
    return DenseLoads(f, 0.0, 0.0, float(body.m * U - g @ at.s - np.sum(Gamma * at.E) / 2))


def conductor_force(load: Conductor, system: System, states: dict[str, BodyState], t: float) -> DenseLoads:
    """Return the forces on a conductor; the dipole's field by rotation matrices from the planet's axes."""
    orbit, total = system.orbit, DenseLoads(np.zeros(next(iter(states.values())).J.shape[1]), 0.0, 0.0, 0.0)
    d, to_orbit = (
        orbit.dipole,
        Rotation.from_euler("ZXZ", [0.0, orbit.inclination, orbit.argument_of_latitude + orbit.rate * t]),
    )
    turn = d.longitude + orbit.planet_spin * t
    north = to_orbit.inv().apply(Rotation.from_euler("ZY", [turn, d.tilt]).apply([0, 0, 1.0]))
    for ends in load.segments:
        a, b = (end_point(system, states, end, load) for end in ends)
        r = (a.frame.position + b.frame.position) / 2 + [orbit.radius, 0, 0]
        R = np.linalg.norm(r)
        B = d.strength * (d.radius / R) ** 3 * (north - 3 * (north @ r) * r / R**2)
        f = value_at(load.current, t) * np.cross(b.frame.position - a.frame.position, B)
        for point in (a, b):
            total = plus(total, wrench_at(point, f / 2, np.zeros(3)))
    return total
