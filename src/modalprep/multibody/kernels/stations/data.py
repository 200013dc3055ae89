"""Constants and results of an evaluation of bodies with stations, in the axes of their links."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address

PART = np.dtype(
    [
        ("parent", np.int64),  # part of the same body, -1 the body's frame
        ("d", np.float64, 3),  # from the parent's centre, undeformed, m
        ("mass", np.float64),  # kg
        ("J", np.float64, 6),  # kg m^2, about the centre: xx, xy, xz, yy, yz, zz
        ("by_mass", np.float64, 4),  # int rho X_r
        ("by_turn", np.float64, 12),  # int rho (x - c) X_r, r last: zero for the first of the four
    ]
)
LEAF = np.dtype([("parent", np.int64), ("d", np.float64, 3)])  # an interface on a part

FRAME = np.dtype(
    [
        ("R", np.float64, 9),  # to the link's axes
        ("r", np.float64, 3),
        ("v", np.float64, 3),  # by the modal rates
        ("w", np.float64, 3),
        ("a", np.float64, 3),  # acceleration without q'' and without the link's motion
        ("alpha", np.float64, 3),
        # of a part
        ("inertia", np.float64, 6),  # moments of inertia
        ("arms", np.float64, 12),  # `by_turn`, turned
        ("force", np.float64, 3),  # of its own acceleration
        ("torque", np.float64, 3),
    ]
)


@by_address
class Parts(NamedTuple):
    """Constants of the bodies with stations; N as in `data.Integrals`."""

    first: np.ndarray  # (nk,) int, first row of a body's parts
    number: np.ndarray  # (nk,) int, of them
    parts: np.ndarray  # (parts,) PART
    moved: np.ndarray  # (parts, 6, N) rho_q (3), th_q (3) of body/stations/motion.py
    H_rest: np.ndarray  # (nk, 12, N) nine rows; the others stay zero
    leaves: np.ndarray  # (interfaces,) LEAF
    leaf_moved: np.ndarray  # (interfaces, 6, N)
    strain: np.ndarray  # (interfaces, N, N) of the arms


@by_address
class PartsData(NamedTuple):
    """Results of an evaluation; the last frame is for passing use."""

    frames: np.ndarray  # (rows + 1,) FRAME
    J: np.ndarray  # (rows + 1, 6, N) velocity (3), angular velocity (3) per modal rate
    force: np.ndarray  # (rows + 1, 6, N) of a unit modal acceleration on each part
    p: np.ndarray  # (12,) what the parts move in the affine functions of their body
    pd: np.ndarray  # (12,)
    pdd: np.ndarray  # (12,)
    dp: np.ndarray  # (12, N)
    S: np.ndarray  # (6, N) momenta of the parts per modal rate, angular ones about the link's origin
    b: np.ndarray  # (N,) modal forces of the parts' own accelerations


def no_parts(kinds: int, interfaces: int) -> Parts:
    """Return the constants of bodies without stations.

    Examples
    --------
    >>> no_parts(1, 2).number
    array([0])
    """
    return empty_parts(kinds, interfaces, 0, 0)


def empty_parts(kinds: int, interfaces: int, parts: int, N: int) -> Parts:
    """Return zeros in place of all constants.

    Examples
    --------
    >>> empty_parts(1, 2, 3, 4).moved.shape
    (3, 6, 4)
    """
    return Parts(
        first=np.zeros(kinds, dtype=np.int64),
        number=np.zeros(kinds, dtype=np.int64),
        parts=np.zeros(parts, PART).view(np.recarray),
        moved=np.zeros((parts, 6, N)),
        H_rest=np.zeros((kinds if N else 0, 12, N)),
        leaves=np.zeros(interfaces if N else 0, LEAF).view(np.recarray),
        leaf_moved=np.zeros((interfaces if N else 0, 6, N)),
        strain=np.zeros((interfaces if N else 0, N, N)),
    )


def parts_data(rows: int, N: int) -> PartsData:
    """Return room for the results of an evaluation of so many parts in all.

    Examples
    --------
    >>> parts_data(3, 4).J.shape
    (4, 6, 4)
    """
    none = np.zeros((rows + 1, 6, N))
    six, twelve = np.zeros((6, N)), np.zeros((12, N))
    line = np.zeros(12)
    frames = np.zeros(rows + 1, FRAME).view(np.recarray)
    return PartsData(frames, none, none.copy(), line, line.copy(), line.copy(), twelve, six, np.zeros(N))
