"""Small bodies from closed forms: no assembly, no eigenvalue problem."""

from __future__ import annotations

import numpy as np
import pytest

from modalprep.body.flexible_body import FlexibleBody
from modalprep.reduction.table import CONSTRAINT, FIXED, TRUNCATION, ModeTable


def make_body(name, points, cells, shape, interfaces, table) -> FlexibleBody:
    """Return a body with these pictures and this table; its other integrals are zero, nothing here reads them."""
    n, k = shape.shape[2], len(interfaces)
    frequency = 2.0 * np.arange(1, n + 1)
    places = np.array([*interfaces.values()], dtype=float)
    nearest = [int(np.argmin(np.linalg.norm(points - place, axis=1))) for place in places]
    P = np.einsum("ab,ij->abij", np.eye(3) / 3, np.eye(n))
    phi = shape[nearest] * (np.arange(k) > 0)[:, None, None]
    return FlexibleBody(
        name=name, m=12.0, s0=np.array([6.0, 0, 0]), E0=np.diag([4.0, 0.01, 0.01]), S=np.zeros((3, n)),
        H=np.zeros((3, 3, n)), P=P, Kg_A=np.zeros((3, n, n)), Kg_W=np.zeros((3, 3, n, n)),
        Kg_F=np.zeros((k, 3, n, n)), Kg_T=np.zeros((k, 3, n, n)), phi=phi, psi=np.zeros((k, 3, n)),
        K=(2 * np.pi * frequency) ** 2, D=0.02 * 2 * np.pi * frequency, frequency=frequency,
        interface_name=tuple(interfaces), interface_position=places, points=points, cells=cells, shape=shape,
        modes=table, provenance={"mesh": "sha256:" + "ab" * 32},
    )  # fmt: skip


def make_table(candidates: int) -> ModeTable:
    """Return modes of falling effective mass in y and z, every third dropped, and a few vectors of the other kinds."""
    mass = np.zeros((candidates, 6))
    for k in range(candidates):
        mass[k, 1 + k % 2] = 12 * 0.6 / (k // 2 + 1) ** 2
        mass[k, 5 - k % 2] = 4 * 0.9 / (k // 2 + 1) ** 4
    kept = np.arange(candidates) % 3 != 2
    other = np.vstack([np.full(6, np.nan), np.full(6, np.nan), [3.0, 0, 0, 0.001, 0, 0]])
    return ModeTable(
        kind=(*[FIXED] * candidates, CONSTRAINT, CONSTRAINT, TRUNCATION),
        frequency=np.array([*1.5 * np.arange(1, candidates + 1) ** 2, np.nan, np.nan, 23456.7]),
        effective_mass=np.vstack([mass, other]),
        total=np.array([12.0, 12, 12, 0.02, 4, 4]),
        kept=np.array([*kept, True, True, True]),
        reason=(*[f"effective mass of candidate {k + 1} compared with 0.1%" for k in range(candidates)],
                "unit displacement x of interface tip", "unit displacement y of interface tip",
                "static response of dropped modes"),
    )  # fmt: skip


def bending(points, mode, axis):
    """Return a smooth shape (n, 3) along `axis` that is clamped at x = 0."""
    shape = np.zeros_like(points)
    x = points[:, 0] / points[:, 0].max()
    shape[:, axis] = x**2 if mode == 0 else x**2 * np.cos(np.pi * mode * x)
    return shape


@pytest.fixture(scope="session")
def cantilever():
    """Twenty beam elements along x; modes bend in y, z, y, z, and the last stretches."""
    points = np.zeros((21, 3))
    points[:, 0] = np.linspace(0, 2, 21)
    cells = {"line": np.column_stack([np.arange(20), np.arange(1, 21)])}
    shapes = [bending(points, 0, 1), bending(points, 0, 2), bending(points, 1, 1), bending(points, 1, 2)]
    shapes.append(np.outer(points[:, 0], [1.0, 0, 0]))
    interfaces = {"root": (0, 0, 0), "tip": (2, 0, 0)}
    return make_body("cantilever", points, cells, np.stack(shapes, axis=2), interfaces, make_table(6))


def block_points(counts, size):
    """Return the nodes of a regular block, x slowest."""
    axes = [np.linspace(0, length, count + 1) for length, count in zip(size, counts, strict=True)]
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)


def hexahedra(counts):
    """Return the cells of that block."""
    nx, ny, nz = counts
    number = np.arange((nx + 1) * (ny + 1) * (nz + 1)).reshape(nx + 1, ny + 1, nz + 1)
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    return np.stack([number[i : nx + i, j : ny + j, k : nz + k].ravel() for i, j, k in corners], axis=1)


def quadratic(points, tetra):
    """Return the points and cells of the tetra10 mesh with a node in the middle of each edge."""
    pairs = np.array([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)])
    ends = np.sort(tetra[:, pairs].reshape(-1, 2), axis=1)
    unique, place = np.unique(ends, axis=0, return_inverse=True)
    middle = len(points) + place.reshape(len(tetra), 6)
    return np.vstack([points, points[unique].mean(axis=1)]), np.hstack([tetra, middle])


@pytest.fixture(scope="session")
def block():
    """Return a small solid of tetra10 cells, six to a brick."""
    points = block_points((6, 2, 2), (1.5, 0.5, 0.4))
    six = np.array([(0, 1, 2, 6), (0, 2, 3, 6), (0, 3, 7, 6), (0, 7, 4, 6), (0, 4, 5, 6), (0, 5, 1, 6)])
    points, cells = quadratic(points, hexahedra((6, 2, 2))[:, six].reshape(-1, 4))
    shape = np.stack([bending(points, 0, 2), bending(points, 0, 1)], axis=2)
    interfaces = {"wall": (0, 0.25, 0.2), "load": (1.5, 0.25, 0.2)}
    return make_body("block", points, {"tetra10": cells}, shape, interfaces, make_table(40))


@pytest.fixture(scope="session")
def frame():
    """Return a body of several cell types: bricks, a plate of quads, and a beam on top."""
    points = block_points((4, 1, 1), (1.0, 0.2, 0.2))
    plate = block_points((4, 4, 1), (1.0, 1.0, 1.0))
    plate = plate[plate[:, 2] == 0] + [0, 0.2, 0]
    mast = np.array([[1.0, 0.1, 0.2], [1.0, 0.1, 0.6], [1.0, 0.1, 1.0]])
    a, b = len(points), len(points) + len(plate)
    grid = np.arange(25).reshape(5, 5) + a
    quads = np.stack([grid[:-1, :-1], grid[1:, :-1], grid[1:, 1:], grid[:-1, 1:]], axis=-1).reshape(-1, 4)
    cells = {"hexahedron": hexahedra((4, 1, 1)), "quad": quads, "line": np.array([[b, b + 1], [b + 1, b + 2]]),
             "vertex": np.array([[b + 2]])}  # fmt: skip
    points = np.vstack([points, plate, mast])
    interfaces = {"base": (0, 0, 0), "top": (1.0, 0.1, 1.0)}
    return make_body("frame", points, cells, bending(points, 0, 2)[:, :, None], interfaces, make_table(3))
