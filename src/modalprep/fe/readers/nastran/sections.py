"""Sections of Nastran bars and beams from moments or dimensions (deck units)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.materials import Conversion
from modalprep.fe.readers.nastran.shapes import SHAPES, Shape
from modalprep.fe.readers.nastran.shear_centres import WALLS, centroid_from_shear_centre


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
    neutral: tuple[float, float] = (0.0, 0.0)  # y, z from the shear centre, on the element's axis, to the centroid
    stations: tuple[tuple[float, ...], ...] = ()  # of a taper: position, A, I1, I2, J, nsm

    @property
    def turned(self) -> tuple[float, float, float]:
        """Principal moments and the angle of the first axis from y towards z, rad."""
        if not self.I12:
            return self.I1, self.I2, 0.0
        angle = 0.5 * math.atan2(2 * self.I12, self.I1 - self.I2)
        mean = (self.I1 + self.I2) / 2
        radius = math.hypot((self.I1 - self.I2) / 2, self.I12)
        return mean + radius, mean - radius, angle

    @property
    def fibres(self) -> tuple[tuple[float, float], ...]:
        """Points of stress recovery along e2 and e3 of `Beam`: e3 is the first principal axis, e2 goes against z.

        Examples
        --------
        >>> Section(A=2.0, I1=8 / 12, I2=2 / 12, I12=0.0, J=0.0, points=((1.0, 0.5),)).fibres
        ((-0.5, 1.0),)
        """
        return tuple(self.ours(y - self.neutral[0], z - self.neutral[1]) for y, z in self.points)

    def ours(self, y: float, z: float) -> tuple[float, float]:
        """Return a position in the section along e2 and e3 of `Beam`."""
        c = math.cos(self.turned[2])
        s = math.sin(self.turned[2])
        return s * y - c * z, c * y + s * z


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
    """PBEAM: the sections along the beam; K1, K2 default to 1."""
    ends = ("YES", "YESA", "NO")
    first = _station(card, 2, (0.0,) * 6)
    row = 1 + (card.row(1)[0] not in ends)
    points = () if row == 1 else _points(card)  # of end A
    stations = {0.0: first}
    while card.row(row)[0] in ends:
        at = card.real(8 * row + 1, "X/XB", 1.0)
        if not 0 <= at <= 1:
            raise card.error(f"X/XB = {at:g} is not between 0 and 1; give the fraction of the length")
        if at == 1 or any(card.row(row)[2:]):  # a station without values lies on the line between the ends
            stations[at] = _station(card, 8 * row + 2, first)
        row += 2 if card.row(row)[0] == "YES" else 1
    k1, k2 = (card.real(8 * row + k, name, 1.0) for k, name in enumerate(("K1", "K2")))
    if any(card.real(8 * (row + 1) + k, "M1 or M2", 0.0) for k in range(4)) or any(
        card.real(8 * row + k, "S1 to CW", 0.0) for k in range(2, 8)
    ):
        conversion.note("PBEAM: shear relief, warping, and the offset and inertia of nsm are left out")
    N1, N2 = (card.real(8 * (row + 1) + k, name, 0.0) for k, name in ((4, "N1(A)"), (5, "N2(A)")))
    if (N1, N2) != tuple(card.real(8 * (row + 1) + k, "N1, N2(B)", value) for k, value in ((6, N1), (7, N2))):
        conversion.note("PBEAM: N1 and N2 of end A hold along the whole beam")
    if any(card.fields[8 * (row + 2) :]):
        raise card.error("it has fields behind its last row, of N2(B); a row of stations begins with YES, YESA or NO")
    return Section(**_tapered(conversion, card, stations), k1=k1, k2=k2, points=points, neutral=(N1, N2))


def pbend(conversion: Conversion, card: Card) -> Section:
    """PBEND: A, I1 in the plane of the arc, I2, J; or mean radius RM and wall T of a pipe behind FSI."""
    if card.is_integer(2) and card.integer(2, "FSI") in (1, 2, 3):
        if card.integer(2, "FSI") > 1:
            conversion.note("PBEND: a pipe has the flexibility of its circular section, without that of its ovalling")
        radius, wall = card.real(3, "RM"), card.real(4, "T")
        found = SHAPES["TUBE"][1](radius + wall / 2, radius - wall / 2)
        return Section(A=found.A, I1=found.I1, I2=found.I2, I12=0.0, J=found.J, nsm=card.real(10, "NSM", 0.0))
    A, I1, I2, J = (card.real(k, name, 0.0) for k, name in enumerate(("A", "I1", "I2", "J"), 2))
    k1, k2, nsm = (card.real(k, name, 0.0) for k, name in enumerate(("K1", "K2", "NSM"), 16))
    if any(card.real(k, "RC, ZC or DELTAN", 0.0) for k in (19, 20, 21)):
        conversion.note("PBEND: the offsets RC, ZC and DELTAN of the arc are left out")
    return Section(A=A, I1=I1, I2=I2, I12=0.0, J=J, nsm=nsm, k1=k1, k2=k2, points=_points(card))


def _station(card: Card, k: int, default: tuple[float, ...]) -> tuple[float, ...]:
    """Return A, I1, I2, I12, J and nsm from field k on."""
    names = ("A", "I1", "I2", "I12", "J", "NSM")
    return tuple(card.real(k + i, name, default[i]) for i, name in enumerate(names))


def _tapered(conversion: Conversion, card: Card, stations: dict[float, tuple[float, ...]]) -> dict[str, Any]:
    """Return the values of `Section`: the mean of those between the stations, and these; the last holds to the end."""
    at = sorted(stations)
    values = np.array([stations[x] for x in at])
    if at[-1] < 1:
        at = [*at, 1.0]
        values = np.vstack([values, values[-1]])
    mean = np.sum(np.diff(at)[:, None] * (values[1:] + values[:-1]) / 2, axis=0)
    found: dict[str, Any] = dict(zip(("A", "I1", "I2", "I12", "J", "nsm"), mean.tolist(), strict=True))
    if np.allclose(values, mean, rtol=1e-6, atol=1e-12 * np.abs(mean).max()):
        return found
    if np.any(values[:, 3]):
        conversion.note(f"{card.name}: a tapered beam with I12 has the mean of its sections along the whole element")
        return found
    rows = values[:, [0, 1, 2, 4, 5]]
    return found | {"stations": tuple((x, *row) for x, row in zip(at, rows.tolist(), strict=True))}


def shape(conversion: Conversion, card: Card) -> Section:
    """PBARL and PBEAML: a section by its dimensions, with the shear factors of its shape."""
    kind = card.text(3)
    if kind not in SHAPES:
        raise card.error(f"section {kind!r} is not known ({', '.join(SHAPES)}); use PBAR with its area and moments")
    count = SHAPES[kind][0]
    found = _by_dimensions(card, kind, 8, [None] * count)
    nsm = card.real(8 + count, "NSM", 0.0)
    if kind != "ROD":
        conversion.note(
            f"{card.name} {kind}: torsion constant and shear factors are those of the textbook for this shape; "
            "Nastran's own may differ"
        )
    stations = {0.0: (*found[:5], nsm)}
    shear: dict[str, Any] = {"k1": found.k1, "k2": found.k2}
    if card.name == "PBEAML":
        shear["neutral"] = _from_shear_centre(kind, [card.real(8 + k, "DIM") for k in range(count)])
        if kind in WALLS:
            conversion.note(f"PBEAML {kind}: the shear centre, on the element's axis, is that of thin walls")
        stations = _stations(card, kind, count, stations[0.0])
        if any(shear["neutral"]) and any(found != stations[0.0] for found in stations.values()):
            conversion.note(f"PBEAML {kind}: a tapered beam has the shear centre of its end A along the whole element")
    return Section(**_tapered(conversion, card, stations | {1.0: stations.get(1.0, stations[0.0])}), **shear)


def _from_shear_centre(kind: str, sizes: list[float]) -> tuple[float, float]:
    """Return y and z of the centroid from the shear centre, which is where flange and web of a tee meet."""
    if kind in WALLS:
        y, z = centroid_from_shear_centre(*WALLS[kind](*sizes)).tolist()
        return y, z
    if kind == "I":
        return _above_shear_centre_of_i(*sizes), 0.0
    if kind == "T1":
        h, b, tf, tw = sizes
        return 0.0, _above_flange(h, b + tf, tf, tw)
    if kind in ("T", "T2"):
        return _above_flange(*sizes) * (1 if kind == "T" else -1), 0.0
    return 0.0, 0.0


def _above_shear_centre_of_i(h: float, b1: float, b2: float, tw: float, t1: float, t2: float) -> float:
    parts = ((b1 * t1, t1 / 2), (b2 * t2, h - t2 / 2), (tw * (h - t1 - t2), (h + t1 - t2) / 2))
    share = t2 * b2**3
    return _mean(parts) - t1 / 2 - (h - (t1 + t2) / 2) * share / (share + t1 * b1**3)


def _above_flange(b: float, h: float, tf: float, tw: float) -> float:
    """Return the centroid of a tee from the middle of its flange, which is above."""
    return _mean(((b * tf, h - tf / 2), (tw * (h - tf), (h - tf) / 2))) - (h - tf / 2)


def _mean(parts: Sequence[tuple[float, float]]) -> float:
    """Return the centroid of areas at heights."""
    return sum(area * at for area, at in parts) / sum(area for area, _ in parts)


def _by_dimensions(card: Card, kind: str, first: int, default: Sequence[float | None]) -> Shape:
    sizes = [card.real(first + k, f"DIM{k + 1}", value) for k, value in enumerate(default)]
    found = SHAPES[kind][1](*sizes)
    if min(sizes) < 0 or not all(value > 0 for value in (found.A, found.I1, found.I2, found.J, found.k1, found.k2)):
        raise card.error(f"the dimensions {', '.join(f'{size:g}' for size in sizes)} make no {kind}; correct them")
    return found


def _stations(card: Card, kind: str, count: int, first: tuple[float, ...]) -> dict[float, tuple[float, ...]]:
    """Return the sections of PBEAML along the beam: behind those of end A, each SO, X/XB, dimensions and nsm."""
    stations = {0.0: first}
    k = 9 + count
    sizes = [card.real(8 + i, "DIM") for i in range(count)]
    while card.text(k) or card.text(k + 1) or any(card.fields[k + 2 : k + 3 + count]):
        at = card.real(k + 1, "X/XB", 1.0)
        if not 0 <= at <= 1:
            raise card.error(f"X/XB = {at:g} is not between 0 and 1; give the fraction of the length")
        there = _by_dimensions(card, kind, k + 2, sizes)
        stations[at] = (*there[:5], card.real(k + 2 + count, "NSM", first[5]))
        k += 3 + count
    return stations


SECTIONS = {"PBAR": pbar, "PBEAM": pbeam, "PBARL": shape, "PBEAML": shape, "PBEND": pbend}
