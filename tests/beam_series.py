"""Uniform cantilevers, computed here: unit load matrices, spinning blades, joined halves, the spin-up of a beam.

Lengths are over L, masses over rho A L, frequencies over ``sqrt(EI / (rho A L^4))``.
"""

from __future__ import annotations

import numpy as np
from analytic import cantilever_roots
from numpy.polynomial import Legendre
from scipy.integrate import solve_ivp
from scipy.linalg import eigh

POINTS, WEIGHTS = ((1 + np.polynomial.legendre.leggauss(80)[0]) / 2, np.polynomial.legendre.leggauss(80)[1] / 2)


def mode_shapes(n: int, x: np.ndarray = POINTS) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """First n modes of a clamped-free beam, slopes, curvatures (n, len(x)): ``int phi^2 = 1``, ``phi(1) = 2 (-1)^i``.

    ``cosh bx - cos bx - s (sinh bx - sin bx)`` with ``1 - s`` in closed form, so that large arguments do not cancel.
    """
    b = cantilever_roots(n)[:, None]
    rest = (np.sin(b) - np.cos(b) - np.exp(-b)) / (np.sinh(b) + np.sin(b))  # 1 - s
    s, falling, rising = 1 - rest, np.exp(-b * x) * (2 - rest) / 2, np.exp(b * x) * rest / 2
    phi = falling + rising - np.cos(b * x) + s * np.sin(b * x)
    slope = b * (rising - falling + np.sin(b * x) + s * np.cos(b * x))
    return phi, slope, b**2 * (falling + rising + np.cos(b * x) - s * np.sin(b * x))


def unit_loads(n: int) -> dict[str, np.ndarray]:
    """``int N phi_i' phi_j'`` (n, n) for the axial forces of unit spin squared, acceleration and force at the tip."""
    slope = mode_shapes(n)[1]
    force = {"centrifugal": (1 - POINTS**2) / 2, "acceleration": 1 - POINTS, "tip force": np.ones_like(POINTS)}
    return {name: (WEIGHTS * N * slope) @ slope.T for name, N in force.items()}


def effective_masses(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Shares (n,) of the first modes in the mass across the beam and in the moment of inertia about its root."""
    phi = mode_shapes(n)[0]
    return (phi @ WEIGHTS) ** 2, 3 * (phi @ (WEIGHTS * POINTS)) ** 2


def _ritz(terms: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """``x^2 P_k(x)`` with Legendre polynomials on (0, 1), first and second derivatives (terms, points)."""
    x, polynomials = POINTS, [Legendre.basis(k, domain=[0, 1]) for k in range(terms)]
    value, first, second = (np.array([p.deriv(d)(x) if d else p(x) for p in polynomials]) for d in range(3))
    return x**2 * value, x**2 * first + 2 * x * value, x**2 * second + 4 * x * first + 2 * value


def blade(spin=0.0, *, hub=0.0, tip_mass=0.0, acceleration=0.0, carried=1.0, terms=14) -> np.ndarray:
    """Flap frequencies (terms,) by Rayleigh-Ritz, ascending.

    The axial force is that of the spin about an axis across the blade, `hub` before its root, less that of an
    acceleration along the blade, both with a mass at the tip, of whose axial force the share `carried` counts. Lag is
    ``sqrt(flap^2 - spin^2)``.
    """
    phi, slope, curvature = _ritz(terms)
    mass = (WEIGHTS * phi) @ phi.T + tip_mass  # x^2 P_k is 1 at the tip
    force = spin**2 * ((1 - POINTS**2) / 2 + hub * (1 - POINTS) + carried * tip_mass * (1 + hub))
    force = force - acceleration * (1 - POINTS + carried * tip_mass)
    stiffness = (WEIGHTS * curvature) @ curvature.T + (WEIGHTS * force * slope) @ slope.T
    return np.sqrt(eigh(stiffness, mass, eigvals_only=True))


def critical_acceleration(tip_mass: float = 0.0, terms: int = 14) -> float:
    """Least ``rho A a L^3 / EI`` at which a column that is accelerated along its axis buckles."""
    _, slope, curvature = _ritz(terms)
    force = (WEIGHTS * (1 - POINTS + tip_mass) * slope) @ slope.T
    return 1 / eigh(force, (WEIGHTS * curvature) @ curvature.T, eigvals_only=True)[-1]


# ---- cubic beam elements ----


def hermite(elements: int) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness and consistent mass (2 elements + 2, ..) of a free beam: deflection and slope node by node."""
    h, size = 1 / elements, 2 * elements + 2
    k = np.array([[12, 6, -12, 6], [6, 4, -6, 2], [-12, -6, 12, -6], [6, 2, -6, 4]], dtype=float)
    m = np.array([[156, 22, 54, -13], [22, 4, 13, -3], [54, 13, 156, -22], [-13, -3, -22, 4]]) / 420
    scale = np.outer([1, h, 1, h], [1, h, 1, h])
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for first in range(0, 2 * elements, 2):
        K[first : first + 4, first : first + 4] += k * scale / h**3
        M[first : first + 4, first : first + 4] += m * scale * h
    return K, M


def halves_error(modes: int, count: int, elements: int = 20) -> np.ndarray:
    """Relative errors (count,) of the frequencies of a cantilever of two halves with Craig-Bampton modes each.

    Against all degrees of freedom of the same elements: Craig and Bampton, AIAA J. 6 (1968) 1313, written out for
    this beam.
    """
    K, M = (A[2:, 2:] for A in hermite(2 * elements))
    middle = [2 * elements - 2, 2 * elements - 1]
    basis = np.zeros((len(K), 2 * modes + 2))
    basis[middle, [-2, -1]] = 1.0
    for k, inside in enumerate((np.arange(2 * elements - 2), np.arange(2 * elements, 4 * elements))):
        inner = np.ix_(inside, inside)
        basis[inside, -2:] = -np.linalg.solve(K[inner], K[np.ix_(inside, middle)])
        basis[inside, k * modes : (k + 1) * modes] = eigh(K[inner], M[inner])[1][:, :modes]
    exact, found = (eigh(T.T @ K @ T, T.T @ M @ T, eigvals_only=True)[:count] for T in (np.eye(len(K)), basis))
    return np.sqrt(found / exact) - 1


# ---- spin-up of a cantilever: data of Simo and Vu-Quoc, J. Appl. Mech. 53 (1986) 855 ----

SPIN, RISE = 6.0, 15.0  # rad/s, s
LENGTH, UNIT = 10.0, np.sqrt(1.4e4 / (1.2 * 10.0**4))  # m, rad/s; EI = 1.4e4 N m^2, rho A = 1.2 kg/m
STRETCH = 1.2 * SPIN**2 * LENGTH**3 / (3 * 2.8e7)  # m, of the steady spin; EA = 2.8e7 N


def spin_up(t: float) -> tuple[float, float]:
    """Rate and angular acceleration of ``SPIN (t / RISE - sin(2 pi t / RISE) / (2 pi))``."""
    if t >= RISE:
        return SPIN, 0.0
    turn = 2 * np.pi / RISE
    return SPIN * (t / RISE - np.sin(turn * t) / (2 * np.pi)), SPIN / RISE * (1 - np.cos(turn * t))


def spin_up_lag(times: np.ndarray, *, stiffened: bool = True, modes: int = 4) -> np.ndarray:
    """Deflection (m) of the tip from its rigid place, by the theory that is linear in the deflection; from rest.

    ``q'' + (w^2 + W^2 (S - 1)) q = -W' int x phi`` with the centrifugal matrix S, or with zero for it: the
    conventional theory (Kane, Ryan and Banerjee, J. Guid. Control Dyn. 10 (1987) 139).
    """
    phi = mode_shapes(modes)[0]
    lever, tip = phi @ (WEIGHTS * POINTS) * LENGTH, mode_shapes(modes, np.array([1.0]))[0][:, 0]
    w2, S = (UNIT * cantilever_roots(modes) ** 2) ** 2, stiffened * unit_loads(modes)["centrifugal"]

    def rate(t, z):
        q, v = np.split(z, 2)
        spin, acceleration = spin_up(t)
        return np.concatenate([v, -acceleration * lever - w2 * q - spin**2 * (S @ q - q)])

    z = solve_ivp(rate, (0, max(times)), np.zeros(2 * modes), "DOP853", times, rtol=1e-8, atol=1e-11).y
    return tip @ z[:modes]
