"""Error of a reduced body against the full model with the root clamped."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import AccuracyError, InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.linalg.algebra import DIRECT, Algebra
from modalprep.linalg.blas import one_numpy_thread
from modalprep.linalg.factor import Factor
from modalprep.linalg.harmonic import Compliance, compliance, damped_response, differences
from modalprep.records import Record
from modalprep.reduction.basis import Reduction
from modalprep.reduction.clamped import unit_loads
from modalprep.reduction.recoveries.error import RecoveryReference, between_resonances
from modalprep.reduction.table import BODY
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.verdicts.notes import silent, warn

MOST = 2000  # modes of the full model, at most
TRIED = 300  # modes of a reduction that meets a target, at most
GROWTH = 1.5
REACH = 1.5  # times up_to: modes of the reference; the series for all others converges with (1 / REACH)^2
DAMPING = 0.01  # ratio of both models
EVENLY = 100  # frequencies of the sweep besides those at resonances


@dataclass(frozen=True, eq=False, kw_only=True)
class ReductionError(Record):
    """Errors of a reduction up to a frequency; relative numbers.

    Attributes
    ----------
    up_to : float
        Hz.
    full, reduced : (n,)
        Frequencies of the full and of the reduced model below `up_to`, Hz, root clamped.
    static : (k,)
        Per unit force and moment on each interface except the root (on a body with one interface: per inertia load):
        strain energy missing in the reduced response, relative to that of the full one.
    sweep : (m,)
        Hz: at the resonances of both, beside them, and between.
    dynamic : (m,)
        Difference of the compliance at these interfaces (or under these loads) over its size, at each frequency, with
        the damping ratio below; what the reference may be wrong by is added.
    damping : float
        Ratio, of both models: undamped ones differ by infinity at a resonance, however close they are.
    recoveries : tuple of str, length r
    recovery_at : (k,)
        Hz: 0, frequencies halfway between resonances (half of `up_to` where there are none), both without damping, and
        resonances, with it.
    recovery : (r, k)
        Largest difference of each recovery over its largest value, under accelerations of the root and loads on the
        other interfaces, at each of these frequencies.
    """

    up_to: float
    full: np.ndarray
    reduced: np.ndarray
    static: np.ndarray
    sweep: np.ndarray
    dynamic: np.ndarray
    damping: float = DAMPING
    recoveries: tuple[str, ...] = ()
    recovery_at: np.ndarray = field(default_factory=lambda: np.zeros(0))
    recovery: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def frequency(self) -> np.ndarray:
        """(n,) relative errors of the frequencies."""
        return np.abs(self.reduced / self.full - 1)

    @property
    def worst_at(self) -> float:
        """Frequency (Hz) of the largest error of the compliance; NaN without a sweep."""
        return float(self.sweep[np.argmax(self.dynamic)]) if len(self.sweep) else float("nan")

    @property
    def worst(self) -> float:
        """The largest error."""
        return max(float(np.max(e, initial=0.0)) for e in (self.frequency, self.static, self.dynamic))

    def worst_of(self, name: str) -> float:
        """Return the largest error of a recovery; of ``body`` that of frequencies, static responses and compliance.

        Returns
        -------
        float
            Relative.
        """
        return self.worst if name == BODY else float(self.recovery[self.recoveries.index(name)].max())


@one_numpy_thread(beside_mkl=True)
def reduction_error(
    model: FEModel,
    reduction: Reduction,
    up_to: float,
    points: int = 6,
    algebra: Algebra = DIRECT,
    recovery: ModelRecovery | None = None,
    damping: float = DAMPING,
) -> ReductionError:
    """Measure a reduction: frequencies, static responses, dynamic compliance and recoveries up to `up_to` (Hz).

    Parameters
    ----------
    model, reduction
        The reduction must be of this model.
    up_to : float
        Hz.
    points : int
        Frequencies at which recoveries are compared, at most: halfway between neighbouring resonances, spread over the
        band, and as many resonances.
    algebra : Algebra
        Functions for factorisation and eigensolution.
    recovery : ModelRecovery or None
        Quantities whose errors are measured too.
    damping : float
        Ratio of both models, for the compliance at resonances.

    Returns
    -------
    ReductionError
        Relative errors of frequencies, static responses and compliance.

    Raises
    ------
    InputError
        When `up_to` or the damping is not positive, or too many modes lie below.

    References
    ----------
    Theory 3.6.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> found = reduction_error(model, craig_bampton(model, modes=12), up_to=5.0)
    >>> len(found.full), bool(found.worst < 1e-3)
    (3, True)
    """
    refuse_other("reduction_error: the model", FEModel, model)
    refuse_other("reduction_error: the reduction", Reduction, reduction)
    return _Reference.of(model, up_to, points, algebra, recovery, damping).compare(reduction)


@dataclass(frozen=True, eq=False)
class _Reference:
    """The full model with its root clamped: reference of all candidates."""

    up_to: float
    damping: float
    rows: np.ndarray  # independent DOFs except those of the root
    F: np.ndarray
    frequency: np.ndarray  # below up_to
    exact: Compliance
    recovered: RecoveryReference

    @classmethod
    def of(
        cls,
        model: FEModel,
        up_to: float,
        points: int,
        algebra: Algebra,
        recovery: ModelRecovery | None,
        damping: float = DAMPING,
    ) -> _Reference:
        if not (up_to > 0 and damping > 0):
            raise InputError(f"up_to = {up_to:g} Hz and damping = {damping:g} must be positive")
        rows = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
        C = model.C[:, rows].tocsr()
        K, M = ((C.T @ A @ C).tocsr() for A in (model.K, model.M))
        factor = algebra.factorise(K, definite=True)
        top = 2 * np.pi * up_to
        w2, Phi = _modes_beyond(K, M, top, factor, algebra)
        F = _loads(model)
        exact = compliance(K, M, w2, Phi, C.T @ F, factor.solve, top)
        full = np.sqrt(w2) / (2 * np.pi)
        inside = full[full < up_to]
        seen = RecoveryReference.of(model, recovery)
        if seen.loads.size:
            between = between_resonances(full[: len(inside) + 1], points)
            for s in (0.0, *(between if len(between) else [up_to / 2])):
                solver = factor if s == 0 else algebra.factorise((K - (2 * np.pi * s) ** 2 * M).tocsr(), definite=False)
                seen.add(2 * np.pi * s, lambda f, solver=solver: C @ solver.solve(C.T @ f))
            chosen = inside[np.unique(np.linspace(0, len(inside) - 1, min(points, len(inside))).astype(int))]
            for w in 2 * np.pi * chosen:
                seen.add(
                    w,
                    lambda f, w=w: C @ damped_response(M, w2, Phi, C.T @ f, factor.solve, w, 2 * damping),
                    2 * damping,
                )
        return cls(up_to, damping, rows, F, inside, exact, seen)

    def compare(self, reduction: Reduction) -> ReductionError:
        """Measure one reduction."""
        own = np.sort(reduction.frequency)
        found = own[: len(self.frequency)]
        padded = np.concatenate([found, np.full(len(self.frequency) - len(found), np.inf)])
        sweep = _around(np.concatenate([self.frequency, own[(own > 0) & (own < self.up_to)]]), self.damping, self.up_to)
        reduced = Compliance((2 * np.pi * reduction.frequency) ** 2, reduction.basis.T @ self.F, np.zeros((0, 0, 0)))
        static = np.diag(self.exact.static)
        moving = reduction.frequency > 0
        missing = 1 - np.einsum("nk,n->k", reduced.a[moving] ** 2, 1 / reduced.w2[moving]) / static
        seen = self.recovered
        return ReductionError(
            up_to=self.up_to,
            full=self.frequency,
            reduced=padded,
            static=np.abs(missing),
            sweep=sweep,
            dynamic=differences(self.exact, reduced, 2 * np.pi * sweep, 2 * self.damping),
            damping=self.damping,
            recoveries=tuple(seen.recovery.quantities),
            recovery_at=np.array(seen.omega) / (2 * np.pi),
            recovery=seen.errors(reduction),
        )


def _modes_beyond(
    K: csr_array, M: csr_array, top: float, factor: Factor, algebra: Algebra
) -> tuple[np.ndarray, np.ndarray]:
    """Return all modes up to one that is above `REACH` times a circular frequency, or all of the model."""
    counted = algebra.count_below(K, M, (REACH * top) ** 2)
    n = 50 if counted is None else counted + 1
    while True:
        if n > MOST:
            raise InputError(
                f"more than {MOST} modes lie below {REACH} times up_to = {top / (2 * np.pi):g} Hz; lower it"
            )
        w2, Phi, _ = algebra.lowest_modes(K, M, n, factor=factor)
        if len(w2) < n or w2[-1] >= (REACH * top) ** 2:
            return w2, Phi
        n = min(2 * n, MOST) if n < MOST else n + 1


def _around(resonance: np.ndarray, ratio: float, up_to: float) -> np.ndarray:
    """Return frequencies (Hz) up to `up_to`: resonances, at 1/4, 1/2, 1, 2, ... half-widths from them, and between."""
    f = np.unique(resonance)
    steps = ratio * 2.0 ** np.arange(-2, max(1, int(np.ceil(np.log2(1 / ratio)))))
    beside = f[:, None] * (1 + np.concatenate([-steps[steps < 1], [0.0], steps]))
    between = np.linspace(0, up_to, EVENLY + 1)[1:]
    found = np.unique(np.concatenate([beside.ravel(), (f[1:] + f[:-1]) / 2, between]))
    return found[(found > 0) & (found <= up_to)]


def _loads(model: FEModel) -> np.ndarray:
    """Unit forces and moments on the interfaces except the root; on a body with one interface its inertia loads."""
    others = [frame.dofs for frame in model.interfaces[1:]]
    if others:
        return unit_loads(model, others)
    loads = model.inertia_loads
    size = np.sqrt(np.einsum("ij,ij->j", loads, loads))
    return loads[:, size > 1e-9 * size.max()]


def to_target(
    model: FEModel,
    reduce: Callable[[int], Reduction],
    target: float | Mapping[str, float],
    up_to: float,
    modes: int = 5,
    algebra: Algebra = DIRECT,
    recovery: ModelRecovery | None = None,
    damping: float = DAMPING,
) -> tuple[Reduction, ReductionError]:
    """Return the first reduction, with increasing numbers of modes, whose errors are below `target`.

    Parameters
    ----------
    model : FEModel
    reduce : callable
        ``reduce(modes) -> Reduction``.
    target : float or {name: float}
        Relative: of the body (`ReductionError.worst`), or of the recoveries named; ``body`` stands for the former.
    up_to : float
        Hz.
    modes : int
        Initial number.
    algebra, damping
        As in `reduction_error`.
    recovery : ModelRecovery or None
        Has the recoveries that `target` names.

    Raises
    ------
    InputError
        When the target or `up_to` is not positive, or a recovery is unknown.
    AccuracyError
        When more modes do not help.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> red, error = to_target(model, lambda n: craig_bampton(model, modes=n), 1e-3, up_to=2.0)
    >>> bool(error.worst < 1e-3)
    True
    """
    targets = target if isinstance(target, Mapping) else {BODY: target}
    for name, value in targets.items():
        if not value > 0:
            raise InputError(f"target_error = {value:g} must be positive")
        refuse_unknown(name, [BODY, *(recovery.quantities if recovery else ())], "target_error: recovery")
    whole = _Reference.of(model, up_to, 6, algebra, recovery, damping)
    while True:
        with silent():  # the notes of the last one count
            reduction = reduce(modes)
        error = whole.compare(reduction)
        above = {name: error.worst_of(name) for name, limit in targets.items() if not error.worst_of(name) < limit}
        if not above:
            warn(reduction.notes)
            return reduction, error
        if modes >= min(TRIED * GROWTH, len(whole.rows)):
            name, found = max(above.items(), key=lambda item: item[1] / targets[item[0]])
            of = "" if name == BODY else f" of recovery {name!r}"
            raise AccuracyError(
                f"with {modes} modes the error{of} up to {up_to:g} Hz is still {found:.1e}, above the target "
                f"{targets[name]:g}; keep truncation vectors, or lower up_to"
            )
        modes = int(np.ceil(GROWTH * modes))
