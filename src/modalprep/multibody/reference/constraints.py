"""The reference implementation of constraints: Phi, G and Phi'' with whole matrices, two ways to solve."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import scipy

from modalprep.multibody.elements.dense import BodyState
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.kernels.closed_loops.constraints import (
    ANGLE,
    COUPLER,
    POINT,
    SLIP,
)
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import body_states, ground_spin, mass_and_force
from modalprep.multibody.reference.loads import dense_loads, interface_point
from modalprep.vectors import cross, skew

DEPENDENT = 1e-9  # pivot of the Jacobian's QR, of the largest, below which a row depends on others
SETTLED = 1e-13  # change of friction, of the largest multiplier
FRICTION_STEPS = 500


class DenseConstraints(NamedTuple):
    """``Phi (m,)``, its rate, and ``Phi'' = G u' + bias``."""

    phi: np.ndarray
    rate: np.ndarray
    G: np.ndarray
    bias: np.ndarray


@dataclass
class _Vector:
    """A vector of space in time: itself, its rate, and its second derivative ``D u' + c``; inertial axes."""

    v: np.ndarray
    d: np.ndarray
    D: np.ndarray
    c: np.ndarray

    def __sub__(self, other: _Vector) -> _Vector:
        return _Vector(self.v - other.v, self.d - other.d, self.D - other.D, self.c - other.c)

    def dot(self, other: _Vector) -> tuple[float, float, np.ndarray, float]:
        """Return the product, its rate, and its second derivative as row and constant."""
        return (
            float(self.v @ other.v),
            float(self.d @ other.v + self.v @ other.d),
            other.v @ self.D + self.v @ other.D,
            float(other.v @ self.c + self.v @ other.c + 2 * self.d @ other.d),
        )


@dataclass
class _End:
    """An interface or a frame on the ground: its origin, rotation, and the rotation's motion."""

    origin: _Vector
    R: np.ndarray
    w: np.ndarray
    Jw: np.ndarray
    cw: np.ndarray

    def fixed(self, e: np.ndarray) -> _Vector:
        """Return a vector fixed in the end's axes."""
        v = self.R @ e
        w = self.w
        return _Vector(v, cross(w, v), -skew(v) @ self.Jw, cross(self.cw, v) + cross(w, cross(w, v)))


def dense_constraints(
    system: System, packed: Packed, loops: Loops, y: np.ndarray, motion: np.ndarray, t: float
) -> DenseConstraints:
    """Return all rows of the closures at a state; arguments as `dense.link_states`."""
    bodies = body_states(system, packed, y, motion)
    states = {packed.link_of(name): s for name, s in zip(system.order, bodies, strict=True)}
    arrays = loops.arrays
    found = []
    ends = [_end(states.get(int(end["link"])), end, system, packed.nu) for end in arrays.ends]
    for i, row in enumerate(loops.closing.rows):
        if row.kind == COUPLER:
            line = _coupler(loops, i, packed, y, motion)
        else:
            at = arrays.rows[i]
            line = _row(at, ends[at["a"]], ends[at["b"]])
        value, rate, acceleration = row.function(t) if row.function else (0.0, 0.0, 0.0)
        value += loops.work.value[i]
        found.append((line[0] - value, line[1] - rate, line[2], line[3] - acceleration))
    columns = list(zip(*found, strict=True))
    return DenseConstraints(*(np.array(column) for column in columns))


def _end(s: BodyState | None, end: np.void, system: System, nu: int) -> _End:
    if s is None:
        none = np.zeros((3, nu))
        w = ground_spin(system)
        p = end["position"]
        origin = _Vector(p, cross(w, p), none, cross(w, cross(w, p)) - system.gravity)
        return _End(origin, end["rotation"].reshape(3, 3), w, none, np.zeros(3))
    frame, J, c = interface_point(s, int(end["interface"]))
    origin = _Vector(frame.position, frame.velocity, J[:3], c[:3])
    return _End(origin, frame.rotation, frame.angular_velocity, J[3:], c[3:])


def _row(row: np.void, a: _End, b: _End) -> tuple:
    kind, axis = row["kind"], row["in_a"]
    apart = b.origin - a.origin
    if kind == POINT:
        return a.fixed(axis).dot(apart)
    if kind == ANGLE:
        return a.fixed(axis).dot(b.fixed(row["in_b"]))
    if kind == SLIP:
        _, rate, G, bias = a.fixed(axis).dot(apart)
        return 0.0, rate, G, bias
    square, rate, G, bias = apart.dot(apart)
    L = np.sqrt(square)
    return L, rate / (2 * L), G / (2 * L), bias / (2 * L) - rate**2 / (4 * L**3)


def _coupler(loops: Loops, i: int, packed: Packed, y: np.ndarray, motion: np.ndarray) -> tuple:
    phi = rate = bias = 0.0
    G = np.zeros(packed.nu)
    for row, link, x, u, factor in loops.arrays.terms:
        if row == i and x >= 0:
            phi = phi + factor * y[x]
            rate = rate + factor * y[packed.nx + u]
            G[u] += factor
        elif row == i:
            phi, rate, bias = (p + factor * m for p, m in zip((phi, rate, bias), motion[link], strict=True))
    return phi, rate, G, bias


def closed_accelerations(
    system: System, loops: Loops, y: np.ndarray, motion: np.ndarray, t: float
) -> tuple[np.ndarray, np.ndarray]:
    """Solve ``[M G'; G 0] [u'; -multiplier] = [f; -bias]`` with all loads; of redundant rows the least multipliers.

    Inactive closures have none. Friction is found by iteration: it adds to f what the normal forces give.

    Returns
    -------
    u' : (nu,)
    multiplier : (m,)
    """
    M, f, rows = _equations(system, loops, y, motion, t)
    active = loops.active_rows
    frictional = np.array([row.kind == SLIP for row in loops.closing.rows])
    slides = np.flatnonzero(frictional).tolist()
    udot, multiplier = np.zeros(len(f)), np.zeros(len(rows.bias))
    for _ in range(FRICTION_STEPS):
        before = multiplier.copy()
        udot, multiplier[active] = _saddle(
            M, f + rows.G[frictional].T @ multiplier[frictional], rows.G[active], rows.bias[active]
        )
        multiplier[frictional] = [_friction(loops, i, rows.rate, multiplier) for i in slides]
        if np.abs(multiplier - before)[frictional].max(initial=0.0) <= SETTLED * np.abs(multiplier).max(initial=0.0):
            break
    return udot, multiplier


def _saddle(M: np.ndarray, f: np.ndarray, G: np.ndarray, bias: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Solve for accelerations and multipliers, rows scaled."""
    n, m = len(f), len(bias)
    K = np.block([[M, G.T], [G, np.zeros((m, m))]])
    scale = np.concatenate([1 / np.sqrt(np.diag(M)), np.ones(m)])
    response = np.sqrt(np.maximum(np.einsum("ij,ij->i", G * scale[:n] ** 2, G), 1e-300))
    scale[n:] = 1 / np.where(response > 1e-9 * response.max(initial=0.0), response, 1.0)
    solution = scale * np.linalg.lstsq(K * scale * scale[:, None], scale * np.append(f, -bias), rcond=1e-11)[0]
    return solution[:n], -solution[n:]


def _friction(loops: Loops, i: int, rate: np.ndarray, multiplier: np.ndarray) -> float:
    """Coulomb friction in row i by the other rows of its closure."""
    closure = loops.closing.rows[i].closure
    slide = loops.closing.sliding(closure)
    normal = loops.closing.normal(closure)
    speed = np.linalg.norm(rate[slide])
    mu, sliding = loops.closing.rows[i].friction
    return -mu * np.linalg.norm(multiplier[normal]) * np.tanh(speed / sliding) * rate[i] / max(speed, 1e-300)


def reduced_accelerations(system: System, loops: Loops, y: np.ndarray, motion: np.ndarray, t: float) -> np.ndarray:
    """Solve in as many independent speeds as there are degrees of freedom (theory 5.6).

    A pivoted QR factorisation of G chooses the dependent speeds, ``G_d u_d = -G_i u_i + b``; with
    ``u' = R z' + s`` the equations are ``R' M R z' = R' (f - M s)``.

    Returns
    -------
    u' : (nu,)
    """
    M, f, rows = _equations(system, loops, y, motion, t)
    R, s = null_space(rows.G[loops.active_rows], -rows.bias[loops.active_rows])
    return R @ np.linalg.solve(R.T @ M @ R, R.T @ (f - M @ s)) + s


def null_space(G: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return R (n, n - rank) and s (n,) of all solutions ``R z + s`` of ``G u = b``, z some of u.

    Examples
    --------
    >>> R, s = null_space(np.array([[2.0, 1.0]]), np.array([4.0]))
    >>> R.ravel(), s
    (array([-0.5,  1. ]), array([2., 0.]))
    """
    n = G.shape[1]
    Q, T, order = scipy.linalg.qr(G, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(T))
    rank = int(np.sum(sizes > DEPENDENT * sizes.max(initial=0.0)))
    dependent = order[:rank]
    independent = order[rank:]
    R = np.zeros((n, n - rank))
    s = np.zeros(n)
    R[independent, np.arange(n - rank)] = 1.0
    R[dependent] = -np.linalg.solve(T[:rank, :rank], T[:rank, rank:])
    s[dependent] = np.linalg.solve(T[:rank, :rank], (Q.T @ b)[:rank])
    return R, s


def _equations(
    system: System, loops: Loops, y: np.ndarray, motion: np.ndarray, t: float
) -> tuple[np.ndarray, np.ndarray, DenseConstraints]:
    packed = pack(system)
    M, f = mass_and_force(system.with_masses_at(t), y, motion)
    loads = dense_loads(system, packed, y, motion, t)
    rows = dense_constraints(system, packed, loops, y, motion, t)
    return M + loads.mass, f + loads.f, rows
