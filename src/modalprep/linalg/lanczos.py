"""Block shift-invert Lanczos with full reorthogonalisation and thick restart.

Grimes, Lewis, Simon, SIAM J. Matrix Anal. Appl. 15 (1994) 228; Wu, Simon, ibid. 22 (2000) 602; Nour-Omid,
Parlett, Ericsson, Jensen, Math. Comp. 48 (1987) 663, for the last multiplication of Ritz vectors.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from modalprep.errors import AccuracyError
from modalprep.linalg.blas import deduct, eigh, inner, product
from modalprep.linalg.factor import Factor
from modalprep.linalg.sparse import Matrix, times

TOLERANCE = 1e-10  # of 1/(w^2 - shift): residual of a converged pair
DEPENDENT = 1e-14  # squared norm that is left of a new vector, over the largest of its block
GONE = 1e-20  # the same over its own: round-off
RESTARTS = 60
MEMORY = 2e9  # bytes of the basis, where it needs so much
ROWS = 20_000
CAUTION = 0.6  # of the vectors that modes still to converge would need at the rate so far


@dataclass
class Krylov:
    """M-orthonormal basis V, and ``H = V^T M (K - shift M)^-1 M V``.

    Parameters
    ----------
    M : (n, n) csr
    capacity : int
        Columns that the basis may have.
    """

    M: Matrix
    capacity: int
    size: int = 0
    V: np.ndarray = field(init=False)
    M_near: list[np.ndarray] = field(init=False)  # M times the last vectors, to which an answer is not orthogonal
    H: np.ndarray = field(init=False)

    def __post_init__(self) -> None:
        """Reserve the arrays."""
        shape = (self.M.shape[0], self.capacity)
        self.V = np.empty(shape, order="F")
        self.H = np.zeros((self.capacity, self.capacity))

    def lock(self, theta: np.ndarray, phi: np.ndarray) -> None:
        """Start with eigenvectors ``phi (n, k)`` that are known."""
        k = len(theta)
        self.V[:, :k] = phi
        self.H[np.arange(k), np.arange(k)] = theta
        self.size = k
        self.M_near = [times(self.M, self.V[:, :k]), np.zeros((len(phi), 0))]

    def append(self, W: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Orthonormalise W against the basis and itself and append what is new.

        In exact arithmetic only the last block and its own are not orthogonal to the answer to the last block (after a
        restart all are): they go first, then all of them take what round-off and the division by a small remainder
        have brought back.

        Returns the coefficients of W on the old basis, ``(size, b)``, and on the new vectors.
        """
        m = self.size
        last = self.size - self.M_near[1].shape[1]
        coefficient = np.zeros((m, W.shape[1]))
        for first, MV in zip((last - self.M_near[0].shape[1], last), self.M_near, strict=True):
            near = slice(first, first + MV.shape[1])
            coefficient[near] = inner(MV, W)
        near = slice(last - self.M_near[0].shape[1], m)
        deduct(W, self.V[:, near], coefficient[near])
        W, MW, beta = _orthonormal(W, self.M, np.einsum("ij,ij->j", coefficient, coefficient))
        MW, gamma = self._cleaned(W, MW)
        self.M_near = [self.M_near[1], MW]
        self.size = m + MW.shape[1]
        return coefficient, gamma @ beta

    def _cleaned(self, W: np.ndarray, MW: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Append orthonormal W, made orthogonal to the basis too; return M W and the old by it."""
        m = self.size
        W = deduct(W, self.V[:, :m], inner(self.V[:, :m], MW))
        return _orthonormal(W, self.M, np.ones(W.shape[1]), self.V[:, m : m + W.shape[1]])[1:]

    def combine(self, S: np.ndarray) -> np.ndarray:
        """Return the combinations ``V S``, in place of the first vectors."""
        for rows in range(0, len(self.V), ROWS):
            part = self.V[rows : rows + ROWS]
            part[:, : S.shape[1]] = product(part[:, : len(S)], S)
        return self.V[:, : S.shape[1]]

    def compress(self, S: np.ndarray, theta: np.ndarray, tail: int) -> None:
        """Keep the combinations ``V S`` with their Ritz values and the last `tail` vectors."""
        m = self.size - tail
        k = S.shape[1]
        coupling = self.H[m : self.size, :m] @ S
        self.combine(S)
        self.V[:, k : k + tail] = self.V[:, m : self.size]
        self.H[:] = 0.0
        self.H[np.arange(k), np.arange(k)] = theta
        self.H[k : k + tail, :k] = coupling
        self.H[:k, k : k + tail] = coupling.T
        self.size = k + tail
        self.M_near = [times(self.M, self.V[:, :k]), self.M_near[1]]


def _orthonormal(
    W: np.ndarray, M: Matrix, before: np.ndarray, out: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return an M-orthonormal basis Q of W, in `out` where it is given, ``M Q`` and ``Q^T M W``.

    Directions below `DEPENDENT` of the largest, or below `GONE` of what W was, are dropped; `before` is the squared
    norm that was taken from it. A light structure with a heavy node answers its first loads by motions of that node, to
    five digits and more: what is left then is small but not nothing.
    """
    MW = times(M, W)
    gram = inner(W, MW)
    D = 1 / np.sqrt(np.maximum(before + gram.diagonal(), np.finfo(float).tiny))
    share, Y = eigh(gram * D * D[:, None])
    new = share > np.maximum(GONE, DEPENDENT * share[-1:])
    Z = D[:, None] * (Y[:, new] / np.sqrt(share[new]))
    return product(W, Z, None if out is None else out[:, : Z.shape[1]]), product(MW, Z), Z.T @ gram


def block_lanczos(
    factor: Factor,
    M: Matrix,
    n: int,
    *,
    shift: float,
    known: tuple | None = None,
    block: int = 0,
    capacity: int = 0,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the n eigenvalues ``w^2`` (ascending) and M-orthonormal modes ``(n_dof, n)`` next above `shift`.

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
        (rad/s)^2, below all modes.
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
    >>> from scipy.sparse import csr_array
    >>> from modalprep.linalg.factor import factorise
    >>> K = csr_array(np.diag(np.arange(1.0, 41.0)))
    >>> w2, phi = block_lanczos(factorise(K), csr_array(np.eye(40)), 3, shift=0.0)
    >>> w2
    array([1., 2., 3.])
    """
    block = block or int(np.clip(n // 9, 6, 16))
    w2, phi = known or (np.zeros(0), np.zeros((M.shape[0], 0)))
    capacity = min((capacity or _columns(M.shape[0], n, block)) + len(w2), M.shape[0])
    space = Krylov(M, capacity + block)
    space.lock(1 / (w2 - shift), phi)
    start = np.random.default_rng(len(w2)).standard_normal((M.shape[0], block))
    space.append(factor.solve(times(M, start)))
    done = np.zeros(n, dtype=bool)
    for _ in range(RESTARTS):
        theta, S, rest = _expand(space, factor, n, capacity)
        done = _converged(theta[:n], rest[:, :n])
        tail = len(rest)
        if len(theta) >= n and np.all(done):
            w2 = 1 / theta[:n] + shift
            order = np.argsort(w2, kind="stable")
            S = np.vstack([S[:, :n], rest[:, :n] / theta[:n]])[:, order]  # (K - shift M)^-1 M / theta times the vector
            return w2[order], space.combine(S)
        if tail == 0:
            break
        keep = min(len(theta), n + (capacity - n) // 2)
        space.compress(S[:, :keep], theta[:keep], tail)
    raise AccuracyError(f"only {int(done.sum())} of {n} modes were found; the structure may have fewer with mass")


def _converged(theta: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Return which Ritz pairs have converged, where ``(K - shift M)^-1 M`` leaves `rest` of each on the next block."""
    return np.linalg.norm(rest, axis=0) <= TOLERANCE * np.abs(theta)


def _columns(size: int, n: int, block: int) -> int:
    """Return the vectors of a basis. Restarts cost more than vectors, as long as those fit into memory."""
    return int(np.clip(MEMORY // (8 * size), 2 * n + 8 * block, 4 * n + 8 * block))


def _expand(space: Krylov, factor: Factor, n: int, capacity: int) -> tuple:
    """Grow the basis until the modes have converged or it is full; return Ritz values, vectors and rests.

    The largest values come first. The last block has not been multiplied yet; `m` counts the vectors that have.
    """
    check = space.size + 1.5 * n
    seen = (space.size, 0)
    while True:
        m = space.size
        tail = space.M_near[1].shape[1]
        coefficient, beta = space.append(factor.solve(space.M_near[1]))
        new = len(beta)
        space.H[:m, m - tail : m] = coefficient
        space.H[m - tail : m, :m] = coefficient.T
        space.H[m : m + new, m - tail : m] = beta
        space.H[m - tail : m, m : m + new] = beta.T
        full = new == 0 or space.size >= capacity
        if full or m >= check:
            theta, S = eigh((space.H[:m, :m] + space.H[:m, :m].T) / 2)
            theta = theta[::-1]
            S = S[:, ::-1]
            rest = beta @ S[m - tail : m]
            count = int(np.sum(_converged(theta[:n], rest[:, :n])))
            if full or count == n:
                return theta, S, rest
            slope = max(count - seen[1], 1) / (m - seen[0])
            check = m + np.clip(CAUTION * (n - count) / slope, 2 * tail, n / 2)
            seen = (m, count)
