"""Bases of scikit-fem whose DOFs are those of a model, so that `skfem.asm` of a form is a matrix of the model."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import skfem
from skfem.assembly import CellBasis, Dofs

from modalprep.fe.forms.cells import corner_mesh
from modalprep.fe.mesh.mapping import CellMapping
from modalprep.fe.mesh.reference_cells import nodal_element, node_of_function, quadrature


class DofMap(NamedTuple):
    """Nodes of a model and their DOFs.

    Attributes
    ----------
    points : (n_points, 3)
        Coordinates of the nodes in the model's frame, m.
    dof : (n_nodes, 6) int
        DOFs of the nodes, -1 where a node has none.
    n : int
        Number of DOFs.
    """

    points: np.ndarray
    dof: np.ndarray
    n: int


class ModelDofs(Dofs):
    """The DOFs of a model as those of a scikit-fem basis.

    Parameters
    ----------
    mesh : skfem.Mesh
    element : skfem.Element
    element_dofs : (Nbfun, ne) int
        DOF of the model of each function of each cell.
    n : int
        Number of DOFs.
    """

    def __init__(self, mesh: skfem.Mesh, element: skfem.Element, element_dofs: np.ndarray, n: int) -> None:
        self.topo, self.element = mesh, element
        self.element_dofs = np.ascontiguousarray(element_dofs, dtype=np.int32)
        self.N = n
        counts = element._bfun_counts()
        nodal, edge, facet, interior = np.split(self.element_dofs, np.cumsum(counts)[:3])
        self.nodal_dofs = _by_entity(nodal, mesh.t, mesh.p.shape[1])
        self.edge_dofs = _by_entity(edge, mesh.t2e, mesh.edges.shape[1]) if counts[1] else np.empty((0, 0), np.int32)
        self.facet_dofs = _by_entity(facet, mesh.t2f, mesh.facets.shape[1]) if counts[2] else np.empty((0, 0), np.int32)
        self.interior_dofs = interior


def _by_entity(dofs: np.ndarray, entities: np.ndarray, count: int) -> np.ndarray:
    """Return the DOFs ``(k, count)`` of vertices, edges or facets from those of the cells that have them, else -1."""
    found = np.full((len(dofs) // len(entities), count), -1, dtype=np.int32)
    for entity, own in zip(entities, np.split(dofs, len(entities)), strict=True):
        found[:, entity] = own
    return found


class ModelBasis(CellBasis):
    """A basis of cells of a model.

    Forms have, beside what scikit-fem gives them, the unit normals of surfaces or tangents of lines as ``w.n``.
    Positions ``w.x`` are in the model's frame, whose origin is the root interface. A basis of part of the cells
    (`with_elements`) keeps the DOFs of the model; that of another element (`with_element`) numbers its own.
    """

    def default_parameters(self) -> dict:
        """Return position, size and normal of the points of the quadrature."""
        own = super().default_parameters()
        if self.mesh.dim() < 3 and self.tind is None:
            own["n"] = skfem.element.DiscreteField(self.mapping.normals(self.X))
        return own

    def with_elements(self, elements: np.ndarray | None = None) -> CellBasis:
        """Return the basis of some of the cells, in the DOFs of the model."""
        return CellBasis(
            self.mesh,
            self.elem,
            mapping=self.mapping,
            elements=elements,
            quadrature=(self.X, self.W),
            dofs=self.dofs,
            disable_doflocs=True,
        )


def cell_basis(
    kind: str,
    nodes: np.ndarray,
    dofmap: DofMap,
    element: skfem.Element | None = None,
    *,
    degree: int | None = None,
    at: tuple[np.ndarray, np.ndarray] | None = None,
    x: np.ndarray | None = None,
) -> ModelBasis:
    """Return the basis of cells of one kind.

    Parameters
    ----------
    kind : str
        meshio's name of the cell.
    nodes : (ne, nn) int
    dofmap : DofMap
    element : skfem.Element
        Default the three displacements with the shape functions of the cell, ``u (3, ne, nq)``.
    degree : int
        Of the quadrature; default scikit-fem's for the element.
    at : (points (dim, nq), weights (nq,))
        Instead of a degree.
    x : (ne, nn, 3)
        Coordinates of the nodes of each cell, if not those of `dofmap`, m.

    Returns
    -------
    ModelBasis
        Its ``element_dofs (Nbfun, ne)`` is the map from the functions of each cell to the DOFs of the model.

    Examples
    --------
    >>> dofmap = DofMap(np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]]), np.arange(18).reshape(3, 6), 18)
    >>> basis = cell_basis("triangle", np.array([[0, 1, 2]]), dofmap)
    >>> float(basis.dx.sum()), basis.element_dofs[:, 0].tolist()
    (2.0, [0, 1, 2, 6, 7, 8, 12, 13, 14])
    """
    mesh = corner_mesh(kind, dofmap.points, nodes)
    mapping = CellMapping(kind, dofmap.points[nodes] if x is None else x)
    own_element = skfem.ElementVector(nodal_element(kind), 3) if element is None else element
    width = own_element.nodal_dofs
    ordered = nodes if getattr(own_element, "in_node_order", False) else nodes[:, node_of_function(kind)]
    numbers = dofmap.dof[ordered, :width]
    internal = getattr(own_element, "internal", 0)
    own = dofmap.n + np.arange(len(nodes) * internal).reshape(len(nodes), internal)
    numbers = np.concatenate([numbers.reshape(len(nodes), -1), own], axis=1).T
    dofs = ModelDofs(mesh, own_element, numbers, dofmap.n + own.size)
    if at is None:
        at = quadrature(kind, 2 * own_element.maxdeg if degree is None else degree)
    return ModelBasis(mesh, own_element, mapping=mapping, quadrature=at, dofs=dofs)
