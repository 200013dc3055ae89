"""The sections of the page of a run, in their order."""

from __future__ import annotations

import mimetypes
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import AUDIT, BALANCE, END, MOMENTUM, WORST
from modalprep.report.body_page.section import Section, chart, embedded, paragraph
from modalprep.report.body_page.table import Table, part
from modalprep.report.numbers import number, raised
from modalprep.report.run_page.channels import channel_unit
from modalprep.report.run_page.curves import curves
from modalprep.verdicts.verdict import FAILED, PASSED

if TYPE_CHECKING:
    from modalprep.multibody.evaluation.impact import Impact
    from modalprep.verdicts.verdict import Requirement

LISTED = 300  # channels of the table of extremes
DRAWN = 12  # charts of channels
LARGEST = 12_000_000  # bytes of a film inside the page
CARRIED = ("force", "torque", "multiplier")  # of closures and couplers
OPEN = 10  # times of an event that are listed
EVALUATIONS = {
    "method": "method at the end",
    "steps": "steps",
    "evaluations": "evaluations of the equations",
    "rejected": "rejected steps",
    "halved": "halved steps",
    "stiffness_ratio": "steps that stability asks of the explicit method",
}


def the_run(run: Result, settings: Mapping[str, str], notes: Sequence[str]) -> Section:
    """Return the section of how the run went: messages, method, tolerance, steps."""
    rows = [("outcome", raised(f"{run.status}: {run.message}"))]
    if len(run.time):
        rows.append(("time", f"{number(run.time[0])} to {number(run.time[-1], 6)} s, {len(run.time)} times recorded"))
    rows += list(settings.items())
    rows += [(text, _said(run.stats[key])) for key, text in EVALUATIONS.items() if key in run.stats]
    html = part("messages.html", notes=notes) + Table(name="run", columns=("quantity", "value"), rows=rows).html()
    return Section(title="Run", anchor="run-section", html=html)


def _said(value: Any) -> str:
    return number(value, 3) if isinstance(value, float) else str(value)


def the_system(system: Any) -> list[Section]:
    """Return the section of bodies and joints, none without a system."""
    if system is None:
        return []
    bodies = Table(
        name="bodies",
        columns=("body", "mass (kg)", "modes", "lowest mode (Hz)", "highest mode (Hz)"),
        rows=[(name, body.m, body.n, *_band(body.frequency)) for name, body in system.bodies.items()],
        total=("sum", float(sum(body.m for body in system.bodies.values())), None, None, None),
        caption="Bodies; their modes are those with the root clamped.",
    )
    joints = Table(
        name="joints",
        columns=("joint", "type", "parent", "child"),
        rows=[(joint.name, joint.type, joint.parent, joint.child) for joint in system.joints],
    )
    gravity = ", ".join(number(float(g)) for g in system.gravity)
    counts = [(len(getattr(system, key, ())), text) for key, text in (("loads", "loads"), ("closures", "closures"))]
    more = "".join(f", {count} {text}" for count, text in counts if count)
    html = bodies.html() + joints.html() + paragraph(f"Gravity ({gravity}) m/s²{more}.")
    return [Section(title="System", anchor="system", html=html)]


def _band(frequency: np.ndarray) -> tuple[float | None, float | None]:
    return (float(frequency[0]), float(frequency[-1])) if len(frequency) else (None, None)


def audits(run: Result, rtol: float, audited: Sequence[Requirement]) -> Section:
    """Return the section of the audit: end, energy, momenta, closures of loops."""
    table = Table(
        name="audit",
        columns=("audit", "value", "limit", "result", "meaning"),
        rows=audit_rows(run, rtol, audited),
        forms={"value": ".1e", "limit": ".0e"},
        caption=f"What the run says against itself, at a relative tolerance of {number(rtol)}.",
    )
    return Section(title="Audit", anchor="audit-section", html=table.html())


def audit_rows(run: Result, rtol: float, audited: Sequence[Requirement]) -> list[tuple[Any, ...]]:
    """Return value, limit, result and meaning of each audit of a run.

    Examples
    --------
    >>> run = Result(time=np.zeros(1), channels={}, status="done", message="", stats={"energy_error": 2e-8})
    >>> [row[:4] for row in audit_rows(run, 1e-6, ())]
    [('end of the run', None, None, 'passed'), ('energy balance', 2e-08, 0.001, 'passed')]
    """
    results = {audit.name: audit.result for audit in audited}
    end = (FAILED, run.message) if run.status == "diverged" else (PASSED, "reached")
    rows: list[tuple[Any, ...]] = [(END, None, None, *end)]
    kinds = (
        ("energy_error", BALANCE, AUDIT, "largest error over the largest part"),
        ("momentum_error", "momenta", MOMENTUM, "of what nothing holds or loads"),
        ("momentum_restored", "momenta given back", AUDIT, "of what nothing holds, in all steps"),
    )
    for key, name, times, meaning in kinds:
        if key in run.stats:
            limit = min(times * rtol, WORST)
            rows.append((name, float(run.stats[key]), limit, results.get(name, PASSED), meaning))
    return [*rows, *_gaps(run)]


def _gaps(run: Result) -> list[tuple[Any, ...]]:
    """Return the largest gap of each closure while it carries a force; before an event closes it there is a gap."""
    rows: list[tuple[Any, ...]] = []
    for name in (name.removesuffix(".violation") for name in run.channels if name.endswith(".violation")):
        carried = [run.channels[key] for part in CARRIED if (key := f"{name}.{part}") in run.channels]
        closed = np.any([np.abs(x).reshape(len(x), -1).max(axis=1) > 0 for x in carried], axis=0)
        gaps = np.abs(run.channels[f"{name}.violation"])[closed] if np.any(closed) else np.zeros(0)
        said = "largest gap while it carries a force, m or rad" if gaps.size else "it carries no force"
        rows.append((f"closure {name}", float(gaps.max()) if gaps.size else None, None, "", said))
    return rows


def events(run: Result) -> list[Section]:
    """Return the section of events and impacts, none without any."""
    rows = [
        (name, len(times), ", ".join(f"{number(t, 6)}" for t in times[:OPEN]) + (", ..." if len(times) > OPEN else ""))
        for name, times in run.events.items()
    ]
    hits = [(name, hit.t, hit.energy_loss, _impulses(hit)) for name, own in run.impacts.items() for hit in own]
    if not rows and not hits:
        return []
    html = Table(name="events", columns=("event", "crossings", "times (s)"), rows=rows).html()
    if hits:
        columns = ("impact", "time (s)", "lost energy (J)", "magnitudes of impulses (N s, N m s)")
        html += Table(name="impacts", columns=columns, rows=hits).html()
    return [Section(title="Events", anchor="events-section", html=html)]


def _impulses(hit: Impact) -> str:
    return ", ".join(f"{key} {number(float(np.linalg.norm(x)))}" for key, x in hit.impulse.items())


def extremes(run: Result, channels: Sequence[str]) -> list[Section]:
    """Return the section of the smallest and largest values of channels with their times, none without channels."""
    columns = {k: v for k, v in run.table(channels).items() if np.isfinite(v).any()} if len(channels) else {}
    if not columns:
        return []
    rows = []
    for name, values in list(columns.items())[:LISTED]:
        low = int(np.nanargmin(values))
        high = int(np.nanargmax(values))
        pairs = ((float(values[k]), float(run.time[k])) for k in (low, high))
        rows.append((name, channel_unit(run, name), *(x for pair in pairs for x in pair), float(values[-1])))
    table = Table(
        name="channel-extremes",
        columns=("channel", "unit", "smallest", "smallest at (s)", "largest", "largest at (s)", "last"),
        rows=rows,
        caption="Smallest, largest and last value of each channel among the recorded times.",
    )
    left = len(columns) - LISTED
    more = paragraph(f"{left} more channels are in the CSV file beside this page.") if left > 0 else Markup("")
    return [Section(title="Extremes", anchor="extremes-section", html=table.html() + more)]


def histories(
    run: Result, channels: Sequence[str], plots: Sequence[tuple[str, Path]], plotted: Sequence[str]
) -> list[Section]:
    """Return the section of the plots of the pipeline file, and of the channels that they do not show."""
    html = Markup("").join(chart(file, title) for title, file in plots)
    shown = [name for name in channels if len(run.time) > 1 and name not in plotted]
    for name in shown[:DRAWN]:
        html += curves(run.time, run.table([name]), name, channel_unit(run, name))
    if len(shown) > DRAWN:
        html += paragraph(f"{len(shown) - DRAWN} more channels are not drawn; [[plots]] and simulation.output choose.")
    return [Section(title="Plots over time", anchor="plots", html=html)] if html else []


def film(file: Path | None) -> list[Section]:
    """Return the section of the film, none without one; a large one is only named."""
    if file is None:
        return []
    kind = mimetypes.guess_type(file.name)[0] or ""
    if file.stat().st_size > LARGEST:
        html = paragraph(f"The film is in {file.name}, beside this page; it is too large to be part of it.")
    elif kind.startswith("video"):
        html = Markup('<figure class="chart"><video controls loop src="{}"></video></figure>').format(embedded(file))
    else:
        html = Markup('<figure class="card film"><img src="{}" alt="film of the run"></figure>').format(embedded(file))
    return [Section(title="Film", anchor="film", html=html)]
