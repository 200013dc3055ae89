"""The model with its fixed interfaces held: partition, factor, constraint modes and static answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError, InputError, MechanismError
from modalprep.fe.model import FEModel
from modalprep.linalg.factor import Factor, factorize

MECHANISM = 1e-15  # strain energy over the sum of its absolute terms: round-off of a rigid motion is 1e-17


@dataclass(frozen=True, eq=False)
class Clamped:
    """Independent DOFs split into ``b`` (fixed interfaces, the root first) and ``i`` (all others).

    Attributes
    ----------
    K, M : (n_free, n_free) csr
    b, i : int arrays
        Positions among the independent DOFs.
    K_ii, M_ii : csr
    factor : Factor
        Of ``K_ii``.
    Psi : (n_i, n_b)
        Constraint modes ``-K_ii^-1 K_ib``.
    """

    model: FEModel
    K: csr_array
    M: csr_array
    b: np.ndarray
    i: np.ndarray
    K_ii: csr_array
    M_ii: csr_array
    factor: Factor
    Psi: np.ndarray

    def static(self, F: np.ndarray) -> np.ndarray:
        """Return the displacement ``(n_dof, k)`` under nodal loads ``F (n_dof, k)`` with only the root held."""
        f = self.model.C.T @ F
        x = np.zeros_like(f)
        others = np.arange(6, len(self.b))  # the root's six DOFs come first
        if len(others):
            Psi = self.Psi[:, others]
            K_ob = self.K[self.b[others]]
            schur = K_ob[:, self.b[others]].toarray() + K_ob[:, self.i] @ Psi
            x[self.b[others]] = np.linalg.solve(schur, f[self.b[others]] + Psi.T @ f[self.i])
            x[self.i] = Psi @ x[self.b[others]]
        x[self.i] += self.factor.solve(f[self.i])
        return self.model.C @ x

    def expand(self, x_i: np.ndarray) -> np.ndarray:
        """Put vectors of interior DOFs ``(n_i, k)`` among the independent ones ``(n_free, k)``."""
        x = np.zeros((self.K.shape[0], x_i.shape[1]))
        x[self.i] = x_i
        return x


def clamp(model: FEModel, solver: str = "auto") -> Clamped:
    """Hold the fixed interfaces of a model and factorize what is left.

    Raises
    ------
    MechanismError
        When the held structure can still move without strain; the sentence says where.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> held = clamp(cantilever_model())
    >>> len(held.b), held.Psi.shape
    (6, (60, 6))
    """
    K, M = ((model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M))
    fixed = np.concatenate([frame.dofs for frame in model.interfaces if frame.boundary == "fixed"])
    b = np.searchsorted(model.free, fixed)
    i = np.setdiff1d(np.arange(K.shape[0]), b)
    if not len(i):
        raise InputError("every node is held by a fixed interface: no mode is left; hold fewer nodes")
    K_ii, M_ii = (A[i][:, i].tocsr() for A in (K, M))
    try:
        factor = factorize(K_ii, solver)
    except AccuracyError:
        raise MechanismError(_moving(model, model.free[i], np.asarray(K_ii.diagonal() == 0, dtype=float))) from None
    _refuse_mechanism(model, K_ii, factor, model.free[i])
    Psi = -factor.solve(K[i][:, b].toarray())
    return Clamped(model, K, M, b, i, K_ii, M_ii, factor, Psi)


def _refuse_mechanism(model: FEModel, K: csr_array, factor: Factor, dofs: np.ndarray) -> None:
    """Inverse iteration finds the softest shape; a mechanism has no strain energy beyond round-off."""
    x = np.random.default_rng(0).standard_normal(len(dofs))
    for _ in range(3):
        x = factor.solve(K.diagonal() * x)
        x /= np.abs(x).max()
    if not np.all(np.isfinite(x)) or abs(x @ (K @ x)) < MECHANISM * (np.abs(x) @ (abs(K) @ np.abs(x))):
        raise MechanismError(_moving(model, dofs, np.abs(np.nan_to_num(x))))


def _moving(model: FEModel, dofs: np.ndarray, motion: np.ndarray) -> str:
    node, component = (int(v[0]) for v in np.nonzero(model.dof == dofs[np.argmax(motion)]))
    what = (
        "moves along x",
        "moves along y",
        "moves along z",
        "turns about x",
        "turns about y",
        "turns about z",
    )
    at = "an interface frame"
    if node < len(model.points):
        at = f"node {node + 1} near ({', '.join(f'{v:.4g}' for v in model.points[node] + model.origin)}) m"
    return (
        f"the structure is a mechanism: with its fixed interfaces held, {at} still {what[component]} without strain; "
        "connect that part, or fix an interface with enough nodes"
    )
