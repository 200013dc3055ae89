"""Lowest modes of ``K phi = w^2 M phi``, verified before they are returned."""

from __future__ import annotations

from contextlib import suppress
from typing import NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, eigh
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError, InputError
from modalprep.linalg.blas import inner, one_numpy_thread, product, share_threads
from modalprep.linalg.congruent import Congruent, bound, shifted, stored
from modalprep.linalg.factor import Factor, factorise
from modalprep.linalg.lanczos import block_lanczos
from modalprep.linalg.pardiso import equilibrium
from modalprep.linalg.sparse import times
from modalprep.linalg.unique import made_unique

DENSE = 500  # below this size LAPACK is quicker than Lanczos and finds every mode
RESIDUAL = 1e-9  # of w^2 |M phi|: what Lanczos reaches wherever round-off lets it
ROUND_OFF = 10 * np.finfo(float).eps  # of |K| |phi|: what may be left of the equation besides
POOR = 100.0  # times these two: what sweeps could not mend means trouble
ORTHOGONALITY = 1e-8
PROBES, SURE = 32, 3.0  # random combinations of modes; of an error they show a third at least
SWEEPS = 3
NEAR = 1e-6  # of w^2: closer modes count as repeated
COLUMNS = 32  # modes that are checked at a time by one of `THREADS`: 128 take half as long again
THREADS = 2
WIDE = 1e-6  # 1/w^2 over that of the lowest mode: below it round-off matters
MASSLESS = 1e-14  # 1/w^2 over that of the lowest mode: the round-off of a direction without mass


class Modes(NamedTuple):
    """Lowest modes.

    Attributes
    ----------
    w2 : (n,)
        (rad/s)^2, ascending.
    phi : (n_dof, n)
        M-orthonormal.
    counted : str
        How it is known that none is missing; empty where the factorisation did not tell.
    """

    w2: np.ndarray
    phi: np.ndarray
    counted: str


@one_numpy_thread(beside_mkl=True)
def lowest_modes(
    K: csr_array | Congruent,
    M: csr_array | Congruent,
    n: int,
    *,
    factor: Factor | None = None,
    shift: float = 0.0,
    solver: str = "auto",
) -> Modes:
    """Return the n lowest modes.

    Block Lanczos on the factor of ``K - shift M``; dense for small models. Residual and orthonormality of every mode
    are checked, and the inertia of ``K - w^2 M`` just below the highest mode counts that none was missed.

    Parameters
    ----------
    K, M : csr
        Symmetric; DOFs of M may be massless.
    n : int
        Clipped to the number of DOFs with mass.
    factor : Factor
        Of ``K - shift M`` when it exists already.
    shift : float
        (rad/s)^2; negative for a body with rigid motions, whose K is singular.
    solver : {"auto", "in_memory", "single", "out_of_core", "superlu"}
        As `factorise` takes it.

    Returns
    -------
    Modes
        ``w^2`` (n,), (rad/s)^2, ascending, and the shapes (n_dof, n), orthonormal in M.

    Raises
    ------
    AccuracyError
        When a mode does not satisfy the equation, or one is missing.

    References
    ----------
    R. G. Grimes, J. G. Lewis, H. D. Simon, A shifted block Lanczos algorithm for solving sparse symmetric generalized
    eigenproblems, SIAM J. Matrix Anal. Appl. 15 (1994) 228.

    Examples
    --------
    >>> K = csr_array(np.array([[2.0, -1.0], [-1.0, 2.0]]))
    >>> w2, phi, _ = lowest_modes(K, csr_array(np.eye(2)), 1)
    >>> w2
    array([1.])
    """
    size = K.shape[0]
    n = min(n, int(np.count_nonzero(M.diagonal())))
    if n == 0:
        return Modes(np.zeros(0), np.zeros((size, 0)), "")
    if size <= DENSE or n > size // 3:
        w2, phi = _verified(K, M, *_dense(stored(K).toarray(), stored(M).toarray(), n, shift))
        phi = _alone(phi)
        counted = "a dense solver leaves none out"
    else:
        factor = factor or factorise(shifted(K, M, shift), solver)
        w2, phi, counted = _counted(K, M, n, factor, shift, solver)
    return Modes(w2, made_unique(w2, phi, K), counted)


def count_below(
    K: csr_array | Congruent, M: csr_array | Congruent, w2: float, solver: str = "auto", order: np.ndarray | None = None
) -> int | None:
    """Return how many eigenvalues of ``K phi = w^2 M phi`` lie below `w2`, by Sylvester's law of inertia.

    None where the factorisation does not tell (SuperLU, where it is inaccurate without exchanges of rows) or does not
    fit into the memory: a factor in single precision does not count. `order (n,)` is the order of elimination of
    another shift.

    Examples
    --------
    >>> K = csr_array(np.diag([1.0, 4.0, 9.0]))
    >>> count_below(K, csr_array(np.eye(3)), 5.0)
    2
    """
    try:
        how = "auto" if solver == "single" else solver
        return factorise(shifted(K, M, w2), how, definite=False, order=order).negative
    except InputError:
        return None


def _counted(
    K: csr_array | Congruent, M: csr_array | Congruent, n: int, factor: Factor, shift: float, solver: str
) -> tuple:
    """Lanczos, and once more from another start when modes are missing.

    The count is just below the highest mode, whose own repetitions may be cut off.
    """
    known = None
    block = getattr(factor, "block", 0)  # of one on disk, which is read for each of them
    while True:
        again = known is not None
        w2, phi = _verified(K, M, *block_lanczos(factor, M, n, shift=shift, known=known, block=block), factor)
        phi = _alone(phi)  # the count needs the memory of the basis
        known = w2, phi
        cut = w2[-1] - max(NEAR * abs(w2[-1]), NEAR * abs(w2[0]))
        found = int(np.sum(w2 < cut))
        exist = _exist(K, M, cut, factor, solver)
        if exist is None or exist == found:
            return w2, phi, "" if exist is None else "counted by the inertia of K - w^2 M"
        if again:
            raise AccuracyError(
                f"{found} modes were found below {np.sqrt(max(cut, 0)) / (2 * np.pi):.6g} Hz, where there are {exist}; "
                "the structure has parts that hardly have mass or stiffness: check materials and connections"
            )


def _alone(phi: np.ndarray) -> np.ndarray:
    """Return modes without the larger basis of which they are a part."""
    return phi.copy(order="K") if phi.base is not None and phi.base.size > phi.size else phi


def _exist(K: csr_array | Congruent, M: csr_array | Congruent, cut: float, factor: Factor, solver: str) -> int | None:
    """Return how many modes there are, counted by a second factor, for which the first makes room where it must."""
    if not factor.fits_twice():
        factor.release()
    return count_below(K, M, cut, solver, getattr(factor, "order", None))


def _verified(
    K: csr_array | Congruent, M: csr_array | Congruent, w2: np.ndarray, phi: np.ndarray, factor: Factor | None = None
) -> tuple:
    """Return modes that satisfy the equation to round-off where the factor allows it, or raise AccuracyError.

    Rigid motions, stiff parts and factors of few digits cost Lanczos digits: subspace iteration on the factor returns
    them. Taking off ``(K - s M)^-1 (K - w^2 M) phi`` is in exact arithmetic the same as ``(K - s M)^-1 M phi``, but
    round-off of the solution is then that of the residual.
    """
    ratio, mode, gram = _worst(K, M, w2, phi)
    for _ in range(SWEEPS):
        if factor is None or (ratio <= 1 and gram <= ORTHOGONALITY):
            break
        w2, phi = _ritz(K, M, phi - factor.solve(times(K, phi) - times(M, phi) * w2))
        ratio, mode, gram = _worst(K, M, w2, phi)
    if ratio <= POOR and gram <= ORTHOGONALITY:
        return w2, phi
    raise AccuracyError(
        f"mode {mode + 1} of {len(w2)} is not accurate (residual {ratio:.1e} times what is allowed, "
        f"orthogonality {gram:.1e}); check the mesh for very thin or stiff parts"
    )


def _dense(K: np.ndarray, M: np.ndarray, n: int, shift: float) -> tuple[np.ndarray, np.ndarray]:
    """Diagonalise the flexibility: its round-off is relative to the lowest mode."""
    size = len(K)
    try:
        flexibility, phi = eigh(M, K - shift * M, subset_by_index=(size - n, size - 1))
    except LinAlgError:
        raise AccuracyError("the stiffness matrix is not positive definite: the structure is not held") from None
    flexibility = flexibility[::-1]
    phi = phi[:, ::-1]
    heavy = flexibility > MASSLESS * flexibility[0]
    flexibility = flexibility[heavy]
    phi = phi[:, heavy]
    w2 = 1 / flexibility + shift
    phi = phi / np.sqrt(flexibility)
    return _with_upper_modes(K, M, w2, phi) if flexibility[-1] < WIDE * flexibility[0] else (w2, phi)


def _with_upper_modes(K: np.ndarray, M: np.ndarray, w2: np.ndarray, phi: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Take the upper half of the decades from K, whose round-off is relative to the highest mode, where M allows it.

    The lower modes stay as they are: each mode is made orthonormal to those below it.
    """
    upper = w2 > np.sqrt(abs(w2[0])) * np.sqrt(abs(w2[-1]))
    if len(w2) == len(K):
        with suppress(LinAlgError):  # M is singular to round-off: the modes are those of the flexibility
            values, shapes = eigh(K, M)
            w2, phi = np.where(upper, values, w2), np.where(upper, shapes, phi)
    return w2, phi @ np.linalg.inv(np.linalg.cholesky(phi.T @ M @ phi)).T


def _ritz(K: csr_array | Congruent, M: csr_array | Congruent, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rayleigh-Ritz on the space of X."""
    X = X / np.sqrt(np.einsum("ij,ij->j", X, M @ X))
    w2, Y = eigh(X.T @ (K @ X), X.T @ (M @ X))
    return w2, X @ Y


def _worst(
    K: csr_array | Congruent, M: csr_array | Congruent, w2: np.ndarray, phi: np.ndarray
) -> tuple[float, int, float]:
    """Return the largest residual over what is allowed, its mode, and the largest error of orthonormality.

    Forces and moments count by their own stiffness.
    """
    scale = equilibrium(K)[:, None]
    starts = range(0, len(w2), COLUMNS)
    with share_threads(THREADS) as pool:
        found = pool.map(lambda k: _ratios(K, M, scale, w2[k : k + COLUMNS], phi[:, k : k + COLUMNS]), starts)
        ratio = np.concatenate(list(found))
        gram = _size_of_rows(M, phi)
        if gram > ORTHOGONALITY:
            gram = max(pool.map(lambda k: _gram_error(M, phi, slice(k, k + COLUMNS)), starts))
    return float(ratio.max()), int(np.argmax(ratio)), gram


def _size_of_rows(M: csr_array, phi: np.ndarray) -> float:
    """Return the largest norm of a row of ``phi^T M phi - 1``, about, by `PROBES` random combinations.

    No entry exceeds the norm of its row. The estimate is multiplied by `SURE`: about once in 1e10 times it is less than
    a third of the norm. If it exceeds what is allowed, the caller looks at every entry.
    """
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (phi.shape[1], PROBES))
    error = inner(phi, times(M, product(phi, signs))) - signs
    return SURE * float(np.sqrt(np.mean(error**2, axis=1).max()))


def _gram_error(M: csr_array, phi: np.ndarray, part: slice) -> float:
    """Return the largest error of orthonormality of some modes to those up to them."""
    before = phi[:, : part.stop]
    return float(np.abs(inner(before, times(M, phi[:, part])) - np.eye(before.shape[1])[:, part]).max())


def _ratios(
    K: csr_array | Congruent, M: csr_array | Congruent, scale: np.ndarray, w2: np.ndarray, phi: np.ndarray
) -> np.ndarray:
    """Return the residuals of some modes over what is allowed."""
    phi = np.ascontiguousarray(phi)
    inertial = scale * w2 * times(M, phi)
    residual = np.linalg.norm(scale * times(K, phi) - inertial, axis=0)
    allowed = RESIDUAL * np.linalg.norm(inertial, axis=0)
    if not np.all(residual < allowed):
        allowed += ROUND_OFF * np.linalg.norm(scale * bound(K, phi), axis=0)
    return residual / allowed
