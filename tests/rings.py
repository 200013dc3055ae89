"""Sectors of rings, their symmetry and their models."""

import numpy as np
from structured import box

import modalprep as mp
from modalprep.fe import CyclicSymmetry, Mesh

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
HUB = {"hub": mp.Interface(group="hub", kind="rbe2")}


def arc(sectors, radius, across, around, height=None):
    """Points of radius, angle and height, and the number of each, (around, across) or (around, across, layers)."""
    angle = np.linspace(0, 2 * np.pi / sectors, around + 1)
    grid = np.meshgrid(angle, np.linspace(*radius, across + 1), [0.0] if height is None else height, indexing="ij")
    points = np.stack([grid[1] * np.cos(grid[0]), grid[1] * np.sin(grid[0]), grid[2]], axis=-1)
    number = np.arange(grid[0].size).reshape(grid[0].shape)
    return points.reshape(-1, 3), number[..., 0] if height is None else number


def with_nodes(points, cells, **nodes):
    """A mesh whose group `part` has all cells, with groups of nodes."""
    every = np.concatenate(list(nodes.values()))
    ends = np.cumsum([0, *map(len, nodes.values())])
    groups = {name: {"vertex": np.arange(a, b)} for name, a, b in zip(nodes, ends[:-1], ends[1:], strict=True)}
    groups["part"] = {kind: np.arange(len(conn)) for kind, conn in cells.items()}
    return Mesh(points=points, cells={**cells, "vertex": every[:, None]}, groups=groups)


def shells(sectors=7, around=2):
    """An annular disc of shells, held at its bore; the edges of two sectors have names."""
    points, number = arc(sectors, (0.1, 0.4), 3, around)
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    sides = {"low": number[0], "high": number[-1]} if sectors == 2 else {}
    mesh = with_nodes(points, {"quad": np.stack(corners, axis=-1).reshape(-1, 4)}, hub=number[:, 0], **sides)
    symmetry = CyclicSymmetry(sectors=sectors, **{name: name for name in sides})
    return mesh, {"part": mp.Shell(material=STEEL, thickness=0.01)}, symmetry


def bricks(sectors=6, n=(2, 3, 1), bend=0.05, twist=0.0, uneven=0.0):
    """A dished disc of bricks of 20 nodes, held at its bore; uneven: the nodes of the edges do not match."""
    unit, cells = box("hexahedron20", n)
    across = unit[:, 1] * (1 + uneven * unit[:, 0] * (1 - unit[:, 1]))
    radius = 0.05 + 0.15 * across
    angle = -2 * np.pi / sectors * unit[:, 0] + twist * unit[:, 1]
    points = np.column_stack(
        [radius * np.cos(angle), radius * np.sin(angle), 0.01 * unit[:, 2] + bend * unit[:, 1] ** 2]
    )
    sides = {name: np.flatnonzero(np.isclose(unit[:, 0], x)) for name, x in (("low", 1.0), ("high", 0.0))}
    mesh = with_nodes(points, {"hexahedron20": cells}, hub=np.flatnonzero(np.isclose(unit[:, 1], 0)), **sides)
    section = {"part": mp.Solid(material=STEEL, integration="reduced")}
    return mesh, section, CyclicSymmetry(sectors=sectors, low="low", high="high")


def solid_disc(sectors=6):
    """A disc of wedges around its axis and bricks around these, of first order, held at its rim; the axis is free."""
    points, number = arc(sectors, (0.1, 0.3), 2, 2, np.linspace(0, 0.03, 2))
    axis = len(points) + np.arange(2)
    points = np.concatenate([points, [[0, 0, 0], [0, 0, 0.03]]])
    layers = number[..., 0], number[..., 1]
    around = ((0, 0), (0, 1), (1, 1), (1, 0))
    outer = [[layer[i + a, j + b] for layer in layers for a, b in around] for i in (0, 1) for j in (0, 1)]
    inner = [[x for k in (0, 1) for x in (axis[k], layers[k][i, 0], layers[k][i + 1, 0])] for i in (0, 1)]
    cells = {"hexahedron": np.array(outer), "wedge": np.array(inner)}
    mesh = with_nodes(points, cells, hub=number[:, -1].ravel())
    return mesh, {"part": mp.Solid(material=STEEL)}, CyclicSymmetry(sectors=sectors)


def beams(sectors=5, spring=1e4):
    """A polygon of beams with a spoke of springs to a hub on the axis; sections stand on edge to the radius."""
    points, number = arc(sectors, (1.0, 1.0), 0, 4)
    line = np.column_stack([number[:-1, 0], number[1:, 0]])
    points = np.concatenate([points, [[0.0, 0, 0]]])
    mesh = with_nodes(points, {"line": np.concatenate([line, [[len(points) - 1, 2]]])}, hub=np.array([len(points) - 1]))
    mesh = mesh.with_(groups=mesh.groups | {"rim": {"line": np.arange(4)}, "spoke": {"line": np.array([4])}})
    section = {
        "rim": mp.Beam(material=STEEL, A=1e-4, Iy=1e-7, Iz=1e-9, J=1e-8, up=(0.0, 0.0, 1.0)),
        "spoke": mp.Spring(translation=3 * (spring,), rotation=3 * (spring,)),
    }
    return mesh, section, CyclicSymmetry(sectors=sectors)
