"""Collada files (.dae): the triangles of their scene."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path

import numpy as np

KINDS = ("triangles", "polylist", "polygons")
Surface = tuple[np.ndarray, np.ndarray]  # points (n, 3), triangles (m, 3)


def read_collada(path: Path) -> list[Surface]:
    """Return the surfaces of the scene, in m where the file says its unit, in its own axes whatever its `up_axis`.

    References
    ----------
    Khronos Group, COLLADA 1.4.1 specification: geometry, mesh, node, asset.
    """
    root = ET.parse(path).getroot()
    for element in root.iter():
        element.tag = element.tag.rpartition("}")[2]
    unit = root.find("asset/unit")
    scale = 1.0 if unit is None else float(unit.get("meter", "1"))
    geometries = {each.get("id", ""): list(_parts(each)) for each in root.iterfind("library_geometries/geometry")}
    found = []
    for node in root.iterfind("library_visual_scenes/visual_scene/node"):
        for T, name in _placed(node, np.eye(4)):
            found += [(scale * (p @ T[:3, :3].T + T[:3, 3]), corners) for p, corners in geometries.get(name, [])]
    return found


def _parts(geometry: ET.Element) -> Iterator[Surface]:
    """Yield the surfaces of a geometry in its own axes."""
    mesh = geometry.find("mesh")
    for part in [] if mesh is None else [each for each in mesh if each.tag in KINDS]:
        inputs = {each.get("semantic"): each for each in part.findall("input")}
        width = max(int(each.get("offset", "0")) for each in inputs.values()) + 1
        vertex = inputs["VERTEX"]
        points = _points(mesh, vertex.get("source", "")) if mesh is not None else np.zeros((0, 3))
        words = [np.array((p.text or "").split(), dtype=int) for p in part.findall("p")]
        corners = [each.reshape(-1, width)[:, int(vertex.get("offset", "0"))] for each in words]
        yield points, np.array([three for each in _polygons(part, corners) for three in _fan(each)]).reshape(-1, 3)


def _points(mesh: ET.Element, vertices: str) -> np.ndarray:
    named = {each.get("id"): each for each in mesh.iter() if each.get("id")}
    position = next(each for each in named[vertices[1:]].findall("input") if each.get("semantic") == "POSITION")
    numbers = named[position.get("source", "")[1:]].findtext("float_array", "")
    return np.array(numbers.split(), dtype=float).reshape(-1, 3)


def _polygons(part: ET.Element, corners: list[np.ndarray]) -> Iterator[np.ndarray]:
    """Yield the corners of each polygon."""
    if part.tag == "polygons":
        yield from corners
        return
    for each in corners:
        counts = part.findtext("vcount")
        sizes = np.full(len(each) // 3, 3) if part.tag == "triangles" else np.array((counts or "").split(), dtype=int)
        yield from np.split(each, np.cumsum(sizes)[:-1])


def _fan(corners: np.ndarray) -> Iterator[tuple[int, int, int]]:
    for second, third in pairwise(corners[1:]):
        yield corners[0], second, third


def _placed(node: ET.Element, T: np.ndarray) -> Iterator[tuple[np.ndarray, str]]:
    """Yield the geometries of a node and of those below it, with their places (4, 4)."""
    for step in node:
        T = T @ _step(step)
    for instance in node.findall("instance_geometry"):
        yield T, instance.get("url", "")[1:]
    for below in node.findall("node"):
        yield from _placed(below, T)


def _step(element: ET.Element) -> np.ndarray:
    from scipy.spatial.transform import Rotation

    T = np.eye(4)
    numbers = np.array((element.text or "").split(), dtype=float) if element.tag in STEPS else np.zeros(0)
    if element.tag == "matrix":
        T = numbers.reshape(4, 4)
    elif element.tag == "translate":
        T[:3, 3] = numbers
    elif element.tag == "scale":
        T[:3, :3] = np.diag(numbers)
    elif element.tag == "rotate":
        axis = numbers[:3] / np.linalg.norm(numbers[:3])
        T[:3, :3] = Rotation.from_rotvec(np.deg2rad(numbers[3]) * axis).as_matrix()
    return T


STEPS = ("matrix", "translate", "scale", "rotate")
