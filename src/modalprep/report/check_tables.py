"""Tables for the terminal: findings on a mesh or a body."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Console
from rich.table import Column
from rich.text import Text

from modalprep.report.terminal import plain_table, print_table, print_text, print_verdict, right_aligned
from modalprep.verdicts.notes import kind_of


def quality_table(quality, console: Console) -> None:
    """Print the statistics of a mesh, a row per type of cell, and its findings.

    Parameters
    ----------
    quality : Quality
        Of `modalprep.fe.quality.quality.check_mesh`.
    console : Console

    Examples
    --------
    >>> from modalprep.examples import beam_mesh
    >>> from modalprep.fe.quality.quality import check_mesh
    >>> quality_table(check_mesh(beam_mesh(4)), Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Mesh quality...
    line       4        2.5     2.5      2.5...
    No errors, no warnings.
    """
    figures = right_aligned("number", "smallest", "median", "largest", "aspect", "angles", "Jacobian", "warpage")
    rich = plain_table(Column("cells", no_wrap=True), *figures)
    for kind, row in quality.statistics.items():
        rich.add_row(*map(Text, (kind, *_quality_cells(row))))
    head = ("Mesh quality", "bold"), (": mean edge in m; the worst aspect ratio, angles in degrees, Jacobian", "dim")
    console.print(Text.assemble(*head))
    print_table(rich, console)
    if quality.free_edges or quality.joints:
        console.print(Text(f"{quality.free_edges} free shell edges, {quality.joints} where more than two shells meet"))
    for finding in quality.findings:
        style = "bold red" if finding.severity == "error" else "bold dark_orange"
        print_text(Text.assemble((f"{finding.severity:8}", style), finding.message), console)
    console.print(Text(_counts(quality)))


def survey_table(title: str, rows: Iterable[tuple[str, str, str, bool]], console: Console) -> None:
    """Print what a file of a part holds: kind, name and description of each item, and whether it is used.

    Examples
    --------
    >>> survey_table("part.step", [("opening", "hole_1", "radius 4", True)], Console(width=80, color_system=None))
    part.step
    found    name    used
    ───────────────────────────────
    opening  hole_1  yes   radius 4
    """
    rich = plain_table(*(Column(head, no_wrap=True) for head in ("found", "name", "used")), "")
    for kind, name, what, used in rows:
        mark = Text("yes", "bold green") if used else Text("no")
        rich.add_row(Text(kind), Text(name), mark, Text(what), style="" if used else "dim")
    console.print(Text(title, "bold"))
    print_table(rich, console)


def check_table(report, console: Console) -> None:
    """Print one row per physics check, the notes, and the verdict.

    Parameters
    ----------
    report : CheckReport
        Of `modalprep.body.checks`.
    console : Console

    Examples
    --------
    >>> from modalprep.body.checks import CheckReport, check_body
    >>> from modalprep.examples import uniform_beam
    >>> report = CheckReport(subject="beam.h5", checks=tuple(check_body(uniform_beam(modes=2))))
    >>> check_table(report, Console(width=120, color_system=None))  # doctest: +ELLIPSIS
    Checks of beam.h5: relative errors
    ...
    PASS: ...
    """
    rich = plain_table(Column("       check", no_wrap=True), *right_aligned("value", "limit"), "meaning")
    for check in report.checks:
        mark = Text("ok", "green") if check.within else Text("warn") if check.passed else Text("FAILED", "bold red")
        mark.pad_right(len("FAILED ") - len(mark))
        rich.add_row(mark + Text(check.name), f"{check.value:.1e}", f"{check.limit:.0e}", Text(check.meaning))
    console.print(Text.assemble(("Checks of ", "bold"), (report.subject, "bold"), (": relative errors", "dim")))
    print_table(rich, console)
    for note in report.notes:
        if kind_of(note) == "notes":
            print_text(Text(note), console)
    print_verdict(report.verdict, console)


def _quality_cells(row) -> list[str]:
    angles = "" if row.small is None else f"{row.small:.0f}-{row.large:.0f}"
    sizes = [_short(value) for value in (row.smallest, row.median, row.largest, row.aspect)]
    return [str(row.count), *sizes, angles, _short(row.jacobian), _short(row.warpage)]


def _short(value: float | None) -> str:
    return "" if value is None else f"{0.0 if abs(value) < 1e-9 else value:.3g}"


def _counts(quality) -> str:
    parts = []
    for noun, findings in (("error", quality.errors), ("warning", quality.warnings)):
        parts.append(f"{len(findings) or 'no'} {noun}{'' if len(findings) == 1 else 's'}")
    return ", ".join(parts).capitalize() + "."
