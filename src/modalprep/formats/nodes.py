"""Nodes of a body in exchange files: its interfaces and optional mesh nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.records import Record


@dataclass(frozen=True, eq=False, kw_only=True)
class Node(Record):
    """A node in the body frame: position (3,) m, ``phi, psi`` (3, n), ``Kg_F, Kg_T`` (3, n, n) as in `FlexibleBody`."""

    name: str
    position: np.ndarray
    phi: np.ndarray
    psi: np.ndarray
    Kg_F: np.ndarray
    Kg_T: np.ndarray


def export_nodes(body: FlexibleBody, mesh_nodes: Sequence[int] = ()) -> list[Node]:
    """Return the interfaces in their order (the root first), then the mesh nodes.

    A modal file has only the translation of a mesh node: its ``psi`` and geometric stiffness are zero here.

    Parameters
    ----------
    mesh_nodes : sequence of int
        Rows of ``body.points``, from 0.

    Raises
    ------
    InputError
        When the body has no modes, or not a modal mass of 1, or a mesh node does not exist.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> [node.name for node in export_nodes(uniform_beam(modes=2), [7])]
    ['root', 'tip', 'node_7']
    """
    if not body.n:
        raise InputError(f"body {body.name!r} has no modes; enter it as a rigid body of {body.m:g} kg instead")
    refuse_other_modal_mass(body)
    wrong = [p for p in mesh_nodes if not 0 <= p < len(body.points)]
    if wrong:
        raise InputError(f"mesh node {wrong[0]} does not exist; {body.name!r} has 0 to {len(body.points) - 1}")
    return [_interface(body, k) for k in range(len(body.interface_name))] + [_point(body, p) for p in mesh_nodes]


def refuse_other_modal_mass(body: FlexibleBody) -> None:
    """Refuse a body whose modal mass is not 1, as other programs assume: one at another fill level."""
    if not body.normalised:
        raise InputError(
            f"body {body.name!r} has the modes of another fill level, so that its modal mass is not 1, which this "
            "format cannot represent; export the body with its own modes"
        )


def _interface(body: FlexibleBody, k: int) -> Node:
    return Node(
        name=body.interface_name[k],
        position=body.interface_position[k],
        phi=body.phi[k],
        psi=body.psi[k],
        Kg_F=body.Kg_F[k],
        Kg_T=body.Kg_T[k],
    )


def _point(body: FlexibleBody, p: int) -> Node:
    none = np.zeros((3, body.n, body.n))
    return Node(
        name=f"node_{p}", position=body.points[p], phi=body.shape[p], psi=np.zeros((3, body.n)), Kg_F=none, Kg_T=none
    )
