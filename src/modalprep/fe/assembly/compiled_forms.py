"""The compiled loops as forms of scikit-fem: one pass over the elements gives all matrices and vectors."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array

from modalprep.fe.assembly.geometric_stiffness import GeometricStiffness, over_dofs
from modalprep.fe.assembly.structure import Structure
from modalprep.fe.assembly.structure_forms import MatrixForm, ModelForms, NumberForm, VectorForm
from modalprep.fe.forms import mass as weak
from modalprep.fe.forms import solid


def _prestress(structure: Structure, d: np.ndarray) -> csr_array:
    pattern = structure.pattern
    return pattern.csr(over_dofs(structure.blocks, pattern, structure.dofmap.dof, d[:, None])[:, 0])


COMPILED = ModelForms(
    stiffness=MatrixForm(lambda s: s.totals.stiffness(), solid.stiffness),
    geometric_stiffness=MatrixForm(_prestress, solid.geometric_stiffness),
    mass=MatrixForm(lambda s: s.totals.mass(), weak.mass),
    mass_of_pair=MatrixForm(lambda s, a, b: s.totals.tensor()[a, b], weak.mass_of_pair),
    first=VectorForm(lambda s, a: s.totals.g[:, a], weak.first),
    second=VectorForm(lambda s, a, b: s.totals.h[:, 3 * a + b], weak.second),
    total=NumberForm(lambda s: s.totals.rigid.m, weak.total),
    moment=NumberForm(lambda s, a: s.totals.rigid.s0[a], weak.moment),
    moment_of_pair=NumberForm(lambda s, a, b: s.totals.rigid.E0[a, b], weak.moment_of_pair),
    mass_tensor=lambda s: s.totals.tensor(),
    prestress=lambda s, links: GeometricStiffness(s.blocks, s.pattern, s.dofmap.dof, links),
)
