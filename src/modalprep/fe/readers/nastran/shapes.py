"""Sections of PBARL and PBEAML by their dimensions: area, moments, torsion constant, shear factors (deck units).

Positions are y upwards (plane 1) and z sideways, as in the figures of the cards. Nastran does not print its torsion
constants and shear factors. Those here are the classical ones: of solid sections 0.9 (round) and 5/6, of thin-walled
ones the area of the walls along the shear force over the whole, of open walls ``sum b t^3 / 3``, of closed cells Bredt.
The factor of the rod is known to be Nastran's.

References
----------
W. C. Young, R. G. Budynas, Roark's Formulas for Stress and Strain, 7th edition (2002), tables 8.13 (shear) and 10.7.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

SOLID = 5 / 6  # shear factor of a rectangle
ROUND, THIN_TUBE = 0.9, 0.5


class Shape(NamedTuple):
    """Area, moments about the centroid (plane 1, plane 2, product), torsion constant and shear factors."""

    A: float
    I1: float
    I2: float
    I12: float
    J: float
    k1: float
    k2: float


NONE = Shape(*[0.0] * 7)  # of dimensions that do not fit each other


def _strips(J: float, along: tuple[float, float], *rectangles: tuple[float, float, float, float]) -> Shape:
    """Sum rectangles (width along z, height along y, centre z, centre y); width < 0 cuts.

    `along` are the areas that carry the shear forces of the planes 1 and 2.
    """
    b, h, z, y = np.array(rectangles).T
    area = b * h
    A = area.sum()
    z, y = z - area @ z / A, y - area @ y / A
    own = area * h**2 / 12, area * np.abs(b) ** 2 / 12
    I1 = (own[0] + area * y**2).sum()
    I2 = (own[1] + area * z**2).sum()
    I12 = area @ (y * z)
    I12 = float(I12) if abs(I12) > 1e-12 * (I1 + I2) else 0.0
    return Shape(float(A), float(I1), float(I2), I12, J, float(along[0] / A), float(along[1] / A))


def _open(*walls: tuple[float, float]) -> float:
    """Torsion constant of thin open walls (length, thickness)."""
    return sum(length * thickness**3 for length, thickness in walls) / 3


def _ring(outer: float, inner: float, k: float = THIN_TUBE) -> Shape:
    second = math.pi * (outer**4 - inner**4) / 4
    return Shape(math.pi * (outer**2 - inner**2), second, second, 0.0, 2 * second, k, k)


def _rectangle_torsion(b: float, h: float) -> float:
    s = max(b, h)
    t = min(b, h)
    return s * t**3 * (1 / 3 - 0.21 * t / s * (1 - t**4 / (12 * s**4)))  # Roark, table 10.7


def _bar(b: float, h: float) -> Shape:
    return _strips(_rectangle_torsion(b, h), (SOLID * b * h, SOLID * b * h), (b, h, 0, 0))


def _hexa(side: float, b: float, h: float) -> Shape:
    """Hexagon of width b and height h whose triangles at both sides are `side` wide; torsion of its mean rectangle."""
    flat = b - 2 * side
    A = h * (b - side)
    J = _rectangle_torsion(b - side, h)
    I1 = flat * h**3 / 12 + side * h**3 / 24
    I2 = h * flat**3 / 12 + h * side**3 / 18 + h * side * (flat / 2 + side / 3) ** 2
    return Shape(A, I1, I2, 0.0, J, SOLID, SOLID)


def _box1(b: float, h: float, top: float, bottom: float, right: float, left: float) -> Shape:
    across, up = b - (left + right) / 2, h - (top + bottom) / 2
    J = 4 * (across * up) ** 2 / (across * (1 / top + 1 / bottom) + up * (1 / left + 1 / right))
    inside_b, inside_h = b - left - right, h - top - bottom
    hole = (-inside_b, inside_h, (left - right) / 2, (bottom - top) / 2)
    return _strips(J, (inside_h * (left + right), inside_b * (top + bottom)), (b, h, 0, 0), hole)


def _i(h: float, b1: float, b2: float, tw: float, t1: float, t2: float) -> Shape:
    J = _open((b1, t1), (b2, t2), (h - (t1 + t2) / 2, tw))
    along = tw * (h - t1 - t2), SOLID * (b1 * t1 + b2 * t2)
    return _strips(J, along, (b1, t1, 0, t1 / 2), (b2, t2, 0, h - t2 / 2), (tw, h - t1 - t2, 0, (h + t1 - t2) / 2))


def _i1(outstands: float, tw: float, inside: float, h: float) -> Shape:
    return _i(h, outstands + tw, outstands + tw, tw, (h - inside) / 2, (h - inside) / 2)


def _t(b: float, h: float, tf: float, tw: float) -> Shape:
    along = tw * (h - tf), SOLID * b * tf
    return _strips(_open((b, tf), (h - tf / 2, tw)), along, (b, tf, 0, h - tf / 2), (tw, h - tf, 0, (h - tf) / 2))


def _turned(shape: Shape) -> Shape:
    """Exchange y and z."""
    A, I1, I2, I12, J, k1, k2 = shape
    return Shape(A, I2, I1, I12, J, k2, k1)


def _l(b: float, h: float, t1: float, t2: float) -> Shape:
    """Lower leg of thickness t1 towards +z, upright leg of thickness t2."""
    J = _open((b - t2 / 2, t1), (h - t1 / 2, t2))
    along = SOLID * t2 * h, SOLID * t1 * b
    return _strips(J, along, (b, t1, b / 2, t1 / 2), (t2, h - t1, t2 / 2, (h + t1) / 2))


def _chan(b: float, h: float, tw: float, tf: float) -> Shape:
    J = _open((b - tw / 2, tf), (b - tw / 2, tf), (h - tf, tw))
    flange = (b, tf, b / 2)
    along = (tw * (h - 2 * tf), SOLID * 2 * b * tf)
    return _strips(J, along, (*flange, tf / 2), (*flange, h - tf / 2), (tw, h - 2 * tf, tw / 2, h / 2))


def _chan1(outstand: float, tw: float, inside: float, h: float) -> Shape:
    return _chan(outstand + tw, h, tw, (h - inside) / 2)


def _chan2(legs: float, web: float, h: float, b: float) -> Shape:
    """A channel with upright legs at both ends of a lying web."""
    return _turned(_chan(h, b, web, legs))


def _z(outstand: float, tw: float, inside: float, h: float) -> Shape:
    """The lower flange points to +z, the upper to -z."""
    b = outstand + tw
    tf = (h - inside) / 2
    J = _open((b, tf), (b, tf), (h - tf, tw))
    along = (tw * inside, SOLID * 2 * b * tf)
    z = outstand / 2
    y = (h - tf) / 2
    return _strips(J, along, (b, tf, z, -y), (b, tf, -z, y), (tw, inside, 0, 0))


def _cross(outstands: float, tw: float, h: float, tf: float) -> Shape:
    J = _open((h, tw), (outstands, tf))
    along = (SOLID * h * tw, SOLID * (outstands + tw) * tf)
    z = (outstands / 2 + tw) / 2
    return _strips(J, along, (tw, h, 0, 0), (outstands / 2, tf, z, 0), (outstands / 2, tf, -z, 0))


def _h(inside: float, legs: float, h: float, tw: float) -> Shape:
    leg = legs / 2
    z = (inside + legs / 2) / 2
    J = _open((h, leg), (h, leg), (inside + leg, tw))
    along = (SOLID * legs * h, inside * tw)
    return _strips(J, along, (leg, h, -z, 0), (leg, h, z, 0), (inside, tw, 0, 0))


def _hat(h: float, t: float, top: float, brim: float) -> Shape:
    z = (top - t) / 2
    J = _open((2 * brim + 2 * (h - t) + top, t))
    walls = [(t, h - 2 * t, s * z, h / 2) for s in (-1, 1)]
    brims = [(brim + t, t, s * (top + brim - t) / 2, t / 2) for s in (-1, 1)]
    along = 2 * t * (h - 2 * t), SOLID * t * (top + 2 * (brim + t))
    return _strips(J, along, (top, t, 0, h - t / 2), *walls, *brims)


def _hat1(plate: float, h: float, top: float, t: float, base: float) -> Shape:
    """A hat, h - base high, on a plate of thickness `base`; the closed cell carries the torsion."""
    across = top - t
    up = h - base / 2 - t / 2
    J = 4 * (across * up) ** 2 / (across * (1 / t + 1 / base) + 2 * up / t)
    walls = [(t, h - base - 2 * t, s * (top - t) / 2, (h + base) / 2) for s in (-1, 1)]
    brim = (plate - top) / 2 + t
    brims = [(brim, t, s * (plate - brim) / 2, base + t / 2) for s in (-1, 1)]
    along = 2 * t * (h - base - 2 * t), SOLID * (plate * base + top * t + 2 * brim * t)
    return _strips(J, along, (plate, base, 0, base / 2), (top, t, 0, h - t / 2), *walls, *brims)


def _dbox(
    b: float, h: float, left: float, t1: float, tc: float, t2: float, tl: float, bl: float, tr: float, br: float
) -> Shape:
    """Two cells side by side: the middle wall stands `left` from the outer face of the left one.

    Walls left, middle and right, then above and below of the left cell and of the right one.
    """
    inner = left - t1 - tc / 2, b - left - t2 - tc / 2
    both = h - max(tl, tr) - max(bl, br)
    if min(*inner, both, t1, tc, t2, tl, bl, tr, br) <= 0:
        return NONE
    widths = left - t1 / 2, b - left - t2 / 2
    heights = h - (tl + bl) / 2, h - (tr + br) / 2
    J = two_cells(widths, heights, ((t1, tl, bl), (t2, tr, br)), tc)
    along = (
        t1 * (h - tl - bl) + t2 * (h - tr - br) + tc * both,
        inner[0] * (tl + bl) + inner[1] * (tr + br),
    )
    outer = (b, h, b / 2, h / 2)
    cells = [
        (-inner[0], h - tl - bl, t1 + inner[0] / 2, (h + bl - tl) / 2),
        (-inner[1], h - tr - br, b - t2 - inner[1] / 2, (h + br - tr) / 2),
    ]
    return _strips(J, along, outer, *cells)


def two_cells(
    widths: tuple[float, float],
    heights: tuple[float, float],
    walls: tuple[tuple[float, float, float], tuple[float, float, float]],
    middle: float,
) -> float:
    """Torsion constant of two thin-walled cells (Bredt and Batho): ``J = 4 A^T D^-1 A``.

    ``D`` has the sums of length over thickness around each cell, and of the wall that both share.
    """
    shared = sum(heights) / 2 / middle
    sums = [h / side + w / top + w / bottom for w, h, (side, top, bottom) in zip(widths, heights, walls, strict=True)]
    D = np.diag(sums) + shared * np.array([[1, -1], [-1, 1]])
    area = np.multiply(widths, heights)
    return float(4 * area @ np.linalg.solve(D, area))


def _gbox(b: float, h: float, top: float, bottom: float, web: float, between: float) -> Shape:
    """A box of two webs between flanges that stand out."""
    across, up, inside = between + web, h - (top + bottom) / 2, h - top - bottom
    outstand = b - between - 2 * web
    if min(outstand, inside, top, bottom, web) <= 0:
        return NONE
    J = 4 * (across * up) ** 2 / (across * (1 / top + 1 / bottom) + 2 * up / web) + _open(
        (outstand, top), (outstand, bottom)
    )
    webs = [(web, inside, s * across / 2, bottom + inside / 2) for s in (-1, 1)]
    along = 2 * web * inside, SOLID * b * (top + bottom)
    return _strips(J, along, (b, bottom, 0, bottom / 2), (b, top, 0, h - top / 2), *webs)


def _fcross(h: float, b: float, tv: float, th: float, bv: float, tfv: float, bh: float, tfh: float) -> Shape:
    """A cross whose four ends have flanges: of the upright web `bv` wide, of the lying one `bh` high."""
    upright, lying = h - 2 * tfv, (b - tv - 2 * tfh) / 2
    if min(upright, lying) <= 0:
        return NONE
    J = _open((h - tfv, tv), (b - tfh, th), (bv, tfv), (bv, tfv), (bh, tfh), (bh, tfh))
    along = (tv * upright + SOLID * 2 * bh * tfh, th * 2 * lying + SOLID * 2 * bv * tfv)
    parts = [(tv, upright, 0, 0)]
    for s in (-1, 1):
        parts += [
            (bv, tfv, 0, s * (h - tfv) / 2),
            (tfh, bh, s * (b - tfh) / 2, 0),
            (lying, th, s * (tv + lying) / 2, 0),
        ]
    return _strips(J, along, *parts)


SHAPES: dict[str, tuple[int, Callable[..., Shape]]] = {
    "ROD": (1, lambda r: _ring(r, 0.0, ROUND)),
    "TUBE": (2, _ring),
    "TUBE2": (2, lambda r, t: _ring(r, r - t)),
    "BAR": (2, _bar),
    "BOX": (4, lambda b, h, t1, t2: _box1(b, h, t1, t1, t2, t2)),
    "BOX1": (6, _box1),
    "I": (6, _i),
    "I1": (4, _i1),
    "T": (4, _t),
    "T1": (4, lambda h, b, tf, tw: _turned(_t(h, b + tf, tf, tw))),
    "T2": (4, _t),
    "L": (4, _l),
    "CHAN": (4, _chan),
    "CHAN1": (4, _chan1),
    "CHAN2": (4, _chan2),
    "CROSS": (4, _cross),
    "H": (4, _h),
    "HAT": (4, _hat),
    "HAT1": (5, _hat1),
    "HEXA": (3, _hexa),
    "Z": (4, _z),
    "DBOX": (10, _dbox),
    "GBOX": (6, _gbox),
    "FCROSS": (8, _fcross),
}
