"""Mass, centre and inertia of a body of an MJCF file: as it says, or of its shapes."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterable

import numpy as np

from modalprep.errors import InputError
from modalprep.formats.robots.mjcf_file import MjcfFile
from modalprep.formats.robots.tree import Link
from modalprep.formats.robots.xml import number, numbers, some
from modalprep.vectors import inertia_tensor, skew

DENSITY = 1000.0  # kg/m^3, of shapes without another
MASSLESS = ("plane", "hfield")
SIZES = {"sphere": 1, "capsule": 2, "cylinder": 2, "ellipsoid": 3, "box": 3}
ALONG = ("capsule", "cylinder", "box", "ellipsoid")  # shapes that `fromto` may place


def body_mass(file: MjcfFile, body: ET.Element, shapes: Iterable[tuple[ET.Element, np.ndarray, np.ndarray]]) -> Link:
    """Return the mass of a body without its pictures; `shapes` are its geoms, completed, with places of their frames.

    Raises
    ------
    InputError
        When its mass would be that of a mesh, or of a shape that is not one.
    """
    inertial = body.find("inertial")
    rule = file.settings.get("inertiafromgeom", "auto")
    if inertial is not None and rule != "true":
        return _given(file, inertial)
    if rule == "false":
        return Link()
    low, high = some_range(file)
    parts = [_part(file, *each) for each in shapes if low <= number(each[0], "group", 0.0) <= high]
    mass = sum(part.mass for part in parts)
    if mass == 0:
        return Link()
    centre = sum((part.mass * part.centre for part in parts), np.zeros(3)) / mass
    steiner = [part.inertia - part.mass * skew(part.centre - centre) @ skew(part.centre - centre) for part in parts]
    return Link(mass, centre, sum(steiner, np.zeros((3, 3))))


def some_range(file: MjcfFile) -> tuple[float, float]:
    """Return the groups of shapes that have mass."""
    low, high = (float(word) for word in file.settings.get("inertiagrouprange", "0 5").split())
    return low, high


def _given(file: MjcfFile, inertial: ET.Element) -> Link:
    centre, turn = file.pose(inertial)
    key = "fullinertia" if inertial.get("fullinertia") else "diaginertia"
    J = inertia_tensor(numbers(inertial, key, 6 if key == "fullinertia" else 3).tolist())
    return Link(number(inertial, "mass", 0.0), centre, turn @ J @ turn.T)


def _part(file: MjcfFile, geom: ET.Element, position: np.ndarray, rotation: np.ndarray) -> Link:
    """Return mass, centre and inertia of a shape in the axes of its body; its frame has a place there."""
    kind = geom.get("type", "sphere")
    has_mass = number(geom, "mass", number(geom, "density", DENSITY)) > 0
    if kind in MASSLESS or not has_mass:
        return Link()
    if kind not in SIZES or geom.get("mesh") or geom.get("shellinertia") == "true":
        raise InputError(
            f"the mass of geom {geom.get('name') or geom.get('mesh')!r} is that of a {kind} (a mesh, a shell or "
            "another shape that is not integrated here); give its body an <inertial>, or write the compiled model by "
            "mujoco.mj_saveLastXML and take that"
        )
    size, (place, turn) = _size(geom, kind), file.pose(geom)
    if geom.get("fromto"):
        a, b = numbers(geom, "fromto", 6).reshape(2, 3)
        half = np.linalg.norm(b - a) / 2
        size = np.array([size[0], size[0], half]) if kind in ("box", "ellipsoid") else np.array([size[0], half])
        axis = ET.Element("geom", zaxis=" ".join(repr(float(x)) for x in (a - b)))
        place, turn = (a + b) / 2, file.rotation(axis)
    volume, moments = _shape(kind, size)
    mass = number(geom, "mass", number(geom, "density", DENSITY) * volume)
    turn = rotation @ turn
    return Link(mass, position + rotation @ place, mass * (turn @ np.diag(moments) @ turn.T))


def _size(geom: ET.Element, kind: str) -> np.ndarray:
    size = some(geom, "size")
    along = geom.get("fromto") is not None
    if along and kind not in ALONG:
        raise InputError(f"geom {geom.get('name')!r}: a {kind} has no fromto")
    needed = 1 if along else SIZES[kind]
    if len(size) < needed or not np.all(size[:needed] > 0):
        raise InputError(f"geom {geom.get('name')!r}: a {kind} needs {needed} positive numbers as its size")
    return size


def _shape(kind: str, size: np.ndarray) -> tuple[float, np.ndarray]:
    """Return volume and moments of inertia (3,) for unit mass of a shape along z."""
    if kind in ("box", "ellipsoid", "sphere"):
        a = size[:3] if len(size) >= 3 and kind != "sphere" else np.full(3, size[0])
        share = 3.0 if kind == "box" else 5.0
        volume = 8 * np.prod(a) if kind == "box" else 4 / 3 * np.pi * np.prod(a)
        return float(volume), (np.sum(a**2) - a**2) / share
    r, h = size[:2]
    rod = 2 * np.pi * r**2 * h
    across, along = (3 * r**2 + 4 * h**2) / 12, r**2 / 2
    if kind == "cylinder":
        return float(rod), np.array([across, across, along])
    ends = 4 / 3 * np.pi * r**3
    total = rod + ends
    across = (rod * across + ends * (0.4 * r**2 + h**2 + 0.75 * h * r)) / total
    along = (rod * along + ends * 0.4 * r**2) / total
    return float(total), np.array([across, across, along])
