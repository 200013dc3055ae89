"""The mass of a term: its matrix, linear vectors, mass tensor and rigid inertia, all from one density (theory 1.8).

The density is what the form gives of unit displacements: ``rho`` times the identity, or times a projector P, where only
the motion along P of the faces or lines moves the mass. Then it has the displacement ``P u + (1 - P) u_r``, where
``u_r`` is that of the frame of the root, so that it still moves rigidly with the body.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_array, csr_array
from skfem.assembly import BilinearForm, CellBasis
from skfem.assembly.form.form import FormExtraParams
from skfem.element import DiscreteField

from modalprep.errors import InputError
from modalprep.fe.elements.mass import PAIRS, SAME, MassSamples, RigidInertia, mass_from_samples
from modalprep.vectors import skew

EXACT = 1e-9  # relative: forms and sums of products agree to round-off
AT_ONCE = 512  # cells, whose matrices caches keep
ADVICE = "a mass is int rho u.v, or along some directions such as int rho (u.n) (v.n)"


class TermMass(NamedTuple):
    """The mass objects of theory 1 that a term adds.

    Attributes
    ----------
    g : (n_dof, 3)
    h : (n_dof, 3, 3)
    pairs : {(a, b): (n_dof, n_dof) csr}
    rigid : RigidInertia
    """

    g: np.ndarray
    h: np.ndarray
    pairs: dict[tuple[int, int], csr_array]
    rigid: RigidInertia

    @property
    def M(self) -> csr_array:
        """The mass matrix ``(n_dof, n_dof)``."""
        return (self.pairs[0, 0] + self.pairs[1, 1] + self.pairs[2, 2]).tocsr()


def term_mass(form: BilinearForm, bases: list[CellBasis], root: np.ndarray, n: int) -> TermMass:
    """Return the mass of a form on bases of a model with n DOFs; those of the frame of its root are ``root (6,)``.

    Raises
    ------
    InputError
        When the form is not that of a mass.
    """
    g, h = np.zeros((n, 3)), np.zeros((n, 3, 3))
    rigid = RigidInertia(0.0, np.zeros(3), np.zeros((3, 3)))
    pairs = dict.fromkeys(PAIRS, csr_array((n, n)))
    for basis in bases:
        own = csr_array((n, n))
        for samples, dofs in _samples(basis, *_density(form, basis), root):
            mass = mass_from_samples(samples)
            np.add.at(g, dofs, mass.g)
            np.add.at(h, dofs, mass.h)
            rigid += mass.rigid
            pairs = {pair: pairs[pair] + _matrix(mass.tensor[:, k], dofs, n) for k, pair in enumerate(PAIRS)}
            nl = basis.Nbfun
            own += _matrix(mass.tensor[:, SAME, :nl, :nl].sum(axis=1), dofs[:, :nl], n)
        _refuse_other_parts(own, form.assemble(basis))
    return TermMass(g, h, pairs, rigid)


def _density(form: BilinearForm, basis: CellBasis) -> tuple[np.ndarray, np.ndarray | None]:
    """Return rho ``(ne, nq)`` and the projector ``(ne, nq, 3, 3)``, None where all directions count."""
    units = [_constant(basis, a) for a in range(3)]
    w = FormExtraParams(basis.default_parameters())
    D = np.array([[np.broadcast_to(form.form(*u, *v, w), basis.dx.shape) for u in units] for v in units])
    D = np.moveaxis(D, (0, 1), (2, 3))
    principal = np.linalg.eigvalsh((D + D.swapaxes(2, 3)) / 2)  # ascending
    rho = principal[..., -1]
    size = np.abs(D).max()
    if size == 0 or np.any(principal[..., 0] < -EXACT * size):
        raise InputError("its density is zero or negative; give a positive one")
    if np.all(np.abs(D - rho[..., None, None] * np.eye(3)) <= EXACT * size):
        return rho, None
    P = D / np.where(rho > 0, rho, 1.0)[..., None, None]
    if np.any(np.abs(P @ P - P) > EXACT):
        raise InputError(f"its density differs between directions; {ADVICE}")
    return rho, P


def _constant(basis: CellBasis, a: int) -> list[DiscreteField]:
    """Return the fields of a unit displacement along axis a, without rotation."""
    fields = [field.zeros() for field in basis.basis[0]]
    fields[0] = DiscreteField(np.asarray(fields[0]).copy(), *fields[0].astuple[1:])
    np.asarray(fields[0])[a] = 1.0
    return fields


def _samples(
    basis: CellBasis, rho: np.ndarray, P: np.ndarray | None, root: np.ndarray
) -> Iterator[tuple[MassSamples, np.ndarray]]:
    """Yield the samples of some cells with their DOFs ``(ne, nl)``, those of the root last where P needs them."""
    ne, nq = basis.dx.shape
    at = np.moveaxis(np.asarray(basis.global_coordinates()), 0, 2)
    for some in (slice(k, k + AT_ONCE) for k in range(0, ne, AT_ONCE)):
        x = at[some]
        shape = np.stack([np.broadcast_to(f[0], (3, ne, nq))[:, some] for f in basis.basis], axis=3)
        shape = np.moveaxis(shape, 0, 2)
        dofs = basis.element_dofs.T[some]
        if P is not None:
            rigid = np.concatenate([np.broadcast_to(np.eye(3), (*x.shape, 3)), -skew(x)], axis=3)
            shape = np.concatenate([P[some] @ shape, rigid - P[some] @ rigid], axis=3)
            dofs = np.concatenate([dofs, np.tile(root, (len(dofs), 1))], axis=1)
        weight = (rho * basis.dx)[some]
        yield MassSamples(weight, np.ones(nq), x, shape), dofs


def _matrix(local: np.ndarray, dofs: np.ndarray, n: int) -> csr_array:
    """Sum up local matrices ``(ne, nl, nl)``."""
    rows = np.broadcast_to(dofs[:, :, None], local.shape)
    place = (rows.ravel(), rows.swapaxes(1, 2).ravel())
    return coo_array((local.ravel(), place), shape=(n, n)).tocsr()


def _refuse_other_parts(own: csr_array, given) -> None:
    """Refuse a form that is more than a density, such as one of gradients or rotations."""
    if abs(own - csr_array(given)).max() > EXACT * abs(own).max():
        raise InputError(f"its mass is not that of a density alone, it has gradients or rotations; {ADVICE}")
