"""Convergence of the recovered quantities of a body with the number of its modes (theory 3.6)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.linalg.ritz import ritz
from modalprep.records import Record
from modalprep.reduction.dropped import dropped_flexibility, unit_forces
from modalprep.reduction.recoveries.error import between_resonances, largest_difference
from modalprep.reduction.recoveries.unit_loads import body_loads
from modalprep.reduction.truncation import ENERGY

POINTS = 6  # frequencies at which the harmonic response is compared, at most
COUNTS = 9  # numbers of modes, at most
ROWS = 20_000  # numbers of a recovery that are followed; of larger ones evenly chosen places


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
        Largest difference under harmonic unit loads below `up_to`, over the largest value under that load. Truncation
        vectors and constraint modes are there whatever the number of modes.
    up_to : float
        Hz.

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


class Response(NamedTuple):
    """Harmonic response of a body with some of its directions: fields over its n coordinates, one load per column."""

    u: np.ndarray  # by mode acceleration
    bare: np.ndarray  # by mode displacement
    qdd: np.ndarray


def recovery_convergence(body: Any, spans: Any, up_to: float | None = None) -> Convergence | None:
    """Return the convergence of the recoveries of a body in which ``spans`` of a reduction say what its modes are.

    Parameters
    ----------
    body : ModalBody
        With recoveries.
    spans : Spans
        Of its reduction: `Reduction.spans`.
    up_to : float or None
        Hz; half of the frequency of the highest kept mode by default.

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
    n = 0 if spans is None else spans.modes.shape[1]
    if not body.recovery or not n:
        return None
    up_to = float(spans.frequency[-1] / 2 if up_to is None else up_to)
    loads, count, omega = body_loads(body), counts(n), harmonic_frequencies(body.K, 2 * np.pi * up_to)
    whole = [_response(body, np.eye(body.n), np.sqrt(body.K), loads, w) for w in omega]
    error = np.zeros((len(body.recovery), len(count)))
    blocks = {name: _thinned(block) for name, block in body.recovery.items()}
    for k, number in enumerate(count[:-1]):
        Y, w = _directions(body.K, spans, number)
        some = [_response(body, Y, w, loads, at) for at in omega]
        for i, block in enumerate(blocks.values()):
            error[i, k] = max(
                largest_difference(block.units, _values(block, a, loads), _values(block, b, loads))
                for a, b in zip(some, whole, strict=True)
            )
    return Convergence(
        recoveries=tuple(blocks),
        methods=tuple("displacement" if block.loads is None else "acceleration" for block in blocks.values()),
        share=np.array([len(b.q) / len(body.recovery[name].q) for name, b in blocks.items()]),
        count=np.array(count),
        frequency=np.array([0.0, *spans.frequency])[count],
        error=error,
        up_to=up_to,
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


def harmonic_frequencies(K: np.ndarray, up_to: float) -> list[float]:
    """Return circular frequencies: 0, and halfway between resonances below `up_to` (1/s), or half of that."""
    w = np.sqrt(K[K > 0])
    inside = w[: np.count_nonzero(w < up_to) + 1]
    return [0.0, *(between_resonances(inside, POINTS).tolist() or [up_to / 2])]


def _directions(K: np.ndarray, spans: Any, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return directions ``(n, r)`` and circular frequencies of a body with the first modes, of unit modal mass."""
    loose = np.eye(len(K))[:, K <= 0]
    first, answers = spans.modes[:, :number], spans.answers
    rest = answers - first @ (first.T @ answers)
    energy, left = (np.einsum("n,nm,nm->m", K, x, x) for x in (answers, rest))
    W = np.hstack([spans.others, first, rest[:, left > ENERGY * energy.max(initial=0.0)]])
    w2, Y = ritz(W[:, np.any(W, axis=0)], csr_array(np.diag(K)), csr_array(np.eye(len(K))), loose)
    return Y, np.sqrt(w2)


def _response(body: Any, Y: np.ndarray, w: np.ndarray, loads: np.ndarray, omega: float) -> Response:
    forces = unit_forces(body) @ loads
    gap = (w**2 - omega**2)[:, None]
    p = np.divide(Y.T @ forces, gap, out=np.zeros((len(w), loads.shape[1])), where=gap != 0)
    strained = Y @ np.where(w[:, None] > 0, p, 0.0)
    qdd = -(omega**2) * (Y @ p)
    flexibility = dropped_flexibility(body.K, Y, w)
    return Response(strained + flexibility @ (forces - qdd), strained, qdd)


def _values(block: Any, found: Response, loads: np.ndarray) -> np.ndarray:
    values = block.q @ (found.bare if block.loads is None else found.u)
    if block.qdd is not None:
        values = values + block.qdd @ found.qdd
    return values if block.loads is None else values + block.loads @ loads


def _thinned(block: Any) -> Any:
    """Return a recovery at evenly chosen places where it has too many numbers."""
    p, c, _ = block.q.shape
    some = np.unique(np.linspace(0, p - 1, max(1, ROWS // c)).astype(int)) if p * c > ROWS else np.arange(p)
    if len(some) == p:
        return block
    arrays = {name: getattr(block, name) for name in ("q", "qdd", "loads", "position", "node", "cell")}
    units = block.units if len(block.units) == c else tuple(np.reshape(block.units, (p, c))[some].ravel().tolist())
    return block.with_(
        places=tuple(block.places[i] for i in some), units=units,
        **{name: array[some] for name, array in arrays.items() if array is not None},
    )  # fmt: skip
