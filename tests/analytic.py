"""Closed forms and published numbers, each with its source."""

from __future__ import annotations

from itertools import pairwise
from math import comb

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from scipy.linalg import eigh, expm
from scipy.optimize import brentq


def cantilever_roots(n: int) -> np.ndarray:
    """First n roots beta L of ``1 + cos cosh = 0`` (clamped-free Euler-Bernoulli beam)."""
    edges = np.pi * np.arange(n + 1)
    return np.array([brentq(lambda b: np.cos(b) + 1 / np.cosh(b), a + 1e-9, b) for a, b in pairwise(edges)])


def cantilever_frequency(n: int, EI: float, rho_A: float, L: float) -> np.ndarray:
    """Bending frequencies (rad/s) of an Euler-Bernoulli cantilever."""
    return cantilever_roots(n) ** 2 * np.sqrt(EI / (rho_A * L**4))


def timoshenko_simply_supported(n: int, *, E, G, k, rho, A, I, L) -> np.ndarray:  # noqa: E741
    """Lower-branch bending frequencies (rad/s) of a simply supported Timoshenko beam: exact for sin shapes."""
    p = np.arange(1, n + 1) * np.pi / L
    a = rho * I * rho / (k * G * E * I)  # in w^4; the characteristic equation divided by E I
    b = rho * A / (E * I) + p**2 * (rho / E + rho / (k * G))
    return np.sqrt((b - np.sqrt(b**2 - 4 * a * p**4)) / (2 * a))


# Rotating uniform cantilever, lambda = omega sqrt(rho A L^4 / EI) against gamma = Omega sqrt(rho A L^4 / EI):
# flap of Wright, Smith, Thresher and Wang, J. Appl. Mech. 49 (1982) 197, table of uniform blades without tip mass, as
# the tests of pyBModes print it (test_rotating_uniform_blade.py) and as beam_series.blade finds it;
# lag^2 = flap^2 - gamma^2 for a thin beam
ROTATING_FLAP = {
    0: (3.5160, 22.0345, 61.6972), 1: (3.6816, 22.1810, 61.8418), 2: (4.1373, 22.6149, 62.2732),
    4: (5.5850, 24.2733, 63.9668), 6: (7.3604, 26.8091, 66.6839), 8: (9.2568, 29.9954, 70.2930),
}  # fmt: skip

# --- plates, laminates and shells ---------------------------------------------------------------------------------


def timoshenko_cantilever(n: int, *, E, G, k, rho, A, I, L) -> np.ndarray:  # noqa: E741
    """First n bending frequencies (rad/s) of a Timoshenko cantilever.

    State (w, psi, M, Q) with ``w' = psi + Q/kGA, psi' = M/EI, M' = -Q - rho I omega^2 psi, Q' = -rho A omega^2 w``;
    clamped-free when the lower right block of the transfer matrix is singular. Shear and rotary inertia lower every
    frequency, so that all roots lie below those of Euler and Bernoulli's theory.
    """

    def residual(omega):
        system = np.zeros((4, 4))
        system[0, 1], system[0, 3], system[1, 2] = 1.0, 1 / (k * G * A), 1 / (E * I)
        system[2, 3], system[2, 1], system[3, 0] = -1.0, -rho * I * omega**2, -rho * A * omega**2
        return np.linalg.det(expm(system * L)[2:, 2:])

    euler = cantilever_frequency(n, E * I, rho * A, L)
    samples = np.linspace(0.3 * euler[0], 1.01 * euler[-1], 40 * n)
    signs = np.sign([residual(omega) for omega in samples])
    brackets = [(samples[m], samples[m + 1]) for m in np.flatnonzero(np.diff(signs))[:n]]
    return np.array([brentq(residual, a, b, xtol=1e-12 * euler[0]) for a, b in brackets])


def thin_plate_simply_supported(modes, *, D, rho_h, a, b) -> np.ndarray:
    """Frequencies (rad/s) of a simply supported rectangle, ``pi^2 (m^2/a^2 + n^2/b^2) sqrt(D/rho h)`` (Navier)."""
    return np.array([np.pi**2 * ((m / a) ** 2 + (n / b) ** 2) * np.sqrt(D / rho_h) for m, n in modes])


class PlateRitz:
    """Kirchhoff plate on the unit square, D = rho h = 1, by Rayleigh-Ritz with polynomials: upper bounds.

    Shapes ``f(x) P_i(x) f(y) P_j(y)`` with Legendre polynomials P and ``f = x^p (1-x)^q``, p, q = 0 (free edge),
    1 (simply supported), 2 (clamped): Leissa, J. Sound Vib. 31 (1973) 257; Bhat, J. Sound Vib. 102 (1985) 493.

    Attributes
    ----------
    K, M : (n^2, n^2)
    Gxx, Gyy, Gxy : (n^2, n^2)
        Energy of unit compressive ``Nx``, ``Ny`` and unit shear ``Nxy``.
    """

    def __init__(self, edges: str, nu: float, n: int = 14) -> None:
        """`edges`: F, S or C at x = 0, x = 1, y = 0, y = 1."""
        order = ["FSC".index(e) for e in edges]
        X, Y = (self._integrals(*order[i : i + 2], n) for i in (0, 2))

        def form(i, j, k, m):  # int d^i/dx^i of row, d^j of column; k, m in y
            return np.kron(X[i, j], Y[k, m])

        self.K = (
            form(2, 2, 0, 0)
            + form(0, 0, 2, 2)
            + nu * (form(2, 0, 0, 2) + form(0, 2, 2, 0))
            + 2 * (1 - nu) * form(1, 1, 1, 1)
        )
        self.M = form(0, 0, 0, 0)
        self.Gxx, self.Gyy = form(1, 1, 0, 0), form(0, 0, 1, 1)
        self.Gxy = form(1, 0, 0, 1) + form(0, 1, 1, 0)

    @staticmethod
    def _integrals(p: int, q: int, n: int) -> dict:
        x, w = np.polynomial.legendre.leggauss(n + 6)
        x, w = (x + 1) / 2, w / 2
        base = Polynomial([0, 1]) ** p * Polynomial([1, -1]) ** q
        shapes = [(Legendre.basis(i, domain=[0, 1]), base) for i in range(n)]
        product = {  # Leibniz' rule, so that the Legendre polynomials keep their digits
            d: np.array([sum(comb(d, j) * f.deriv(j)(x) * g.deriv(d - j)(x) for j in range(d + 1)) for f, g in shapes])
            for d in range(3)
        }
        return {(i, j): (product[i] * w) @ product[j].T for i in range(3) for j in range(3)}

    def frequencies(self, count: int) -> np.ndarray:
        """``omega a^2 sqrt(rho h / D)``, rigid motions left out."""
        w2 = eigh(self.K, self.M, eigvals_only=True)
        return np.sqrt(w2[w2 > 1e-3][:count])

    def buckling(self, Nx: float = 0.0, Ny: float = 0.0, Nxy: float = 0.0) -> float:
        """Return ``k = lambda a^2 / (pi^2 D)`` for compressive Nx, Ny and shear Nxy times lambda."""
        values = eigh(Nx * self.Gxx + Ny * self.Gyy + Nxy * self.Gxy, self.K, eigvals_only=True)
        return 1 / (values[-1] * np.pi**2)


# Square plates, nu = 0.3, omega a^2 sqrt(rho h/D): PlateRitz with 18 polynomials in each direction, which
# test_plates.py computes again (Leissa, J. Sound Vib. 31 (1973) 257, prints 35.992 73.413 108.27 131.64;
# 3.4917 8.5246 21.429 27.331; 13.489 19.789 24.432 35.024: upper bounds of 36 beam functions, up to 1 % high)
PLATE_CLAMPED = (35.985, 73.394, 73.394, 108.22, 131.58, 132.20)
PLATE_CANTILEVER = (3.4710, 8.5063, 21.284, 27.199, 30.955, 54.184)
PLATE_FREE = (13.468, 19.596, 24.270, 34.801, 34.801, 61.093)
# NAFEMS R0015, tests FV12 and FV16 (looked up in Altair's verification pages): 10 x 10 x 0.05 m, E = 200 GPa,
# nu = 0.3, rho = 8000 kg/m^3; targets in Hz
NAFEMS_FV12 = (1.622, 2.360, 2.922, 4.233, 4.233, 7.416)
NAFEMS_FV16 = (0.421, 1.029, 2.582, 3.306, 3.753, 6.555)
# Square plates, k = N a^2/(pi^2 D): Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., chapter 9
PLATE_BUCKLING = {"uniaxial": 4.0, "biaxial": 2.0, "shear": 9.325, "clamped": 10.07}


def mindlin_simply_supported(modes, *, E, nu, rho, h, a, k=5 / 6) -> np.ndarray:
    """Lowest frequencies (rad/s) of a simply supported square Mindlin plate, tangential rotations held (hard).

    Mindlin, J. Appl. Mech. 18 (1951) 31: ``w = W s s, bx = X c s, by = Y s c`` are exact.
    """
    D, S = E * h**3 / (12 * (1 - nu**2)), k * E / (2 * (1 + nu)) * h
    lam = np.diag([D, D, D * (1 - nu) / 2]) + D * nu * np.array([[0, 1, 0], [1, 0, 0], [0, 0, 0]])
    stiffness = np.zeros((6, 6))
    stiffness[3:, 3:] = lam
    inertia = (rho * h, 0.0, rho * h**3 / 12)
    return np.array([navier_plate(stiffness, S * np.eye(2), inertia, a, a, m, n, membrane=False) for m, n in modes])


def navier_plate(ABD, S, inertia, a, b, m, n, *, angle_ply=False, membrane=True) -> float:
    """Lowest frequency (rad/s) of a simply supported laminate with half waves m, n (first-order shear theory).

    Reddy, Mechanics of Laminated Composite Plates and Shells, 2nd ed. (2004), chapters 6 and 7: w = W s s,
    bx = X c s, by = Y s c with ``u = U c s, v = V s c`` (SS-1, cross-ply: v and the normal force vanish at x = 0, a;
    Jones calls it S2) or ``u = U s c, v = V c s`` (SS-2, antisymmetric angle-ply: u and the shear force vanish).

    Parameters
    ----------
    ABD : (6, 6)
        Forces and moments (xx, yy, xy) per membrane strain and curvature.
    S : (2, 2)
        Shear stiffness (xz, yz).
    inertia : (I0, I1, I2)
    """
    points, weight = np.polynomial.legendre.leggauss(2 * max(m, n) + 12)
    x, y = (g.ravel() for g in np.meshgrid((points + 1) * a / 2, (points + 1) * b / 2, indexing="ij"))
    weight = np.outer(weight, weight).ravel() * a * b / 4
    p, q = m * np.pi / a, n * np.pi / b
    sx, cx, sy, cy = np.sin(p * x), np.cos(p * x), np.sin(q * y), np.cos(q * y)
    cs, sc, ss = (cx * sy, (-p * sx * sy, q * cx * cy)), (sx * cy, (p * cx * cy, -q * sx * sy)), sx * sy
    in_plane = (sc, cs) if angle_ply else (cs, sc)
    B, N = np.zeros((8, 5, len(x))), np.zeros((5, 5, len(x)))  # unknowns u, v, w, bx, by
    for first, (fx, fy) in ((0, in_plane), (3, (cs, sc))):
        B[first, first // 3 * 3], B[first + 2, first // 3 * 3] = fx[1]
        B[first + 2, first // 3 * 3 + 1], B[first + 1, first // 3 * 3 + 1] = fy[1]
        N[first // 3 * 3, first // 3 * 3], N[first // 3 * 3 + 1, first // 3 * 3 + 1] = fx[0], fy[0]
    B[6, 2], B[7, 2], N[2, 2] = p * cx * sy, q * sx * cy, ss
    B[6, 3], B[7, 4] = cs[0], sc[0]
    C, R = np.zeros((8, 8)), np.diag([inertia[0]] * 3 + [inertia[2]] * 2).astype(float)
    C[:6, :6], C[6:, 6:] = ABD, S
    R[[0, 1, 3, 4], [3, 4, 0, 1]] = inertia[1]
    K = np.einsum("iap,ij,jbp,p->ab", B, C, B, weight, optimize=True)
    M = np.einsum("iap,ij,jbp,p->ab", N, R, N, weight, optimize=True)
    keep = slice(None) if membrane else slice(2, None)
    return float(1 / np.sqrt(eigh(M[keep, keep], K[keep, keep], eigvals_only=True)[-1]))  # accurate for thin plates


def navier_antisymmetric_cross_ply(ABD, I0, a, b, m, n) -> float:
    """Frequency (rad/s) of a thin antisymmetric cross-ply laminate on S2 supports (Jones, chapter 5, [0/90]).

    ``omega^2 = (T33 + (2 T12 T23 T13 - T22 T13^2 - T11 T23^2) / (T11 T22 - T12^2)) / I0`` with A11 = A22,
    D11 = D22, B11 = -B22.
    """
    p, q = m * np.pi / a, n * np.pi / b
    A, B, D = ABD[:3, :3], ABD[:3, 3:], ABD[3:, 3:]
    T11, T22 = A[0, 0] * p**2 + A[2, 2] * q**2, A[0, 0] * q**2 + A[2, 2] * p**2
    T12, T13, T23 = (A[0, 1] + A[2, 2]) * p * q, -B[0, 0] * p**3, B[0, 0] * q**3
    T33 = D[0, 0] * (p**4 + q**4) + 2 * (D[0, 1] + 2 * D[2, 2]) * p**2 * q**2
    coupling = (2 * T12 * T23 * T13 - T22 * T13**2 - T11 * T23**2) / (T11 * T22 - T12**2)
    return float(np.sqrt((T33 + coupling) / I0))


def lamina(material, angle: float) -> tuple[np.ndarray, np.ndarray]:
    """Plane-stress stiffness (3, 3) of (xx, yy, xy) and shear (2, 2) of (xz, yz) of a lamina turned by `angle` (rad).

    Jones, Mechanics of Composite Materials, 2nd ed., chapter 2: compliance of axes 1, 2 turned as a tensor.
    """
    E1, E2, nu12 = material.E1, material.E2, material.nu12
    compliance = np.array([[1 / E1, -nu12 / E1, 0], [-nu12 / E1, 1 / E2, 0], [0, 0, 1 / material.G12]])
    c, s = np.cos(angle), np.sin(angle)
    strain = np.array([[c * c, s * s, c * s], [s * s, c * c, -c * s], [-2 * c * s, 2 * c * s, c * c - s * s]])
    turn = np.array([[c, s], [-s, c]])
    return strain.T @ np.linalg.inv(compliance) @ strain, turn.T @ np.diag([material.G13, material.G23]) @ turn


def laminate(plies, k=5 / 6) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness ABD (6, 6), shear (2, 2) of ``[(material, thickness, angle)]``, bottom first (Jones, chapter 4)."""
    z = -sum(t for _, t, _ in plies) / 2
    ABD, S = np.zeros((6, 6)), np.zeros((2, 2))
    for material, t, angle in plies:
        Q, shear = lamina(material, angle)
        moments = [((z + t) ** i - z**i) / i for i in (1, 2, 3)]
        ABD += np.block([[moments[0] * Q, moments[1] * Q], [moments[1] * Q, moments[2] * Q]])
        S += k * t * shear
        z += t
    return ABD, S


def off_axis_modulus(material, angle: float) -> float:
    """Young's modulus along a direction at `angle` (rad) from the fibre (Jones, chapter 2)."""
    c, s = np.cos(angle), np.sin(angle)
    shear = 1 / material.G12 - 2 * material.nu12 / material.E1
    return 1 / (c**4 / material.E1 + s**4 / material.E2 + shear * (c * s) ** 2)


def cylinder_buckling(*, E, nu, t, R, L) -> float:
    """Critical axial force (N/m) of a cylinder whose ends hold v and w, membrane prestress.

    Sanders, NASA TR R-24 (1959): ``u = U cos ax cos n theta, v = V sin ax sin n theta, w = W sin ax cos n theta``
    satisfy the equations; the prestress does work on ``u_x^2 + v_x^2 + w_x^2``. The least over m and n.
    """
    membrane, bending = E * t / (1 - nu**2), E * t**3 / 12 / (1 - nu**2)
    C = np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    critical = []
    for m in range(1, 10):
        for n in range(1, 30):  # n = 0 lies above, Timoshenko's E t^2 / (R sqrt(3 (1 - nu^2)))
            a = m * np.pi / L
            strain = np.array([[-a, 0, 0], [0, n / R, 1 / R], [-n / R, a, 0]])
            curvature = np.array(
                [[0, 0, a**2], [0, n / R**2, n**2 / R**2], [n / (2 * R**2), 1.5 * a / R, 2 * a * n / R]]
            )
            K = membrane * strain.T @ C @ strain + bending * curvature.T @ C @ curvature
            critical.append(np.linalg.eigvalsh(K)[0] / a**2)
    return min(critical)


# Obstacle course of shells; the original tables were not at hand, the values are as later papers and programs quote
# them, and fine meshes here confirm each. Scordelis and Lo, J. ACI 61 (1964) 539, with the value of MacNeal and Harder,
# Finite Elements in Analysis and Design 1 (1985) 3 (0.3086 in the original; deep shell theory and fine meshes give
# 0.3006); theirs also the twisted beam, unit tip load along the width of the tip (z) or across it (y), as Altair's
# OptiStruct verification problem OS-V:0700 prints it.
# Pinched cylinder: Belytschko and others, CMAME 51 (1985) 221, as the example pinched_cylinder of
# FinEtoolsFlexStructures.jl prints it.
# Thin twisted beam (t = 0.0032, load 1e-6): Belytschko, Wong, Stolarski, IJNME 28 (1989) 385.
SCORDELIS_LO, SCORDELIS_LO_DEEP = 0.3024, 0.3006
PINCHED_CYLINDER = 1.82488e-5
TWISTED_BEAM = {"z": 5.424e-3, "y": 1.754e-3}
THIN_TWISTED_BEAM = {"z": 5.256e-3, "y": 1.294e-3}
# Hemisphere with a hole of 18 degrees: printed are 0.0940 (MacNeal and Harder), 0.0930 (Simo, Fox, Rifai, CMAME 73
# (1989) 53) and 0.0924 (Morley and Morris 1978, no hole), by which the tests divide
HEMISPHERE, HEMISPHERE_PRINTED = 0.0924, (0.0924, 0.0940)


# --- beams on several supports ------------------------------------------------------------------------------------


def clamped_pinned_roots(n: int) -> np.ndarray:
    """First n roots beta L of ``tan = tanh``: clamped-pinned and, above its rigid motion, pinned-free (Blevins)."""
    edges = np.pi * (np.arange(n + 1) + 0.25)
    f = lambda b: np.sin(b) - np.cos(b) * np.tanh(b)  # noqa: E731
    return np.array([brentq(f, a + 1e-9, b + 1e-9) for a, b in pairwise(edges)])


def free_free_roots(n: int) -> np.ndarray:
    """First n roots beta L of ``cos cosh = 1``: free-free above its rigid motions, and clamped-clamped."""
    edges = np.pi * np.arange(1, n + 2)
    return np.array([brentq(lambda b: np.cos(b) - 1 / np.cosh(b), a, b) for a, b in pairwise(edges)])
