"""Terms of a user in the matrices and loads of a model (theory 1.8)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import skfem
from scipy.sparse import coo_array, csr_array
from skfem.assembly import BilinearForm, CellBasis

from modalprep.errors import InputError
from modalprep.fe.assembly.geometric_stiffness import PrestressStiffness
from modalprep.fe.assembly.model import AddedTerm, FEModel
from modalprep.fe.forms.elements import interpolated
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.terms.added_mass import AddedMass
from modalprep.fe.terms.bases import term_bases
from modalprep.fe.terms.foundation import Foundation
from modalprep.fe.terms.mass import term_mass
from modalprep.fe.terms.term import Term

AnyTerm = Term | Foundation | AddedMass
SYMMETRIC = 1e-9  # relative: what round-off of a form leaves
BALANCED = 1e-12  # of the sum of magnitudes: forces of a rigid motion that are round-off


def with_terms(model: FEModel, mesh: Mesh, terms: Mapping[str, Term]) -> FEModel:
    """Return the model with terms added to its matrices and loads.

    Raises
    ------
    InputError
        When a term has no cells, its form does not suit them, or a matrix is not symmetric.
    """
    for name, term in terms.items():
        with _naming(name, term):
            model = _ADD[term.to](model, name, term, term_bases(model, mesh, term))
    return model


def held_by_terms(mesh: Mesh, terms: Mapping[str, Term]) -> np.ndarray:
    """Return the nodes of stiffness terms, which connect them to the frame of the root."""
    groups = [mesh.group(term.group) for term in terms.values() if term.to == "stiffness"]
    return np.unique(np.concatenate([np.zeros(0, int), *(c.ravel() for cells in groups for c in cells.values())]))


@contextmanager
def _naming(name: str, term: Term) -> Iterator[None]:
    """Name the term in messages; what a form of a user raises is its own fault."""
    try:
        yield
    except InputError as error:
        raise InputError(f"term {name!r}: {error}") from None
    except (ValueError, TypeError, AttributeError, IndexError, KeyError) as error:
        raise InputError(
            f"term {name!r}: its form cannot be integrated over group {term.group!r} ({error}); forms have (u, v, w), "
            "on beams and shells with a property (u, t, v, s, w), a load (v, w) or (v, s, w)"
        ) from None


def _add_stiffness(model: FEModel, name: str, term: Term, bases: list[CellBasis]) -> FEModel:
    return with_foundation(model, name, _symmetric(term.form, bases))


def with_foundation(model: FEModel, name: str, A: csr_array) -> FEModel:
    """Return the model with a symmetric stiffness ``A (n_dof, n_dof)`` between it and the frame of the root."""
    own = _relative(model, A)
    K = (model.K + own).tocsr()
    terms = {**model.terms, name: AddedTerm(own, None)}
    return model.with_(K=K, geometric_stiffness=_with_elastic(model.geometric_stiffness, K), terms=terms)


def _with_elastic(prestress: Any, K: csr_array) -> Any:
    """Return a geometric stiffness whose links carry the forces of another elastic stiffness."""
    if isinstance(prestress, WithGeometricTerms):
        return replace(prestress, inner=_with_elastic(prestress.inner, K))
    links = getattr(prestress, "links", None)  # a model from matrices may have none
    return prestress if links is None else replace(prestress, links=replace(links, K=K))


def _add_mass(model: FEModel, name: str, term: Term, bases: list[CellBasis]) -> FEModel:
    _symmetric(term.form, bases)
    own = term_mass(term.form, bases, model.interfaces[0].dofs, model.n_dof)
    return model.with_(
        M=(model.M + own.M).tocsr(),
        g=model.g + own.g,
        h=model.h + own.h,
        M_ab=model.M_ab.with_pairs(own.pairs),
        rigid=model.rigid + own.rigid,
        terms={**model.terms, name: AddedTerm(None, own.M)},
    )


def _add_geometric_stiffness(model: FEModel, name: str, term: Term, bases: list[CellBasis]) -> FEModel:
    d = np.random.default_rng(0).standard_normal(model.n_dof)
    once, twice = (_symmetric(term.form, bases, k * d) for k in (1, 2))
    if abs(twice - 2 * once).max() > SYMMETRIC * abs(once).max():
        raise InputError("its geometric stiffness is not proportional to the prestress; it must be linear in w.d")
    own = WithGeometricTerms(model.geometric_stiffness, term.form, bases, model)
    return model.with_(geometric_stiffness=own)


def _add_load(model: FEModel, name: str, term: Term, bases: list[CellBasis]) -> FEModel:
    load = np.asarray(skfem.asm(term.form, bases), dtype=float)
    if not np.any(load) or not np.all(np.isfinite(load)):
        raise InputError("its load is zero or not finite; give another form")
    return model.with_(loads={**model.loads, name: load})


_ADD = {
    "stiffness": _add_stiffness,
    "mass": _add_mass,
    "geometric_stiffness": _add_geometric_stiffness,
    "load": _add_load,
}


def _symmetric(form: BilinearForm, bases: list[CellBasis], d: np.ndarray | None = None) -> csr_array:
    """Return the matrix of a form; with the displacement d of a prestress."""
    A = csr_array(sum(form.assemble(basis, **({} if d is None else {"d": interpolated(basis, d)})) for basis in bases))
    size = abs(A).max()
    if size == 0 or not np.isfinite(size):
        raise InputError("its matrix is zero or not finite; give another form")
    if abs(A - A.T).max() > SYMMETRIC * size:
        raise InputError("its matrix is not symmetric: form(u, v, w) must equal form(v, u, w)")
    return ((A + A.T) / 2).tocsr()


def _relative(model: FEModel, A: csr_array) -> csr_array:
    """Return ``T^T A T``, where ``T u`` is the displacement relative to the frame of the root."""
    R = model.rigid_body()
    force = A @ R
    force[np.abs(force) <= BALANCED * (abs(A) @ np.abs(R))] = 0.0
    if not np.any(force):
        return A
    root = model.interfaces[0].dofs
    rows, columns = np.nonzero(force)
    between = coo_array((force[rows, columns], (rows, root[columns])), shape=A.shape)
    own = coo_array(((R.T @ force).ravel(), (np.repeat(root, 6), np.tile(root, 6))), shape=A.shape)
    return (A - between - between.T + own).tocsr()


@dataclass(frozen=True, eq=False)
class WithGeometricTerms:
    """The geometric stiffness of a model and that of a term.

    Attributes
    ----------
    inner : PrestressStiffness
    form : BilinearForm
    bases : list of CellBasis
    model : FEModel
        Whose frame of the root displacements are relative to.
    """

    inner: PrestressStiffness
    form: BilinearForm
    bases: list[CellBasis]
    model: FEModel

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the prestress due to displacement d under the nodal load (N)."""
        return (self.inner(d, load) + self._own(d)).tocsr()

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the prestress of each static response (n_dof, k) under its load."""
        out = self.inner.project(static, loads, Phi)
        for k in np.flatnonzero(np.any(loads, axis=0)):
            out[k] += Phi.T @ (self._own(static[:, k]) @ Phi)
        return out

    def _own(self, d: np.ndarray) -> csr_array:
        moved = d - self.model.rigid_body() @ d[self.model.interfaces[0].dofs]
        A = csr_array(sum(self.form.assemble(basis, d=interpolated(basis, moved)) for basis in self.bases))
        return _relative(self.model, ((A + A.T) / 2).tocsr())
