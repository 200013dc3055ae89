"""Amplitudes of motions that repeat themselves with the turns of a rotor: Hill's matrix of its linear equations."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from modalprep.multibody.rotors.turning import Turn

HARMONICS = (2, 4, 6, 9, 12)  # of a motion on both sides, tried until they suffice
TAIL = 1e-6  # of a motion: what it drives beyond its harmonics is below it


def hill_matrices(found: Turn, count: int) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
    """Return A and B, all harmonics of -count to count below each other: motions ``z e^(s t)`` have ``A z = s B z``.

    Both are (k, k), k = (2 count + 1) 2 n, and s is in units of the rate.

    References
    ----------
    Theory 5.10, equation (5.11).
    """
    E, F = _harmonics(found)
    n, m = E.shape[1], 2 * count + 1
    rates = _rates(found, count)
    A, B = np.zeros((2, m, n, m, n), dtype=complex)
    for row in range(m):
        for column in range(m):
            if abs(row - column) < max(len(E) / 2, 1):
                own = E[(row - column) % len(E)]
                B[row, :, column] = own
                A[row, :, column] = F[(row - column) % len(E)] - rates[column] * own
    return A.reshape(m * n, m * n), B.reshape(m * n, m * n)


def drives_more(found: Turn, value: complex, vector: np.ndarray) -> bool:
    """Whether a motion of a few harmonics (harmonics, 2 n) drives further ones, which it does not have."""
    E, F = _harmonics(found)
    count, reach = len(vector) // 2, (len(E) - 1) // 2
    rates = value + _rates(found, count)
    for beyond in range(count + 1, count + reach + 1):
        for place in (beyond, -beyond):
            near = [k for k in range(-count, count + 1) if abs(place - k) <= reach]
            driven = [(F[place - k] - rates[k + count] * E[place - k]) @ vector[k + count] for k in near]
            if np.linalg.norm(np.sum(driven, axis=0)) > TAIL * np.linalg.norm(vector):
                return True
    return False


def motion_spectrum(found: Turn, x: np.ndarray) -> np.ndarray:
    """Return the harmonics (harmonics, 6 ni) of the interfaces in inertial axes, of those of the coordinates.

    There is one more on both sides, since C turns once, but at rest.
    """
    C = np.fft.fft(found.C, axis=0) / len(found.C)
    reach = 1 if len(C) > 1 else 0
    spectrum = np.zeros((len(x) + 2 * reach, C.shape[1]), dtype=np.complex128)
    for k in range(-reach, reach + 1):
        spectrum[reach + k : reach + k + len(x)] += x @ C[k].T
    return spectrum


def across(motion: np.ndarray, axis: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the components (k,) of motions (k, 3) along two directions across an axis, which turns one to the other.

    The first is the inertial axis that is most across, made normal to the axis: y where this is x.

    Examples
    --------
    >>> across(np.array([[1.0, 2.0, 3.0]]), np.array([1.0, 0.0, 0.0]))
    (array([2.]), array([3.]))
    """
    first = np.eye(3)[np.argmin(np.abs(axis))]
    first = first - (first @ axis) * axis
    first /= np.linalg.norm(first)
    return motion @ first, motion @ np.cross(axis, first)


def _rates(found: Turn, count: int) -> np.ndarray:
    """Return those of the harmonics (2 count + 1,), in units of the rate."""
    return 1j * np.arange(-count, count + 1) * found.speed / found.rate


def _harmonics(found: Turn) -> tuple[np.ndarray, np.ndarray]:
    """Return those of E and F over a turn, as `numpy.fft` orders them."""
    E, F = (np.fft.fft(each, axis=0) / len(each) for each in (found.E, found.F))
    return E, F
