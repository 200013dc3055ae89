"""Largest nodal displacement of modes."""

from __future__ import annotations

import numpy as np

SHARE = 0.12  # largest displacement shown, of the body's size
NOISE = 1e-6  # of the largest displacement of any mode: below it the mode has rotations only


def largest_displacement(shape: np.ndarray) -> np.ndarray:
    """Return the largest displacement of each mode, 0 where it is round-off.

    A straight beam in torsion has nodal rotations only; its displacements are then round-off, which pictures must not
    amplify.

    Parameters
    ----------
    shape : (n_points, 3, n)

    Returns
    -------
    (n,)

    Examples
    --------
    >>> shape = np.zeros((4, 3, 2))
    >>> shape[3, 1] = [0.5, 1e-13]
    >>> largest_displacement(shape)
    array([0.5, 0. ])
    """
    largest = np.linalg.norm(shape, axis=1).max(axis=0, initial=0.0)
    return np.where(largest > NOISE * largest.max(initial=0.0), largest, 0.0)


def unseen_modes(shape: np.ndarray) -> list[int]:
    """Return the modes, counted from 1, without nodal displacement.

    Examples
    --------
    >>> unseen_modes(np.zeros((2, 3, 1)))
    [1]
    """
    return [int(k) + 1 for k in np.flatnonzero(largest_displacement(shape) == 0)]
