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
from modalprep.records import Record
from modalprep.reduction.basis import Reduction
from modalprep.reduction.clamped import unit_loads
from modalprep.reduction.recoveries.error import RecoveryReference, between_resonances
from modalprep.reduction.table import BODY
from modalprep.suggest import refuse_other, refuse_unknown

MOST = 300  # modes compared, at most
GROWTH = 1.5


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
        Hz, between the resonances.
    dynamic : (m,)
        Difference of the compliance at these interfaces (or under these loads) over its size, at each frequency.
    recoveries : tuple of str, length r
    recovery_at : (k,)
        Hz: 0, and those of the sweep, or half of `up_to` where it has none.
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
    recoveries: tuple[str, ...] = ()
    recovery_at: np.ndarray = field(default_factory=lambda: np.zeros(0))
    recovery: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))

    @property
    def frequency(self) -> np.ndarray:
        """(n,) relative errors of the frequencies."""
        return np.abs(self.reduced / self.full - 1)

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
) -> ReductionError:
    """Measure a reduction: frequencies, static responses, dynamic compliance and recoveries up to `up_to` (Hz).

    Parameters
    ----------
    model, reduction
        The reduction must be of this model.
    up_to : float
        Hz.
    points : int
        Frequencies of the sweep: halfway between neighbouring resonances of the full model, spread over the band.
    algebra : Algebra
        Functions for factorisation and eigensolution.
    recovery : ModelRecovery or None
        Quantities whose errors are measured too.

    Returns
    -------
    ReductionError
        Relative errors of frequencies, static responses and compliance.

    Raises
    ------
    InputError
        When `up_to` is not positive.

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
    return _Reference.of(model, up_to, points, algebra, recovery).compare(reduction)


@dataclass(frozen=True, eq=False)
class _Reference:
    """The full model with its root clamped: reference of all candidates."""

    up_to: float
    rows: np.ndarray  # independent DOFs except those of the root
    C: csr_array
    F: np.ndarray
    frequency: np.ndarray
    static: np.ndarray  # compliance (k, k)
    sweep: np.ndarray
    dynamic: np.ndarray  # (m, k, k)
    recovered: RecoveryReference

    @classmethod
    def of(
        cls, model: FEModel, up_to: float, points: int, algebra: Algebra, recovery: ModelRecovery | None
    ) -> _Reference:
        if not up_to > 0:
            raise InputError(f"up_to = {up_to:g} Hz must be positive")
        rows = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
        C = model.C[:, rows].tocsr()
        K, M = ((C.T @ A @ C).tocsr() for A in (model.K, model.M))
        cut = (2 * np.pi * up_to) ** 2
        n = algebra.count_below(K, M, cut)
        w2, _, _ = algebra.lowest_modes(K, M, min((n if n is not None else 50) + 1, MOST))
        full = np.sqrt(np.maximum(w2, 0)) / (2 * np.pi)
        F = _loads(model)
        inside = full[full < up_to]
        sweep = between_resonances(full[: len(inside) + 1], points)

        def solver(s: float) -> Callable[[np.ndarray], np.ndarray]:
            factor = algebra.factorise((K - (2 * np.pi * s) ** 2 * M).tocsr(), definite=s == 0)
            return lambda F: C @ factor.solve(C.T @ F)

        answers, seen = [], RecoveryReference.of(model, recovery)
        for s in (0.0, *sweep):
            solve = solver(s)
            answers.append(F.T @ solve(F))
            seen.add(2 * np.pi * s, solve)
        if seen.loads.size and not len(sweep):
            seen.add(np.pi * up_to, solver(up_to / 2))
        dynamic = np.array(answers[1:]).reshape(len(sweep), *answers[0].shape)
        return cls(up_to, rows, C, F, inside, answers[0], sweep, dynamic, seen)

    def compare(self, reduction: Reduction) -> ReductionError:
        """Measure one reduction."""
        f, w2 = reduction.basis.T @ self.F, (2 * np.pi * reduction.frequency) ** 2
        compliance = [f.T @ (f / (w2 - (2 * np.pi * s) ** 2)[:, None]) for s in (0.0, *self.sweep)]
        scale = 1 / np.sqrt(np.diag(self.static))
        loose = [_norm(a - b, scale) / _norm(b, scale) for a, b in zip(compliance[1:], self.dynamic, strict=True)]
        found = np.sort(reduction.frequency)[: len(self.frequency)]
        padded = np.concatenate([found, np.full(len(self.frequency) - len(found), np.inf)])
        missing = 1 - np.diag(compliance[0]) / np.diag(self.static)
        seen = self.recovered
        return ReductionError(
            up_to=self.up_to,
            full=self.frequency,
            reduced=padded,
            static=np.abs(missing),
            sweep=self.sweep,
            dynamic=np.array(loose),
            recoveries=tuple(seen.recovery.quantities),
            recovery_at=np.array(seen.omega) / (2 * np.pi),
            recovery=seen.errors(reduction),
        )


def _loads(model: FEModel) -> np.ndarray:
    """Unit forces and moments on the interfaces except the root; on a body with one interface its inertia loads."""
    others = [frame.dofs for frame in model.interfaces[1:]]
    if others:
        return unit_loads(model, others)
    loads = model.inertia_loads
    size = np.sqrt(np.einsum("ij,ij->j", loads, loads))
    return loads[:, size > 1e-9 * size.max()]


def _norm(A: np.ndarray, scale: np.ndarray) -> float:
    return float(np.linalg.norm(A * scale * scale[:, None]))


def to_target(
    model: FEModel,
    reduce: Callable[[int], Reduction],
    target: float | Mapping[str, float],
    up_to: float,
    modes: int = 5,
    algebra: Algebra = DIRECT,
    recovery: ModelRecovery | None = None,
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
    algebra : Algebra
        Functions for factorisation and eigensolution.
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
    whole = _Reference.of(model, up_to, 6, algebra, recovery)
    while True:
        reduction = reduce(modes)
        error = whole.compare(reduction)
        above = {name: error.worst_of(name) for name, limit in targets.items() if not error.worst_of(name) < limit}
        if not above:
            return reduction, error
        if modes >= min(MOST * GROWTH, len(whole.rows)):
            name, found = max(above.items(), key=lambda item: item[1] / targets[item[0]])
            of = "" if name == BODY else f" of recovery {name!r}"
            raise AccuracyError(
                f"with {modes} modes the error{of} up to {up_to:g} Hz is still {found:.1e}, above the target "
                f"{targets[name]:g}; keep truncation vectors, or lower up_to"
            )
        modes = int(np.ceil(GROWTH * modes))
