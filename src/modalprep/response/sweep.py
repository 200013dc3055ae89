"""Response to a sine sweep at a rate: exact integration, against the steady state (theory 11.6)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from typing import Literal

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.response.channels import Block, body_blocks
from modalprep.response.harmonic import with_largest_mises
from modalprep.response.inputs import PER_CYCLE, Rate, Spectrum, Sweep, as_spectra, uncovered
from modalprep.response.integrate import Integrator
from modalprep.response.modal import Damping, ModalEquations, modal_equations
from modalprep.response.result import Collector, Response
from modalprep.response.transient import with_mises
from modalprep.response.validity import large_deflection, limits_of_validity, missing_modes
from modalprep.verdicts.notes import told


@told
def sweep_response(
    body: FlexibleBody,
    inputs: Mapping[str, float | Spectrum],
    lowest: float,
    highest: float,
    rate: Rate,
    *,
    direction: Literal["up", "down"] = "up",
    samples: int = PER_CYCLE,
    damping: Damping = None,
    channels: Sequence[str] = (),
) -> Response:
    """Return the largest magnitudes of all channels while a sine sweeps from rest, by the frequency at that time.

    Parameters
    ----------
    inputs : {name: float or Spectrum}
        Amplitudes at the frequency of the time, as in `harmonic_response`.
    lowest, highest : float
        Hz.
    rate : (float, 'oct/min' or 'Hz/s')
        Of the frequency.
    direction : 'up' or 'down'
        Down begins at the highest frequency.
    samples : int
        In a cycle; inputs are straight lines between them.
    damping : float, {Hz: ratio}, (n,), Rayleigh, or (n, n)
        Instead of the body's own, as in `modal_equations`.
    channels : sequence of str
        Names, or their beginnings, of the channels with curves; default all.

    Returns
    -------
    Response
        Over intervals of frequency of a sixtieth of an octave. Peaks have ``peak``, ``at_hz``, ``at_s`` and ``steady``,
        the largest magnitude of the harmonic response at the middles of the intervals and at the resonances.

    Raises
    ------
    InputError
        When an input or a channel is not known, the band or the rate is none, or there are too many samples.

    References
    ----------
    F. M. Lewis, Vibration during acceleration through a critical speed, Trans. ASME 54 (1932) 253-261. Theory 11.6.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> found = sweep_response(uniform_beam(modes=2), {"base.y": 1.0}, 0.3, 1.0, (2.0, "oct/min"), damping=0.02)
    >>> figures = found.peak("tip.acceleration.y").figures
    >>> round(figures["peak"] / figures["steady"], 2)  # too fast for the steady state
    0.5
    """
    spectra = as_spectra(inputs)
    equations = modal_equations(body, tuple(spectra), damping, highest)
    clock = Sweep(lowest, highest, rate, direction)
    clock.refuse_long(samples)
    every = body_blocks(body, equations)
    blocks = [block for block in every if not block.is_large]
    ends = clock.ends()
    f = np.sqrt(ends[1:] * ends[:-1])
    rising = np.argsort(f)
    swept, largest, times = _march(equations, spectra, clock, ends, samples, blocks)
    steady, top = _steady(equations, spectra, f[rising], blocks)
    found = Collector(tuple(channels))
    for k, block in enumerate(blocks):
        figures = _figures(largest[k], times[k], f) | {"steady": top[k]}
        found.add(block, block, largest[k][rising], figures, "peak", steady[k])
    found.refuse_unmet()
    error = (2 * np.pi / samples) ** 2 / 8
    notes = [
        *missing_modes(body, equations, highest),
        f"straight lines between {samples} samples of a cycle miss the sine by {100 * error:.2g} % of its amplitude",
        *large_deflection(body, equations, swept),
        *limits_of_validity(body, equations, highest),
        *uncovered(spectra, lowest, highest),
        *(f"{block.name} has too many channels for a sweep, which leaves it out" for block in every if block.is_large),
    ]
    values = np.stack([x.values_at(f[rising]) for x in spectra.values()], axis=1)
    return found.response("sweep", f[rising], spectra, values, notes)


def _figures(largest: np.ndarray, times: np.ndarray, f: np.ndarray) -> dict[str, np.ndarray]:
    """Return the largest of all intervals (p, c), its frequency and its time."""
    at = np.argmax(largest, axis=0)
    peak, time = (np.take_along_axis(x, at[None], 0)[0] for x in (largest, times))
    return {"peak": peak, "at_hz": f[at], "at_s": time}


def _march(
    equations: ModalEquations,
    spectra: Mapping[str, Spectrum],
    clock: Sweep,
    ends: np.ndarray,
    samples: int,
    blocks: list[Block],
) -> tuple[np.ndarray, list[np.ndarray], list[np.ndarray]]:
    """Return q at the largest coordinate of each interval, and of each block the largest magnitudes with times."""
    integrator = Integrator(equations)
    swept = []
    largest, times = [[] for _ in blocks], [[] for _ in blocks]
    for a, b in pairwise(ends):
        start, end = clock.time(np.array([a, b]))
        count = max(2, int(np.ceil((end - start) * max(a, b) * samples)))
        t = np.linspace(start, end, count + 1)
        u = _input(spectra, clock, t)
        q, _, qdd = integrator.run((end - start) / count, u)
        swept.append(q[np.argsort(-np.abs(q).max(axis=1))[:1]])
        for k, block in enumerate(blocks):
            parts = [_maxima(part, q, qdd, u, t) for part in block.parts(2 * len(t))]
            largest[k].append(np.concatenate([x for x, _ in parts]))
            times[k].append(np.concatenate([x for _, x in parts]))
    return np.concatenate(swept), [np.stack(x) for x in largest], [np.stack(x) for x in times]


def _input(spectra: Mapping[str, Spectrum], clock: Sweep, t: np.ndarray) -> np.ndarray:
    """Return ``Im(amplitude exp(i phase))`` of each input (nt, k)."""
    wave = np.exp(1j * clock.phase(t))
    f = clock.frequency(t)
    return np.stack([np.imag(x.values_at(f) * wave) for x in spectra.values()], axis=1)


def _maxima(part: Block, q: np.ndarray, qdd: np.ndarray, u: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    size = np.abs(with_mises(part, part.values(q[..., None], qdd[..., None], u[..., None])[..., 0]))
    at = np.argmax(size, axis=0)
    return np.take_along_axis(size, at[None], 0)[0], t[at]


def _steady(
    equations: ModalEquations, spectra: Mapping[str, Spectrum], f: np.ndarray, blocks: list[Block]
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return, of each block, the magnitudes of the harmonic response at f, and the largest, resonances included."""
    at, ratio = equations.resonances
    peaks = at[(at > f[0]) & (at < f[-1]) & (ratio > 0)]
    every = np.concatenate([f, peaks])
    u = np.stack([x.values_at(every) for x in spectra.values()], axis=1).astype(complex)[..., None]
    q = equations.solve(every, u)
    qdd = -((2 * np.pi * every[:, None, None]) ** 2) * q
    curves, top = [], []
    for block in blocks:
        parts = (part.values(q, qdd, u)[..., 0] for part in block.parts(2 * len(every)))
        size = np.concatenate([np.abs(with_largest_mises(block, s)) for s in parts], axis=1)
        curves.append(size[: len(f)])
        top.append(size.max(axis=0))
    return curves, top
