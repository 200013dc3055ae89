"""Block shift-invert Lanczos with full reorthogonalisation and thick restart.

Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228; Wu, Simon, ibid. 22 (2000) 602.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.factor import Factor

TOLERANCE = 1e-10  # of 1/(w^2 - shift): residual of a converged pair
DEPENDENT = 1e-10  # squared norm that is left of a new vector, over its own
RESTARTS = 60


@dataclass
class Krylov:
    """M-orthonormal basis V with ``M V``, and ``H = V^T M (K - shift M)^-1 M V``.

    Parameters
    ----------
    M : (n, n) csr
    capacity : int
        Columns that the basis may have.
    """

    M: csr_array
    capacity: int
    size: int = 0
    V: np.ndarray = field(init=False)
    MV: np.ndarray = field(init=False)
    H: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Reserve the arrays."""
        n = self.M.shape[0]
        self.V, self.MV = (np.empty((n, self.capacity), order="F") for _ in range(2))
        self.H = np.zeros((self.capacity, self.capacity))

    def append(self, W: np.ndarray) -> tuple[np.ndarray, int]:
        """Orthonormalise W against the basis and itself and append what is new.

        Returns the coefficients of W on the old basis, ``(size, b)``, and the number of new vectors.
        """
        m = self.size
        old, M_old = self.V[:, :m], self.MV[:, :m]
        before = np.einsum("ij,ij->j", W, self.M @ W)
        coefficient = M_old.T @ W
        W, _ = _orthonormal(W - old @ coefficient, self.M, before)
        W = W - old @ (M_old.T @ W)  # what cancellation left of the old directions
        W, MW = _orthonormal(W, self.M, np.ones(W.shape[1]))
        new = W.shape[1]
        self.V[:, m : m + new], self.MV[:, m : m + new] = W, MW
        self.size += new
        return coefficient, new

    def compress(self, S: np.ndarray, theta: np.ndarray, tail: int) -> None:
        """Keep the combinations ``V S`` with their Ritz values and the last `tail` vectors."""
        m, k = self.size - tail, S.shape[1]
        coupling = self.H[m : self.size, :m] @ S
        for A in (self.V, self.MV):
            A[:, :k] = A[:, :m] @ S
            A[:, k : k + tail] = A[:, m : self.size]
        self.H[:] = 0.0
        self.H[np.arange(k), np.arange(k)] = theta
        self.H[k : k + tail, :k] = coupling
        self.H[:k, k : k + tail] = coupling.T
        self.size = k + tail


def _orthonormal(W: np.ndarray, M: csr_array, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return an M-orthonormal basis of W and M times it; directions below `DEPENDENT` of `scale` are dropped."""
    MW = M @ W
    D = 1 / np.sqrt(np.maximum(scale, np.finfo(float).tiny))
    share, Y = eigh((W.T @ MW) * D * D[:, None])
    new = share > DEPENDENT
    Z = D[:, None] * (Y[:, new] / np.sqrt(share[new]))
    return W @ Z, MW @ Z


def block_lanczos(
    factor: Factor, M: csr_array, n: int, *, shift: float, block: int = 0, capacity: int = 0
) -> tuple[np.ndarray, np.ndarray]:
    """Return the n eigenvalues ``w^2`` next above `shift` (ascending) and M-orthonormal modes ``(n_dof, n)``.

    Each step solves for a block of right-hand sides at once, which a sparse factor does several times faster than
    one by one, and finds repeated roots up to the size of the block. The start block is fixed.

    Parameters
    ----------
    factor : Factor
        Of ``K - shift M``.
    M : (n_dof, n_dof) csr
        Positive semidefinite.
    n : int
        At most the rank of M.
    shift : float
    block, capacity : int
        0 chooses both from n.

    Raises
    ------
    AccuracyError
        When it does not converge.

    Examples
    --------
    >>> from modalprep.linalg.factor import factorize
    >>> K = csr_array(np.diag(np.arange(1.0, 41.0)))
    >>> w2, phi = block_lanczos(factorize(K), csr_array(np.eye(40)), 3, shift=0.0)
    >>> w2
    array([1., 2., 3.])
    """
    block = block or int(np.clip(n // 8, 4, 16))
    capacity = min(capacity or 2 * n + 8 * block, M.shape[0])
    space = Krylov(M, capacity + block)
    start = np.random.default_rng(0).standard_normal((M.shape[0], block))
    tail = space.append(factor.solve(M @ start))[1]
    for _ in range(RESTARTS):
        theta, S, residual, tail = _expand(space, factor, n, tail, capacity)
        done = residual[:n] <= TOLERANCE * np.abs(theta[:n])
        if len(theta) >= n and np.all(done):
            phi = space.V[:, : S.shape[0]] @ S[:, :n]
            return 1 / theta[:n] + shift, phi
        if tail == 0:
            break
        keep = min(len(theta), n + (capacity - n) // 2)
        space.compress(S[:, :keep], theta[:keep], tail)
    raise AccuracyError(f"only {int(done.sum())} of {n} modes were found; the structure may have fewer with mass")


def _expand(space: Krylov, factor: Factor, n: int, tail: int, capacity: int) -> tuple:
    """Grow the basis until the modes have converged or it is full; return Ritz values, vectors and residuals.

    The last block has not been multiplied yet; `m` counts the vectors that have.
    """
    checked = 0
    while True:
        m = space.size
        W = factor.solve(space.MV[:, m - tail : m])
        coefficient, new = space.append(W)
        space.H[:m, m - tail : m] = coefficient
        space.H[m - tail : m, :m] = coefficient.T
        beta = space.MV[:, m : m + new].T @ W
        space.H[m : m + new, m - tail : m] = beta
        space.H[m - tail : m, m : m + new] = beta.T
        full = new == 0 or space.size >= capacity
        if full or (m >= 1.5 * n and m - checked >= max(n // 4, 2 * tail)):
            checked = m
            theta, S = eigh((space.H[:m, :m] + space.H[:m, :m].T) / 2)
            order = np.argsort(-theta)
            theta, S = theta[order], S[:, order]
            residual = np.linalg.norm(beta @ S[m - tail : m], axis=0)
            if full or np.all(residual[:n] <= TOLERANCE * np.abs(theta[:n])):
                return theta, S, residual, new
        tail = new
