"""Interfaces: 6-DOF frames where a body meets its neighbours, and connections that tie node sets to new nodes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, ClassVar, Literal, get_args

import numpy as np

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.fe.links.centroid import set_centroid
from modalprep.fe.links.mean_points import MeanPoints, cells_of
from modalprep.fe.mesh.mesh import Link, Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.suggest import refuse_unknown

Vector = tuple[float, float, float]
Tie = Literal["rbe2", "rbe3"]
Kind = Literal["node", "support", Tie]
Boundary = Literal["fixed", "free"]


@dataclass(frozen=True, kw_only=True, repr=False)
class Interface(NodeSet):
    """A 6-DOF frame through which a body is connected to its neighbours, defined on a node set.

    Attributes
    ----------
    kind : {"node", "rbe2", "rbe3", "support"}
        node: the six DOFs of a single node. rbe2: a massless frame to which every node of the set is tied rigidly.
        rbe3: a frame that follows the mean motion of the nodes and distributes its load without stiffening them.
        support: a frame without nodes of its own, which the supports of the model are tied to; the root only.
    boundary : {"fixed", "free"}
        fixed: its six DOFs are retained in the reduction, with constraint modes (Craig-Bampton). free: it moves
        with the modes, as the tip of a cantilever does. The root interface is always fixed.
    position : (3,) or None
        m, in mesh coordinates; None takes the node, the middle of a cylinder on its axis, the centroid of the
        set's surface or nodes, or that of the supported nodes.

    Raises
    ------
    InputError
        When none or several node sets are given, any of kind support, or the kind or boundary is unknown.

    Examples
    --------
    >>> Interface(group="bolt_a").kind
    'rbe2'
    """

    applies: ClassVar[tuple[Rule, ...]] = (
        Rule(("position",), needs=("kind",), among=("rbe2", "rbe3", "support"), advice="the node is its place"),
    )
    kind: Kind = "rbe2"
    boundary: Boundary = "fixed"
    position: Vector | None = None

    def __post_init__(self) -> None:
        """Refuse other kinds and boundaries."""
        if self.kind != "support":
            super().__post_init__()
        elif self._given():
            raise InputError(f"an interface of kind 'support' has no nodes of its own; make {self} a support")
        refuse_unknown(self.kind, get_args(Kind), f"interface at {self}: kind")
        refuse_idle(self, f"interface at {self}: ")
        refuse_unknown(self.boundary, get_args(Boundary), f"interface at {self}: boundary")

    def __repr__(self) -> str:
        """The nodes."""
        return super().__repr__() if self._given() else "the supports"


@dataclass(frozen=True, kw_only=True, repr=False)
class Connection(NodeSet):
    """A new node tied to a node set, to which a mass, a spring or a beam is attached.

    Attributes
    ----------
    kind : {"rbe2", "rbe3"}
        rbe2: the node set follows the new node rigidly. rbe3: the new node follows its mean motion.
    position : (3,) or None
        m, in mesh coordinates; None takes the place that an interface takes.

    Raises
    ------
    InputError
        When none or several node sets are given, or the kind is unknown.

    Examples
    --------
    >>> Connection(group="ring").kind
    'rbe3'
    """

    kind: Tie = "rbe3"
    position: Vector | None = None

    def __post_init__(self) -> None:
        """Refuse other kinds."""
        super().__post_init__()
        refuse_unknown(self.kind, get_args(Tie), f"connection at {self}: kind")


@dataclass(frozen=True, eq=False, kw_only=True)
class InterfaceFrame:
    """An interface placed in a model.

    Attributes
    ----------
    name : str
    position : (3,)
        m, in the model's frame.
    dofs : (6,) int
        Its three translations and three rotations among the model's DOFs.
    nodes : (k,) int
        Nodes tied to it; empty for kind ``node``. Of kind ``support`` those that it holds.
    boundary : str
    """

    name: str
    position: np.ndarray
    dofs: np.ndarray
    nodes: np.ndarray
    boundary: str


def interface_position(mesh: Mesh, name: str, spec: Any, nodes: np.ndarray) -> np.ndarray:
    """Return the position of the frame (m, mesh coordinates): given, the single node, or the centroid of the set.

    Raises
    ------
    InputError
        When kind ``node`` meets a set of several nodes.
    """
    if spec.kind == "node" and len(nodes) != 1:
        raise InputError(
            f"interface {name!r} is of kind 'node' but {spec} has {len(nodes)} nodes; "
            "use kind = 'rbe2' or a group with one node"
        )
    if spec.position is not None and spec.kind != "node":
        return np.asarray(spec.position, dtype=float)
    if spec.kind == "support":
        return mesh.points[nodes].mean(axis=0)
    if spec.kind == "rbe3" and not spec.cylinder and (over := cells_of(mesh, spec, nodes)[0]):
        return MeanPoints.over(mesh.points, nodes, over).nodal @ mesh.points[nodes]
    return mesh.points[nodes[0]] if spec.kind == "node" else set_centroid(mesh, spec, nodes)


def connect(mesh: Mesh, connections: dict[str, Connection], used: np.ndarray) -> Mesh:
    """Return the mesh with one new node per connection, in a group of the connection's name.

    Parameters
    ----------
    mesh : Mesh
    connections : {name: Connection}
    used : (k,) int
        Nodes that elements use.

    Raises
    ------
    InputError
        When a node set is empty.
    """
    points = [mesh.points]
    links = list(mesh.links)
    groups = dict(mesh.groups)
    notes = list(mesh.notes)
    vertices = mesh.cells.get("vertex", np.zeros((0, 1), dtype=int))
    for k, (name, spec) in enumerate(connections.items()):
        nodes = spec.nodes(mesh, used)
        node = len(mesh.points) + k
        points.append(interface_position(mesh, name, spec, nodes)[None])
        groups[name] = {"vertex": np.array([len(vertices)])}
        vertices = np.concatenate([vertices, [[node]]])
        over, note = cells_of(mesh, spec, nodes) if spec.kind == "rbe3" else ({}, "")
        notes += [f"connection {name!r}: {note}"] * bool(note)
        links.append(Link(kind=spec.kind, node=node, nodes=nodes, over=over))
    cells = {**mesh.cells, "vertex": vertices} if len(vertices) else mesh.cells
    points = np.concatenate(points)
    return mesh.with_(points=points, cells=cells, groups=groups, links=tuple(links), notes=tuple(notes))


def link_geometric_stiffness(force: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return the geometric stiffness (..., 3, 3), on the rotations of the frame, of forces on the ends of rigid links.

    A link end moves by ``theta x r + theta x (theta x r) / 2``; a force on it (from the frame, ``(..., k, 3)`` N)
    does work on the second-order part: ``theta^T [ (f r^T + r f^T)/2 - (f.r) I ] theta / 2``.

    Examples
    --------
    >>> pull = link_geometric_stiffness(np.array([[1.0, 0, 0]]), np.array([[-2.0, 0, 0]]))
    >>> pull.diagonal()  # tension on a link of 2 m that trails behind: a pendulum of stiffness f r
    array([0., 2., 2.])
    """
    fr = np.einsum("...ka,...kb->...ab", force, arm)
    trace = np.trace(fr, axis1=-2, axis2=-1)[..., None, None]
    return (fr + np.swapaxes(fr, -1, -2)) / 2 - trace * np.eye(3)
