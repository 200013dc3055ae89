"""The readable twin of the kernel: one mass matrix for the whole system (book chapter 6).

Every body's spatial acceleration is affine in the speeds' derivatives, ``A_i = J_i u' + c_i``; stacking the
partial velocities ``[J_i; E_i]`` (E_i picks the body's q'') gives ``M u' = f`` by Kane's equations. Also the
poses, momenta and energies of a state, which results and checks use.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.layout import (
    COORDINATES,
    EPSILON,
    FREE,
    PRESCRIBED,
    REVOLUTE,
    SPEEDS,
    Tree,
    coordinate_count,
    topology,
)
from modalprep.multibody.system import System
from modalprep.vectors import skew


@dataclass
class BodyState:
    """Motion of one body: world rotation R and position p of its root, V = (v, w) in its own frame, q, q'.

    `J` and `c` give its spatial specific acceleration ``J u' + c``.
    """

    body: FlexibleBody
    R: np.ndarray
    p: np.ndarray
    V: np.ndarray
    q: np.ndarray
    qd: np.ndarray
    J: np.ndarray
    c: np.ndarray
    rows: slice


def body_equations(body: FlexibleBody, V: np.ndarray, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix (6 + n, 6 + n) and bias (6 + n,) of FORMULATION section 4.

    The torque row holds ``eps_cab q' Kg_W[b, a] q'`` besides the terms printed there: the derivative of
    ``C_c(q) q'``, without which energy is not conserved.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> M, b = body_equations(body, np.zeros(6), np.zeros(2), np.zeros(2))
    >>> round(float(M[0, 0]), 9), float(abs(b).max())
    (12.0, 0.0)
    """
    w = V[3:]
    W2 = skew(w) @ skew(w)
    PW = body.P + body.Kg_W
    S = body.S + body.Kg_A @ q
    L = body.H + PW @ q
    s = body.s0 + body.S @ q + 0.5 * (body.Kg_A @ q) @ q
    half = body.H @ q + 0.5 * (PW @ q) @ q
    E = body.E0 + half + half.T
    J = np.trace(E) * np.eye(3) - E
    C = np.einsum("cab,ban->cn", EPSILON, L)
    Y = L @ qd
    n = body.n
    M = np.block([[body.m * np.eye(3), -skew(s), S], [skew(s), J, C], [S.T, C.T, np.eye(n)]])
    force = W2 @ s + 2 * skew(w) @ (S @ qd) + (body.Kg_A @ qd) @ qd
    torque = skew(w) @ J @ w + 2 * (np.trace(Y) * w - Y @ w) + np.einsum("cab,ba->c", EPSILON, (body.Kg_W @ qd) @ qd)
    modal = np.einsum("ab,abn->n", W2, L) + 2 * np.einsum("ab,abn->n", skew(w), body.P @ qd) + body.K * q + body.D * qd
    return M, np.concatenate([force, torque, modal])


def node_motion(body: FlexibleBody, k: int, w: np.ndarray, q: np.ndarray, qd: np.ndarray):
    """Motion of interface k in the body frame.

    Returns ``r (3,), R (3, 3), Phi (6, n), vel (6,), acc (6,)``: position, rotation, partial velocities, elastic
    velocity, and the acceleration when A and
    q'' are zero. The rotation is the Cayley map of ``psi q``.
    """
    u = body.phi[k] @ q - 0.5 * (body.Kg_F[k] @ q) @ q
    x = body.psi[k] @ q - 0.5 * (body.Kg_T[k] @ q) @ q
    r = body.interface_position[k] + u
    s = 4 / (4 + x @ x)
    to_rate = s * (np.eye(3) + skew(x) / 2)
    translation, turn = body.phi[k] - body.Kg_F[k] @ q, body.psi[k] - body.Kg_T[k] @ q
    xd = turn @ qd
    Phi = np.vstack([translation, to_rate @ turn])
    vel = Phi @ qd
    linear = np.cross(w, np.cross(w, r)) + 2 * np.cross(w, vel[:3]) - (body.Kg_F[k] @ qd) @ qd
    angular = -s / 2 * (x @ xd) * vel[3:] - to_rate @ ((body.Kg_T[k] @ qd) @ qd) + np.cross(w, vel[3:])
    R = np.eye(3) + s * (skew(x) + skew(x) @ skew(x) / 2)
    return r, R, Phi, vel, np.concatenate([linear, angular])


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix about a unit axis (Rodrigues)."""
    return np.eye(3) + np.sin(angle) * skew(axis) + (1 - np.cos(angle)) * skew(axis) @ skew(axis)


def quaternion_matrix(e: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion (w, x, y, z) of any length."""
    w, v = e[0] / np.linalg.norm(e), e[1:] / np.linalg.norm(e)
    return np.eye(3) + 2 * w * skew(v) + 2 * skew(v) @ skew(v)


def body_states(system: System, tree: Tree, y: np.ndarray, motion: np.ndarray) -> list[BodyState]:
    """Return the motion of every body in the order of the tree.

    Parameters
    ----------
    tree : Tree
        `topology` of the system.
    y : (nx + nu,)
        State as `layout` packs it.
    motion : (nb, 3)
        Angle, rate and acceleration of prescribed hinges; other rows unused.
    """
    nx = coordinate_count(tree)
    states: list[BodyState] = []
    for i, name in enumerate(system.order):
        body, joint = system.bodies[name], tree.joint[i]
        x, u = tree.x[i], nx + tree.u[i]
        xq, uq = x + COORDINATES[joint], u + SPEEDS[joint]
        q, qd = y[xq : xq + body.n], y[uq : uq + body.n]
        rows = slice(uq - nx, uq - nx + body.n)
        parent = states[tree.parent[i]] if tree.parent[i] >= 0 else None
        R, p, V, J, c = _carried(parent, tree.node[i], tree.place[i], tree.gravity, len(y) - nx)
        if joint == FREE:
            R, V = quaternion_matrix(y[x + 3 : x + 7]), y[u : u + 6]
            J = np.zeros_like(J)
            J[:, u - nx : u - nx + 6] = np.eye(6)
            c = np.concatenate([np.cross(V[3:], V[:3]) - R.T @ tree.gravity, np.zeros(3)])
            p = y[x : x + 3]
        else:
            angle, rate, acceleration = motion[i] if joint == PRESCRIBED else (0.0, 0.0, 0.0)
            if joint == REVOLUTE:
                angle, rate = y[x], y[u]
            turn = tree.fixed[i] @ turn_about(tree.axis[i], angle)
            R, X = R @ turn, np.kron(np.eye(2), turn.T)
            V, J, c = X @ V, X @ J, X @ c
            spin = np.concatenate([np.zeros(3), tree.axis[i]])
            c = c + np.concatenate([np.zeros(3), np.cross(V[3:], tree.axis[i] * rate)]) + spin * acceleration
            V = V + spin * rate
            if joint == REVOLUTE:
                J[:, u - nx] += spin
        states.append(BodyState(body, R, p, V, q, qd, J, c, rows))
    return states


def _carried(parent: BodyState | None, node: int, place: np.ndarray, gravity: np.ndarray, nu: int):
    """Motion of the parent's hinge point (or of the ground) in its own axes: R, p, V, J, c."""
    if parent is None:
        return np.eye(3), place, np.zeros(6), np.zeros((6, nu)), np.concatenate([-gravity, np.zeros(3)])
    r, R, Phi, vel, acc = node_motion(parent.body, node, parent.V[3:], parent.q, parent.qd)
    shift = np.block([[np.eye(3), -skew(r)], [np.zeros((3, 3)), np.eye(3)]])
    J = shift @ parent.J
    J[:, parent.rows] += Phi
    X = np.kron(np.eye(2), R.T)
    return (
        parent.R @ R,
        parent.p + parent.R @ r,
        X @ (shift @ parent.V + vel),
        X @ J,
        X @ (shift @ parent.c + acc),
    )


def mass_and_force(system: System, y: np.ndarray, motion: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return ``M (nu, nu)`` and ``f (nu,)`` of ``M u' = f`` at a state.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.system import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -10.0, 0]))
    >>> M, f = mass_and_force(arm, np.zeros(6))
    >>> M.shape, round(float(f[0] / M[0, 0]), 3)
    ((3, 3), -1.5)
    """
    motion = np.zeros((len(system.bodies), 3)) if motion is None else motion
    states = body_states(system, topology(system), y, motion)
    nu = states[0].J.shape[1]
    M, f = np.zeros((nu, nu)), np.zeros(nu)
    for s in states:
        partial = np.vstack([s.J, np.eye(nu)[s.rows]])
        M_body, bias = body_equations(s.body, s.V, s.q, s.qd)
        remainder = np.concatenate([s.c, np.zeros(s.body.n)])
        M += partial.T @ M_body @ partial
        f -= partial.T @ (M_body @ remainder + bias)
    return M, f


def dense_accelerations(system: System, y: np.ndarray, motion: np.ndarray | None = None) -> np.ndarray:
    """Solve for the accelerations ``u' (nu,)`` with the whole mass matrix."""
    M, f = mass_and_force(system, y, motion)
    return np.linalg.solve(M, f)


def energy_and_momentum(gravity: np.ndarray, states: list[BodyState]) -> dict[str, np.ndarray]:
    """Return kinetic, strain and gravity energy (J), linear and angular momentum about the inertial origin.

    With ``T = V' M V / 2`` of the same mass matrix as the equations of motion, so that they balance exactly.
    """
    out = {"kinetic": 0.0, "strain": 0.0, "gravity": 0.0, "linear": np.zeros(3), "angular": np.zeros(3)}
    for s in states:
        M, _ = body_equations(s.body, s.V, s.q, s.qd)
        v = np.concatenate([s.V, s.qd])
        momentum = M[:6] @ v
        linear = s.R @ momentum[:3]
        first = s.R @ np.array([M[5, 1], M[3, 2], M[4, 0]])  # s(q) read back from M_rr = [[m, -s~], [s~, J]]
        out["kinetic"] += 0.5 * v @ M @ v
        out["strain"] += 0.5 * s.q @ (s.body.K * s.q)
        out["gravity"] -= gravity @ (s.body.m * s.p + first)
        out["linear"] = out["linear"] + linear
        out["angular"] = out["angular"] + np.cross(s.p, linear) + s.R @ momentum[3:]
    return out
