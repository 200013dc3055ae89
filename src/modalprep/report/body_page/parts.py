"""The sections of the page of a body, in their order."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from modalprep.body.flexible_body import FlexibleBody
from modalprep.reduction.table import DIRECTIONS, ModeTable
from modalprep.report.body_page.box import check_table, requirement_table
from modalprep.report.body_page.charts import cumulative_plot
from modalprep.report.body_page.modes import mode_tables, recovery_table, selection_csv
from modalprep.report.body_page.section import Section, chart, embedded
from modalprep.report.body_page.table import Table, data_address, part
from modalprep.report.charts.mass_chart import effective_mass_plot
from modalprep.report.charts.plots import error_plot
from modalprep.report.numbers import quantity, raised
from modalprep.report.scene.motion import unseen_modes
from modalprep.report.tables import (
    ENVELOPE,
    HELD,
    envelope_rows,
    hertz,
    is_held_elsewhere,
    kept_fraction,
    percent,
    summary_rows,
)
from modalprep.verdicts.notes import kind_of

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.multibody.results.envelopes import Envelope
    from modalprep.verdicts.verdict import Verdict

NOTHING = "Nothing speaks against it: it has no warnings."
FRAME = "The body frame has its {}."


def in_short(sentences: Sequence[str], verdict: Verdict) -> Section:
    """Return the section of plain sentences with which a page begins; the box above has the reasons of the verdict."""
    against = f"The box above has {len(verdict.reasons)} reasons not to trust it blindly, and what to change."
    sentences = [*sentences, against.replace("1 reasons", "1 reason") if verdict.reasons else NOTHING]
    rows = Markup("").join(Markup("<li>{}</li>\n").format(raised(sentence)) for sentence in sentences)
    return Section(title="In short", anchor="in-short", html=Markup("<ul>\n{}</ul>").format(rows))


def overview(body: FlexibleBody, notes: Sequence[str], mesh_picture: Path | None) -> Section:
    """Return the section of the body as a whole: notes that are no warnings, mass, interfaces, frequencies."""
    html = part(
        "overview.html",
        notes=[note for note in notes if kind_of(note) == "notes"],
        summary=summary_rows(body),
        frame=FRAME.format(body.frame),
        mesh_picture=embedded(mesh_picture) if mesh_picture else None,
    )
    return Section(title="Body", anchor="body", html=html)


def modes(body: FlexibleBody, drawn: tuple[dict[str, Any] | None, str], pictures: Mapping[int, Path]) -> list[Section]:
    """Return the section of the body's own modes, none for a rigid body.

    Parameters
    ----------
    drawn : (scene or None, str)
        Of `scene.drawable`.
    """
    if not body.n:
        return []
    scene, problem = drawn
    tables = mode_tables(body)
    html = part(
        "modes.html",
        scene=scene,
        scene_problem=problem,
        pictured=bool(pictures),
        cards=_cards(body, pictures, len(scene["modes"]) if scene else 0),
        unseen=unseen_modes(body.shape),
        tables=tables,
        mass_sum=_drawn(cumulative_plot, body) if len(tables) > 1 and np.any(body.frequency > 0) else None,
    )
    return [Section(title="Modes of the body", anchor="modes-of-the-body", html=html)]


def _cards(body: FlexibleBody, pictures: Mapping[int, Path], moving: int) -> list[dict[str, Any]]:
    """One card per mode with a picture; the first `moving` are in the viewer."""
    damping = body.D / (2 * np.sqrt(np.where(body.K > 0, body.K, 1.0)))  # rigid-body modes have none
    return [
        {
            "number": mode,
            "frequency": hertz(body.frequency[mode - 1]),
            "name": body.mode_names[mode - 1] if body.mode_names else "",
            "damping": f"{100 * damping[mode - 1]:.3g}",
            "moving": mode <= moving,
            "image": embedded(pictures[mode]),
        }
        for mode in range(1, body.n + 1)
        if mode in pictures
    ]


def selection(table: ModeTable, mass_plot: Path | None) -> Section:
    """Return the section of the candidates of the reduction, with the reason for keeping or dropping each."""
    html = part(
        "selection.html",
        table=table,
        directions=DIRECTIONS,
        rows=_rows(table),
        kinds=list(dict.fromkeys(table.kind)),
        held=HELD if is_held_elsewhere(table) else "",
        sums=[percent(value) for value in kept_fraction(table)],
        mass_plot=embedded(mass_plot) if mass_plot else _drawn(effective_mass_plot, table),
        csv=data_address(selection_csv(table).encode(), "text/csv"),
    )
    return Section(title="Mode selection", anchor="mode-selection", html=html)


def _rows(table: ModeTable) -> list[dict[str, Any]]:
    """Return the rows as text, with the plain numbers to sort by (-1 where there is none)."""
    return [
        {
            "kind": kind,
            "frequency": (hertz(table.frequency[k]), _sortable(table.frequency[k])),
            "masses": [(percent(value), _sortable(value)) for value in table.fraction[k]],
            "kept": bool(table.kept[k]),
            "reason": table.reason[k],
        }
        for k, kind in enumerate(table.kind)
    ]


def _sortable(value: float) -> str:
    return "-1" if np.isnan(value) else f"{value:.9g}"


def mac(chart: dict[str, Any] | None) -> list[Section]:
    """Return the section of `mac.mac_chart`, none for fewer than two modes."""
    if chart is None:
        return []
    numbers = range(1, chart["count"] + 1)
    rows = [(k, *row) for k, row in zip(numbers, chart["values"], strict=True)]
    text = Table(name="mac", columns=("mode", *map(str, numbers)), rows=rows).csv()
    html = part("mac.html", mac=chart, csv=data_address(text.encode(), "text/csv"))
    return [Section(title="Modal assurance criterion (MAC)", anchor="mac-section", html=html)]


def recoveries(body: FlexibleBody) -> list[Section]:
    """Return the section of what the body recovers, none where it is nothing."""
    if not (body.recovery or body.stress):
        return []
    return [Section(title="Recoveries", anchor="recovery", html=recovery_table(body).html())]


def simulation(plots: Sequence[tuple[str, Path]], envelopes: Sequence[Envelope]) -> list[Section]:
    """Return the sections of a run: its plots, and the extremes of the recoveries."""
    found = []
    if plots:
        html = Markup("").join(chart(file, title) for title, file in plots)
        found.append(Section(title="Simulation", anchor="simulation", html=html))
    if envelopes:
        found.append(Section(title="Recovered over the run", anchor="recovered", html=extremes_table(envelopes).html()))
    return found


def extremes_table(envelopes: Sequence[Envelope]) -> Table:
    """Return the extremes of each recovered component, with what is allowed and the margin of safety."""
    rows = []
    for envelope in envelopes:
        pairs = zip(envelope.worst(), envelope_rows([envelope]), strict=True)
        rows += [(*cells[:-1], _allowed(envelope, row), cells[-1]) for row, cells in pairs]
    columns = (*ENVELOPE[:-1], "allowable", "margin of safety")
    return Table(
        name="extremes",
        columns=columns,
        rows=rows,
        caption="Extremes over the run; a negative margin of safety means that an allowable is exceeded.",
    )


def _allowed(envelope: Envelope, row: Mapping[str, Any]) -> str:
    """Return the allowable of a component; of stress only that of von Mises stress is compared with it."""
    if envelope.allowable is None:
        return "none given"
    return "" if np.isnan(row["margin"]) else quantity(envelope.allowable, row["unit"])


def errors(curves: Mapping[str, tuple[Any, Any]] | None, axes: tuple[str, str]) -> list[Section]:
    """Return the section of the errors against the full model, none where they were not measured."""
    if not curves:
        return []
    x, y = axes
    drawn = Markup('<figure class="chart"><img src="{}" alt="error curves"></figure>').format(
        _drawn(error_plot, curves, xlabel=x, ylabel=y)
    )
    tables = [
        Table(
            name=f"error-{number}",
            columns=(x, y),
            caption=f"{label}:",
            forms={y: ".2e"},
            rows=list(zip(np.ravel(at).tolist(), np.ravel(values).tolist(), strict=True)),
        )
        for number, (label, (at, values)) in enumerate(curves.items(), start=1)
    ]
    html = drawn + part("tables.html", text="", tables=tables)
    return [Section(title="Errors against the full model", anchor="errors", html=html)]


def requirements(verdict: Verdict) -> list[Section]:
    """Return the section of the requirements besides the checks, none without any."""
    table = requirement_table(verdict)
    return [Section(title="Requirements", anchor="requirements", html=table.html())] if table.rows else []


def checks(results: Sequence[Check]) -> list[Section]:
    """Return the section of the physics checks, none without any."""
    return [Section(title="Checks", anchor="checks", html=check_table(results).html())] if results else []


def provenance(sources: Mapping[str, Mapping[str, str]]) -> list[Section]:
    """Return the section of hashes, versions and sources, none without any."""
    if not any(sources.values()):
        return []
    return [Section(title="Provenance", anchor="provenance", html=part("provenance.html", found=sources))]


def _drawn(draw: Callable[..., Path], what: Any, **options: Any) -> str:
    """Return a chart as a data address."""
    with tempfile.TemporaryDirectory() as folder:
        return embedded(draw(what, Path(folder) / "chart.png", **options))
