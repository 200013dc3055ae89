"""Bars, panels and tubes with a stringer or a ring frame under their skin: one geometry in every element family.

The root is tied rigidly to the interface. At the other end the edge of the skin is free, or tied (rbe2, rbe3) to a node
that carries a mass. Solids are the reference: bricks with 20 nodes, whose frequencies are CalculiX' (test_solids.py).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from structured import HEX_EDGES, surface

import modalprep as mp

ALUMINIUM = mp.Material(E=7e10, nu=0.3, rho=2700.0)
SHELLS = [("triangle", "opt"), ("triangle", "cst"), ("quad", "opt"), ("triangle6", "opt"), ("quad8", "opt"),
          ("quad9", "opt")]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Stiffened:
    """A skin over (x, y), of a cylinder about x if it has a radius, or about y if it is an arch; lengths in m.

    The stiffener stands on the middle of the skin, along x or y, as thick as the skin or `rib`, and `height` deep.
    """

    length: float = 0.6
    width: float = 0.24
    thickness: float = 0.005
    radius: float = 0.0
    arch: bool = False
    along: str = "x"  # or "y", or "" without a stiffener
    height: float = 0.03
    rib: float = 0.005
    mass: float = 0.5  # kg, at the end

    @property
    def closed(self) -> bool:
        """Whether it is a whole tube."""
        return bool(self.radius) and not self.arch and self.width > 6.28 * self.radius

    @property
    def below(self) -> float:
        """The height of the middle of the stiffener."""
        return -(self.height + self.thickness) / 2

    @property
    def centre(self) -> float:
        """The height of the middle of the end: on the axis of a tube."""
        return -self.radius if self.closed else 0.0

    def placed(self, x, y, z):
        """Return places (..., 3) at heights z over the middle of the skin."""
        if not self.radius:
            return np.stack(np.broadcast_arrays(x, y, z), axis=-1)
        angle, r = (x if self.arch else y) / self.radius, self.radius + z
        around, height = r * np.sin(angle), r * np.cos(angle) - self.radius
        return np.stack(np.broadcast_arrays(*((around, y, height) if self.arch else (x, around, height))), axis=-1)

    def sides(self, n: int, across: bool) -> np.ndarray:
        """Return positions of cells along x, or `across`; n to a side, one over the stiffener if it cuts this line."""
        low, high = (-self.width / 2, self.width / 2) if across else (0.0, self.length)
        middle = (low + high) / 2
        if self.along != ("x" if across else "y"):
            return np.linspace(low, high, 2 * n + 1)
        return np.concatenate(
            [np.linspace(low, middle - self.rib / 2, n + 1), np.linspace(middle + self.rib / 2, high, n + 1)]
        )


def joined(points, cells, *more):
    """Join nodes that coincide, as along the seam of a tube."""
    _, first, number = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return points[first], *(number.ravel()[c] for c in (cells, *more))


def skin_and_beams(shape: Stiffened, kind: str, n: tuple[int, int], membrane: str = "opt"):
    """Return the mesh and properties of shells, with beams on the nodes of the middle."""
    half, w = shape.length / 2, shape.width
    points, cells = surface(*n, kind, lambda s, t: (shape.length * s, w * (t - 0.5), 0 * s), diagonal="alternating")
    flat = points
    points, cells, number = joined(shape.placed(*flat.T), cells, np.arange(len(flat)))

    def along(axis, at):
        """Cells of a line where a coordinate has a value, from end to end."""
        own = np.flatnonzero(np.abs(flat[:, axis] - at) < 1e-9)
        own = number[own[np.argsort(flat[own, 1 - axis])]]
        step = 2 if kind[-1] in "689" else 1
        order = (0, 2, 1) if step == 2 else (0, 1)
        return np.stack([own[k : len(own) - step + k : step] for k in order], axis=1)

    root, end = along(0, 0.0), along(0, shape.length)
    sections = {"skin": mp.Shell(material=ALUMINIUM, thickness=shape.thickness, membrane=membrane)}
    lines = {"root": root, "end": end}
    if shape.along:
        lines["stiffener"] = along(1, 0.0) if shape.along == "x" else along(0, half)
        sections["stiffener"] = mp.fe.beam_section(
            "rectangle", ALUMINIUM, width=shape.rib, height=shape.height, offset=(0.0, shape.below)
        )
    line = "line3" if kind[-1] in "689" else "line"
    mesh = _mesh(points, {kind: {"skin": cells}, line: lines})
    middle = points[mesh.cells[line][:, :2]].mean(axis=1)
    up = [0, 1, 1] * (middle - [0, 0, -shape.radius]) if shape.radius else np.tile([0, 0, 1.0], (len(middle), 1))
    return mesh.with_(data={"up": {line: up}}), sections


def beams(shape: Stiffened, kind: str, n: int):
    """Return the mesh and properties of a bar of beams (line, line3), whose section is that of the skin."""
    x = np.linspace(0, shape.length, 2 * n + 1 if kind == "line3" else n + 1)
    points, ends = shape.placed(x, 0.0, 0.0), np.arange(0, len(x), len(x) // n)
    lines = np.stack([ends[:-1], ends[1:], ends[:-1] + 1][: 3 if kind == "line3" else 2], axis=1)
    middle = points[ends].reshape(-1, 3)
    mesh = _mesh(points, {kind: {"skin": lines}, "vertex": {"root": np.array([[0]]), "end": np.array([[len(x) - 1]])}})
    up = [0, 0, shape.radius or 1.0] + (middle[1:] + middle[:-1]) / 2 * [1, 0, bool(shape.radius)] * bool(shape.radius)
    section = mp.fe.beam_section("rectangle", ALUMINIUM, width=shape.width, height=shape.thickness)
    return mesh.with_(data={"up": {kind: up}}), {"skin": section}


def bricks(shape: Stiffened, n: tuple[int, int], through: tuple[int, int] = (1, 4)):
    """Return the mesh and properties of bricks with 20 nodes, `through` of them in the skin and the stiffener."""
    z = np.linspace(-shape.thickness / 2, shape.thickness / 2, through[0] + 1)
    if shape.along:
        z = np.concatenate([np.linspace(shape.below - shape.height / 2, z[0], through[1] + 1)[:-1], z])
    grid = [shape.sides(n[0] // 2, False), shape.sides(n[1] // 2, True), z]
    fine = [np.sort(np.concatenate([a, (a[1:] + a[:-1]) / 2])) for a in grid]
    corners = np.array([(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)])
    nodes = np.vstack([corners, [(corners[a] + corners[b]) // 2 for a, b in HEX_EDGES]])
    first = np.stack(np.meshgrid(*(np.arange(len(a) - 1) for a in grid), indexing="ij"), axis=-1).reshape(-1, 3)
    skin = first[:, 2] >= len(z) - 1 - through[0]
    if shape.along:
        across = int(shape.along == "x")
        first = first[skin | (first[:, across] == (len(grid[across]) - 1) // 2)]
        skin = first[:, 2] >= len(z) - 1 - through[0]
    at = 2 * first[:, None] + nodes
    cells = np.ravel_multi_index(at.reshape(-1, 3).T, [len(a) for a in fine]).reshape(at.shape[:2])
    used, cells = np.unique(cells, return_inverse=True)
    points = shape.placed(*(a.ravel()[used] for a in np.meshgrid(*fine, indexing="ij")))
    points, cells = joined(points, cells.reshape(at.shape[:2]))
    faces = {
        name: cells[chosen & (first[:, 0] == place)][:, side]
        for name, chosen, place, side in (
            ("root", True, 0, [0, 3, 7, 4, 11, 19, 15, 16][:8]),
            ("end", skin, len(grid[0]) - 2, [1, 2, 6, 5, 9, 18, 13, 17]),
        )
    }
    return _mesh(points, {"hexahedron20": {"all": cells}, "quad8": faces}), {"all": mp.Solid(material=ALUMINIUM)}


def _mesh(points, cells: dict[str, dict[str, np.ndarray]]):
    """Return a mesh of named cells by kind."""
    groups = {
        name: {kind: sum(len(c) for c in list(named.values())[:k]) + np.arange(len(own))}
        for kind, named in cells.items()
        for k, (name, own) in enumerate(named.items())
    }
    return mp.fe.Mesh(
        points=points, cells={k: np.concatenate(list(v.values())) for k, v in cells.items()}, groups=groups
    )


def assembled(shape: Stiffened, mesh, sections, end: str = "") -> mp.fe.FEModel:
    """Return the model, its `end` free or tied (rbe2, rbe3) to a node with a mass."""
    root = {"root": mp.Interface(group="root", kind="rbe2", position=(0.0, 0.0, 0.0))}
    if not end:
        return mp.assemble(mesh, sections, root)
    place = shape.placed(shape.length, 0.0, shape.centre)
    tip = {"tip": mp.Connection(group="end", kind=end, position=tuple(place))}
    inertia = (*3 * (shape.mass * 0.05**2,), 0.0, 0.0, 0.0)
    return mp.assemble(mesh, sections | {"tip": mp.PointMass(mass=shape.mass, inertia=inertia)}, root, connections=tip)


def frequencies(model: mp.fe.FEModel, count: int = 5) -> np.ndarray:
    """Return the lowest frequencies in Hz."""
    return mp.craig_bampton(model, modes=count + 3, truncation=()).frequency[:count]
