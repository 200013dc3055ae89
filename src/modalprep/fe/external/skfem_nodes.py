"""The nodes of bases of scikit-fem: which DOFs are the displacements and rotations of one, and where it is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
import skfem
from skfem.assembly import CellBasis

from modalprep.errors import InputError
from modalprep.fe.forms.cells import MESHES
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import nodal_element, node_order

COMPONENTS = {"u^1": 0, "u^2": 1, "u^3": 2, "ux": 0, "uy": 1, "uz": 2, "rx": 3, "ry": 4, "rz": 5}


class Nodes(NamedTuple):
    """Nodes of bases.

    Attributes
    ----------
    points : (n_nodes, 3)
        m.
    dof : (n_nodes, 6) int
        DOFs of the bases, -1 where a node has none.
    cells : {type: (n_cells, n_corners) int}
        Of their corners, to draw.
    """

    points: np.ndarray
    dof: np.ndarray
    cells: dict[str, np.ndarray]

    def of(self, dofs: np.ndarray) -> np.ndarray:
        """Return the nodes that have some of the DOFs."""
        return np.flatnonzero(np.isin(self.dof, dofs).any(axis=1))


def nodes_of(bases: Sequence[CellBasis]) -> Nodes:
    """Return the nodes of bases; those of several that share their first DOF are one.

    Raises
    ------
    InputError
        When a DOF is no displacement or rotation along an axis.
    """
    found: dict[int, tuple[np.ndarray, np.ndarray]] = {}
    for basis in bases:
        at = _places(basis)
        for rows, components in _runs(basis):
            for own in rows.T[(rows >= 0).all(axis=0)]:
                _add(found, own, components, at)
    first = {dof: k for k, dof in enumerate(found)}
    cells: dict[str, list[np.ndarray]] = {}
    for basis in bases:
        kind = next(kind for kind, mesh in MESHES.items() if isinstance(basis.mesh, mesh))
        corners = basis.nodal_dofs[0, basis.mesh.t[: len(CELLS[kind].corners)]].T
        order = node_order(kind, nodal_element(kind).doflocs)
        cells.setdefault(kind, []).append(np.vectorize(first.get)(corners)[:, order])
    points, dof = (np.array(part) for part in zip(*found.values(), strict=True))
    return Nodes(points, dof, {kind: np.concatenate(own) for kind, own in cells.items()})


def _add(found: dict, own: np.ndarray, components: list[int], at: np.ndarray) -> None:
    found.setdefault(int(own[0]), (at[:, own[0]], np.full(6, -1)))[1][components] = own


def _runs(basis: CellBasis) -> Iterator[tuple[np.ndarray, list[int]]]:
    """Yield DOFs ``(k, n)`` of n vertices, edges, faces or cells that are one node each, and their components."""
    start = 0
    names = basis.elem.dofnames
    for dofs in (basis.nodal_dofs, basis.facet_dofs, basis.edge_dofs, basis.interior_dofs):
        own = [_component(basis, name) for name in names[start : start + len(dofs)]]
        start += len(dofs)
        turns = [k for k, component in enumerate(own) if component == 0]
        for begin, end in zip(turns, [*turns, len(own)][1:], strict=True):
            yield dofs[begin:end], own[begin:end]


def _component(basis: CellBasis, name: str) -> int:
    if name not in COMPONENTS:
        raise InputError(
            f"the DOF {name!r} of {type(basis.elem).__name__} is no displacement along x, y or z; a body moves in "
            "space: use skfem.ElementVector of three components"
        )
    return COMPONENTS[name]


def _places(basis: CellBasis) -> np.ndarray:
    """Return where each DOF is ``(3, N)``, m."""
    x = basis.mapping.F(np.asarray(basis.elem.doflocs, dtype=float).T)  # (dim, ne, Nbfun)
    at = np.zeros((3, basis.N))
    at[: len(x), basis.element_dofs] = x.transpose(0, 2, 1)
    for own in basis.nodal_dofs:  # vertices themselves: shells integrate over flattened cells
        vertices = np.flatnonzero(own >= 0)
        at[: len(x), own[vertices]] = basis.mesh.p[:, vertices]
    return at


def boundary_dofs(basis: CellBasis) -> dict[str, np.ndarray]:
    """Return the DOFs on each named boundary of the mesh of a basis."""
    names = basis.mesh.boundaries or {}
    return {str(name): skfem.Basis.get_dofs(basis, name).flatten() for name in names}
