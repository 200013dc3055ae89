"""What a job states, as numbers and words by stable names: the columns of the table of a study."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.pipeline.responses.required import largest_error
from modalprep.pipeline.study.table import with_unit
from modalprep.report import summary
from modalprep.response.result import PARTS
from modalprep.verdicts.verdict import FAILED

if TYPE_CHECKING:
    from modalprep.body.flexible_body import FlexibleBody
    from modalprep.multibody.results.envelopes import Envelope
    from modalprep.multibody.results.result import Result
    from modalprep.pipeline.outcome import Outcome
    from modalprep.pipeline.responses.respond import Responded

LOWEST = 10  # frequencies that are stated
Quantity = int | float | str
Stated = Iterator[tuple[str, Any]]


def quantities(outcome: Outcome) -> dict[str, Quantity]:
    """Return what a run states: what [collect] names, then body, responses, strength, system, motion and verdict.

    Names end in the unit of their number, as in ``mass_kg``. What is not known, NaN or infinite is left out.

    Parameters
    ----------
    outcome : Outcome
        Of `run_pipeline`.

    Returns
    -------
    dict of float or str
        By name, in the order of the columns.

    Examples
    --------
    >>> from pathlib import Path
    >>> from modalprep.pipeline.outcome import Outcome
    >>> quantities(Outcome(Path("output")))
    {'verdict': 'NOT CHECKED', 'not_met': 0, 'warnings': 0}
    """
    found = {name: _plain(value) for name, value in _stated(outcome)}
    return {name: value for name, value in found.items() if not isinstance(value, float) or math.isfinite(value)}


def _stated(outcome: Outcome) -> Stated:
    collect = outcome.asked.collect if outcome.asked else None
    if outcome.simulated is not None and collect is not None:
        yield from collected(outcome.simulated.main, collect.channels, collect.statistics)
    if outcome.built is not None:
        yield from _of_body(outcome.built.body)
        if outcome.built.error is not None:
            yield "reduction_error", largest_error(outcome.built.error)
    yield from _of_margins(outcome.margins)
    for found in outcome.responses:
        yield from _of_response(found)
    if outcome.strength is not None:
        yield from _of_strength(summary.strength(outcome.strength))
    if outcome.synthesised is not None:
        yield from _numbered("synthesis_frequency_{}_Hz", outcome.synthesised.modes.frequency)
    yield from _of_analysis(outcome)
    yield from _of_simulation(outcome)
    yield from _of_verdict(outcome)


def _of_body(body: FlexibleBody) -> Stated:
    from modalprep.body.quality.effective_mass import participation
    from modalprep.report.body_page.mass import central_inertia, without_noise

    yield "mass_kg", body.m
    yield from zip(("centre_x_m", "centre_y_m", "centre_z_m"), without_noise(body.s0 / body.m), strict=True)
    inertia = without_noise(central_inertia(body))
    for name, i, j in (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("yz", 1, 2), ("zx", 2, 0)):
        yield f"inertia_{name}_kg_m2", inertia[i, j]
    yield "mode_count", body.n
    yield from _numbered("frequency_{}_Hz", body.frequency)
    yield from _numbered("mode_{}", body.mode_names)
    if body.n and body.at_root and body.normalised:
        for axis, share in zip("xyz", (participation(body)[:, :3] ** 2).sum(axis=0) / body.m, strict=True):
            yield f"effective_mass_{axis}", share


def _of_margins(margins: Mapping[str, float]) -> Stated:
    known = {name: margin for name, margin in margins.items() if math.isfinite(margin)}
    if known:
        worst = min(known, key=known.__getitem__)
        yield "margin", known[worst]
        yield "margin_of", worst


def _of_response(response: Responded) -> Stated:
    for peak in response.response.worst():
        place = peak.place if peak.place in PARTS or not peak.component else ""  # the worst is elsewhere in each job
        parts = (response.name, peak.block, place, peak.component)
        yield with_unit(f"{'.'.join(filter(None, parts))}_peak", peak.unit), peak.largest


def _of_strength(results: Mapping[str, Mapping[str, Mapping[str, Mapping[str, Any]]]]) -> Stated:
    for name, spectra in results["srs"].items():
        for channel, spectrum in spectra.items():
            yield with_unit(f"{name}.{channel}_maximax", spectrum["unit"]), spectrum["maximax"]
    for name, damages in results["fatigue"].items():
        for channel, damage in damages.items():
            yield f"{name}.{channel}_damage", damage["damage"]


def _of_analysis(outcome: Outcome) -> Stated:
    found = outcome.analysed
    if found is not None and found.equilibrium is not None:
        yield "stable", "yes" if found.equilibrium.stable else "no"
    if found is not None and found.modes is not None:
        yield from _numbered("system_frequency_{}_Hz", found.modes.frequency)
        yield from _numbered("system_damping_{}", found.modes.damping)


def _of_simulation(outcome: Outcome) -> Stated:
    if outcome.simulated is None:
        return
    yield from _of_run(outcome.simulated.main)
    for envelope in outcome.simulated.envelopes:
        yield from _of_envelope(envelope)
    counts = summary.ensemble(outcome.simulated.ensemble)
    for status, count in counts.items():
        if isinstance(count, int):
            yield "cases" if status == "cases" else f"cases_{status}", count


def _of_run(run: Result) -> Stated:
    yield "run_status", run.status
    yield "end_time_s", run.time[-1] if len(run.time) else math.nan
    for name in ("steps", "energy_error", "momentum_error"):
        yield name, run.stats.get(name, math.nan)
    for event, times in run.events.items():
        yield f"{event}_first_s", times[0] if len(times) else math.nan


def collected(run: Result, channels: Sequence[str], statistics: Sequence[str]) -> Stated:
    """Yield statistics of channels over the output times of a run, by names such as ``hinge.angle_max_rad``.

    Parameters
    ----------
    run : Result
    channels : sequence of str
        A vector gives its components.
    statistics : sequence of {"min", "max", "rms", "final"}
        The rms is that of the straight lines' squares between the times, by the trapezoidal rule.

    Examples
    --------
    >>> from modalprep.multibody.results.result import Result
    >>> run = Result(time=np.array([0.0, 1.0]), channels={"a.angle": np.array([1.0, -3.0])}, status="", message="")
    >>> {name: float(value) for name, value in collected(run, ["a.angle"], ["max", "rms"])}
    {'a.angle_max_rad': 1.0, 'a.angle_rms_rad': 2.23606797749979}
    """
    from modalprep.report.run_page.channels import channel_unit

    for part, values in run.table(channels).items() if channels else ():
        for name in statistics:
            yield with_unit(f"{part}_{name}", channel_unit(run, part)), _statistic(name, run.time, values)


def _statistic(name: str, time: np.ndarray, values: np.ndarray) -> float:
    known = np.isfinite(values)
    time, values = time[known], values[known]
    if not len(values):
        return math.nan
    if name == "rms":
        span = time[-1] - time[0]
        return float(np.sqrt(np.trapezoid(values**2, time) / span)) if span > 0 else abs(values[-1])
    return {"min": values.min(), "max": values.max(), "final": values[-1]}[name]


def _of_envelope(envelope: Envelope) -> Stated:
    c = len(envelope.components)
    for j, component in enumerate(envelope.components):
        units = set(envelope.units[j::c])
        unit = units.pop() if len(units) == 1 else ""
        name = f"{envelope.body}.{envelope.name}.{component}"
        yield with_unit(f"{name}_min", unit), envelope.lowest[:, j].min()
        yield with_unit(f"{name}_max", unit), envelope.highest[:, j].max()


def _of_verdict(outcome: Outcome) -> Stated:
    verdict = outcome.verdict
    yield "verdict", verdict.word
    yield "not_met", len(verdict.those(FAILED))
    yield "warnings", len(verdict.warnings)


def _numbered(name: str, values: Sequence[Any] | np.ndarray) -> Stated:
    for k, value in enumerate(values[:LOWEST], start=1):
        yield name.format(k), value


def _plain(value: Any) -> Quantity:
    return value.item() if isinstance(value, np.generic) else value
