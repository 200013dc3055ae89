"""Block shift-invert Lanczos with full reorthogonalisation and thick restart.

Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228; Wu, Simon, ibid. 22 (2000) 602.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError
from modalprep.linalg.blas import inner, product, subtract
from modalprep.linalg.factor import Factor

TOLERANCE = 1e-10  # of 1/(w^2 - shift): residual of a converged pair
DEPENDENT = 1e-10  # squared norm that is left of a new vector, over its own
RESTARTS = 60
MEMORY = 2e9  # bytes of the basis, where it needs so much
ROWS = 20_000


@dataclass
class Krylov:
    """M-orthonormal basis V, and ``H = V^T M (K - shift M)^-1 M V``.

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
    M_last: np.ndarray = field(init=False)  # M times the newest vectors
    H: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Reserve the arrays."""
        self.V = np.empty((self.M.shape[0], self.capacity), order="F")
        self.H = np.zeros((self.capacity, self.capacity))

    def lock(self, theta: np.ndarray, phi: np.ndarray) -> None:
        """Start with eigenvectors ``phi (n, k)`` that are known."""
        k = len(theta)
        self.V[:, :k] = phi
        self.H[np.arange(k), np.arange(k)] = theta
        self.size = k

    def append(self, W: np.ndarray, near: int) -> tuple[np.ndarray, np.ndarray]:
        """Orthonormalise W against the basis and itself and append what is new.

        In exact arithmetic only the last `near` vectors are not orthogonal to it already: they go first, then all
        of them take what round-off and the division by a small remainder have brought back.

        Returns the coefficients of W on the old basis, ``(size, b)``, and on the new vectors.
        """
        m, old = self.size, self.V[:, : self.size]
        coefficient = np.zeros((m, W.shape[1]))
        close = old[:, m - near :]
        coefficient[m - near :] = inner(close, self.M @ W)
        W = subtract(W, close, coefficient[m - near :])
        W, MW, beta = _orthonormal(W, self.M, np.einsum("ij,ij->j", coefficient, coefficient))
        W = subtract(W, old, inner(old, MW))
        W, self.M_last, gamma = _orthonormal(W, self.M, np.ones(W.shape[1]))
        new = W.shape[1]
        self.V[:, m : m + new] = W
        self.size += new
        return coefficient, gamma @ beta

    def compress(self, S: np.ndarray, theta: np.ndarray, tail: int) -> None:
        """Keep the combinations ``V S`` with their Ritz values and the last `tail` vectors."""
        m, k = self.size - tail, S.shape[1]
        coupling = self.H[m : self.size, :m] @ S
        for rows in range(0, len(self.V), ROWS):
            part = self.V[rows : rows + ROWS]
            part[:, : k + tail] = np.hstack([part[:, :m] @ S, part[:, m : self.size]])
        self.H[:] = 0.0
        self.H[np.arange(k), np.arange(k)] = theta
        self.H[k : k + tail, :k] = coupling
        self.H[:k, k : k + tail] = coupling.T
        self.size = k + tail


def _orthonormal(W: np.ndarray, M: csr_array, before: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an M-orthonormal basis Q of W, ``M Q`` and ``Q^T M W``.

    Directions below `DEPENDENT` of what W was are dropped; `before` is the squared norm that was taken from it.
    """
    MW = M @ W
    gram = inner(W, MW)
    D = 1 / np.sqrt(np.maximum(before + gram.diagonal(), np.finfo(float).tiny))
    share, Y = eigh(gram * D * D[:, None])
    new = share > DEPENDENT
    Z = D[:, None] * (Y[:, new] / np.sqrt(share[new]))
    return product(W, Z), product(MW, Z), Z.T @ gram


def block_lanczos(
    factor: Factor, M: csr_array, n: int, *, shift: float, known: tuple | None = None, block: int = 0, capacity: int = 0
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
    known : (w2 (k,), phi (n_dof, k))
        Modes found before: a new start block, orthogonal to them, finds what they lack.
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
    block = block or int(np.clip(n // 12, 6, 16))
    w2, phi = known or (np.zeros(0), np.zeros((M.shape[0], 0)))
    capacity = min((capacity or _capacity(M.shape[0], n, block)) + len(w2), M.shape[0])
    space = Krylov(M, capacity + block)
    space.lock(1 / (w2 - shift), phi)
    start = np.random.default_rng(len(w2)).standard_normal((M.shape[0], block))
    space.append(factor.solve(M @ start), len(w2))
    for _ in range(RESTARTS):
        theta, S, residual, tail = _expand(space, factor, n, capacity)
        done = residual[:n] <= TOLERANCE * np.abs(theta[:n])
        if len(theta) >= n and np.all(done):
            phi = product(space.V[:, : S.shape[0]], S[:, :n])
            return 1 / theta[:n] + shift, phi
        if tail == 0:
            break
        keep = min(len(theta), n + (capacity - n) // 2)
        space.compress(S[:, :keep], theta[:keep], tail)
    raise AccuracyError(f"only {int(done.sum())} of {n} modes were found; the structure may have fewer with mass")


def _capacity(size: int, n: int, block: int) -> int:
    """Restarts cost more than vectors, as long as those fit into memory."""
    return int(np.clip(MEMORY // (8 * size), 2 * n + 8 * block, 4 * n + 8 * block))


def _expand(space: Krylov, factor: Factor, n: int, capacity: int) -> tuple:
    """Grow the basis until the modes have converged or it is full; return Ritz values, vectors and residuals.

    The last block has not been multiplied yet; `m` counts the vectors that have. After a restart its first answer
    has a share of every vector, later ones only of their own and the preceding block.
    """
    first, checked, near = space.size + 1.5 * n, 0, space.size
    while True:
        m, tail = space.size, space.M_last.shape[1]
        coefficient, beta = space.append(factor.solve(space.M_last), near)
        new = len(beta)
        space.H[:m, m - tail : m] = coefficient
        space.H[m - tail : m, :m] = coefficient.T
        space.H[m : m + new, m - tail : m] = beta
        space.H[m - tail : m, m : m + new] = beta.T
        near = tail + new
        full = new == 0 or space.size >= capacity
        if full or (m >= first and m - checked >= max(n // 8, 2 * tail)):
            checked = m
            theta, S = eigh((space.H[:m, :m] + space.H[:m, :m].T) / 2)
            order = np.argsort(-theta)
            theta, S = theta[order], S[:, order]
            residual = np.linalg.norm(beta @ S[m - tail : m], axis=0)
            if full or np.all(residual[:n] <= TOLERANCE * np.abs(theta[:n])):
                return theta, S, residual, new
