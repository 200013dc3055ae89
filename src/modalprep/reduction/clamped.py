"""The model with its fixed interfaces clamped: partition, factor, constraint modes and static responses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh, solve_triangular
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError, InputError, MechanismError
from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.linalg.blas import inner, product
from modalprep.linalg.bordered import Bordered
from modalprep.linalg.congruent import Congruent, bound
from modalprep.linalg.empty import EmptyFactor
from modalprep.linalg.factor import Factor
from modalprep.linalg.memory import reserved
from modalprep.linalg.sparse import times

TWICE = 1_000_000  # unknowns from which the interior matrices are not stored beside those of the model
BYTES = 2e8  # of right-hand sides and their solutions at a time
LEAST = 8  # of them, as a solution reads the whole factor
FREE = 1e-11  # stiffness of an interface direction over that of its DOFs alone: mechanisms have 1e-16 to 2e-12
MECHANISM = 1e-15  # strain energy over the sum of its absolute terms: round-off of a rigid motion is 1e-17


@dataclass(frozen=True, eq=False)
class Clamped:
    """Independent DOFs split into ``b`` (fixed interfaces, the root first) and ``i`` (all others).

    Attributes
    ----------
    K, M : Bordered
        ``(n_free, n_free)``.
    factor : Factor
        Of ``K_ii``.
    """

    model: FEModel
    K: Bordered
    M: Bordered
    factor: Factor

    @property
    def b(self) -> np.ndarray:
        """Positions (n_b,) among the independent DOFs."""
        return self.K.b

    @property
    def i(self) -> slice | np.ndarray:
        """Positions of all others: a slice where they follow each other, which selects without a copy."""
        return self.K.i

    @property
    def K_ii(self) -> csr_array | Congruent:
        """Interior stiffness (n_i, n_i)."""
        return self.K.inside

    @property
    def M_ii(self) -> csr_array | Congruent:
        """Interior mass (n_i, n_i)."""
        return self.M.inside

    @cached_property
    def _solved(self) -> np.ndarray:
        """Constraint modes, and the answers to the unit loads on the interior DOFs; all in one solution."""
        x = np.hstack([-self.K.coupling.toarray().T, self.inside_loads])
        for columns in self.at_once(x.shape[1]):
            x[:, columns] = self.interior_response(x[:, columns])
        return x

    def at_once(self, n: int) -> list[slice]:
        """Return slices that cover n columns, which are solved for at once: a solution needs memory for each."""
        block = getattr(self.factor, "block", LEAST)  # of one on disk, which is read for each of them
        step = max(block, int(BYTES / (8 * self.K.shape[0])))
        return [slice(k, min(k + step, n)) for k in range(0, n, step)]

    @property
    def inside_loads(self) -> np.ndarray:
        """`unit_loads` on the interior DOFs, ``(n_i, 12 + 6 n_if)``."""
        return (self.model.C.T @ self.unit_loads)[self.i]

    @property
    def Psi(self) -> np.ndarray:
        """Constraint modes ``-K_ii^-1 K_ib (n_i, n_b)``."""
        return self._solved[:, : len(self.b)]

    @property
    def unit_answers(self) -> np.ndarray:
        """Displacements ``(n_i, 12 + 6 n_if)`` under `inside_loads` with every fixed interface held."""
        return self._solved[:, len(self.b) :]

    @cached_property
    def _released(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """With only the root clamped: displacements ``(n_free, k)`` of unit flexible and of free directions.

        Directions of the other fixed interfaces in which the body moves without strain (`FREE`) are its
        mechanisms: their shapes come M-orthonormal, the others with their inverse stiffness.
        """
        others = np.arange(6, len(self.b))  # the root's six DOFs come first
        W = np.zeros((self.K.shape[0], len(others)))
        W[self.b[others], np.arange(len(others))] = 1.0
        W[self.i] = self.Psi[:, others]
        schur = W[self.b[others]].T @ (self.K.border[others] @ W)
        scale = 1 / np.sqrt(self.K.diagonal()[self.b[others]])
        stiffness, V = eigh((schur + schur.T) / 2 * scale * scale[:, None])
        free = stiffness < FREE
        shapes = product(W, scale[:, None] * V)
        loose = shapes[:, free]
        if loose.shape[1]:
            loose = solve_triangular(np.linalg.cholesky(loose.T @ (self.M @ loose)), loose.T, lower=True).T
        return shapes[:, ~free], 1 / stiffness[~free], loose

    @property
    def constraint_shapes(self) -> np.ndarray:
        """Span ``(n_free, k)`` of the constraint modes of the other fixed interfaces, without `mechanisms`."""
        return self._released[0]

    @property
    def mechanisms(self) -> np.ndarray:
        """M-orthonormal motions ``(n_free, k)`` without strain that remain when only the root is clamped."""
        return self._released[2]

    def release(self) -> None:
        """Free the factor and the answers to unit loads; they are computed again where they are asked for."""
        self.factor.release()
        self.__dict__.pop("_solved", None)

    def static(self, F: np.ndarray) -> np.ndarray:
        """Return the displacement ``(n_dof, k)`` under nodal loads ``F (n_dof, k)`` with only the root clamped.

        Where clamping the root leaves mechanisms, these accelerate and their inertia balances the load.
        """
        return times(self.model.C, self.static_free(self.model.C.T @ F))

    def static_free(self, f: np.ndarray, fixed_response: np.ndarray | None = None) -> np.ndarray:
        """Return `static` among the independent DOFs: displacements ``(n_free, k)`` under ``f (n_free, k)``.

        `fixed_response` (n_i, k) are the answers with every fixed interface held, where they are known.
        """
        shapes, flexibility, loose = self._released
        if loose.shape[1]:
            f = f - self.M @ (loose @ (loose.T @ f))
            fixed_response = None
        x = product(shapes, flexibility[:, None] * inner(shapes, f))
        if fixed_response is not None:
            x[self.i] += fixed_response
            return x
        for columns in self.at_once(f.shape[1]):
            x[self.i, columns] += self.interior_response(f[self.i, columns])
        return x

    def interior_response(self, f: np.ndarray) -> np.ndarray:
        """Return the displacements ``(n_i, k)`` under ``f (n_i, k)`` with every fixed interface held."""
        loaded = np.any(f, axis=0)  # loads on fixed interfaces are not
        if np.all(loaded):
            return self.factor.solve(f)
        x = np.zeros(f.shape, order="F")
        x[:, loaded] = self.factor.solve(f[:, loaded])
        return x

    @property
    def unit_loads(self) -> np.ndarray:
        """The body's unit loads ``(n_dof, 12 + 6 n_if)``: inertia, then force and moment on each interface."""
        model = self.model
        return np.concatenate([model.inertia_loads, unit_loads(model, [f.dofs for f in model.interfaces])], axis=1)

    def expand(self, *x_i: np.ndarray) -> np.ndarray:
        """Expand vectors of interior DOFs, each ``(n_i, k)``, to the independent DOFs, side by side."""
        ends = np.cumsum([0, *(x.shape[1] for x in x_i)])
        out = np.zeros((self.K.shape[0], ends[-1]))
        for x, start, end in zip(x_i, ends[:-1], ends[1:], strict=True):
            out[self.i, start:end] = x
        return out


def unit_loads(model: FEModel, dofs: list[np.ndarray]) -> np.ndarray:
    """Return unit nodal loads ``(n_dof, k)`` on each of the DOFs."""
    columns = np.concatenate([np.zeros(0, dtype=int), *dofs])
    unit = np.zeros((model.n_dof, len(columns)))
    unit[columns, np.arange(len(columns))] = 1.0
    return unit


def clamp(model: FEModel, solver: str = "auto", algebra: Algebra = DIRECT, columns: int = 0) -> Clamped:
    """Clamp the fixed interfaces of a model and factorise the interior stiffness.

    The factor leaves memory for so many `columns` of vectors (n_free,).

    Raises
    ------
    MechanismError
        When the clamped structure can still move without strain; the sentence says where.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> clamped = clamp(cantilever_model())
    >>> len(clamped.b), clamped.Psi.shape
    (6, (60, 6))
    """
    fixed = np.concatenate([frame.dofs for frame in model.interfaces if frame.boundary == "fixed"])
    b = np.searchsorted(model.free, fixed)
    i = _others(b, len(model.free))
    K = _of_independent(model, model.K, b, i)
    M = _of_independent(model, model.M, b, i)
    if len(model.free) == len(b):
        return Clamped(model, K, M, _nothing_inside(b))
    try:
        with reserved(8.0 * len(model.free) * columns):
            factor = algebra.factorise(K.inside, solver)
    except AccuracyError:
        raise MechanismError(_moving(model, model.free[i], np.asarray(K.inside.diagonal() == 0, dtype=float))) from None
    _refuse_mechanism(model, K.inside, factor, model.free[i])
    return Clamped(model, K, M, factor)


def _nothing_inside(b: np.ndarray) -> Factor:
    """Return the factor of the matrix without rows, of a body that its constraint modes describe whole."""
    if len(b) == 6:
        raise InputError("every node belongs to the fixed interface, so that no mode is left; fix fewer nodes")
    return EmptyFactor()


def _others(b: np.ndarray, n: int) -> slice | np.ndarray:
    """Return the positions below n that are not in b, as a slice where they follow each other."""
    i = np.delete(np.arange(n), b)
    return slice(i[0], i[-1] + 1) if len(i) and i[-1] - i[0] < len(i) else i


def _of_independent(model: FEModel, A: csr_array, b: np.ndarray, i: slice | np.ndarray) -> Bordered:
    """Return the symmetric ``C^T A C``; its inside transposed, which takes less time than to sort it as it is."""
    C_i = model.C[:, i]
    border = model.C[:, b].T.tocsr() @ A @ model.C
    if len(model.free) > TWICE:
        return Bordered(Congruent(A, C_i), border.tocsr(), b, i)
    inside = (C_i.T.tocsr() @ A @ C_i).T.tocsr()
    inside.eliminate_zeros()  # the mass of solids does not couple components: a third of the pattern of K
    return Bordered(inside, border.tocsr(), b, i)


def _refuse_mechanism(model: FEModel, K: csr_array | Congruent, factor: Factor, dofs: np.ndarray) -> None:
    """Refuse a mechanism: inverse iteration finds the softest shape, whose strain energy is then round-off."""
    x = np.random.default_rng(0).standard_normal(len(dofs))
    diagonal = K.diagonal()
    for _ in range(3):
        x = factor.solve(diagonal * x)
        x /= np.abs(x).max()
    if not np.all(np.isfinite(x)) or abs(x @ (K @ x)) < MECHANISM * (np.abs(x) @ bound(K, x)):
        raise MechanismError(_moving(model, dofs, np.abs(np.nan_to_num(x))))


def _moving(model: FEModel, dofs: np.ndarray, motion: np.ndarray) -> str:
    node, component = (int(v[0]) for v in np.nonzero(model.dof == dofs[np.argmax(motion)]))
    what = f"{('moves along', 'turns about')[component // 3]} {'xyz'[component % 3]}"
    at = "an interface frame"
    if node < len(model.points):
        at = f"node {node + 1} near ({', '.join(f'{v:.4g}' for v in model.points[node] + model.origin)}) m"
    return (
        f"the structure is a mechanism: with its fixed interfaces clamped, {at} still {what} without strain; "
        "connect that part, or fix an interface with enough nodes"
    )
