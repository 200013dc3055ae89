"""Where the centroid lies from the shear centre, by thin walls: channels, hats and unequal boxes of PBEAML.

A wall is the line along its middle. A twist about the shear centre warps a section without bending it: the warping of
a twist about the centroid follows from the equilibrium of the shear flows of open and closed walls, and the twist that
has no moments about y and z with it is about the shear centre.

References
----------
V. Z. Vlasov, Thin-walled Elastic Beams (1961), chapter 1; T. H. G. Megson, Aircraft Structures for Engineering
Students, 4th edition (2007), chapters 17 and 18.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np


class Walls(NamedTuple):
    """Points (y, z) of a section, and its walls: two of the points and a thickness."""

    points: Sequence[tuple[float, float]]
    walls: Sequence[tuple[int, int, float]]


def centroid_from_shear_centre(
    points: Sequence[tuple[float, float]], walls: Sequence[tuple[int, int, float]]
) -> np.ndarray:
    """Return y and z (2,) of the centroid, from the shear centre.

    Examples
    --------
    A tee, whose shear centre is where its walls meet:

    >>> y, z = centroid_from_shear_centre([(0, -1), (0, 1), (0, 0), (-2, 0)], [(0, 2, 0.1), (2, 1, 0.1), (2, 3, 0.1)])
    >>> float(y)
    -0.5
    """
    first, second, thickness = (np.array(own) for own in zip(*walls, strict=True))
    p = np.array(points, dtype=float)
    area = thickness * np.linalg.norm(p[second] - p[first], axis=1)
    p -= area @ (p[first] + p[second]) / (2 * area.sum())
    functions = np.column_stack([p, _warping(p, first, second, thickness)])
    a, b = functions[first], functions[second]
    products = (
        np.sum([(own * area[:, None]).T @ own for own in (a, b, a + b)], axis=0) / 6
    )  # integrals of linear functions
    z, y = np.linalg.solve(products[:2, :2], products[:2, 2])
    return np.array([y, -z])


def _warping(p: np.ndarray, first: np.ndarray, second: np.ndarray, thickness: np.ndarray) -> np.ndarray:
    """Return the warping of the points by a unit twist about the origin, for which the shear flows are in equilibrium.

    A flow is ``t (u_2 - u_1 + c) / l`` with twice the area c that the wall sweeps from the origin.
    """
    d = p[second] - p[first]
    length = np.linalg.norm(d, axis=1)
    weight = np.sqrt(thickness / length)
    rows = np.zeros((len(length), len(p)))
    rows[np.arange(len(length)), second] = weight
    rows[np.arange(len(length)), first] = -weight
    swept = p[first, 0] * p[second, 1] - p[first, 1] * p[second, 0]
    u = np.linalg.lstsq(rows, -weight * swept, rcond=None)[0]
    area = thickness * length
    return u - area @ (u[first] + u[second]) / (2 * area.sum())


def _turned(own: Walls) -> Walls:
    """Exchange y and z."""
    return Walls([(z, y) for y, z in own.points], own.walls)


def _l(b: float, h: float, t1: float, t2: float) -> Walls:
    return Walls([(t1 / 2, b), (t1 / 2, t2 / 2), (h, t2 / 2)], [(0, 1, t1), (1, 2, t2)])


def _chan(b: float, h: float, tw: float, tf: float) -> Walls:
    low, high, web = tf / 2, h - tf / 2, tw / 2
    return Walls([(low, b), (low, web), (high, web), (high, b)], [(0, 1, tf), (1, 2, tw), (2, 3, tf)])


def _hat(h: float, t: float, top: float, brim: float) -> Walls:
    low, high, side = t / 2, h - t / 2, (top - t) / 2
    end = side + t / 2 + brim
    points = [(low, -end), (low, -side), (high, -side), (high, side), (low, side), (low, end)]
    return Walls(points, [(k, k + 1, t) for k in range(5)])


def _hat1(plate: float, h: float, top: float, t: float, base: float) -> Walls:
    """The brims lie on the plate, as one wall."""
    low, high, side, end = base / 2, h - t / 2, (top - t) / 2, plate / 2
    points = [(low, -end), (low, -side), (high, -side), (high, side), (low, side), (low, end)]
    brims = [(0, 1, base + t), (4, 5, base + t)]
    return Walls(points, [*brims, (1, 2, t), (2, 3, t), (3, 4, t), (4, 1, base)])


def _box1(b: float, h: float, top: float, bottom: float, right: float, left: float) -> Walls:
    points = [
        (bottom / 2, left / 2),
        (bottom / 2, b - right / 2),
        (h - top / 2, b - right / 2),
        (h - top / 2, left / 2),
    ]
    return Walls(points, [(0, 1, bottom), (1, 2, right), (2, 3, top), (3, 0, left)])


def _dbox(
    b: float, h: float, left: float, t1: float, tc: float, t2: float, tl: float, bl: float, tr: float, br: float
) -> Walls:
    """The walls above and below meet the middle wall at the mean of their heights."""
    z1, z2 = t1 / 2, b - t2 / 2
    low, high = (bl + br) / 4, h - (tl + tr) / 4
    points = [(bl / 2, z1), (low, left), (br / 2, z2), (h - tr / 2, z2), (high, left), (h - tl / 2, z1)]
    return Walls(points, [(0, 1, bl), (1, 2, br), (2, 3, t2), (3, 4, tr), (4, 5, tl), (5, 0, t1), (1, 4, tc)])


def _gbox(b: float, h: float, top: float, bottom: float, web: float, between: float) -> Walls:
    low, high, side = bottom / 2, h - top / 2, (between + web) / 2
    points = [(y, z) for y in (low, high) for z in (-b / 2, -side, side, b / 2)]
    flanges = [(k, k + 1, t) for first, t in ((0, bottom), (4, top)) for k in range(first, first + 3)]
    return Walls(points, [*flanges, (1, 5, web), (2, 6, web)])


WALLS: dict[str, Callable[..., Walls]] = {
    "L": _l,
    "CHAN": _chan,
    "CHAN1": lambda outstand, tw, inside, h: _chan(outstand + tw, h, tw, (h - inside) / 2),
    "CHAN2": lambda legs, web, h, b: _turned(_chan(h, b, web, legs)),
    "HAT": _hat,
    "HAT1": _hat1,
    "BOX1": _box1,
    "DBOX": _dbox,
    "GBOX": _gbox,
}
