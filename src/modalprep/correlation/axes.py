"""Axes of measured components: coordinate systems of a universal file, and a frame turned against the model's."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.readers.systems import System

KINDS = {0: "R", 1: "C"}  # Cartesian, cylindrical
GLOBAL = (0, 1)  # numbers that mean the frame of the file where it defines no system of this number
SQUARE = 1e-4  # largest deviation of axes from a rotation: files have five digits at least
WORD = re.compile(r"([+-]?)([xyz])")


def node_systems(path: Path, sets: list[dict[str, Any]], length: float) -> dict[int, System]:
    """Return the coordinate systems of datasets 2420 by their number; rows 1 to 3 are the axes, row 4 is the origin.

    Raises
    ------
    InputError
        When axes are not perpendicular, or the system is spherical, for which programs order the angles differently.
    """
    found = {}
    for data in sets:
        for label, kind, matrix in zip(data["CS_sys_labels"], data["CS_types"], data["CS_matrices"], strict=True):
            axes = np.asarray(matrix, dtype=float)[:3]
            origin = np.asarray(matrix, dtype=float)[3]
            if np.abs(axes @ axes.T - np.eye(3)).max() > SQUARE or np.linalg.det(axes) < 0:
                raise InputError(f"{path}: coordinate system {label} (dataset 2420) is no rotation; export it again")
            found[int(label)] = System(KINDS.get(int(kind), "S"), length * origin, axes)
    return found


def placed(path: Path, nodes: dict[str, Any], systems: dict[int, System], length: float) -> np.ndarray:
    """Return the nodes (p, 3) in the frame of the file, m; dataset 15 may give them in a system of their own."""
    points = length * np.stack([np.asarray(nodes[axis], dtype=float) for axis in "xyz"], axis=1)
    if nodes["type"] != 15 or not systems:
        return points
    numbers = np.asarray(nodes["def_cs"]).astype(int)
    for number in set(numbers.tolist()) & set(systems):
        own = numbers == number
        given = points[own]
        if systems[number].kind != "R":
            raise InputError(
                f"{path}: nodes are placed in the cylindrical or spherical system {number}; export x, y, z"
            )
        points[own] = systems[number].to_basic(given)
    return points


def component_axes(path: Path, nodes: dict[str, Any], systems: dict[int, System], points: np.ndarray):
    """Return the directions (p, 3, 3) of the components of each node by rows, or None where all are those of the frame.

    Raises
    ------
    InputError
        When a node names a system that the file does not define, or a spherical one.
    """
    numbers = np.asarray(nodes["disp_cs"]).astype(int)
    if not any(number in systems or number not in GLOBAL for number in numbers.tolist()):
        return None
    axes = np.tile(np.eye(3), (len(points), 1, 1))
    for k, number in enumerate(numbers.tolist()):
        if number in systems:
            if systems[number].kind == "S":
                raise InputError(
                    f"{path}: the components of node {_label(nodes, k)} are those of the spherical system {number}, "
                    "whose order programs do not agree on; export them in Cartesian or cylindrical axes"
                )
            axes[k] = systems[number].axes_at(points[k])
        elif number not in GLOBAL:
            raise InputError(
                f"{path}: the components of node {_label(nodes, k)} are those of coordinate system {number}, which the "
                "file does not define (dataset 2420); export the systems too, or the shapes in global axes"
            )
    return axes


def _label(nodes: dict[str, Any], k: int) -> int:
    return int(np.asarray(nodes["node_nums"])[k])


def turned_axes(text: str) -> np.ndarray:
    """Return the rotation (3, 3) whose rows are axes x, y, z of a body in the axes of a test, from their names.

    Raises
    ------
    InputError
        When the text is not three different axes, or they are left-handed.

    Examples
    --------
    >>> turned_axes("y,-x,z")
    array([[ 0.,  1.,  0.],
           [-1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    words = [word for part in text.split(",") if (word := WORD.fullmatch(part.strip()))]
    if text.count(",") != 2 or len({word[2] for word in words}) != 3:
        raise InputError(f"axes {text!r} are not three of x, y, z with signs, such as y,-x,z")
    R = np.zeros((3, 3))
    for row, word in enumerate(words):
        R[row, "xyz".index(word[2])] = -1.0 if word[1] == "-" else 1.0
    if np.linalg.det(R) < 0:
        raise InputError(f"axes {text!r} are left-handed; change the sign of one of them")
    return R
