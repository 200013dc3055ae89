"""The accelerations of the independent coordinates near a state, by coordinates, speeds and inputs, with their errors.

Trees are solved by the factors of the order-n algorithm, closed systems by Cholesky's. Rounding errors of the entries
of mass matrix, stiffness and damping count as independent of each other: the root mean square of what they make is
estimated with vectors of random signs.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from modalprep.multibody.analysis.tangent import SystemTangent, Tangent
from modalprep.multibody.kernels.rounding import rounding_forces

PROBES = 4  # vectors of random signs: a root mean square to about a third


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
        self.state = np.empty((2 * n, 2 * n))
        self.by_input = np.zeros((2 * n, force.shape[1]))
        self.state[:n] = 0.0
        if exact.chart.evaluator.packed.quaternions:
            self.state[:n, :n] = equations.N
        self.state.reshape(-1)[n : 2 * n * n : 2 * n + 1] = 1.0
        self.error = self._of_tree(force) if exact.chart.evaluator.loops is None else self._of_loops(force)

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
        if not (evaluator.factored and evaluator.y is self.exact.chart.y):
            evaluator.load(self.exact.chart.y)
            evaluator.accelerations(np.zeros(evaluator.nu))

    def _of_tree(self, force: np.ndarray) -> float:
        """Write A and B by the factors of the order-n algorithm; return the error."""
        self._factorise()
        given, evaluator = self.equations, self.exact.chart.evaluator
        signs = _signs(len(force))
        numbers = np.empty((5, len(force)))
        error = evaluator.linear_equations(
            given.K, given.D, given.M, given.size, force, signs, numbers, self.state, self.by_input
        )
        if given.called is None:
            return error
        return evaluator.mean_response(self._with_called(numbers[2:4], numbers[4]), signs)

    def _of_loops(self, force: np.ndarray) -> float:
        """Write A and B by Cholesky's factor; return the error."""
        given, n = self.equations, len(force)
        scale = self.exact.chart.evaluator.scale[self.exact.chart.independent]
        self.A[:] = -given.solve(np.hstack([given.K, given.D]))
        self.B[:] = given.solve(force)
        sizes = (np.abs(self.A) / scale[:, None]).max(axis=0, initial=0.0).reshape(2, n)
        weights, worst = np.empty((2, n)), np.empty(n)
        cancelling = self._mean(given.size, scale)
        rounding_forces(given.K, given.D, given.M, given.size, scale, sizes, cancelling, weights, worst)
        return self._mean(self._with_called(weights, worst), scale)

    def _with_called(self, weights: np.ndarray, worst: np.ndarray) -> np.ndarray:
        """Return forces of rounding errors (n,) and of callbacks' errors, where the columns of `weights` are one."""
        called = self.equations.called
        return worst if called is None else worst + (called.K * weights[0] + called.D * weights[1]).max(axis=1)

    def _mean(self, force: np.ndarray, scale: np.ndarray) -> float:
        """Return the largest root mean square, in the scales, of what forces (n,) of independent signs accelerate."""
        found = self.equations.solve(force[:, None] * _signs(len(force))) / scale[:, None]
        return float(np.sqrt((found**2).mean(axis=1).max(initial=0.0)))

    def error_of(self, rows: np.ndarray) -> np.ndarray:
        """Return the estimated errors of ``rows (k, n) A``."""
        found = self._accelerated(np.ascontiguousarray(rows.T))
        return np.sqrt(found.T**2 @ self.equations.force_errors(self.A) ** 2)

    def _accelerated(self, forces: np.ndarray) -> np.ndarray:
        """Return the accelerations by generalised forces (n, k)."""
        if self.exact.chart.evaluator.loops is not None:
            return self.equations.solve(forces)
        self._factorise()
        found = np.empty(forces.shape)
        self.exact.chart.evaluator.respond(1.0, forces, found)
        return found


@cache
def _signs(n: int) -> np.ndarray:
    """Return random signs (n, 4)."""
    return np.random.default_rng(0).choice([-1.0, 1.0], (n, PROBES))
