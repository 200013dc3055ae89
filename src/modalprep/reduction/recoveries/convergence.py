"""Convergence of recovered quantities with the number of modes, by mode displacement and acceleration (theory 3.6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.fe.recovery.recover import ModelRecovery
from modalprep.records import Record
from modalprep.reduction.recoveries.unit_loads import Contributions, JudgedLoads

AT_ONCE = 2_000_000  # numbers of a recovery under all loads that are followed at a time


@dataclass(frozen=True, eq=False, kw_only=True)
class Convergence(Record):
    """What the first 0, 1, 2, ... kept modes leave of each recovery, relative to its complete static response.

    Attributes
    ----------
    recoveries : tuple of str, length r
    methods : tuple of str, length r
        ``acceleration`` or ``displacement``: what the recovery has in the body.
    frequency : (n,)
        Hz, of the kept candidates in ascending order.
    displacement : (r, n + 1)
        Of static loads by the modes alone. Truncation vectors and mode acceleration add what is left.
    acceleration : (r, n + 1)
        Of harmonic loads of frequency `up_to` by mode acceleration, estimated; NaN where that is not known.
    up_to : float
        Hz; NaN without.

    References
    ----------
    Theory 3.6.

    Examples
    --------
    >>> found = Convergence(recoveries=("strut",), methods=("acceleration",), frequency=np.array([3.0]),
    ...     displacement=np.array([[1.0, 0.1]]), acceleration=np.full((1, 2), np.nan), up_to=np.nan)
    >>> found.displacement.shape == (len(found.recoveries), len(found.frequency) + 1)
    True
    """

    recoveries: tuple[str, ...]
    methods: tuple[str, ...]
    frequency: np.ndarray
    displacement: np.ndarray
    acceleration: np.ndarray
    up_to: float

    def notes(self) -> tuple[str, ...]:
        """Return a sentence on what the kept modes leave.

        Returns
        -------
        tuple of str
            One, or none without recoveries.
        """
        left = [f"{100 * d:.3g}% of {name}" for name, d in zip(self.recoveries, self.displacement[:, -1], strict=True)]
        if not left:
            return ()
        return (
            f"the {len(self.frequency)} kept modes alone leave {', '.join(left)} in statics, under the worst unit load; "
            "truncation vectors and mode acceleration add it",
        )


def convergence(recovery: ModelRecovery, loads: JudgedLoads, kept: np.ndarray, up_to: float | None) -> Convergence:
    """Return what is left of each recovery when the modes of ``kept (n,)`` are taken one by one.

    Dropped candidates are never taken. By mode acceleration the modes beyond those taken lack
    ``w^2 / (w_k^2 - w^2)`` of their static part, those beyond the candidates at most that of the highest candidate.
    """
    frequency = np.sqrt(loads.w2) / (2 * np.pi)
    some = np.flatnonzero(kept)
    parts = {name: Contributions.of(q, loads) for name, q in recovery.quantities.items()}
    r, n = len(parts), len(some)
    factor = np.full((r, n + 1), np.nan)
    amplified = None if up_to is None or not len(loads.w2) else _dynamic(loads.w2, 2 * np.pi * up_to)
    if amplified is not None:
        own = [_left(found, some, *amplified) for found in parts.values()]
        factor = np.array(own).reshape(r, n + 1)
    ones = np.ones(len(loads.w2))
    return Convergence(
        recoveries=tuple(parts),
        methods=tuple(recovery.wanted[name].method for name in parts),
        frequency=frequency[some],
        displacement=np.array([_left(found, some, ones, 1.0) for found in parts.values()]).reshape(r, n + 1),
        acceleration=factor,
        up_to=np.nan if up_to is None else float(up_to),
    )


def _dynamic(w2: np.ndarray, w: float) -> tuple[np.ndarray, float] | None:
    """Return ``w^2 / (w_k^2 - w^2)`` of the candidates, and its bound beyond them; None where they end below w."""
    if w2[-1] <= w**2:
        return None
    with np.errstate(divide="ignore"):
        return w**2 / (w2 - w**2), w**2 / (w2[-1] - w**2)


def _left(found: Contributions, some: np.ndarray, weight: np.ndarray, beyond: float) -> np.ndarray:
    """Return the largest remainder ``(n + 1,)`` after each of the modes `some`, over the complete response."""
    p, c, m = found.complete.shape
    scales, total = found.scales(), np.zeros(len(some) + 1)
    step = max(1, AT_ONCE // max(1, c * m))
    for first in range(0, p, step):
        here = slice(first, first + step)
        modal, rest = found.modal[here], np.zeros_like(found.complete[here])
        for k in range(modal.shape[2]):
            rest += modal[:, :, k, None] * found.factor[k]
        rest = beyond * (found.complete[here] - rest)  # of modes that are no candidates
        for k in range(modal.shape[2]):
            rest += weight[k] * (modal[:, :, k, None] * found.factor[k])
        total[0] = max(total[0], _largest(rest, found, scales))
        for place, k in enumerate(some, start=1):
            rest -= weight[k] * (modal[:, :, k, None] * found.factor[k])
            total[place] = max(total[place], _largest(rest, found, scales))
    return total


def _largest(rest: np.ndarray, found: Contributions, scales: np.ndarray) -> float:
    sizes = [
        np.max(np.abs(rest[:, own]).max(axis=(0, 1), initial=0.0) / scale, initial=0.0)
        for (_, own), scale in zip(found.groups, scales, strict=True)
    ]
    return float(max(sizes, default=0.0))
