"""Beam sections of Abaqus by their sizes, in units of the deck."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Profile:
    """A section in the local axes 1 and 2.

    Attributes
    ----------
    I11, I22, I12 : float
        ``int x2^2``, ``int x1^2`` and ``int x1 x2`` about the centroid.
    centroid : (float, float)
        From the node.
    size : (float, float)
        Extent along 1 and 2.
    points : tuple of (float, float)
        Outer fibres from the centroid.

    Examples
    --------
    >>> round(rectangle(2.0, 1.0).I22, 6), round(rectangle(2.0, 1.0).J, 4)
    (0.666667, 0.4574)
    """

    A: float
    I11: float
    I22: float
    I12: float
    J: float
    k: float
    centroid: tuple[float, float] = (0.0, 0.0)
    size: tuple[float, float] = (0.0, 0.0)
    points: tuple[tuple[float, float], ...] = ()

    @property
    def principal(self) -> tuple[float, float, float]:
        """Principal moments, the major about the first axis, and the angle from axis 1 to it, rad."""
        if abs(self.I12) <= 1e-12 * (self.I11 + self.I22):
            return self.I11, self.I22, 0.0
        mean = (self.I11 + self.I22) / 2
        half = (self.I11 - self.I22) / 2
        radius = math.hypot(half, self.I12)
        return mean + radius, mean - radius, 0.5 * math.atan2(-self.I12, half)


def _strips(J: float, k: float, *rectangles: tuple[float, float, float, float]) -> Profile:
    """Return the section of rectangles (width along 1, height along 2, centre 1, centre 2); width < 0 cuts out."""
    b, h, x, y = np.array(rectangles).T
    area = b * h
    A = area.sum()
    c1, c2 = area @ x / A, area @ y / A
    left = (x - abs(b) / 2).min()
    right = (x + abs(b) / 2).max()
    low = (y - h / 2).min()
    high = (y + h / 2).max()
    I11 = (area * (h**2 / 12 + (y - c2) ** 2)).sum()
    I22 = (area * (b**2 / 12 + (x - c1) ** 2)).sum()
    corners = tuple((float(p - c1), float(q - c2)) for p in (right, left) for q in (high, low))
    return Profile(
        A=float(A),
        I11=float(I11),
        I22=float(I22),
        I12=float(area @ ((x - c1) * (y - c2))),
        J=J,
        k=k,
        centroid=(float(c1), float(c2)),
        size=(float(right - left), float(high - low)),
        points=corners,
    )


def _open(*walls: tuple[float, float]) -> float:
    """Torsion constant of thin open walls (length, thickness)."""
    return sum(length * thickness**3 for length, thickness in walls) / 3


def rectangle(a: float, b: float) -> Profile:
    """Torsion by Saint-Venant's series (Timoshenko and Goodier, section 109)."""
    long = max(a, b)
    short = min(a, b)
    series = sum(math.tanh(n * math.pi * long / (2 * short)) / n**5 for n in range(1, 40, 2))
    return _strips(long * short**3 / 3 * (1 - 192 * short / (math.pi**5 * long) * series), 0.85, (a, b, 0, 0))


def _ellipse(a: float, b: float) -> Profile:
    """Diameters a along 1 and b along 2; torsion after Saint-Venant (Timoshenko and Goodier, section 107)."""
    A = math.pi * a * b / 4
    J = math.pi * a**3 * b**3 / (16 * (a**2 + b**2))
    points = ((a / 2, 0.0), (0.0, b / 2), (-a / 2, 0.0), (0.0, -b / 2))
    return Profile(A, A * b**2 / 16, A * a**2 / 16, 0.0, J, 0.89, size=(a, b), points=points)


def _u1(A: float, I11: float, I12: float, I22: float, k: float) -> Profile:
    """Of CalculiX' element U1: I11 of bending along axis 1, and the polar moment as torsion constant."""
    return Profile(A, I22, I11, I12, I11 + I22, k)


def _ring(outer: float, inner: float, k: float) -> Profile:
    second = math.pi * (outer**4 - inner**4) / 4
    points = ((outer, 0.0), (0.0, outer), (-outer, 0.0), (0.0, -outer))
    size = (2 * outer, 2 * outer)
    return Profile(math.pi * (outer**2 - inner**2), second, second, 0.0, 2 * second, k, size=size, points=points)


def _box(a: float, b: float, t1: float, t2: float, t3: float, t4: float) -> Profile:
    """Walls t1 at +1, t2 at +2, t3 at -1, t4 at -2; torsion by Bredt's formula."""
    w, h = a - (t1 + t3) / 2, b - (t2 + t4) / 2
    J = 4 * (w * h) ** 2 / (h / t1 + w / t2 + h / t3 + w / t4)
    inner = (-(a - t1 - t3), b - t2 - t4, (t3 - t1) / 2, (t4 - t2) / 2)
    if inner[0] >= 0 or inner[1] <= 0:
        return Profile(0.0, 0.0, 0.0, 0.0, 0.0, 0.44)
    return _strips(J, 0.44, (a, b, 0, 0), inner)


def _i(height: float, h: float, b1: float, b2: float, t1: float, t2: float, t3: float) -> Profile:
    """Flange b1 x t1 below, b2 x t2 above, web t3; the node is at a height above the bottom."""
    J = _open((b1, t1), (b2, t2), (h - (t1 + t2) / 2, t3))
    web = h - t1 - t2
    walls = [(b1, t1, 0, t1 / 2 - height), (b2, t2, 0, h - t2 / 2 - height), (t3, web, 0, t1 + web / 2 - height)]
    return _strips(J, 0.44, *(wall for wall in walls if wall[0] and wall[1]))


def _t(b: float, h: float, height: float, tf: float, tw: float) -> Profile:
    """Flange b x tf above, web tw; the node is at a height above the bottom."""
    J = _open((b, tf), (h - tf / 2, tw))
    return _strips(J, 0.44, (b, tf, 0, h - tf / 2 - height), (tw, h - tf, 0, (h - tf) / 2 - height))


def _l(a: float, b: float, t1: float, t2: float) -> Profile:
    """Leg a x t1 along 1, leg b x t2 along 2; the node is where their middles meet."""
    J = _open((a - t2 / 2, t1), (b - t1 / 2, t2))
    return _strips(J, 1.0, (a, t1, (a - t2) / 2, 0), (t2, b - t1, 0, b / 2))


def _trapezoid(a: float, b: float, c: float, d: float) -> Profile:
    """Width a below, c above, height b; the node is d above the bottom. Torsion after Saint-Venant, A^4 / (40 Ip)."""
    A = (a + c) / 2 * b
    centre = b * (a + 2 * c) / (3 * (a + c))
    I11 = b**3 * (a**2 + 4 * a * c + c**2) / (36 * (a + c))
    I22 = b * (a + c) * (a**2 + c**2) / 48
    points = tuple((s * w / 2, y - centre) for w, y in ((a, 0.0), (c, b)) for s in (1, -1))
    J = A**4 / (40 * (I11 + I22))
    return Profile(A, I11, I22, 0.0, J, 0.822, (0.0, centre - d), (max(a, c), b), points)


def _arbitrary(*values: float) -> Profile:
    """Thin straight walls one after the other: their number, x y of the first two points, t, then x y t of each."""
    n = round(values[0])
    start = values[1:3]
    rest = values[3 : 3 + 3 * n]
    if len(rest) < 3 * n or n < 1:
        return Profile(0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    points = np.array([start, *((rest[3 * i], rest[3 * i + 1]) for i in range(n))])
    t = np.array(rest[2::3])
    d = np.diff(points, axis=0)
    length = np.linalg.norm(d, axis=1)
    area = length * t
    middle = (points[1:] + points[:-1]) / 2
    A = area.sum()
    if not A > 0:
        return Profile(0.0, 0.0, 0.0, 0.0, 0.0, 1.0)
    centre = area @ middle / A
    r = middle - centre
    second = np.einsum("k,ka,kb->ab", area, r, r) + np.einsum("k,ka,kb->ab", area, d, d) / 12
    J = _open(*zip(length, t, strict=True))
    if np.allclose(points[0], points[-1]):
        p = points[:-1]
        q = points[1:]
        enclosed = abs((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum()) / 2
        J = 4 * enclosed**2 / (length / t).sum()
    fibres = tuple((float(x), float(y)) for x, y in points - centre)
    size = np.ptp(points, axis=0)
    return Profile(
        float(A),
        float(second[1, 1]),
        float(second[0, 0]),
        float(second[0, 1]),
        float(J),
        1.0,
        (float(centre[0]), float(centre[1])),
        (float(size[0]), float(size[1])),
        fibres,
    )


# Shear factors k: Abaqus Analysis User's Guide, Choosing a beam element, transverse shear stiffness.
SHAPES: dict[str, tuple[int, Callable[..., Profile]]] = {
    "RECT": (2, rectangle),
    "CIRC": (1, lambda r: _ring(r, 0.0, 0.89)),
    "PIPE": (2, lambda r, t: _ring(r, r - t, 0.53)),
    "THICK PIPE": (2, lambda r, t: _ring(r, r - t, 0.89)),
    "BOX": (6, _box),
    "I": (7, _i),
    "T": (5, _t),
    "L": (4, _l),
    "TRAPEZOID": (4, _trapezoid),
    "ARBITRARY": (0, _arbitrary),
}
CALCULIX: dict[str, tuple[int, Callable[..., Profile]]] = {"CIRC": (2, _ellipse), "GENERAL": (5, _u1)}
