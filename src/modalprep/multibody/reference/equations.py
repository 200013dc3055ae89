"""The reference implementation of the equations of motion: one mass matrix for the whole system (book chapter 6).

Every link's spatial acceleration is affine in the speeds' derivatives, ``A_i = J_i u' + c_i``; stacking the
partial velocities ``[J_i; E_i]`` (E_i picks the body's q'') gives ``M u' = f`` by Kane's equations. Also the
poses, momenta and energies of a state, which results and checks use.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import shortening, strain_arms, swing
from modalprep.body.mass import affine_part, assembled, cross_moment, deflected, partial_rates
from modalprep.multibody.elements.dense import BodyState, LinkState
from modalprep.multibody.model.joint_types import KINDS, PRESCRIBED
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.stations import station_equations, station_node
from modalprep.vectors import cross, on_both, skew

AXIS = np.array([0, 0, 1.0])


def body_equations(body: FlexibleBody, V: np.ndarray, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the mass matrix (6 + n, 6 + n) and bias (6 + n,) of theory 4, its M(q) made positive.

    With the coordinates of body/mass.py, ``Omega_r = w~ w~ p_r + 2 w~ p_r' + dp_r' q'`` is what the particles of the
    affine part accelerate by when A, alpha and q'' are zero.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> M, b = body_equations(body, np.zeros(6), np.zeros(2), np.zeros(2))
    >>> round(float(M[0, 0]), 9), float(abs(b).max())
    (12.0, 0.0)
    """
    if body.stations:
        return station_equations(body, V, q, qd)
    part = affine_part(body)
    at = deflected(part, q)
    w = V[3:]
    spin = skew(V[3:])
    rates = at.d_eta @ qd
    rest, W2 = part.P_rest @ at.eta, spin @ spin
    E, Y = rest @ at.eta, rest @ rates
    Omega = W2 @ at.p + 2 * spin @ (at.dp @ qd) + partial_rates(part, q, qd) @ qd
    force = part.root_mass * Omega[:, 0]
    torque = np.cross(at.p, Omega, axis=0).sum(axis=1)
    torque += cross(w, np.trace(E) * w - E @ w) + 2 * (np.trace(Y) * w - Y @ w)
    modal = np.einsum("ab,abn->n", W2, rest) + 2 * np.einsum("ab,abn->n", spin, part.P_rest @ rates)
    if part.c.size:
        growing = (part.c @ qd) @ qd
        modal += part.M_rest @ growing
        torque += cross_moment(rest @ growing)
    modal = np.einsum("ar,arn->n", Omega, at.dp) + at.d_eta.T @ modal + body.K * q + body.damping_matrix @ qd
    return assembled(body.m, at), np.concatenate([force, torque, modal])


def node_motion(body: FlexibleBody, k: int, w: np.ndarray, q: np.ndarray, qd: np.ndarray):
    """Motion of interface k in the body frame.

    Returns ``r (3,), R (3, 3), Phi (6, n), vel (6,), acc (6,)``: position, rotation, partial velocities, elastic
    velocity, and the acceleration when A and q'' are zero. The rotation vector is ``psi q`` to the fourth order: R is
    the Cayley map of ``(1 + v.v / 12) v``, with ``v = psi q``, and has no singularity.
    """
    if body.stations:
        return station_node(body, k, w, q, qd)
    u, translation, third = _translation(body, k, q, qd)
    v = body.psi[k] @ q - 0.5 * (body.Kg_T[k] @ q) @ q
    r = body.interface_position[k] + u
    x = (1 + v @ v / 12) * v
    slope = (1 + v @ v / 12) * np.eye(3) + np.outer(v, v) / 6
    s = 4 / (4 + x @ x)
    to_rate = s * (np.eye(3) + skew(x) / 2)
    turn = slope @ (body.psi[k] - body.Kg_T[k] @ q)
    vd = (body.psi[k] - body.Kg_T[k] @ q) @ qd
    xd = turn @ qd
    xdd = (v @ vd) / 3 * vd + (vd @ vd) / 6 * v - slope @ ((body.Kg_T[k] @ qd) @ qd)  # without q''
    Phi = np.vstack([translation, to_rate @ turn])
    vel = Phi @ qd
    linear = cross(w, cross(w, r)) + 2 * cross(w, vel[:3]) + third
    angular = -s / 2 * (x @ xd) * vel[3:] + to_rate @ xdd + cross(w, vel[3:])
    R = np.eye(3) + s * (skew(x) + skew(x) @ skew(x) / 2)
    return r, R, Phi, vel, np.concatenate([linear, angular])


def _translation(body: FlexibleBody, k: int, q: np.ndarray, qd: np.ndarray):
    """Displacement (3,) of interface k, partial velocities (3, n), acceleration without q'': see body/line.py."""
    linear, speed, across = body.phi[k] @ q, body.phi[k] @ qd, -body.Kg_F[k] @ q
    bent = across @ q / 2
    bending = across @ qd
    second = -(body.Kg_F[k] @ qd) @ qd
    arm = strain_arms(body.interface_position, body.points)[k]
    g, g_slope, g_curve = shortening(arm @ bent)
    h, h_slope, h_curve = swing(arm @ bent)
    along = h_slope * linear + g_slope * bent
    rate = arm @ bending
    partial = h * body.phi[k] + g * across + np.outer(along, arm @ across)
    acceleration = g * second + (arm @ second) * along
    acceleration += 2 * rate * (h_slope * speed + g_slope * bending) + rate**2 * (h_curve * linear + g_curve * bent)
    return h * linear + g * bent, partial, acceleration


def turn_about(axis: np.ndarray, angle: float) -> np.ndarray:
    """Rotation matrix about a unit axis (Rodrigues)."""
    return np.eye(3) + np.sin(angle) * skew(axis) + (1 - np.cos(angle)) * skew(axis) @ skew(axis)


def quaternion_matrix(e: np.ndarray) -> np.ndarray:
    """Rotation matrix of a quaternion (w, x, y, z) of any length."""
    w = e[0] / np.linalg.norm(e)
    v = e[1:] / np.linalg.norm(e)
    return np.eye(3) + 2 * w * skew(v) + 2 * skew(v) @ skew(v)


def ground_spin(system: System) -> np.ndarray:
    """Return the angular velocity (3,) of the ground, that of the orbit."""
    return system.orbit.rate * AXIS if system.orbit else np.zeros(3)


def _ground(system: System, p: np.ndarray, nu: int) -> LinkState:
    """Motion of a point of the ground, which turns in an orbit."""
    w = ground_spin(system)
    c = np.concatenate([cross(w, cross(w, p)) - system.gravity, np.zeros(3)])
    return LinkState(np.eye(3), p, np.concatenate([cross(w, p), w]), np.zeros((6, nu)), c)


def _interface(parent: LinkState, node: int, arm: np.ndarray) -> LinkState:
    """Motion of an interface of a body, in its own axes (those of the body, turned with the node).

    That of a massless link is at `arm` of its origin.
    """
    partial = np.zeros_like(parent.J)
    w = parent.V[3:]
    if not isinstance(parent, BodyState):
        centripetal = np.concatenate([cross(w, cross(w, arm)), np.zeros(3)])
        return parent.moved(arm, partial, np.zeros(6), centripetal)
    r, R, Phi, vel, acc = node_motion(parent.body, node, w, parent.q, parent.qd)
    partial[:, parent.rows] = Phi
    return parent.moved(r, partial, vel, acc).turned(R)


class _Relative(NamedTuple):
    """Motion of the outboard side of a hinge relative to its inboard side."""

    turn: np.ndarray  # (3, 3) outboard axes to inboard axes
    place: np.ndarray  # (3,) inboard axes
    S: np.ndarray  # (6, n) directions of the speeds, outboard axes
    V: np.ndarray  # (6,) velocity, outboard axes
    extra: np.ndarray | float = 0.0  # (6,) acceleration without speeds of its own, outboard axes


def _single_axis(row: np.record, x: np.ndarray, u: np.ndarray) -> _Relative:
    screw = np.concatenate([AXIS * row["along"], AXIS * row["about"]])
    return _Relative(turn_about(AXIS, row["about"] * x[0]), screw[:3] * x[0], screw[:, None], screw * u[0])


def _prescribed(row: np.record, x: np.ndarray, u: np.ndarray) -> _Relative:
    """``x = [position]``, ``u = [rate, acceleration]``."""
    moved = _single_axis(row, x, u)
    return moved._replace(S=np.zeros((6, 0)), extra=moved.S[:, 0] * u[1])


def _spherical(row: np.record, x: np.ndarray, u: np.ndarray) -> _Relative:
    S = np.eye(6)[:, 3:]
    return _Relative(quaternion_matrix(x), np.zeros(3), S, S @ u)


def _free(row: np.record, x: np.ndarray, u: np.ndarray) -> _Relative:
    return _Relative(quaternion_matrix(x[3:]), x[:3], np.eye(6), u)


def _weld(row: np.record, x: np.ndarray, u: np.ndarray) -> _Relative:
    return _Relative(np.eye(3), np.zeros(3), np.zeros((6, 0)), np.zeros(6))


RELATIVE = {
    "weld": _weld,
    "single_axis": _single_axis,
    "prescribed": _prescribed,
    "spherical": _spherical,
    "free": _free,
}  # by `JointKind.file`


def _hinged(frame: LinkState, first: int, moved: _Relative) -> LinkState:
    """Motion of the outboard side of a hinge whose first speed is given."""
    outward = on_both(moved.turn)
    partial = np.zeros_like(frame.J)
    partial[:, first : first + moved.S.shape[1]] = outward @ moved.S
    w = frame.V[3:]
    velocity = outward @ moved.V
    slide, spin = velocity[:3], velocity[3:]
    linear = cross(w, cross(w, moved.place)) + 2 * cross(w, slide) + cross(spin, slide)
    acceleration = np.concatenate([linear, cross(w, spin)]) + outward @ (np.zeros(6) + moved.extra)
    return frame.moved(moved.place, partial, velocity, acceleration).turned(moved.turn)


def link_states(system: System, packed: Packed, y: np.ndarray, motion: np.ndarray) -> list[LinkState]:
    """Return the motion of every link in the order of the packed tree.

    Parameters
    ----------
    y : (nx + nu,)
        State as `kernels.data` says.
    motion : (nl, 3)
        Position, rate and acceleration of prescribed hinges; other rows unused.
    """
    states: list[LinkState] = []
    for i, link in enumerate(packed.links):
        row = packed.model.links[i]
        x = row["x"]
        u = packed.nx + row["u"]
        if row["parent"] == len(packed.links):
            frame = _ground(system, row["arm"], packed.nu)
        else:
            frame = _interface(states[row["parent"]], row["interface"], row["arm"])
            frame = frame.turned(packed.align(row["parent"]))  # the hinge is placed in the parent link's axes
        frame = frame.turned(row["rotation"].reshape(3, 3))
        kind = KINDS[row["joint"]]
        own_x, own_u = y[x : x + kind.coordinates], y[u : u + kind.speeds]
        if row["joint"] == PRESCRIBED:
            own_x = motion[i, :1]
            own_u = motion[i, 1:]
        moved = RELATIVE[kind.file](row, own_x, own_u)
        frame = _hinged(frame, row["u"], moved).turned(packed.align(i).T)
        states.append(_with_body(frame, system.bodies[link.body], row, y, packed.nx) if link.body else frame)
    return states


def _with_body(link: LinkState, body: FlexibleBody, row: np.record, y: np.ndarray, nx: int) -> BodyState:
    """Return the motion of a link with that of its body."""
    x, u = row["xq"], row["uq"]
    q, qd = y[x : x + body.n], y[nx + u : nx + u + body.n]
    return BodyState(**vars(link), body=body, q=q, qd=qd, rows=slice(u, u + body.n))


def body_states(system: System, packed: Packed, y: np.ndarray, motion: np.ndarray) -> list[BodyState]:
    """Return the motion of every body in the system's order; arguments as `link_states`."""
    return [state for state in link_states(system, packed, y, motion) if isinstance(state, BodyState)]


def seen_states(system: System, states: list[BodyState]) -> list[BodyState]:
    """Return the states with velocities relative to the ground."""
    w = ground_spin(system)
    return [replace(s, V=s.V - np.concatenate([s.R.T @ cross(w, s.p), s.R.T @ w])) for s in states]


def mass_and_force(system: System, y: np.ndarray, motion: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Return ``M (nu, nu)`` and ``f (nu,)`` of ``M u' = f`` at a state.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -10.0, 0]))
    >>> M, f = mass_and_force(arm, np.zeros(6))
    >>> M.shape, round(float(f[0] / M[0, 0]), 3)
    ((3, 3), -1.5)
    """
    packed = pack(system)
    nu = packed.nu
    states = body_states(system, packed, y, np.zeros((len(packed.links), 3)) if motion is None else motion)
    M = np.zeros((nu, nu))
    f = np.zeros(nu)
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
        out["angular"] = out["angular"] + cross(s.p, linear) + s.R @ momentum[3:]
    return out
