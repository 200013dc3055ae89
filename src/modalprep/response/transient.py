"""Response to histories of base acceleration and interface forces (theory 11.5)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.response.channels import Block, body_blocks, channel_name
from modalprep.response.inputs import History
from modalprep.response.integrate import Integrator
from modalprep.response.modal import Damping, ModalEquations, modal_equations
from modalprep.response.result import Collector, Peak, Response, is_chosen
from modalprep.response.validity import highest_mode, large_deflection, limits_of_validity
from modalprep.verdicts.notes import told

PER_PERIOD = 20  # samples in a period of the highest kept mode, unless a step is given
MANY, LONGEST = 100_000, 5_000_000  # samples: unless a step is given, and at most
ON_GRID = 1e-6  # of a step
TELLING = 0.02  # of the largest value of the channels of one block and unit
SAYS = (
    "the inputs reach modes that the body drops: were its {0} truncation vectors, which act statically, to vibrate, "
    "{1} would change by up to {2:.0f} % of the largest value there; keep more modes, or smooth the input"
)


@told
def transient_response(
    body: FlexibleBody,
    inputs: Mapping[str, History],
    *,
    step: float | None = None,
    duration: float | None = None,
    damping: Damping = None,
    channels: Sequence[str] = (),
) -> Response:
    """Return the histories of all channels from rest, exact at the samples for inputs that are straight between them.

    Parameters
    ----------
    inputs : {name: History}
        m/s^2, rad/s^2, N or N m, of ``base.x`` and so on.
    step : float
        s; default a part of the smallest step of the tables, with 20 samples in the shortest period of the body; if
        these are more than 100 000, of the normal modes alone.
    duration : float
        s; default to the end of the longest table.
    damping : float, {Hz: ratio}, (n,), Rayleigh, or (n, n)
        Instead of the body's own, as in `modal_equations`.
    channels : sequence of str
        Names, or their beginnings, of the channels with curves; default all.

    Returns
    -------
    Response
        Peaks have ``highest``, ``at_s``, ``lowest`` and ``lowest_at_s``.

    Raises
    ------
    InputError
        When an input or a channel is not known, or there are too many samples.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, section 6.1. Theory 11.5.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> push = History(time=np.array([0.0, 0.1, 0.2]), value=np.array([0.0, 1.0, 0.0]))
    >>> found = transient_response(uniform_beam(modes=2), {"tip.y": push}, duration=2.0, damping=0.01)
    >>> found.peak("base.force.y").figures["at_s"] < 2.0
    True
    """
    if not inputs:
        raise InputError("a response needs an input, such as 'base.x'")
    equations = modal_equations(body, tuple(inputs), damping, np.inf)
    end = duration or max(float(x.time[-1]) for x in inputs.values())
    h = step or _step(inputs, end, body)
    t = h * np.arange(_count(end, h) + 1)
    u = np.stack([x.values_at(t) for x in inputs.values()], axis=1)
    q, _, qdd = Integrator(equations).run(h, u)
    found = Collector(tuple(channels))
    for block in body_blocks(body, equations):
        for part in block.parts(2 * len(t)):
            values = with_mises(part, part.values(q[..., None], qdd[..., None], u[..., None])[..., 0])
            found.add(block, part, values, _figures(values, t), "peak")
    found.refuse_unmet()
    warnings = unresolved(body, equations, damping, h, u, found.peaks, found.chosen)
    top = 0.0 if not warnings and not equations.M.all() else None  # truncation vectors show what the rest does
    notes = [*warnings, *limits_of_validity(body, equations, top), *_sampling(inputs, h, t[-1], body), *found.notes()]
    notes += large_deflection(body, equations, q)
    return found.response("transient", t, inputs, u, notes)


def with_mises(block: Block, s: np.ndarray) -> np.ndarray:
    """Return values (nt, p, c), of stress with von Mises stress ``sqrt(s^T A s)`` as a further component."""
    if block.mises is None:
        return s
    square = np.maximum(((s @ block.mises) * s).sum(-1, keepdims=True), 0.0)
    return np.concatenate([s, np.sqrt(square)], axis=2)


def _step(inputs: Mapping[str, History], end: float, body: FlexibleBody) -> float:
    """Return a part of the smallest step of the tables, fine enough for all modes, or else for the normal ones."""
    smallest = min(float(np.diff(x.time).min()) for x in inputs.values())
    tops = (float(body.frequency.max()), highest_mode(body))
    steps = [smallest / max(1, int(np.ceil(smallest * PER_PERIOD * top))) for top in tops]
    return steps[0] if end <= MANY * steps[0] else steps[1]


def _count(end: float, h: float) -> int:
    if not (h > 0 and end >= h):
        raise InputError(f"a transient of {end:g} s with a step of {h:g} s has no samples; give others")
    count = int(np.floor(end / h * (1 + 1e-12)))
    if count > LONGEST:
        raise InputError(f"a transient of {end:g} s with a step of {h:.3g} s has {count} samples; give a longer step")
    return count


def _sampling(inputs: Mapping[str, History], h: float, end: float, body: FlexibleBody) -> list[str]:
    """Say what the samples miss."""
    notes = []
    for name, x in inputs.items():
        off = np.abs(x.time / h - np.round(x.time / h))[x.time <= end * (1 + ON_GRID)]
        if np.any(off > ON_GRID * np.maximum(1, x.time[: len(off)] / h)):
            notes.append(f"corners of the input {name} lie between samples of {h:.4g} s, which cut them off")
        if x.time[-1] < end * (1 - ON_GRID) and x.value[-1]:
            notes.append(f"the input {name} drops to zero after its table, at {x.time[-1]:g} s")
        if x.time[0] > 0 and x.value[0]:
            notes.append(f"the input {name} is zero before its table, which begins at {x.time[0]:g} s")
    if h * highest_mode(body) * PER_PERIOD > 1 + ON_GRID:
        period = 1 / (h * highest_mode(body))
        notes.append(f"a period of the highest kept mode has {period:.3g} samples: its extremes may lie between them")
    return notes


def _figures(values: np.ndarray, t: np.ndarray) -> dict[str, np.ndarray]:
    high = np.argmax(values, axis=0)
    low = np.argmin(values, axis=0)
    highest, lowest = (np.take_along_axis(values, at[None], 0)[0] for at in (high, low))
    return {
        "highest": highest,
        "at_s": t[high],
        "lowest": lowest,
        "lowest_at_s": t[low],
        "peak": np.maximum(highest, -lowest),
    }


def unresolved(
    body: FlexibleBody,
    equations: ModalEquations,
    damping: Damping,
    step: float,
    u: np.ndarray,
    peaks: Sequence[Peak],
    chosen: tuple[str, ...],
) -> list[str]:
    """Return a warning where a history changes if truncation vectors, which act statically in it, move.

    They have the static response of the dropped modes, and some of their inertia. Where this does not matter, the
    inputs are slow for the dropped modes.

    Parameters
    ----------
    step : float
        s.
    u : (nt, k)
        Samples of the inputs.
    peaks, chosen
        Of the response, and the channels that were asked for.

    References
    ----------
    Theory 11.5.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2)
    >>> unresolved(beam, modal_equations(beam, ["base.y"]), None, 0.01, np.zeros((2, 1)), (), ())
    []
    """
    still = equations.M == 0
    if not still.any():
        return []
    moved = modal_equations(body, equations.inputs, damping).with_(M=still.astype(float)).moving
    q, _, qdd = Integrator(moved).run(step, u)
    q = q - u @ moved.B.T / moved.K
    size: dict[tuple[str, str], float] = {}
    for peak in peaks:
        size[peak.block, peak.unit] = max(size.get((peak.block, peak.unit), 0.0), peak.largest)
    worst: dict[str, float] = {}
    for block in (block for block in body_blocks(body, moved) if not block.is_large):
        for part in block._replace(u=0 * block.u, mises=None).parts(2 * len(u)):
            change = np.abs(part.values(q[..., None], qdd[..., None], u[..., None])).max(axis=(0, 3)).ravel()
            for value, (place, component, unit) in zip(change, part.labels(), strict=True):
                if is_chosen(name := channel_name(block.name, place, component), chosen) and size[block.name, unit]:
                    worst[name] = value / size[block.name, unit]
    name, most = max(worst.items(), key=lambda item: item[1], default=("", 0.0))
    return [SAYS.format(len(q[0]), name, 100 * most)] if most > TELLING else []
