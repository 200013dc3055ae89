"""Work of the derivatives of bodies with stations: their frames, those of their interfaces, and one that is at rest."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.multibody.kernels.algebra.matrices import UNIT9

STEP = np.dtype(
    [
        ("parent", np.int64),  # row
        ("th", np.float64, 3),  # twist relative to the parent, its axes
        ("rho", np.float64, 3),
        ("factors", np.float64, 12),  # of the spin (spins.py)
        ("R", np.float64, 9),  # to the link's axes, in which the others are
        ("r", np.float64, 3),
        ("v", np.float64, 3),
        ("w", np.float64, 3),
        ("a", np.float64, 3),  # acceleration, q'' too, where the link is at rest
        ("alpha", np.float64, 3),
        ("force", np.float64, 3),  # of what is carried: this part and those beyond it
        ("torque", np.float64, 3),  # about the centre
    ]
)


@by_address
class StationWork(NamedTuple):
    """Parts of all bodies with stations, then the ends of `Bends`, then the frame at rest; axes of the links."""

    steps: np.ndarray  # (rows,) STEP
    J: np.ndarray  # (rows, 6, N) derivatives by q of places and rotations
    rates: np.ndarray  # (rows, 12, N) of v, w, a, alpha
    forces: np.ndarray  # (rows, 12, N) of force and torque by q, then by q'
    # of the affine functions of one body: what its parts move in them, and the second order beyond them
    own: np.ndarray  # (3, 12) place, rate, acceleration of the parts
    beyond: np.ndarray  # (12,) acceleration of the second order
    dp: np.ndarray  # (12, N)
    acc_q: np.ndarray
    acc_qd: np.ndarray


def new_stations(parts: int, ends: int, N: int) -> StationWork:
    """Return the work of so many parts in all, and ends.

    Examples
    --------
    >>> new_stations(3, 2, 4).J.shape
    (6, 6, 4)
    """
    rows = parts + ends + 1
    steps = np.zeros(rows, STEP).view(np.recarray)
    steps["R"][-1] = UNIT9
    shapes = ((rows, 6, N), (rows, 12, N), (rows, 12, N), (3, 12), (12,), (12, N), (12, N), (12, N))
    return StationWork(steps, *map(np.zeros, shapes))
