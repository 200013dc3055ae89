"""Which point of an analysis stands for each sensor, and what to do where they do not fit."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from scipy.spatial import cKDTree

from modalprep.correlation.mode_set import ModeSet
from modalprep.errors import InputError

FAR = 0.05  # of the size of the analysis: a sensor farther from all nodes does not belong to it
DIGITS = 1e-6  # of the coordinates: smaller distances come from the digits of a file
COVERED = 0.3  # of the size of the analysis, by sensors that are taken to fit in another unit or other axes
UNITS = {"in mm": 1e-3, "in cm": 1e-2, "in in": 0.0254, "in ft": 0.3048, "a thousand times as large": 1e3}


def in_frame(test: ModeSet, origin: Sequence[float], rotation: np.ndarray | None) -> ModeSet:
    """Return a test in the frame of the analysis.

    Raises
    ------
    InputError
        When the origin is no point, or the axes are no rotation.
    """
    at = np.asarray(origin, dtype=float)
    R = np.eye(3) if rotation is None else np.asarray(rotation, dtype=float)
    if at.shape != (3,) or not np.isfinite(at).all():
        raise InputError(f"origin has shape {at.shape}; give three finite coordinates in m")
    if R.shape != (3, 3) or np.abs(R @ R.T - np.eye(3)).max() > 1e-6 or np.linalg.det(R) < 0:
        raise InputError(
            "rotation is no rotation (3, 3): its rows are the axes x, y, z of the body in those of the test"
        )
    return test.moved(at, R)


def nearest(test: ModeSet, analysis: ModeSet, tolerance: float | None) -> tuple[np.ndarray, np.ndarray]:
    """Return the row of the nearest point of each sensor, and its distance, m.

    Raises
    ------
    InputError
        When a sensor is farther than the tolerance, m, by default `FAR` times the size of the analysis.
    """
    size = float(np.ptp(analysis.points, axis=0).max())
    allowed = FAR * size if tolerance is None else tolerance
    if not 0 <= allowed < float("inf"):
        raise InputError(f"tolerance = {allowed:g} m must be a length")
    tree = cKDTree(analysis.points)
    distance, node = tree.query(test.points)
    if distance.max() > allowed:
        worst = int(np.argmax(distance))
        raise InputError(
            f"sensor {test.labels[worst]} of {test.name} lies {distance[worst]:.3g} m from the nearest point of "
            f"{analysis.name}, whose size is {size:.3g} m; {_advice(test.points, tree, allowed, size)}"
        )
    return node, distance


def _advice(points: np.ndarray, tree: cKDTree, allowed: float, size: float) -> str:
    """Say which unit of length or which axes would bring every sensor to a point, if any do."""

    def fits(tried: np.ndarray) -> bool:
        wide = np.ptp(tried, axis=0).max() >= COVERED * size  # a point would fit anywhere
        return bool(wide and tree.query(tried)[0].max() <= allowed)

    for name, factor in UNITS.items():
        if fits(factor * points):
            return f"lengths {name} would fit; give the unit of length"
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            R = np.eye(3)[list(order)] * np.array(signs)[:, None]
            if np.linalg.det(R) > 0 and fits(points @ R.T):
                words = ("-" * (sign < 0) + "xyz"[axis] for axis, sign in zip(order, signs, strict=True))
                return f"the axes of the body would fit as {','.join(words)} of the test; give them"
    return "give the unit of length, or the origin or the axes of the body's frame in those of the test"


def said_of_places(test: ModeSet, node: np.ndarray, distance: np.ndarray) -> list[str]:
    """Return notes on sensors beside their point, on one point, or with axes of their own."""
    notes = []
    if distance.max() > DIGITS * np.abs(test.points).max():
        notes.append(f"the largest distance of a sensor from its point is {distance.max():.3g} m")
    order = np.argsort(node, kind="stable")
    shared = [(test.labels[i], test.labels[j]) for i, j in itertools.pairwise(order.tolist()) if node[i] == node[j]]
    if shared:
        named = ", ".join(f"{a} and {b}" for a, b in shared[:5])
        more = f" and {len(shared) - 5} more" if len(shared) > 5 else ""
        notes.append(f"sensors {named}{more} have the same nearest point")
    if test.axes is not None and (own := int(np.any(np.abs(test.axes - np.eye(3)) > 1e-9, axis=(1, 2)).sum())):
        notes.append(f"{own} sensors measure along axes that are not those of the body; it is compared along them")
    return notes
