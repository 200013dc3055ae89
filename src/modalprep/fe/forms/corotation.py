"""The work of nodal forces on elements whose axes rotate, as a form on their nodes (theory 7.7)."""

from __future__ import annotations

import numpy as np
from skfem.helpers import cross, dot

from modalprep.fe.elements.arms import node_transformation
from modalprep.fe.elements.corotation import Rotating
from modalprep.fe.forms.basis import DofMap, ModelBasis, cell_basis
from modalprep.fe.forms.bilinear import AllTrials
from modalprep.fe.forms.elements import Field, FieldElement
from modalprep.fe.forms.terms import Term
from modalprep.fe.mesh.cells import CELLS


# --8<-- [start:forms]
@AllTrials
def nodal_work(u, t, o, v, s, q, w):
    """Second order of (7.8): forces f and moments m of nodes at x with arms r; o and q are rotations of the axes."""

    def half(u, t, o, v, s, q):
        turning = dot(o, cross(w.f, v) + cross(w.m, s) / 2) + dot(w.f, cross(o, cross(q, w.at))) / 2
        return turning + dot(w.f, cross(t, cross(s, w.r))) / 2

    return half(u, t, o, v, s, q) + half(v, s, q, u, t, o)


# --8<-- [end:forms]


class NodalMotion(FieldElement):
    """Displacement and rotation of the ends of the arms of nodes, and the rotation of the axes of their element."""

    def __init__(self, kind: str, block: Rotating) -> None:
        super().__init__(kind)
        self.block = block

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return ``u, t, o`` at the nodes, which must be the points X."""
        ne, n, _ = self.block.arm.shape
        u, t = nodal_motion(self.block)
        o = np.broadcast_to(spin(self.block)[:, None], (ne, n, 3, 6 * n))
        return (u, None), (t, None), (o, None)


def nodal_motion(block: Rotating) -> tuple[np.ndarray, np.ndarray]:
    """Return displacement and rotation ``(ne, n, 3, 6n)`` of the ends of the arms, mesh axes, per nodal DOF."""
    ne, n, _ = block.arm.shape
    axes = np.broadcast_to(np.eye(3), (ne, 3, 3))
    motion = node_transformation(axes, block.arm).reshape(ne, n, 6, 6 * n)
    return motion[:, :, :3], motion[:, :, 3:]


def spin(block: Rotating) -> np.ndarray:
    """Return the rotation ``(ne, 3, 6n)`` of the axes of an element, mesh axes, per nodal DOF."""
    ends = node_transformation(block.frame, block.arm)
    return block.frame.transpose(0, 2, 1) @ block.axes_rotation @ ends


def at_nodes(kind: str, nodes: np.ndarray, dofmap: DofMap, element: FieldElement) -> ModelBasis:
    """Return a basis whose integrals are sums over the nodes of each cell."""
    points = CELLS[kind].node_coordinates().T
    basis = cell_basis(kind, nodes, dofmap, element, at=(points, np.ones(points.shape[1])))
    basis.dx = np.ones_like(basis.dx)
    return basis


def rotating_terms(block: Rotating, dofmap: DofMap, forces: np.ndarray) -> list[Term]:
    """Return the work of nodal forces ``(ne, n, 6)`` of an element on its rotation."""
    kind = {2: "line", 3: "triangle", 4: "quad"}[block.nodes.shape[1]]
    force, moment = np.split(forces, 2, axis=2)
    moment = moment - np.cross(block.arm, force)
    position = block.position @ block.frame
    given = {"f": force, "m": moment, "at": position, "r": block.arm}
    basis = at_nodes(kind, block.nodes, dofmap, NodalMotion(kind, block))
    return [Term(nodal_work, basis, {name: np.moveaxis(value, 2, 0) for name, value in given.items()})]


def cell_forces(terms: list[Term], nodes: np.ndarray, dofmap: DofMap, d: np.ndarray) -> np.ndarray:
    """Return the nodal forces ``(ne, n, 6)`` of stiffness terms for displacements ``d (n_dof,)``."""
    dofs = dofmap.dof[nodes].reshape(len(nodes), -1)
    found = np.zeros(dofs.shape)
    for coo in (term.coo() for term in terms):
        assert coo.local_shape is not None
        shape = (coo.local_shape[1], coo.local_shape[0], len(nodes))
        rows, columns = coo.indices.reshape(2, *shape)
        work = (coo.data.reshape(shape) * d[columns]).sum(axis=0)
        for row, own in zip(rows[0], work, strict=True):
            found[dofs == row[:, None]] += own
    return found.reshape(*nodes.shape, 6)
