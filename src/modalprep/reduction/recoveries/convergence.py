"""Convergence of the recovered quantities of a body with the number of its modes (theory 3.6)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.ritz import ritz
from modalprep.records import Record
from modalprep.reduction.dropped import dropped_flexibility, unit_forces
from modalprep.reduction.recoveries.unit_loads import body_loads
from modalprep.reduction.truncation import BEYOND, ENERGY, MOSTLY

COUNTS = 9  # numbers of modes, at most
ROWS = 20_000  # numbers of a recovery that are followed, at most; of larger ones evenly chosen places
WORK, FEWEST = 300_000_000, 60  # products for each number of modes, and numbers of a recovery that are always followed
DAMPING = 0.01  # ratio of unit loads
BESIDE = np.array([-4.0, -2.0, -1.0, 0.0, 1.0, 2.0, 4.0])  # half-widths from a resonance
EVENLY = 20  # further frequencies over the band


@dataclass(frozen=True, eq=False, kw_only=True)
class Convergence(Record):
    """How far each recovery with the first 0, 1, ... kept modes is from that of the body with all of them.

    Attributes
    ----------
    recoveries : tuple of str, length r
    methods : tuple of str, length r
        ``acceleration`` or ``displacement``, as in the body.
    share : (r,)
        Of the places that were followed: 1, less for large recoveries.
    count : (k,) int
        Numbers of modes, the last all of them.
    frequency : (k,)
        Hz, of the highest of these modes; 0 without any.
    error : (r, k)
        Largest difference of a peak or a root mean square over the band, over the largest of the recovery in this unit
        under any of the loads. Truncation vectors and constraint modes are there whatever the number of modes.
    up_to : float
        Hz.
    loads : tuple of str
        The responses that were asked for; none stands for unit loads.

    References
    ----------
    Theory 3.6.

    Examples
    --------
    >>> found = Convergence(recoveries=("strut",), methods=("acceleration",), share=np.ones(1), count=np.arange(2),
    ...     frequency=np.array([0.0, 3.0]), error=np.array([[1.0, 0.0]]), up_to=2.0)
    >>> found.error.shape == (len(found.recoveries), len(found.count))
    True
    """

    recoveries: tuple[str, ...]
    methods: tuple[str, ...]
    share: np.ndarray
    count: np.ndarray
    frequency: np.ndarray
    error: np.ndarray
    up_to: float
    loads: tuple[str, ...] = ()


class Asked(NamedTuple):
    """Harmonic loads on a body over a band.

    Attributes
    ----------
    name : str
        Of the response that asks for them.
    columns : (12 + 6 n_if, m)
        A, W and loads on the interfaces.
    size : callable
        Their amplitudes ``(nf, m)`` at frequencies ``(nf, m)``, Hz.
    low, high : float
        Hz.
    damping : float
        Ratio.
    """

    name: str
    columns: np.ndarray
    size: Callable[[np.ndarray], np.ndarray]
    low: float
    high: float
    damping: float


class Directions(NamedTuple):
    """What a body with some of its modes can do: directions (n, r), circular frequencies and masses (r,)."""

    Y: np.ndarray
    w: np.ndarray
    mass: np.ndarray


def recovery_convergence(
    body: Any, spans: Any, up_to: float | None = None, asked: Sequence[Asked] = ()
) -> Convergence | None:
    """Return the convergence of the recoveries of a body in which ``spans`` of a reduction say what its modes are.

    Parameters
    ----------
    body : ModalBody
        With recoveries.
    spans : Spans
        Of its reduction: `Reduction.spans`.
    up_to : float or None
        Hz, of unit loads; half of the frequency of the highest kept mode by default.
    asked : sequence of Asked
        The loads that matter; by default unit accelerations of the root and unit loads on the other interfaces.

    Returns
    -------
    Convergence or None
        None without recoveries or modes.

    References
    ----------
    Theory 3.6.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> recovery_convergence(uniform_beam(modes=2), None) is None
    True
    """
    if spans is None or not body.recovery or not spans.modes.shape[1]:
        return None
    n = spans.modes.shape[1]
    top = float(spans.frequency[-1] / 2 if up_to is None else up_to)
    loads = asked or [Asked("", body_loads(body), np.ones_like, 0.0, top, DAMPING)]
    count = counts(n)
    error = np.zeros((len(body.recovery), len(count)))
    share = np.ones(len(body.recovery))
    for one in loads:
        f = harmonic_frequencies(body.K, one)
        most = max(FEWEST, WORK // (body.n * len(f) * one.columns.shape[1]))
        blocks = [_thinned(block, min(ROWS, most)) for block in body.recovery.values()]
        share = np.minimum(share, [len(b.q) / len(x.q) for b, x in zip(blocks, body.recovery.values(), strict=True)])
        whole = _figures(body, directions(body, spans, n, one.high), one, f, blocks)
        for k, number in enumerate(count[:-1]):
            some = _figures(body, directions(body, spans, number, one.high), one, f, blocks)
            for i, block in enumerate(blocks):
                error[i, k] = max(error[i, k], _difference(block.units, some[i], whole[i]))
    return Convergence(
        recoveries=tuple(body.recovery),
        methods=tuple("displacement" if block.loads is None else "acceleration" for block in body.recovery.values()),
        share=share,
        count=np.array(count),
        frequency=np.array([0.0, *spans.frequency])[count],
        error=error,
        up_to=max(one.high for one in loads),
        loads=tuple(one.name for one in loads if one.name),
    )


def counts(n: int) -> list[int]:
    """Return the numbers of modes that are compared, from none to all n.

    Examples
    --------
    >>> counts(3), counts(60)
    ([0, 1, 2, 3], [0, 1, 2, 4, 8, 15, 30, 45, 60])
    """
    if n < COUNTS:
        return list(range(n + 1))
    return sorted({0, round(0.75 * n), *(round(n / 2**k) for k in range(COUNTS - 2))})


def harmonic_frequencies(K: np.ndarray, asked: Asked) -> np.ndarray:
    """Return frequencies (Hz) of a band: resonances, points beside and between them, and some evenly.

    Examples
    --------
    >>> asked = Asked("", np.zeros((24, 1)), np.ones_like, 0.0, 2.0, 0.01)
    >>> harmonic_frequencies(np.array([(2 * np.pi) ** 2]), asked)[9:16]
    array([0.96, 0.98, 0.99, 1.  , 1.01, 1.02, 1.04])
    """
    f = np.sqrt(K[K > 0]) / (2 * np.pi)
    f = f[(f > asked.low) & (f < asked.high)]
    beside = f[:, None] * (1 + asked.damping * BESIDE)
    evenly = np.linspace(asked.low, asked.high, EVENLY + 1)[int(asked.low == 0) :]
    found = np.unique(np.concatenate([beside.ravel(), (f[1:] + f[:-1]) / 2, evenly]).round(12))
    return found[(found >= asked.low) & (found <= asked.high)]


def directions(body: Any, spans: Any, number: int, top: float) -> Directions:
    """Return what a body with the first modes can do; truncation vectors act statically, as in responses (11.1)."""
    K = body.K
    loose = np.eye(len(K))[:, K <= 0]
    first = spans.modes[:, :number]
    answers = spans.answers
    rest = answers - first @ (first.T @ answers)
    energy, left = (np.einsum("n,nm,nm->m", K, x, x) for x in (answers, rest))
    rest = rest[:, left > ENERGY * energy.max(initial=0.0)]
    unit = csr_array(np.eye(len(K)))
    stiff = csr_array(np.diag(K))
    W = np.hstack([spans.others, first, rest])
    w2, Y = ritz(W[:, np.any(W, axis=0)], stiff, unit, loose)
    w = np.sqrt(w2)
    mass = np.ones(len(w2))
    complete = min([body.modes.complete_below, *spans.frequency[number : number + 1]])
    if rest.shape[1] and complete < top:
        share = (Y.T @ ritz(rest, stiff, unit)[1]) ** 2
        mass[(share.sum(axis=1) > MOSTLY) & (w < BEYOND * 2 * np.pi * top)] = 0.0
    return Directions(Y, w, mass)


def _figures(
    body: Any, some: Directions, asked: Asked, f: np.ndarray, blocks: list[Any]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return, of each recovery, the peaks (p, c, m) and the root mean squares over a band."""
    s = 2 * np.pi * f[:, None]
    forces = unit_forces(body) @ asked.columns
    size = asked.size(np.broadcast_to(f[:, None], (len(f), forces.shape[1])))
    gap = some.w**2 - some.mass * (s**2 - 2j * asked.damping * some.w * s)
    p = (some.Y.T @ forces)[None] / np.where(gap == 0, np.inf, gap)[..., None] * size[:, None]
    qdd = np.matmul(some.Y, -(s**2 * some.mass)[..., None] * p)
    bare = np.matmul(some.Y, np.where(some.w[:, None] > 0, p, 0.0))
    flexibility = dropped_flexibility(body.K, some.Y, some.w)
    u = bare + np.matmul(flexibility, forces[None] * size[:, None] - qdd)
    found = []
    for block in blocks:
        values = np.tensordot(block.q, bare if block.loads is None else u, (2, 1))  # (p, c, nf, m)
        if block.qdd is not None:
            values = values + np.tensordot(block.qdd, qdd, (2, 1))
        if block.loads is not None:
            values = values + (block.loads @ asked.columns)[:, :, None] * size
        power = np.abs(values) ** 2
        found.append((np.sqrt(power.max(axis=2)), np.sqrt(np.trapezoid(power, f, axis=2))))
    return found


def _difference(
    units: tuple[str, ...], some: tuple[np.ndarray, np.ndarray], references: tuple[np.ndarray, np.ndarray]
) -> float:
    """Return the largest difference of figures (p, c, m) over the largest with the same unit under any load."""
    worst = 0.0
    for found, reference in zip(some, references, strict=True):
        own = np.broadcast_to(np.reshape(units, (-1, reference.shape[1])), reference.shape[:2])
        for unit in set(units):
            size, off = (np.abs(x[own == unit]).max(initial=0.0) for x in (reference, found - reference))
            worst = max(worst, float(off / size) if size > 0 else 0.0)
    return worst


def _thinned(block: Any, most: int) -> Any:
    """Return a recovery at evenly chosen places where it has too many numbers."""
    p, c, _ = block.q.shape
    some = np.unique(np.linspace(0, p - 1, max(1, most // c)).astype(int)) if p * c > most else np.arange(p)
    if len(some) == p:
        return block
    arrays = {name: getattr(block, name) for name in ("q", "qdd", "loads", "position", "node", "cell")}
    units = block.units if len(block.units) == c else tuple(np.reshape(block.units, (p, c))[some].ravel().tolist())
    return block.with_(
        places=tuple(block.places[i] for i in some),
        units=units,
        **{name: array[some] for name, array in arrays.items() if array is not None},
    )
