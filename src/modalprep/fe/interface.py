"""Interfaces: 6-DOF frames where a body meets its neighbours, and the rigid links (RBE2) that make them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh import Mesh, cell_dimension


@dataclass(frozen=True, kw_only=True)
class Interface:
    """What the user asks for.

    Attributes
    ----------
    group : str
        Mesh group whose nodes carry the interface.
    kind : {"node", "rbe2"}
        One node's own six DOFs, or a massless frame tied rigidly to every node of the group.
    boundary : {"fixed", "free"}
        Fixed: its six DOFs are kept in the reduction as constraint modes (Craig-Bampton). Free: it moves with
        the modes, as the tip of a cantilever does. The root is always fixed.
    position : (3,) or None
        m, in mesh coordinates; None takes the node, or the centroid of the group's surface or nodes.

    Examples
    --------
    >>> Interface(group="bolt_a").kind
    'rbe2'
    """

    group: str
    kind: Literal["node", "rbe2"] = "rbe2"
    boundary: Literal["fixed", "free"] = "fixed"
    position: tuple[float, float, float] | None = None


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
        Nodes tied to it rigidly; empty for kind ``node``.
    boundary : str
    """

    name: str
    position: np.ndarray
    dofs: np.ndarray
    nodes: np.ndarray
    boundary: str


def interface_position(mesh: Mesh, name: str, interface: Interface) -> np.ndarray:
    """Return where the interface frame sits: given, the single node, or the centroid of the group (m).

    Raises
    ------
    InputError
        When kind ``node`` meets a group of several nodes.
    """
    nodes = mesh.nodes(interface.group)
    if interface.kind == "node" and len(nodes) != 1:
        raise InputError(
            f"interface {name!r} is of kind 'node' but group {interface.group!r} has {len(nodes)} nodes; "
            "use kind = 'rbe2' or a group with one node"
        )
    if interface.position is not None and interface.kind == "rbe2":
        return np.asarray(interface.position, dtype=float)
    surfaces = [c[:, :3] for kind, c in mesh.group(interface.group).items() if cell_dimension(kind) == 2]
    if not surfaces:
        return mesh.points[nodes].mean(axis=0)
    corners = mesh.points[np.concatenate(surfaces)]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    return area @ corners.mean(axis=1) / area.sum()


def link_geometric_stiffness(force: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return the stiffness (3, 3) that forces on the far ends of rigid links add to the rotations of their frame.

    A link end moves by ``theta x r + theta x (theta x r) / 2``; a force on it (from the frame, ``(k, 3)`` N)
    does work on the second-order part: ``theta^T [ (f r^T + r f^T)/2 - (f.r) I ] theta / 2``.

    Examples
    --------
    >>> pull = link_geometric_stiffness(np.array([[1.0, 0, 0]]), np.array([[-2.0, 0, 0]]))
    >>> pull.diagonal()  # tension on a link of 2 m that trails behind: a pendulum of stiffness f r
    array([0., 2., 2.])
    """
    fr = np.einsum("ka,kb->ab", force, arm)
    return (fr + fr.T) / 2 - np.trace(fr) * np.eye(3)
