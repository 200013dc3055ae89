"""The bases of scikit-fem on which a term of a user is integrated."""

from __future__ import annotations

import numpy as np
from skfem.assembly import CellBasis

from modalprep.errors import InputError
from modalprep.fe.assembly.bases import dofmap_of, facet_bases, part_bases
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.terms.term import Term

NOUNS = {"faces": ("triangles or quads", 2), "lines": ("lines", 1)}


def term_bases(model: FEModel, mesh: Mesh, term: Term) -> list[CellBasis]:
    """Return the bases of the cells or facets of a term, in the DOFs of the model.

    Raises
    ------
    InputError
        When the group is unknown, has no such cells, or its nodes have no elements.
    """
    if term.on == "facets":
        return facet_bases(model, term.group, term.where)
    parts = [] if model.elements is None else model.elements.parts
    own = [part for part in parts if part.group == term.group and _wanted(term, part.kind)]
    bases = part_bases(own, dofmap_of(model))
    if own and not bases:
        raise InputError(f"group {term.group!r} has points and springs, which have no inside; name other cells")
    return bases or facet_bases(model, _cells(model, mesh, term))


def _wanted(term: Term, kind: str) -> bool:
    return cell_dimension(kind) == NOUNS[term.on][1] if term.on in NOUNS else cell_dimension(kind) > 0


def _cells(model: FEModel, mesh: Mesh, term: Term) -> dict[str, np.ndarray]:
    """Return the cells of a group without a property, on the nodes of other elements."""
    group = mesh.group(term.group)
    cells = {kind: nodes for kind, nodes in group.items() if _wanted(term, kind)}
    if not cells:
        wanted = NOUNS[term.on][0] if term.on in NOUNS else "cells but points"
        raise InputError(f"group {term.group!r} has {', '.join(group)} cells, but no {wanted}; name another group")
    for kind, nodes in cells.items():
        loose = np.any(model.dof[nodes, 0] < 0, axis=1)
        if loose.any():
            raise InputError(f"{loose.sum()} {kind} cells of group {term.group!r} are not on nodes of elements")
    return cells
