"""The eigenvalue problem of a sector for one nodal diameter: Hermitian, solved as a real one of twice the size."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError, InputError
from modalprep.linalg.factor import factorise
from modalprep.linalg.modes import Modes, lowest_modes
from modalprep.reduction.cyclic.sector import Sector, pair

SHIFT = 1e-7  # of the stiffness over the mass of a DOF, (rad/s)^2: of rings that float
RIGID = 1e-4  # of the shift: squared frequencies below it are round-off of rigid motions
NEAR = 1e-6  # of w^2: pairs that are found together
ALONE = 0.5  # of the share 2 of a pair's first vector; that of its second vector is 0


class Spin(NamedTuple):
    """A sector at speed.

    Attributes
    ----------
    K, G : (m, m) csr
        What adds to the stiffness, and the gyroscopic matrix.
    x : (n_dof,)
        The steady displacement, m.
    """

    K: csr_array
    G: csr_array
    x: np.ndarray


@dataclass(frozen=True, eq=False)
class Problem:
    """Matrices of a sector by nodal diameter, at rest or at speed; `held` where nothing floats."""

    sector: Sector
    held: bool
    solver: str
    spin: Spin | None = None

    @cached_property
    def at_rest(self) -> csr_array:
        """The stiffness at rest."""
        return self.sector.reduced(self.sector.model.K)

    @cached_property
    def mass(self) -> csr_array:
        """The mass."""
        return self.sector.reduced(self.sector.model.M)

    def of(self, A: csr_array, n: int) -> csr_array:
        """Return a matrix for n nodal diameters, Hermitian or, of single modes, real."""
        T = self.sector.map(n)
        return (T.conj().T @ A @ T).tocsr()

    def matrices(self, n: int) -> tuple[csr_array, csr_array]:
        """Return stiffness and mass for n nodal diameters."""
        K = self.at_rest if self.spin is None else self.at_rest + self.spin.K
        return self.of(K, n), self.of(self.mass, n)

    def static(self, n: int, f: np.ndarray) -> np.ndarray:
        """Return the displacements (m, k) at rest under loads ``f (m, k)``, with n nodal diameters."""
        T = self.sector.map(n)
        load = T.conj().T @ f
        try:
            factor = factorise(_real(self.of(self.at_rest, n)), self.solver)
        except AccuracyError:
            raise InputError(f"the sector moves without strain in {n} nodal diameters; hold it or connect it") from None
        if not np.iscomplexobj(T):
            return T @ factor.solve(load.real)
        x = factor.solve(np.concatenate([load.real, load.imag]))
        return T @ (x[: len(load)] + 1j * x[len(load) :])


def single_modes(K: csr_array, M: csr_array, count: int, held: bool = True, solver: str = "auto") -> Modes:
    """Return the lowest ``w^2 (k,)`` of Hermitian matrices, M-orthonormal shapes (p, k), and how they were counted.

    Examples
    --------
    >>> K = csr_array(np.array([[2.0, 1j], [-1j, 2.0]]))
    >>> single_modes(K, csr_array(np.eye(2, dtype=complex)), 2)[0].round(9)
    array([1., 3.])
    """
    if not K.shape[0]:
        return Modes(np.zeros(0), np.zeros((0, 0)), "")
    shift = 0.0 if held else -SHIFT * _typical(K, M)
    double = np.iscomplexobj(K)
    w2, X, counted = lowest_modes(_real(K), _real(M), count * (1 + double), shift=shift, solver=solver)
    w2 = np.where(np.abs(w2) < -RIGID * shift, 0.0, w2)
    if double:
        w2, X = one_of_each(K, M, w2, X[: len(X) // 2] + 1j * X[len(X) // 2 :], count)
    return Modes(w2, X, counted)


def one_of_each(K: csr_array, M: csr_array, w2: np.ndarray, Z: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return one of the two vectors of each pair: those of a real problem are also i times each other.

    Examples
    --------
    >>> one = csr_array(np.eye(1, dtype=complex))
    >>> one_of_each(one, one, np.ones(2), np.array([[1.0, 1j]]), 1)[1].shape
    (1, 1)
    """
    values, vectors = [], []
    for group in np.split(np.arange(len(w2)), np.flatnonzero(np.diff(w2) > NEAR * np.abs(w2[1:])) + 1):
        share, Y = eigh(Z[:, group].conj().T @ (M @ Z[:, group]))
        X = Z[:, group] @ (Y[:, share > ALONE] / np.sqrt(share[share > ALONE]))
        own, Y = eigh(X.conj().T @ (K @ X))
        values.append(np.where(w2[group[0]] == 0, 0.0, own))
        vectors.append(X @ Y)
    return np.concatenate(values)[:count], np.concatenate(vectors, axis=1)[:, :count]


def _real(A: csr_array) -> csr_array:
    return pair(A) if np.iscomplexobj(A) else A


def _typical(K: csr_array, M: csr_array) -> float:
    """Return the median stiffness over mass of a DOF, (rad/s)^2."""
    k, m = K.diagonal().real, M.diagonal().real
    return float(np.median(k[m > 0] / m[m > 0]))
