"""The accelerations of the independent coordinates near a state, by coordinates, speeds and inputs, with their errors.

Trees are solved by the factors of the order-n algorithm, closed systems by Cholesky's. Rounding errors of the entries
of mass matrix, stiffness and damping count as independent of each other: the root mean square of what they make is
estimated with vectors of random signs.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from modalprep.multibody.analysis.tangent import EPS, ROUND_OFF, SystemTangent, Tangent
from modalprep.multibody.kernels.responses import add_squares

NEGLIGIBLE = 1e-6  # of what the fastest motion makes: the least that a column counts as
SLOWEST = 1e-3  # 1/s, the fastest motion of a system counts as at least this fast: the rate of a low orbit
PROBES = 4  # vectors of random signs: a root mean square to about a third
MEAN = np.full(PROBES, PROBES**-0.5)


class Accelerations:
    """``u' = A z + B i`` of the independent coordinates, z = [coordinates | speeds].

    Parameters
    ----------
    force : (n, ni)
        Generalised forces of unit inputs.

    Attributes
    ----------
    state : (2 n, 2 n)
        ``z' = state z``: A below the rates of the coordinates.
    by_input : (2 n, ni)
        B below zeros.
    error : float
        Largest estimated error of A relative to its column (`columns`), coordinates in their scales.
    """

    def __init__(self, exact: SystemTangent, equations: Tangent, force: np.ndarray) -> None:
        self.exact, self.equations = exact, equations
        n = len(exact.chart.independent)
        self._factorise()
        self.state = np.zeros((2 * n, 2 * n))
        self.by_input = np.zeros((2 * n, force.shape[1]))
        if np.any(equations.N):
            self.state[:n, :n] = equations.N
        np.fill_diagonal(self.state[:n, n:], 1.0)
        sizes = [self._write(-1.0, each, self.state, n, c) for each, c in ((equations.K, 0), (equations.D, n))]
        self._write(1.0, force, self.by_input, n, 0)
        self.error = self._error(np.array(sizes)) if n else 0.0

    @property
    def A(self) -> np.ndarray:
        """(n, 2 n)."""
        return self.state[len(self.state) // 2 :]

    @property
    def B(self) -> np.ndarray:
        """(n, ni)."""
        return self.by_input[len(self.state) // 2 :]

    def _factorise(self) -> None:
        evaluator = self.exact.chart.evaluator
        if evaluator.loops is None and not (evaluator.factored and evaluator.y is self.exact.chart.y):
            evaluator.load(self.exact.chart.y)
            evaluator.accelerations(np.zeros(evaluator.nu))

    def _write(self, factor: float, forces: np.ndarray, out: np.ndarray, row: int, column: int) -> np.ndarray:
        """Write accelerations by forces (n, k) to a place of `out`; return the largest (k,) in the scales."""
        chart = self.exact.chart
        if chart.evaluator.loops is None:
            return chart.evaluator.respond(factor, forces, out, row, column)
        found = factor * self.equations.solve(forces)
        out[row : row + len(found), column : column + found.shape[1]] = found
        return (np.abs(found) / chart.evaluator.scale[chart.independent, None]).max(axis=0, initial=0.0)

    def _mean(self, force: np.ndarray) -> float:
        """Return the largest root mean square of what forces (n,) of independent signs accelerate, in the scales."""
        found = np.empty((len(force), PROBES))
        squares = np.zeros(len(force))
        self._write(1.0, force[:, None] * _signs(len(force)), found, 0, 0)
        add_squares(found, MEAN, squares)
        scale = self.exact.chart.evaluator.scale[self.exact.chart.independent]
        return float((np.sqrt(squares) / scale).max())

    def _error(self, sizes: np.ndarray) -> float:
        equations, n = self.equations, len(self.equations.M)
        scale = self.exact.chart.evaluator.scale[self.exact.chart.independent]
        by_x, by_u = scale / columns(scale * sizes, self._mean(equations.size))
        # no entry of A is above its column, so that the accelerations that M multiplies are the scales at most
        squares = np.zeros(n)
        for each, by in ((equations.K, by_x), (equations.D, by_u), (equations.M, scale)):
            add_squares(each, by, squares)
        worst = EPS * (np.sqrt(squares) + ROUND_OFF * equations.size * (by_x / scale).max())
        if equations.called is not None:
            worst += (equations.called.K * by_x + equations.called.D * by_u).max(axis=1)
        return self._mean(worst)

    def error_of(self, rows: np.ndarray) -> np.ndarray:
        """Return the estimated errors of ``rows (k, n) A``."""
        self._factorise()
        found = np.empty(rows.T.shape)
        self._write(1.0, np.ascontiguousarray(rows.T), found, 0, 0)
        return np.sqrt(found.T**2 @ self.equations.force_errors(self.A) ** 2)


@cache
def _signs(n: int) -> np.ndarray:
    """Return random signs (n, 4)."""
    return np.random.default_rng(0).choice([-1.0, 1.0], (n, PROBES))


def columns(sizes: np.ndarray, cancelling: float = 0.0) -> np.ndarray:
    """Return what columns of accelerations by coordinates and by speeds, of `sizes` (2, n), count as.

    One that is smaller than `NEGLIGIBLE` of what the fastest motion makes counts as that. So does one in which forces
    cancel, `cancelling` being what they could make one by one.

    Examples
    --------
    >>> columns(np.array([[1.0, 1e6], [0.0, 0.5]]))
    array([[1.e+00, 1.e+06],
           [1.e-03, 5.e-01]])
    """
    by_x, by_u = sizes
    rate = max(np.sqrt(max(by_x.max(), cancelling)), by_u.max(), SLOWEST)
    return np.maximum(sizes, NEGLIGIBLE * np.array([[rate**2], [rate]]))
