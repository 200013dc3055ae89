"""scikit-fem elements that hand whole fields of an element family to a form."""

from __future__ import annotations

import numpy as np
from skfem.assembly import CellBasis
from skfem.element import DiscreteField, Element

from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import nodal_element

NAMES = ["ux", "uy", "uz", "rx", "ry", "rz"]
Field = tuple[np.ndarray, np.ndarray | None]  # (ne, nq, ..., nl) per DOF of the cell, and its gradient (.., 3, nl)


class FieldElement(Element):
    """An element of a family, made for the cells of one basis.

    A family gives `fields`: those of all functions of all cells at once.

    Attributes
    ----------
    kind : str
        meshio's name of the cell.
    internal : int
        Functions inside each cell that are condensed (`condensed.Condensed`), beside those of the nodes.
    """

    maxdeg = 2
    internal = 0
    width = 6  # DOFs of a node
    in_node_order = True  # of meshio, unlike scikit-fem's own elements

    def __init__(self, kind: str) -> None:
        self.kind = kind
        self.refdom = nodal_element(kind).refdom
        cell = CELLS[kind]
        self.nodal_dofs = self.width
        middles = self.width * int(cell.count >= len(cell.corners) + len(cell.edges) > len(cell.corners))
        self.edge_dofs, self.facet_dofs = (middles, 0) if cell.dimension == 3 else (0, middles)
        centre = cell.dimension == 2 and cell.count == len(cell.corners) + len(cell.edges) + 1
        self.interior_dofs = self.width * centre + self.internal
        entities = 1 + bool(middles) + centre
        self.dofnames = NAMES[: self.width] * entities + [f"inner^{k + 1}" for k in range(self.internal)]
        self.doflocs = np.vstack(
            [np.repeat(cell.node_coordinates(), self.width, axis=0), np.full((self.internal, cell.dimension), 0.5)]
        )
        self._at: tuple | None = None

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the fields of all functions at points ``X (dim, nq)`` of the unit cell."""
        raise NotImplementedError

    def gbasis(self, mapping, X, i, tind=None) -> tuple[DiscreteField, ...]:
        """Return the fields of one function; those of all are evaluated once for each set of points."""
        if self._at is None or self._at[0] is not X:
            self._at = X, [tuple(_by_function(part) for part in field) for field in self.fields(X)]
        some = slice(None) if tind is None else tind
        return tuple(
            DiscreteField(*(None if part is None else part[i][..., some, :] for part in field)) for field in self._at[1]
        )


class Levered(FieldElement):
    """The displacement ``u + t x r`` alone of mass on levers r, of an element with displacement u and rotation t.

    Parameters
    ----------
    motion : FieldElement
    lever : (ne, nq or 1, 3) or None
        Mesh axes, m; None without levers.
    unit : float
        0 for the displacement ``t x r`` per length of the lever.
    """

    def __init__(self, motion: FieldElement, lever: np.ndarray | None = None, unit: float = 1.0) -> None:
        super().__init__(motion.kind)
        self.motion, self.lever, self.unit = motion, lever, unit

    def fields(self, X: np.ndarray) -> tuple[Field, ...]:
        """Return the displacement."""
        (u, _), (t, _), *_ = self.motion.fields(X)
        if self.lever is None:
            return ((u, None),)
        return ((self.unit * u + np.cross(t, self.lever[..., None], axis=2), None),)


def interpolated(basis: CellBasis, d: np.ndarray, field: int = 0) -> DiscreteField:
    """Return a field of displacements ``d (n_dof,)``.

    scikit-fem's `interpolate` knows the first field only, and numbers anew the DOFs of a basis that lacks some.
    """
    scale = [d[dofs][:, None] for dofs in basis.element_dofs]
    parts = zip(*(fields[field].astuple for fields in basis.basis), strict=True)
    return DiscreteField(*(None if own[0] is None else sum(map(np.multiply, scale, own)) for own in parts))


def _by_function(values: np.ndarray | None) -> np.ndarray | None:
    """Bring ``(ne, nq, ..., nl)`` into scikit-fem's order, the function first: ``(nl, ..., ne, nq)``."""
    if values is None:
        return None
    return np.ascontiguousarray(np.moveaxis(np.moveaxis(values, -1, 0), (1, 2), (-2, -1)))
