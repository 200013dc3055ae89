"""Sections of Nastran bars and beams from moments or dimensions (deck units)."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.materials import Conversion


@dataclass(frozen=True, kw_only=True)
class Section:
    """A bar's section in deck units: y towards the orientation vector (plane 1), z = x cross y.

    Examples
    --------
    >>> Section(A=2.0, I1=8 / 12, I2=2 / 12, I12=0.0, J=0.0).turned
    (0.6666666666666666, 0.16666666666666666, 0.0)
    """

    A: float
    I1: float
    I2: float
    I12: float
    J: float
    nsm: float = 0.0
    k1: float = 0.0
    k2: float = 0.0
    points: tuple[tuple[float, float], ...] = ()

    @property
    def turned(self) -> tuple[float, float, float]:
        """Principal moments and the angle of the first axis from y towards z, rad."""
        if not self.I12:
            return self.I1, self.I2, 0.0
        angle = 0.5 * math.atan2(2 * self.I12, self.I1 - self.I2)
        mean, radius = (self.I1 + self.I2) / 2, math.hypot((self.I1 - self.I2) / 2, self.I12)
        return mean + radius, mean - radius, angle

    @property
    def fibres(self) -> tuple[tuple[float, float], ...]:
        """Points of stress recovery along e2 and e3 of `Beam`: e3 is the first principal axis, e2 goes against z.

        Examples
        --------
        >>> Section(A=2.0, I1=8 / 12, I2=2 / 12, I12=0.0, J=0.0, points=((1.0, 0.5),)).fibres
        ((-0.5, 1.0),)
        """
        c, s = math.cos(self.turned[2]), math.sin(self.turned[2])
        return tuple((s * y - c * z, c * y + s * z) for y, z in self.points)


def _points(card: Card) -> tuple[tuple[float, float], ...]:
    """C1, C2 to F1, F2 in the second row, without those that are blank or zero."""
    values = [card.real(8 + k, f"{name}{i}", 0.0) for k, (name, i) in enumerate((n, i) for n in "CDEF" for i in (1, 2))]
    return tuple((y, z) for y, z in zip(values[::2], values[1::2], strict=True) if y or z)


def pbar(conversion: Conversion, card: Card) -> Section:
    """PBAR: blank K1, K2 are rigid in shear."""
    A, I1, I2, J, nsm = (card.real(k, name, 0.0) for k, name in enumerate(("A", "I1", "I2", "J", "NSM"), 2))
    k1, k2, I12 = (card.real(k, name, 0.0) for k, name in enumerate(("K1", "K2", "I12"), 16))
    return Section(A=A, I1=I1, I2=I2, I12=I12, J=J, nsm=nsm, k1=k1, k2=k2, points=_points(card))


def pbeam(conversion: Conversion, card: Card) -> Section:
    """PBEAM: the section at end A; K1, K2 default to 1."""
    A, I1, I2, I12, J, nsm = (card.real(k, name, 0.0) for k, name in enumerate(("A", "I1", "I2", "I12", "J", "NSM"), 2))
    row, ends, known = 1, ("YES", "YESA", "NO"), (A, I1, I2, I12, J)
    points = () if card.row(1)[0] in ends else _points(card)  # of end A
    row += card.row(1)[0] not in ends
    while card.row(row)[0] in ends:
        there = [card.real(8 * row + k, "a station's value", value) for k, value in enumerate(known, 2)]
        if not np.allclose(there, known, rtol=1e-3):
            conversion.note("tapered PBEAM: the section at end A holds along the whole element")
        row += 2 if card.row(row)[0] == "YES" else 1
    k1, k2 = (card.real(8 * row + k, name, 1.0) for k, name in enumerate(("K1", "K2")))
    if any(card.real(8 * (row + 1) + k, "N1, N2 or M1, M2", 0.0) for k in range(8)) or any(
        card.real(8 * row + k, "S1 to CW", 0.0) for k in range(2, 8)
    ):
        conversion.note("PBEAM: shear relief, warping, and offsets of neutral axis and nsm are left out")
    return Section(A=A, I1=I1, I2=I2, I12=I12, J=J, nsm=nsm, k1=k1, k2=k2, points=points)


def _strips(J: float, *rectangles: tuple[float, float, float, float]) -> tuple[float, ...]:
    """Return A, I1, I2, I12, J of rectangles (width along z, height along y, centre z, centre y); width < 0 cuts."""
    b, h, z, y = np.array(rectangles).T
    area = b * h
    A = area.sum()
    z, y = z - area @ z / A, y - area @ y / A
    own = area * h**2 / 12, area * np.abs(b) ** 2 / 12
    I1, I2, I12 = (own[0] + area * y**2).sum(), (own[1] + area * z**2).sum(), area @ (y * z)
    return float(A), float(I1), float(I2), float(I12) if abs(I12) > 1e-12 * (I1 + I2) else 0.0, J


def _open(*walls: tuple[float, float]) -> float:
    """Torsion constant of thin open walls (length, thickness)."""
    return sum(length * thickness**3 for length, thickness in walls) / 3


def _ring(outer: float, inner: float) -> tuple[float, ...]:
    second = math.pi * (outer**4 - inner**4) / 4
    return math.pi * (outer**2 - inner**2), second, second, 0.0, 2 * second


def _bar(b: float, h: float) -> tuple[float, ...]:
    s, t = max(b, h), min(b, h)
    return _strips(s * t**3 * (1 / 3 - 0.21 * t / s * (1 - t**4 / (12 * s**4))), (b, h, 0, 0))  # Roark, table 10.7


def _box(b: float, h: float, t1: float, t2: float) -> tuple[float, ...]:
    """Walls t1 above and below, t2 at the sides; torsion after Bredt."""
    J = 2 * t1 * t2 * (b - t2) ** 2 * (h - t1) ** 2 / ((b - t2) * t2 + (h - t1) * t1)
    return _strips(J, (b, h, 0, 0), (-(b - 2 * t2), h - 2 * t1, 0, 0))


def _i(h: float, b1: float, b2: float, tw: float, t1: float, t2: float) -> tuple[float, ...]:
    J = _open((b1, t1), (b2, t2), (h - (t1 + t2) / 2, tw))
    return _strips(J, (b1, t1, 0, t1 / 2), (b2, t2, 0, h - t2 / 2), (tw, h - t1 - t2, 0, (h + t1 - t2) / 2))


def _i1(outstands: float, tw: float, inside: float, h: float) -> tuple[float, ...]:
    return _i(h, outstands + tw, outstands + tw, tw, (h - inside) / 2, (h - inside) / 2)


def _t(b: float, h: float, tf: float, tw: float) -> tuple[float, ...]:
    return _strips(_open((b, tf), (h - tf / 2, tw)), (b, tf, 0, h - tf / 2), (tw, h - tf, 0, (h - tf) / 2))


def _l(b: float, h: float, t1: float, t2: float) -> tuple[float, ...]:
    """Lower leg of thickness t1 towards +z, upright leg of thickness t2."""
    J = _open((b - t2 / 2, t1), (h - t1 / 2, t2))
    return _strips(J, (b, t1, b / 2, t1 / 2), (t2, h - t1, t2 / 2, (h + t1) / 2))


def _chan(b: float, h: float, tw: float, tf: float) -> tuple[float, ...]:
    J = _open((b - tw / 2, tf), (b - tw / 2, tf), (h - tf, tw))
    flange = (b, tf, b / 2)
    return _strips(J, (*flange, tf / 2), (*flange, h - tf / 2), (tw, h - 2 * tf, tw / 2, h / 2))


def _h(inside: float, legs: float, h: float, tw: float) -> tuple[float, ...]:
    leg, z = legs / 2, (inside + legs / 2) / 2
    J = _open((h, leg), (h, leg), (inside + leg, tw))
    return _strips(J, (leg, h, -z, 0), (leg, h, z, 0), (inside, tw, 0, 0))


SHAPES: dict[str, tuple[int, Callable[..., tuple[float, ...]]]] = {
    "ROD": (1, lambda r: _ring(r, 0.0)),
    "TUBE": (2, _ring),
    "TUBE2": (2, lambda r, t: _ring(r, r - t)),
    "BAR": (2, _bar),
    "BOX": (4, _box),
    "I": (6, _i),
    "I1": (4, _i1),
    "T": (4, _t),
    "L": (4, _l),
    "CHAN": (4, _chan),
    "H": (4, _h),
}


def shape(conversion: Conversion, card: Card) -> Section:
    """PBARL and PBEAML: a section by its dimensions; PBARL is rigid in shear, PBEAML has K1 = K2 = 1."""
    kind = card.text(3)
    if kind not in SHAPES:
        raise card.error(f"section {kind!r} is not known ({', '.join(SHAPES)}); use PBAR with its area and moments")
    count, law = SHAPES[kind]
    values = law(*(card.real(8 + k, f"DIM{k + 1}") for k in range(count)))
    if card.name == "PBEAML" and kind in ("T", "L", "CHAN", "I"):
        conversion.note(f"PBEAML {kind}: the centroid lies on the element's axis, not the shear centre as in Nastran")
    shear = "K1 = K2 = 1" if card.name == "PBEAML" else "no shear flexibility"
    conversion.note(
        f"{card.name}: sections by their shape have {shear} here, where Nastran may take factors of the shape; "
        f"give {card.name[:-1]} with K1 and K2 where shear matters"
    )
    A, I1, I2, I12, J = values
    # A beam without K1, K2 in Nastran takes 1; for PBARL we keep PBAR's default, no shear flexibility.
    k = 1.0 if card.name == "PBEAML" else 0.0
    return Section(A=A, I1=I1, I2=I2, I12=I12, J=J, nsm=card.real(8 + count, "NSM", 0.0), k1=k, k2=k)


SECTIONS = {"PBAR": pbar, "PBEAM": pbeam, "PBARL": shape, "PBEAML": shape}
