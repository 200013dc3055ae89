"""Closed forms and published numbers, each with its source."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
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


# Effective mass fractions of a uniform cantilever: (2 sigma / beta)^2 transverse, 3 (2 / beta^2)^2 about the root
CANTILEVER_EFFECTIVE_MASS = np.array([0.613076, 0.188300, 0.064732, 0.033087, 0.020014, 0.013398])
CANTILEVER_EFFECTIVE_INERTIA = np.array([0.970688, 0.024716, 0.003152, 0.000821])

# int (1 - x^2)/2 phi' phi', int (1 - x) phi' phi', int phi' phi' of the unit cantilever (L = rho A = 1), first 3 modes
CENTRIFUGAL = np.array(
    [[1.193336, -0.685855, -0.792379], [-0.685855, 6.478225, 0.169408], [-0.792379, 0.169408, 17.859520]]
)
AXIAL_ACCELERATION = np.array(
    [[1.570878, -0.422320, -1.072085], [-0.422320, 8.647143, 1.890055], [-1.072085, 1.890055, 24.952113]]
)
TIP_FORCE = np.array(
    [[4.647778, -7.379875, 3.941515], [-7.379875, 32.417399, -22.352444], [3.941515, -22.352444, 77.298891]]
)

# Rotating uniform cantilever, lambda = omega sqrt(rho A L^4 / EI) against gamma = Omega sqrt(rho A L^4 / EI):
# flap of Wright, Smith, Thresher, Wang, J. Appl. Mech. 49 (1982) 197; lag^2 = flap^2 - gamma^2 for a thin beam
ROTATING_FLAP = {
    0: (3.5160, 22.0345, 61.6972), 1: (3.6816, 22.1810, 61.8418), 2: (4.1373, 22.6149, 62.2732),
    4: (5.5850, 24.2733, 63.9668), 6: (7.3604, 26.8091, 66.6839), 8: (9.2568, 29.9954, 70.2930),
}  # fmt: skip

# Spin-up beam of Simo and Vu-Quoc (1986): consistent modal theory with many modes, tip deflection (m) at times (s)
SPINUP = {5.0: -0.468781, 7.5: -0.559512, 10.0: -0.362822, 12.5: -0.112637}
SPINUP_MINIMUM, SPINUP_MINIMUM_TIME = -0.574367, 6.762
SPINUP_RESIDUAL = 3.65e-3  # amplitude after 15 s, known to 10 %
SPINUP_STRETCH = 1.2 * 6.0**2 * 10.0**3 / (3 * 2.8e7)  # rho A Omega^2 L^3 / (3 EA)
SPINUP_CONVENTIONAL = {5.0: -0.52184, 7.5: -1.4645}
