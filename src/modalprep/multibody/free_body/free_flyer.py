"""A free-flying body in momenta and in efficient variables: book chapter 9 and appendix A.

With the mass matrix M(q) of theory 4 and ``u = (v, w, q')`` in the body's axes the momenta are
``(p, h, pi) = M u``, and (Lagrange in quasi-coordinates)

    p' = -w~ p + F ;   h' = -w~ h - v~ p + T ;   pi' = dT/dq - K q - D q'

No inertia force is formed, and R p and x~ R p + R h are constant in free flight. Efficient variables go further: with
``sigma = q' + w_c G_c q`` (G_c = eps_cab P_ba), which absorbs ``w x phi q``, the mass matrix M(0) in (v, w, sigma) is
constant, factorised once, and

    h = h0 + (G_c q).pi ;   (p, h0, pi) = M(0) (v, w, sigma) ;   pi' = -w_c G_c pi - K q - D q'

exact when ``w x phi`` lies in the span of the modes (`closure_defect` zero), as it does for all displacements of each
particle. Finite-element modes lack that property (a bending mode has a defect of 1): in their span even the centrifugal
load ``W_ab H_ab`` changes, so such a body is refused.

Neither reduces the cost of the order-n recursion, which never forms M: it eliminates modes and hinges link by link, and
the contribution of children to ``M_ff`` and to the articulated inertia depends on the pose in any variables, so that no
factor can be reused. These formulations serve for one body, and as an independent check of the recursion.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import affine_part, assembled, deflected, mass_matrix, partial_rates
from modalprep.errors import InputError, SimulationError
from modalprep.multibody.kernels.data import EPSILON
from modalprep.multibody.reference.equations import quaternion_matrix
from modalprep.records import Record
from modalprep.vectors import as_rotation, skew

CLOSED = 1e-9  # of the mass-weighted square of w x phi
VARIABLES = ("momentum", "efficient")


@dataclass(frozen=True, eq=False, kw_only=True)
class FreeBodyMotion(Record):
    """Motion of a free body.

    Attributes
    ----------
    time : (nt,)
    position, quaternion : (nt, 3), (nt, 4)
        Root (inertial, m), and the body's axes to inertial (w, x, y, z).
    q : (nt, n)
    linear, angular : (nt, 3)
        Momenta about the inertial origin, inertial axes.
    speeds : (nt, 6 + n)
        Velocity and angular velocity of the root in the body's axes, modal rates.
    energy : dict of (nt,)
        ``kinetic``, ``strain``, ``gravity`` and ``dissipated`` (J); their sum is constant.
    steps : int
    """

    time: np.ndarray
    position: np.ndarray
    quaternion: np.ndarray
    q: np.ndarray
    linear: np.ndarray
    angular: np.ndarray
    speeds: np.ndarray
    energy: dict[str, np.ndarray]
    steps: int


def coriolis(body: FlexibleBody) -> np.ndarray:
    """Return ``G_c = eps_cab P_ba`` (3, n, n), so that ``w_c G_c = int rho phi^T w~ phi``."""
    return np.einsum("cab,baij->cij", EPSILON, body.P)


def closure_defect(body: FlexibleBody) -> float:
    """Return how much of ``w x phi`` the modes cannot take up, at most, as a share of its mass-weighted square.

    A body linearised in the modes, without P, has 1.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> round(closure_defect(uniform_beam(modes=1)), 6)
    1.0
    """
    if body.n == 0:
        return 0.0
    if not np.any(body.P):
        return 1.0
    G = coriolis(body)
    whole = np.einsum("cd,aaij->cdij", np.eye(3), body.P) - np.einsum("dcij->cdij", body.P)
    lacking = whole - np.einsum("cki,dkj->cdij", G, G)
    return float(max(np.abs(lacking[c, c]).max() / max(np.abs(whole[c, c]).max(), 1e-300) for c in range(3)))


def simulate_free_body(
    body: FlexibleBody,
    times: np.ndarray,
    *,
    position: np.ndarray | None = None,
    rotation: np.ndarray | None = None,
    velocity: np.ndarray | None = None,
    angular_velocity: np.ndarray | None = None,
    q: np.ndarray | None = None,
    gravity: np.ndarray | None = None,
    variables: str = "momentum",
    rtol: float = 1e-10,
) -> FreeBodyMotion:
    """Integrate the free flight of a body.

    Parameters
    ----------
    times : (nt,)
        s, ascending.
    position, rotation : (3,), (3, 3) or (4,) or ((3,), float)
        Of the root at the start, inertial (m), and of the body's axes to inertial; default the origin, parallel.
    velocity, angular_velocity : (3,)
        Of the root, m/s, and of the frame, rad/s, in the body's axes.
    q : (n,)
        Modal coordinates at the start, their rates zero.
    gravity : (3,)
        m/s^2, inertial.
    variables : {"momentum", "efficient"}
        Momenta are exact for every body; efficient variables have a constant mass matrix and need modes closed under
        rotation, without geometric stiffness.

    Returns
    -------
    FreeBodyMotion
        Places, orientations, modal coordinates and momenta over the times.

    Raises
    ------
    InputError
        When the variables are unknown, or efficient variables do not apply to the body.
    SimulationError
        When the integration stops.

    References
    ----------
    Theory 4.4 and 4.8.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> motion = simulate_free_body(uniform_beam(modes=2), np.array([0, 0.1]), velocity=np.array([1.0, 0, 0]))
    >>> motion.position[-1].round(6).tolist(), motion.linear[-1].round(6).tolist()
    ([0.1, 0.0, 0.0], [12.0, 0.0, 0.0])
    """
    if variables not in VARIABLES:
        raise InputError(f"variables {variables!r} are not one of {', '.join(VARIABLES)}")
    if variables == "efficient" and (body.has_geometric_stiffness or body.T is not None):
        raise InputError(
            f"body {body.name!r} has geometric stiffness, which a constant mass matrix cannot represent; use "
            "variables = 'momentum', or the body without it: theory = 'no_geometric_stiffness', body.conventional()"
        )
    defect = closure_defect(body) if variables == "efficient" else 0.0
    if defect > CLOSED:
        raise InputError(
            f"body {body.name!r}: its modes do not represent a fraction {defect:.2g} of their own rotation, so that "
            "efficient variables would change its motion; use variables = 'momentum'"
        )
    times = np.asarray(times, dtype=float)
    n = body.n
    q0 = np.zeros(n) if q is None else np.asarray(q, dtype=float)
    u = np.concatenate([np.zeros(3) if a is None else np.asarray(a, dtype=float) for a in (velocity, angular_velocity)])
    momenta = (_Momentum if variables == "momentum" else _Efficient)(body)
    given = as_rotation(np.eye(3) if rotation is None else rotation, "the rotation")
    turn = scipy.spatial.transform.Rotation.from_matrix(given).as_quat(scalar_first=True)
    place = np.zeros(3) if position is None else np.asarray(position, dtype=float)
    start = np.concatenate([place, turn, q0, momenta.of(q0, np.concatenate([u, np.zeros(n)])), [0.0]])
    g = np.zeros(3) if gravity is None else np.asarray(gravity, dtype=float)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        return _rate(momenta, y, g)

    options = {"method": "DOP853", "t_eval": times, "rtol": rtol, "atol": 1e-3 * rtol, "dense_output": True}
    run = scipy.integrate.solve_ivp(rate, times[[0, -1]], start, **options)
    if not run.success:
        raise SimulationError(f"free flight stopped at t = {run.t[-1]:g} s: {run.message}")
    return _motion(momenta, times, run.y.T, g, len(run.sol.ts) - 1)


def _rate(momenta, y: np.ndarray, g: np.ndarray) -> np.ndarray:
    body, n = momenta.body, momenta.body.n
    e = y[3:7]
    q = y[7 : 7 + n]
    P = y[7 + n : -1]
    R = quaternion_matrix(e)
    u = momenta.speeds(q, P)
    v = u[:3]
    w = u[3:6]
    qd = u[6:]
    g = R.T @ g
    at = deflected(momenta.part, q)
    turn = np.block([[0.0, -w], [w[:, None], -skew(w)]]) @ e / 2
    linear = -np.cross(w, P[:3]) + body.m * g
    angular = -np.cross(w, P[3:6]) - np.cross(v, P[:3]) + np.cross(at.s, g)
    resisted = body.damping_matrix @ qd
    modal = momenta.modal_rate(q, u, P) + at.S.T @ g - body.K * q - resisted
    return np.concatenate([R @ v, turn, qd, linear, angular, modal, [qd @ resisted]])


def _motion(momenta, times: np.ndarray, y: np.ndarray, g: np.ndarray, steps: int) -> FreeBodyMotion:
    body, n = momenta.body, momenta.body.n
    q = y[:, 7 : 7 + n]
    P = y[:, 7 + n : -1]
    speeds = np.array([momenta.speeds(*row) for row in zip(q, P, strict=True)])
    R = np.array([quaternion_matrix(e) for e in y[:, 3:7]])
    linear = np.einsum("tab,tb->ta", R, y[:, 7 + n : 10 + n])
    angular = np.cross(y[:, :3], linear) + np.einsum("tab,tb->ta", R, y[:, 10 + n : 13 + n])
    quaternion = y[:, 3:7] / np.linalg.norm(y[:, 3:7], axis=1)[:, None]
    moment = body.m * y[:, :3] + np.einsum("tab,tb->ta", R, [deflected(momenta.part, each).s for each in q])
    energy = {
        "kinetic": np.einsum("ti,ti->t", P, speeds) / 2,
        "strain": q**2 @ body.K / 2,
        "gravity": -moment @ g,
        "dissipated": y[:, -1],
    }
    return FreeBodyMotion(
        time=times,
        position=y[:, :3],
        quaternion=quaternion,
        q=q,
        linear=linear,
        angular=angular,
        speeds=speeds,
        energy=energy,
        steps=steps,
    )


class _Momentum:
    """Momenta of (v, w, q') with the mass matrix of the deflected body."""

    def __init__(self, body: FlexibleBody) -> None:
        self.body = body
        self.part = affine_part(body)

    def mass(self, q: np.ndarray) -> np.ndarray:
        return assembled(self.body.m, deflected(self.part, q))

    def of(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Momenta of speeds ``u = (v, w, q')``."""
        return self.mass(q) @ u

    def speeds(self, q: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Speeds (v, w, q') of momenta."""
        return np.linalg.solve(self.mass(q), P)

    def modal_rate(self, q: np.ndarray, u: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Derivative of the kinetic energy by q (n,)."""
        part = self.part
        at = deflected(self.part, q)
        v = u[:3]
        w = u[3:6]
        qd = u[6:]
        velocity = np.outer(v, [part.root_mass, 0, 0, 0]) + skew(w) @ at.p + at.dp @ qd  # of the affine part
        partial = np.einsum("ab,brn->arn", skew(w), at.dp) + partial_rates(part, q, qd)
        rate = np.einsum("ar,arn->n", velocity, partial)
        spin = np.einsum("ab,abij->ij", skew(w), part.P_rest)
        rates = at.d_eta @ qd
        moved = spin.T @ rates - np.einsum("ab,abij,j->i", skew(w) @ skew(w), part.P_rest, at.eta)  # dT / d eta
        rate += at.d_eta.T @ moved
        if part.c.size:
            rate += (part.c @ qd).T @ (part.M_rest @ rates + spin @ at.eta)  # of the rates of eta
        return rate


class _Efficient:
    """Momenta of (v, w, sigma) with the mass matrix of the undeflected body."""

    def __init__(self, body: FlexibleBody) -> None:
        self.body = body
        self.part = affine_part(body)
        self.G = coriolis(body)
        self.M0 = mass_matrix(body, np.zeros(body.n))
        self.factor = scipy.linalg.cho_factor(self.M0)

    def of(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Momenta of speeds ``u = (v, w, q')``."""
        P = self.M0 @ np.concatenate([u[:6], u[6:] + np.einsum("c,cij,j->i", u[3:6], self.G, q)])
        P[3:6] += (self.G @ q) @ P[6:]
        return P

    def speeds(self, q: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Speeds (v, w, q') of momenta."""
        bare = P.copy()
        bare[3:6] -= (self.G @ q) @ P[6:]
        u = scipy.linalg.cho_solve(self.factor, bare)
        u[6:] -= np.einsum("c,cij,j->i", u[3:6], self.G, q)
        return u

    def modal_rate(self, q: np.ndarray, u: np.ndarray, P: np.ndarray) -> np.ndarray:
        """Derivative of the kinetic energy by q (n,)."""
        return np.einsum("c,cij,i->j", u[3:6], self.G, P[6:])
