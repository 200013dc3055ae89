"""Mass matrix of a modal body: rigid part, coupling and their dependence on the deflection (theory 4).

The mass matrix is the Gram matrix of the partial velocities of the particles, so it cannot be indefinite, however large
the deflection, as long as every product of partial velocities is kept. With the displacement ``phi q + q u2 q / 2`` the
partial velocity of a mode is ``phi + u2 q``. The S(q), L(q) of theory 4 are its moments; that section has
the identity in the modal block, which lacks the products of ``u2 q``. This matters when ``Kg q`` reaches the
size of S and H: for a mode of wave number k at deflections of 1 / (k^2 L), a thousandth of the length L for the twelfth
mode of a beam.

The products need the field u2, of which the body has only the moments ``int rho u2_a = Kg_A`` and
``int rho x_b u2_a = Kg_W``. Of all fields with these moments the affine one, ``u2_a = c_a + d_ab x_b``, has the least
kinetic energy and is used. With four functions X_r, (1, x, y, z) made orthonormal in the mass, and the
rest ``phi'`` of the modes, orthogonal to them, the position of a particle is

    r = X_r p_r(q) + phi' q     p_r = p_r(0) + B_r q + t_r + ..     t_r = q D_r q / 2     dp_r = d p_r / d q

B_r are the moments S and H of the modes in that basis, D_r those of u2: Kg_A and Kg_W. ``P' = P - B^T B`` is the mass
tensor of the rest. A body moves like an affine one (Cohen and Muncaster, The Theory of Pseudo-rigid Bodies, 1988) plus
a linear rest, and with ``X_1 = m^(-1/2)``

    s_a = m^(1/2) p_1a                            S_a = m^(1/2) dp_1a
    E_ab = p_a.p_b + q P'_ab q                    L_ab = dp_a.p_b + P'_ab q
    M_ff = (M - B^T B) + dp^T dp                  (dots and dp^T dp: the sum over r, in dp^T dp over a too)

The third and fourth order of the displacement count too (line.py): the affine part has those of a line that turns and
keeps its length. With the mean strain ``tau = t.p(0) / p(0).p(0)`` about the centre of mass,

    p_r = p_r(0) + h(tau) B_r q + g(tau) t_r

About rest the equations of motion are those of theory 4 to second order in q. About a steady deflection M_ff counts
(below). Without geometric stiffness they are the same altogether. The non-affine motion of u2 is lost.

A body that is deflected by a steady load needs more of u2 (theory 4.7): with
``T_ijk = phi_i M Gamma_jk`` in the body, the rest of u2 is projected on the rest of the modes. The affine functions
already have ``B_i.D_jk`` of T; the remainder, ``T' = T - B.D``, is the field ``phi'_l c_ljk`` with ``M' c = T'``,
``M' = M - B^T B``. The rest then moves with ``eta = q + c q q / 2`` instead of q, and with ``d eta = 1 + c q``

    E_ab = p_a.p_b + eta P'_ab eta     L_ab = dp_a.p_b + d eta^T P'_ab eta     M_ff = d eta^T M' d eta + dp^T dp

so that the mass matrix stays a Gram matrix, positive at every deflection.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import shortening, swing
from modalprep.body.stations.record import refuse_stations
from modalprep.vectors import skew

AFFINE = 1e-10  # of unit modal mass
FLAT = 1e-12  # of the moments about the origin: a smaller one about the centre is round-off of a flat or straight body


class AffinePart(NamedTuple):
    """Motion of a modal body split into its affine part and the rest, theory (4.4) to (4.9); axes a first, function r.

    The function of a direction without extent is zero.

    Attributes
    ----------
    p0 : (3, 4)
        ``p_r(0)``, m sqrt(kg); its first column is the centre of mass times sqrt(m).
    B : (3, 4, n)
        ``B_r``, S and H in the affine functions.
    Kg_p : (3, 4, n, n)
        ``D_r``, Kg_A and Kg_W in the affine functions.
    P_rest : (3, 3, n, n)
        ``P'``.
    M_rest : (n, n)
        ``M' = M - B^T B``, M the modal mass, the identity except for depleting bodies.
    strain : (3, 4)
        ``p(0) / p(0).p(0)`` without its first column.
    root_mass : float
        sqrt(m).
    c : (n, n, n)
        ``c_ljk`` of the second order of the rest; (0, 0, 0) in a body without T.
    """

    p0: np.ndarray
    B: np.ndarray
    Kg_p: np.ndarray
    P_rest: np.ndarray
    M_rest: np.ndarray
    strain: np.ndarray
    root_mass: float
    c: np.ndarray


class Deflected(NamedTuple):
    """Moments of a body at a deflection q: p(q), dp(q), then in the notation of theory 4."""

    p: np.ndarray  # (3, 4)
    dp: np.ndarray  # (3, 4, n)
    s: np.ndarray  # (3,)
    E: np.ndarray  # (3, 3)
    S: np.ndarray  # (3, n)
    L: np.ndarray  # (3, 3, n)
    M_ff: np.ndarray  # (n, n)
    eta: np.ndarray  # (n,) coordinates of the rest
    d_eta: np.ndarray  # (n, n)


def rigid_mass_matrix(m: float, s0: np.ndarray, E0: np.ndarray) -> np.ndarray:
    """Return ``[[m, -s0~], [s0~, J]]``, ``J = tr(E0) - E0`` (6, 6).

    Examples
    --------
    >>> rigid_mass_matrix(2.0, np.zeros(3), np.diag([1.0, 2, 3])).diagonal()
    array([2., 2., 2., 5., 4., 3.])
    """
    s = skew(s0)
    return np.block([[m * np.eye(3), -s], [s, np.trace(E0) * np.eye(3) - E0]])


def cross_moment(H: np.ndarray) -> np.ndarray:
    """Return ``int rho x cross phi (3, ...)`` of ``H[a, b] = int rho x_b phi_a (3, 3, ...)``.

    Examples
    --------
    >>> cross_moment(np.arange(9.0).reshape(3, 3))
    array([ 2., -4.,  2.])
    """
    return np.array([H[2, 1] - H[1, 2], H[0, 2] - H[2, 0], H[1, 0] - H[0, 1]])


class AffineAxes(NamedTuple):
    """The affine functions X_r of a body: constant, then linear along the principal axes of its second moment.

    Attributes
    ----------
    root : float
        sqrt(m).
    centre : (3,)
        Of mass, m.
    axes : (3, 3)
        Columns.
    scale, inverse : (3,)
        Roots of the principal second moments, m sqrt(kg), and their inverses; zero in a direction without extent.
    """

    root: float
    centre: np.ndarray
    axes: np.ndarray
    scale: np.ndarray
    inverse: np.ndarray

    def coordinates(self, total: np.ndarray, by_x: np.ndarray) -> np.ndarray:
        """Return affine coordinates (3, 4, ...) of a field by ``int rho u_a`` and ``int rho x_b u_a``."""
        about = by_x - np.einsum("a...,b->ab...", total, self.centre)
        linear = np.einsum("ab...,br,r->ar...", about, self.axes, self.inverse)
        return np.concatenate([total[:, None] / self.root, linear], axis=1)

    @property
    def strain(self) -> np.ndarray:
        """``p(0) / p(0).p(0)`` (3, 4) without its first column, of the mean strain."""
        along = np.column_stack([np.zeros(3), self.axes * self.scale])
        return along / max(np.sum(self.scale**2), np.finfo(float).tiny)


def affine_axes(body: FlexibleBody) -> AffineAxes:
    """Return the affine functions of a body.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> affine_axes(uniform_beam(modes=1)).centre.round(9)
    array([5., 0., 0.])
    """
    centre = body.s0 / body.m
    moments, axes = np.linalg.eigh(body.E0 - body.m * np.outer(centre, centre))
    thick = moments > FLAT * np.trace(body.E0)
    scale = np.sqrt(moments, where=thick, out=np.zeros(3))
    inverse = np.divide(1.0, scale, where=thick, out=np.zeros(3))
    return AffineAxes(np.sqrt(body.m), centre, axes, scale, inverse)


def affine_part(body: FlexibleBody) -> AffinePart:
    """Split the motion of a body into its affine part and the rest.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> part = affine_part(uniform_beam(modes=1))
    >>> (part.p0 @ part.p0.T).diagonal().round(3)  # E0
    array([4.0e+02, 6.0e-03, 2.4e-02])
    """
    axes = affine_axes(body)
    first = axes.coordinates(body.S, body.H)
    place = np.column_stack([axes.root * axes.centre, axes.axes * axes.scale])
    rest = body.P - np.einsum("ari,brj->abij", first, first)
    mass = body.modal_mass - np.einsum("ari,arj->ij", first, first)
    second = axes.coordinates(body.Kg_A, body.Kg_W)
    return AffinePart(place, first, second, rest, mass, axes.strain, axes.root, _rest_second(body, first, second, mass))


def _rest_second(body: FlexibleBody, first: np.ndarray, second: np.ndarray, mass: np.ndarray) -> np.ndarray:
    """Solve ``M' c = T - B.D``; modes that are affine within `AFFINE` have no rest."""
    if body.T is None:
        return np.zeros((0, 0, 0))
    size, V = np.linalg.eigh((mass + mass.T) / 2)
    inverse = np.divide(1.0, size, where=size > AFFINE, out=np.zeros(body.n))
    left = body.T - np.einsum("ari,arjk->ijk", first, second)
    return np.einsum("il,l,ml,mjk->ijk", V, inverse, V, left, optimize=True)


def rest_coordinates(part: AffinePart, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return ``eta(q) (n,)`` of the rest and ``d eta / d q (n, n)``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> eta, slope = rest_coordinates(affine_part(uniform_beam(modes=2)), np.array([1.0, 2.0]))
    >>> eta, slope.diagonal()  # without T
    (array([1., 2.]), array([1., 1.]))
    """
    if not part.c.size:
        return q, np.eye(len(q))
    bent = part.c @ q
    return q + bent @ q / 2, np.eye(len(q)) + bent


def mean_strain(part: AffinePart, q: np.ndarray) -> tuple[float, np.ndarray]:
    """Return tau of the deflection q and its slopes (n,).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> tau, slope = mean_strain(affine_part(uniform_beam(modes=1)), np.array([1.0]))
    >>> bool(tau < 0), bool(np.isclose(slope[0], 2 * tau))  # the bent beam is shorter
    (True, True)
    """
    slopes = np.einsum("ar,arij,j->i", part.strain, part.Kg_p, q)
    return slopes @ q / 2, slopes


def deflected(part: AffinePart, q: np.ndarray) -> Deflected:
    """Return the moments at a deflection ``q (n,)``, m sqrt(kg).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> tip = deflected(affine_part(uniform_beam(modes=1)), np.array([1.0]))
    >>> bool(tip.s[0] < 60)  # the bent beam is shorter
    True
    """
    eta, d_eta = rest_coordinates(part, q)
    bent, rest, aside = part.Kg_p @ q, part.P_rest @ eta, part.B @ q
    t = 0.5 * bent @ q
    tau, strains = mean_strain(part, q)
    g, g_slope, _ = shortening(tau)
    h, h_slope, _ = swing(tau)
    p = part.p0 + h * aside + g * t
    dp = h * part.B + g * bent + np.multiply.outer(h_slope * aside + g_slope * t, strains)
    E = p @ p.T + rest @ eta
    L = np.einsum("arn,br->abn", dp, p) + rest @ d_eta
    M_ff = d_eta.T @ part.M_rest @ d_eta + np.einsum("ari,arj->ij", dp, dp)
    return Deflected(p, dp, part.root_mass * p[:, 0], E, part.root_mass * dp[:, 0], L, M_ff, eta, d_eta)


def partial_rates(part: AffinePart, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Return the time derivative of ``dp(q)``, (3, 4, n).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> part, q, qd = affine_part(uniform_beam(modes=1)), np.array([1.0]), np.array([2.0])
    >>> change = deflected(part, q + 1e-6 * qd).dp - deflected(part, q - 1e-6 * qd).dp
    >>> bool(np.allclose(partial_rates(part, q, qd), change / 2e-6))
    True
    """
    bent, turning = part.Kg_p @ q, part.Kg_p @ qd
    t = 0.5 * bent @ q
    rate = bent @ qd
    aside = part.B @ q
    drift = part.B @ qd
    (tau, strains), (_, strain_rates) = mean_strain(part, q), mean_strain(part, qd)
    speed = strains @ qd
    g, g_slope, g_curve = shortening(tau)
    _, h_slope, h_curve = swing(tau)
    along = h_slope * aside + g_slope * t
    curve = speed * (h_curve * aside + g_curve * t)
    change = np.multiply.outer(along, strain_rates) + np.multiply.outer(curve, strains)
    change += np.multiply.outer(h_slope * drift + g_slope * rate, strains)
    return change + g * turning + speed * (g_slope * bent + h_slope * part.B)


def deflected_points(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return where the body's `points` are at each of the modal coordinates ``q (k, n)``: ``(k, n_points, 3)``, m.

    In the body's frame, with the second order of the displacement as the equations of motion have it: its affine part,
    and of a body with T the rest along the modes. A bending beam keeps its length.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=1)
    >>> tip = deflected_points(body, 1.0 / body.shape[-1:, 1])[0, -1]  # moved aside by 1 m of 10 m
    >>> bool(0.997 < tip[1] < 0.999), bool(9.93 < tip[0] < 9.95)  # shorter by .6 u^2 / L
    (True, True)
    """
    part = affine_part(body)
    n = len(body.points)
    size = np.sum(part.p0[:, 1:] ** 2, axis=0)
    arm = body.points - body.s0 / body.m
    linear = np.divide(arm @ part.p0[:, 1:], size, out=np.zeros((n, 3)), where=size > 0)
    functions = np.column_stack([np.full(n, 1 / part.root_mass), linear])
    across = body.points - functions @ part.p0.T  # of a flat body
    rest = body.shape - np.einsum("pr,arn->pan", functions, part.B)
    found = ((deflected(part, each), swing(mean_strain(part, each)[0])[0]) for each in q)
    return np.array([across + functions @ at.p.T + h * rest @ at.eta for at, h in found]).reshape(-1, n, 3)


def steady_mass(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return the modal mass ``(n, n)`` at a steady deflection ``q (n,)``: constant except for a body with T.

    Without T the equations of motion have the affine part of the second order alone, which of straight beams T cancels.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> steady_mass(uniform_beam(modes=2), np.ones(2)).diagonal()
    array([1., 1.])
    """
    return body.modal_mass if body.T is None else deflected(affine_part(body), q).M_ff


def mass_matrix(body: FlexibleBody, q: np.ndarray) -> np.ndarray:
    """Return ``M(q) (6 + n, 6 + n)`` for velocity and spin of the frame (in B) and the modal rates.

    ``[[m, -s~, S], [s~, J, C], [S^T, C^T, M_ff]]`` at q, never indefinite. ``T = V^T M(q) V / 2`` is the
    kinetic energy, exactly so for the linear displacements ``phi q`` of a body without geometric stiffness.

    Parameters
    ----------
    q : (n,)
        Modal coordinates, m sqrt(kg).

    Returns
    -------
    (6 + n, 6 + n) float
        Symmetric; kg, kg m, kg m^2 of the rigid part, without unit of the modal one.

    Raises
    ------
    InputError
        When a body with stations is deflected.

    References
    ----------
    Theory 4.3 and 4.6.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> mass_matrix(uniform_beam(modes=2), np.zeros(2)).diagonal().round(1)[[0, 4, 7]]
    array([ 12., 400.,   1.])
    """
    if np.any(q):
        refuse_stations("mass_matrix of a deflected body", body.stations, "take `body.deflection.mass_at`")
    return assembled(body.m, deflected(affine_part(body), q))


def stated_mass_matrix(body: FlexibleBody) -> np.ndarray:
    """Return the mass matrix (6 + n, 6 + n) without deflection as the integrals state it, as `mass_matrix`.

    Integrals that contradict each other make it indefinite. `mass_matrix` never is: it takes a direction along which
    the second moment about the centre of mass is negative for one without extent.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2)
    >>> bool(np.allclose(stated_mass_matrix(beam), mass_matrix(beam, np.zeros(2))))
    True
    """
    cross = np.vstack([body.S, cross_moment(body.H)])
    return np.block([[rigid_mass_matrix(body.m, body.s0, body.E0), cross], [cross.T, body.modal_mass]])


def assembled(m: float, at: Deflected) -> np.ndarray:
    """Return the mass matrix of a body of mass m at a deflection."""
    cross = np.vstack([at.S, cross_moment(at.L)])
    return np.block([[rigid_mass_matrix(m, at.s, at.E), cross], [cross.T, at.M_ff]])
