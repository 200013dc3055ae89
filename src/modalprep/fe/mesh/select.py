"""Node sets: a mesh group, a node number of the file, or a geometric query."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.mesh import Mesh

Vector = tuple[float, float, float]
TOLERANCE = 1e-6  # of the model's size: how far a node may lie off a plane or cylinder


@dataclass(frozen=True, kw_only=True)
class NodeSet:
    """A set of nodes, given in exactly one way; lengths in m, mesh coordinates. Queries see the nodes of elements only.

    Attributes
    ----------
    group : str
        Every node of a mesh group.
    node : int
        The file's own number of one node.
    near : (3,)
        The one node closest to a point.
    box : ((3,), (3,))
        Nodes between two opposite corners, faces included.
    plane : ((3,), (3,))
        Nodes on the plane through a point, with a normal.
    cylinder : ((3,), (3,), float) or ((3,), (3,), float, float)
        Nodes on the cylinder with an axis through a point, along a direction, of a radius; and how far they may lie
        off it, by default 1e-6 of the size of the mesh.

    Raises
    ------
    InputError
        When none or several are given.

    Examples
    --------
    >>> NodeSet(near=(0.0, 0.0, 1.0))
    near (0, 0, 1)
    """

    group: str | None = None
    node: int | None = None
    near: Vector | None = None
    box: tuple[Vector, Vector] | None = None
    plane: tuple[Vector, Vector] | None = None
    cylinder: tuple[Vector, Vector, float] | tuple[Vector, Vector, float, float] | None = None

    def __post_init__(self) -> None:
        """Refuse ambiguous sets."""
        given = self._given()
        if len(given) != 1:
            ways = ", ".join(f.name for f in fields(NodeSet))
            raise InputError(
                f"a node set needs exactly one of {ways}; this one has {' and '.join(given) if given else 'none'}"
            )

    def _given(self) -> list[str]:
        return [f.name for f in fields(NodeSet) if getattr(self, f.name) is not None]

    def nodes(self, mesh: Mesh, used: np.ndarray) -> np.ndarray:
        """Return the sorted node numbers (k,) of the set; queries choose among `used`.

        Raises
        ------
        InputError
            When the set is empty.
        """
        way = self._given()[0]
        given = getattr(self, way)
        found = mesh.nodes(given) if way == "group" else getattr(self, f"_{way}")(mesh, used, given)
        if not len(found):
            raise InputError(f"no node lies at {self}; the mesh spans {_span(mesh, used)} m")
        return np.asarray(found)

    def _node(self, mesh: Mesh, used: np.ndarray, node: int) -> np.ndarray:
        if len(mesh.labels):
            return np.flatnonzero(mesh.labels == node)
        return np.array([node - 1] if 0 < node <= len(mesh.points) else [], dtype=int)

    def _near(self, mesh: Mesh, used: np.ndarray, near: Vector) -> np.ndarray:
        return used[[np.argmin(np.linalg.norm(mesh.points[used] - near, axis=1))]]

    def _box(self, mesh: Mesh, used: np.ndarray, box: tuple[Vector, Vector]) -> np.ndarray:
        slack = _slack(mesh, used)
        low = np.min(box, axis=0) - slack
        high = np.max(box, axis=0) + slack
        return used[np.all((mesh.points[used] >= low) & (mesh.points[used] <= high), axis=1)]

    def _plane(self, mesh: Mesh, used: np.ndarray, plane: tuple[Vector, Vector]) -> np.ndarray:
        point, normal = plane
        return used[np.abs((mesh.points[used] - point) @ self._unit(normal)) <= _slack(mesh, used)]

    def _cylinder(self, mesh: Mesh, used: np.ndarray, cylinder: tuple) -> np.ndarray:
        point, _, radius, *given = cylinder
        distance = np.linalg.norm(np.cross(mesh.points[used] - point, self.cylinder_axis()), axis=1)
        return used[np.abs(distance - radius) <= (given[0] if given else _slack(mesh, used))]

    def cylinder_axis(self) -> np.ndarray:
        """Return the direction (3,) of the cylinder's axis, of length one.

        Raises
        ------
        InputError
            When the given direction has no length.
        """
        assert self.cylinder is not None
        return self._unit(self.cylinder[1])

    def _unit(self, direction: Vector) -> np.ndarray:
        length = np.linalg.norm(direction)
        if not length > 0:
            raise InputError(f"the direction of {self} has no length")
        return np.asarray(direction) / length

    def __repr__(self) -> str:
        """The kind of the set and its values."""
        way = self._given()[0]
        value = getattr(self, way)
        return f"{way} {value!r}" if isinstance(value, str) else f"{way} {_numbers(value)}"


def _numbers(value: object) -> str:
    if isinstance(value, (tuple, list, np.ndarray)):
        return f"({', '.join(_numbers(v) for v in value)})"
    return f"{value:g}"


def _slack(mesh: Mesh, used: np.ndarray) -> float:
    return TOLERANCE * float(np.ptp(mesh.points[used], axis=0).max())


def _span(mesh: Mesh, used: np.ndarray) -> str:
    low = mesh.points[used].min(axis=0)
    high = mesh.points[used].max(axis=0)
    return f"({', '.join(f'{v:.4g}' for v in low)}) to ({', '.join(f'{v:.4g}' for v in high)})"
