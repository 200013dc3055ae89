"""The equations of motion about a state as matrices, and their roots: stiff modes do not cost the digits of soft ones.

With the accelerations of the state, the generalised forces that the motion needs beyond its loads (inverse dynamics)
change by ``M du' + D du + K dx``. Mass, gyroscopic and circulatory matrices and stiffness stand apart there, each entry
with its own round-off, whereas ``M^-1 K`` mixes the stiffness of every mode into each row.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache, cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, eig

from modalprep.errors import SimulationError
from modalprep.multibody.analysis.closure_tangent import Conditions, conditions, exerted
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.tree_tangent import TreeTangent
from modalprep.multibody.elements import registry
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.kernels.closed_loops.constraints import SLIP
from modalprep.multibody.kernels.rounding import EPS, ROUND_OFF
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.loads import called_forces

PLACE_STEP, SPEED_STEP = 0.05, 1.0  # initial steps, in scales of the coordinates and of their rates
ADVICE = "keep fewer modes and truncation vectors, or use another state"
NOT_POSITIVE = f"cannot linearise: the mass matrix is not positive definite at this state; {ADVICE}"


@dataclass(frozen=True)
class Roots:
    """Eigenvalues (k,), vectors ``(x, u)`` (2 n, k), and the first-order error of each (k,)."""

    values: NDArray[np.complex128]
    vectors: NDArray[np.complex128]
    error: np.ndarray


class TangentErrors(NamedTuple):
    """Estimated errors of a `Tangent`, to first order.

    Attributes
    ----------
    K, D : (n, n)

    References
    ----------
    Theory 5.6.
    """

    K: np.ndarray
    D: np.ndarray


@dataclass(frozen=True)
class Tangent:
    """Linear equations before they are solved: ``x' = N x + u`` and ``M u' + D u + K x = 0``.

    Changes x (m, rad, or of modal coordinates) and u (the same per s) of the independent coordinates and speeds.

    Attributes
    ----------
    N, M, D, K : (n, n)
        What the turning of axes adds to the rates of the coordinates; mass, damping with gyroscopic forces, stiffness.
    size : (n,)
        Sum of the absolute values that make each force, when a coordinate changes by its scale.
    called : (n, n), (n, n) or None
        Estimated errors of what callbacks add to K and D.

    References
    ----------
    Theory 5.6 and 5.8.

    Examples
    --------
    >>> none = np.zeros((1, 1))
    >>> Tangent(none, np.array([[2.0]]), none, np.array([[6.0]])).solve(np.array([[3.0]]))
    array([[1.5]])
    """

    N: np.ndarray
    M: np.ndarray
    D: np.ndarray
    K: np.ndarray
    size: np.ndarray = field(default_factory=lambda: np.zeros(1))
    called: TangentErrors | None = None
    _sizes: Callable[[], np.ndarray] = lambda: np.zeros((1, 1))

    @cached_property
    def errors(self) -> TangentErrors:
        """Estimated errors of K and D."""
        K = ROUND_OFF * EPS * self._sizes() + np.zeros_like(self.K)
        if self.called is None:
            return TangentErrors(K, np.zeros_like(self.D))
        return TangentErrors(K + self.called.K, self.called.D)

    def solve(self, force: np.ndarray) -> np.ndarray:
        """Return the accelerations under generalised forces (n, k), N or N m, or modal.

        Returns
        -------
        (n, k)

        Raises
        ------
        SimulationError
            When the mass matrix is not positive definite.
        """
        return cho_solve(self._factor, force)

    def force_errors(self, A: np.ndarray) -> np.ndarray:
        """Return the errors of ``[K D]`` and of what M makes of ``A (n, 2 n)``.

        Those estimated, and round-off of each entry, independent of the others.

        Returns
        -------
        (n, 2 n)
            Root mean squares.
        """
        error = np.hstack([self.errors.K + EPS * np.abs(self.K), self.errors.D + EPS * np.abs(self.D)])
        return np.sqrt(error**2 + (EPS * self.M) ** 2 @ A**2)

    @cached_property
    def _factor(self) -> tuple[np.ndarray, bool]:
        try:
            return cho_factor(self.M)
        except np.linalg.LinAlgError:
            raise SimulationError(NOT_POSITIVE) from None


class GivenAccelerations:
    """The forces of a motion near the state of a chart, the accelerations of the independent coordinates given.

    These forces have no poles where the mass matrix of a deflected body ceases to be positive, as the accelerations
    under given forces have: they are smooth over steps of a body's size.
    """

    def __init__(self, chart: Chart, udot: np.ndarray) -> None:
        self.chart = chart
        self.evaluator = chart.evaluator
        self.own = udot[chart.independent]
        still = not np.any(chart.y[self.evaluator.nx :]) and not any(j.motions for j in self.evaluator.system.joints)
        self.projects = still or not len(chart.dependent)  # the dependent accelerations are those of R alone

    def all(self, state: np.ndarray, R: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Return the accelerations (nu,) of the tree; R is that of the state."""
        if self.projects:
            return R @ own
        self.evaluator.load(state)
        closed = self.evaluator.accelerations(np.zeros(self.evaluator.nu))
        return closed + R @ (own - closed[self.chart.independent])

    def force(self, state: np.ndarray, own: np.ndarray, push: Callable[[], np.ndarray] | None = None) -> np.ndarray:
        """Return the generalised forces (n,) that accelerations need beyond the loads; `push` adds loads."""
        R = self.chart.tangent(state)
        return R.T @ self.evaluator.required(state, self.all(state, R, own), push=push)


@cache
def nothing(shape: tuple[int, ...]) -> np.ndarray:
    """Return zeros that cannot be written.

    Examples
    --------
    >>> nothing((1, 2))
    array([[0., 0.]])
    """
    return np.broadcast_to(0.0, shape)


class SystemTangent:
    """The exact derivatives of the inverse dynamics of a system about the state of a chart (theory 5.8).

    Those of callbacks alone are found by differences.

    Parameters
    ----------
    udot : (nu,)
        Accelerations.
    moving : bool
        Whether prescribed hinges move; otherwise they are held where they are.
    more : (nu,) or 0
        Forces that the loops exert beside those that the accelerations need, as of an implicit step.

    Attributes
    ----------
    tree : TreeTangent
        With the motion of all interfaces and its derivatives.
    speeds_x : (nu, n)
        What the dependent speeds change by with the independent coordinates, the independent speeds given.
    accelerations_x, accelerations_u : (nu, n)
        What the dependent accelerations change by with coordinates and speeds, the independent ones given.
    """

    def __init__(self, chart: Chart, udot: np.ndarray, *, moving: bool = True, more: np.ndarray | float = 0.0) -> None:
        self.chart, evaluator = chart, chart.evaluator
        loading = evaluator.loading
        required = self._required(udot, moving)
        self.motion = loading.motion.copy()
        system = evaluator.system.with_masses_at(evaluator.t)
        packed = evaluator.packed if system is evaluator.system else pack(system)
        self.tree = TreeTangent(system, packed, chart.y, udot, self.motion, evaluator.t)
        if system.loads or system.orbit:
            for load in registry.tangents(self.tree.scene):
                self.tree.add(load)
        self.tree.add_joint_elements(loading.slope)
        none = nothing(chart.R.shape)
        self.speeds_x = self.accelerations_x = self.accelerations_u = none
        if evaluator.loops is not None:
            self._close(evaluator.loops, required + more)
        self.found = self.tree.finish()
        self.called = self._called() if not loading.compiled else None

    def _required(self, udot: np.ndarray, moving: bool) -> np.ndarray:
        """Return the forces that the accelerations need, with the slopes of joints' elements in the loading."""
        evaluator = self.chart.evaluator
        if evaluator.loading.active or evaluator.loops:
            return evaluator.required(self.chart.y, udot, moving=moving)
        motion = evaluator.loading.prescribe(evaluator.t)
        if not moving:
            motion[:, 1:] = 0.0
        return np.zeros(evaluator.nu)

    def _close(self, loops: Loops, required: np.ndarray) -> None:
        """Add what the loops exert, and find how the dependent speeds and accelerations follow."""
        chart, tree = self.chart, self.tree
        unit = loops.work.unit[chart.kept]
        slides = np.flatnonzero([row.kind == SLIP for row in loops.closing.rows])
        if len(slides):  # friction stays as it is
            friction = loops.work.multiplier[slides].copy()
            required = required - conditions(tree, loops, slides).G.T @ friction
            for load in exerted(tree, loops, slides, friction):
                tree.add(load)
        multiplier = unit * (chart.inverse.T @ required[chart.dependent])
        for load in exerted(tree, loops, chart.kept, multiplier):
            tree.add(load)
        rows = Conditions(*(unit[:, None] * part for part in conditions(tree, loops, chart.kept)))
        inverse, R, own = -chart.inverse, chart.R, chart.dependent
        self.speeds_x = np.zeros_like(R)
        self.accelerations_x = np.zeros_like(R)
        self.accelerations_u = np.zeros_like(R)
        self.speeds_x[own] = inverse @ rows.rate_x @ R
        by_x = rows.acceleration_x @ R + rows.acceleration_u @ self.speeds_x
        self.accelerations_x[own] = inverse @ by_x
        self.accelerations_u[own] = inverse @ rows.acceleration_u @ R

    def _called(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the derivatives (nu, 2 nu) of the forces of callbacks by differences, and their estimated errors.

        Raises
        ------
        SimulationError
            When they do not exist near the state.
        """
        evaluator, y = self.chart.evaluator, self.chart.y
        nu = evaluator.nu

        def force(z: np.ndarray) -> np.ndarray:
            state = evaluator.moved(y, z[:nu])
            state[evaluator.nx :] = y[evaluator.nx :] + z[nu:]
            return called_forces(self.tree.system, evaluator.packed, state, self.motion, evaluator.t)

        J, error = jacobian(force, np.concatenate([PLACE_STEP * evaluator.scale, SPEED_STEP * evaluator.scale]))
        if not np.all(np.isfinite(error)):
            raise SimulationError("cannot linearise: the forces do not exist near this state; use another state")
        return J, error

    @property
    def K(self) -> np.ndarray:
        """The derivative (nu, nu) of the forces of the tree by its coordinates, those of callbacks too."""
        return self.found.K if self.called is None else self.found.K - np.hsplit(self.called[0], 2)[0]

    def equations(self, N: np.ndarray) -> Tangent:
        """Return the matrices in the independent coordinates; N as in `linearise`."""
        R, M, D, K = self.chart.R, self.found.M, self.found.D, self.K
        called = None
        if self.called is not None:
            called = TangentErrors(*(_reduced(R, each) for each in np.hsplit(self.called[1], 2)))
        if self.called is not None:
            D = D - np.hsplit(self.called[0], 2)[1]
        if len(self.chart.dependent):
            K = R.T @ (K @ R + D @ self.speeds_x + M @ self.accelerations_x)
            D = R.T @ (D @ R + M @ self.accelerations_u)
            M = R.T @ M @ R
        sizes = partial(_sizes, self.found.size, self.found.stiffness, self.chart.evaluator.scale, R)
        return Tangent(N, M, D, K, self._size(sizes), called, sizes)

    def _size(self, sizes: Callable[[], np.ndarray]) -> np.ndarray:
        """Return `Tangent.size`."""
        if len(self.chart.dependent):
            return (sizes() * self.chart.evaluator.scale[self.chart.independent]).max(axis=1, initial=0.0)
        if isinstance(self.found.stiffness, float):
            return self.found.size
        return self.found.size + np.max(self.found.stiffness * self.chart.evaluator.scale, axis=-1, initial=0.0)


def _sizes(size: np.ndarray, stiffness: np.ndarray | float, scale: np.ndarray, R: np.ndarray) -> np.ndarray:
    """Return the sums of the absolute values that make K (n, n)."""
    return _reduced(R, size[:, None] / scale + stiffness)


def _reduced(R: np.ndarray, sizes: np.ndarray) -> np.ndarray:
    """Return sizes (nu, nu) in the independent coordinates."""
    return sizes if len(R) == R.shape[1] else np.abs(R).T @ sizes @ np.abs(R)


def roots(t: Tangent) -> Roots:
    """Return the roots, the slowest to round-off of their own size: by shift and inversion near zero.

    Coordinates are scaled to stiffness one, and time by the shift.

    Examples
    --------
    >>> none = np.zeros((2, 2))
    >>> chain = Tangent(none, np.eye(2), none, np.array([[1.0, -1.0], [-1.0, 1.0 + 1e12]]))
    >>> np.sort(np.abs(roots(chain).values))[::2].round(9).tolist()
    [1.0, 1000000.0]
    """
    n = len(t.M)
    w = slowest(t)
    S = 1 / np.sqrt(np.abs(np.diag(t.K)) + w**2 * np.diag(t.M))
    N = t.N * S / (S[:, None] * w)
    one = np.eye(n)
    none = np.zeros((n, n))
    M, D, K, D_error, K_error = (
        X * S * S[:, None] for X in (w**2 * t.M, w * t.D, t.K, w * t.errors.D, t.errors.K + EPS * np.abs(t.K))
    )
    E, F = np.block([[one, none], [none, M]]), np.block([[N, one], [-K, -D]])
    inverse = np.linalg.inv(F - E)
    mu, left, right = eig(inverse @ E, left=True)
    off = np.abs(left).T @ np.abs(inverse) @ np.block([[none, none], [K_error, D_error]]) @ np.abs(right)
    own = EPS * np.linalg.norm(inverse @ E) / np.abs(mu) ** 2  # of vectors of length one
    across = np.maximum(np.abs(np.sum(left.conj() * right, axis=0)), np.finfo(float).tiny)
    error = (np.diag(off) / np.abs(mu) + own) / across
    values = 1 + 1 / mu
    # inversion costs fast roots digits, but none is zero
    fast = np.abs(values) > 1
    dual = (inverse.T @ left).conj()
    values[fast] = (np.sum(dual * (F @ right), axis=0) / np.sum(dual * (E @ right), axis=0))[fast]
    error[fast] = 0.0
    return Roots(values=w * values, vectors=right * np.concatenate([S, w * S])[:, None], error=w * error)


def slowest(t: Tangent) -> float:
    """Return a rate (1/s) of the order of the slowest: that of a coordinate by itself, else of the damping, else 1."""
    k, m = np.diag(t.K), np.diag(t.M)
    held = k > 10 * np.diag(t.errors.K) + EPS * np.abs(t.K).max(axis=1, initial=0.0)
    if np.any(held):
        return float(np.sqrt((k[held] / m[held]).min()))
    return float((np.abs(t.D) / np.sqrt(np.outer(m, m))).max(initial=0.0)) or 1.0
