"""The weak forms of scikit-fem over a structure: the reference implementation of the elements."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial, reduce
from operator import add
from typing import Any

import numpy as np
from scipy.sparse import csr_array
from skfem.assembly import Form, asm
from skfem.assembly.form.coo_data import COOData

from modalprep.fe.assembly.geometric_stiffness import GeometricStiffness
from modalprep.fe.assembly.link_stiffness import LinkStiffness
from modalprep.fe.assembly.structure import Structure
from modalprep.fe.assembly.structure_forms import MatrixForm, ModelForms, NumberForm, VectorForm
from modalprep.fe.assembly.totals import MassTensor
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.distribution import Inertia
from modalprep.fe.elements.mass import PAIRS, MassObjects
from modalprep.fe.forms import mass as weak
from modalprep.fe.forms import solid
from modalprep.fe.forms.basis import DofMap


def _matrix(structure: Structure, found: Iterable[COOData]) -> csr_array:
    """Return the sum of matrices of cells, symmetric to the last bit."""
    total = csr_array(reduce(add, found, _nothing(structure.dofmap.n)).tocsr())
    return ((total + total.T) / 2).tocsr()


def _cells(block: Block | Inertia, values: np.ndarray | None, dof: np.ndarray, n: int) -> COOData:
    """Return matrices ``(ne, nl, nl)`` of elements without weak forms: point masses, springs, lumped masses."""
    if values is None:
        return _nothing(n)
    rows = np.broadcast_to(dof[block.nodes, : block.components].reshape(len(values), -1, 1), values.shape)
    return COOData(np.array([rows.ravel(), rows.swapaxes(1, 2).ravel()]), values.ravel(), (n, n), None)


def _nothing(n: int) -> COOData:
    return COOData(np.zeros((2, 0), dtype=np.int32), np.zeros(0), (n, n), None)


def _stiffness(structure: Structure) -> csr_array:
    return _matrix(structure, _terms(structure, lambda own: own.stiffness(), lambda block, _: block.stiffness()))


def _prestress(structure: Structure, d: np.ndarray) -> csr_array:
    def of_block(block: Block, dof: np.ndarray) -> np.ndarray | None:
        return block.geometric_stiffness(d[dof[block.nodes, : block.components]].reshape(len(block.nodes), -1))

    return _matrix(structure, _terms(structure, lambda own: own.geometric_stiffness(d), of_block))


def _terms(structure: Structure, of_forms: Callable, of_block: Callable) -> Iterator[COOData]:
    dof, n = structure.dofmap.dof, structure.dofmap.n
    for block, own in zip(structure.blocks, structure.plain, strict=True):
        if own is None:
            yield _cells(block, of_block(block, dof), dof, n)
        else:
            yield from (term.coo() for term in of_forms(own))


def _masses(structure: Structure) -> Iterator[Callable[..., Any]]:
    """Yield what assembles a form of mass over each block: of its weak forms, or of its lumped or rigid mass."""
    for inertia, own in zip(structure.inertias, structure.weak_masses, strict=True):
        if own is not None:
            yield from (mass.assembled for mass in own)
        elif (mass := inertia.mass()) is not None:
            yield partial(_of_objects, structure.dofmap, inertia, mass)


def _of_objects(dofmap: DofMap, inertia: Inertia, mass: MassObjects, form: Form, *, a: int = 0, b: int = 0) -> Any:
    """Return the value of a form of mass for `MassObjects`."""
    numbers = {weak.total: mass.rigid.m, weak.moment: mass.rigid.s0[a], weak.moment_of_pair: mass.rigid.E0[a, b]}
    if form in numbers:
        return numbers[form]
    if form in (weak.mass, weak.mass_of_pair):
        values = mass.matrix() if form is weak.mass else mass.of_pair(a, b)
        return _cells(inertia, values, dofmap.dof, dofmap.n).tocsr()
    values = mass.g[..., a] if form is weak.first else mass.h[..., a, b]
    dofs = dofmap.dof[inertia.nodes, : inertia.components]
    return np.bincount(dofs.ravel(), values.ravel(), dofmap.n)


def _of_masses(form: Form, structure: Structure, **given: int) -> Any:
    return sum(assembled(form, **given) for assembled in _masses(structure))


def _mass_matrix(form: Form, structure: Structure, **given: int) -> csr_array:
    empty = csr_array((structure.dofmap.n, structure.dofmap.n))
    return csr_array(_of_masses(form, structure, **given) + empty)


def _mass_vector(form: Form, structure: Structure, **given: int) -> np.ndarray:
    return _of_masses(form, structure, **given) + np.zeros(structure.dofmap.n)


def _mass_tensor(structure: Structure) -> MassTensor:
    dofmap = structure.dofmap
    pairs = {(a, b): asm(PLAIN.mass_of_pair, structure, a=a, b=b) for a, b in PAIRS}
    return MassTensor(dofmap.dof, None, None, pairs, dofmap.n)


@dataclass(frozen=True, eq=False)
class PlainGeometricStiffness(GeometricStiffness):
    """Geometric stiffness of the weak forms, and of rigid links."""

    structure: Structure

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the prestress due to displacement d under the nodal load (N)."""
        return (asm(PLAIN.geometric_stiffness, self.structure, d=d) + self.links(d, load)).tocsr()

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the prestress of each static response (n_dof, k) under its load."""
        found = np.zeros((loads.shape[1], Phi.shape[1], Phi.shape[1]))
        for k in np.flatnonzero(np.any(loads, axis=0)):
            found[k] = Phi.T @ (self(static[:, k], loads[:, k]) @ Phi)
        return found


def _prestress_stiffness(structure: Structure, links: LinkStiffness) -> GeometricStiffness:
    own = structure.without_masses()
    return PlainGeometricStiffness(own.blocks, own.pattern, own.dofmap.dof, links, structure=own)


PLAIN = ModelForms(
    stiffness=MatrixForm(_stiffness, solid.stiffness),
    geometric_stiffness=MatrixForm(_prestress, solid.geometric_stiffness),
    mass=MatrixForm(partial(_mass_matrix, weak.mass), weak.mass),
    mass_of_pair=MatrixForm(partial(_mass_matrix, weak.mass_of_pair), weak.mass_of_pair),
    first=VectorForm(partial(_mass_vector, weak.first), weak.first),
    second=VectorForm(partial(_mass_vector, weak.second), weak.second),
    total=NumberForm(partial(_of_masses, weak.total), weak.total),
    moment=NumberForm(partial(_of_masses, weak.moment), weak.moment),
    moment_of_pair=NumberForm(partial(_of_masses, weak.moment_of_pair), weak.moment_of_pair),
    mass_tensor=_mass_tensor,
    prestress=_prestress_stiffness,
)
