"""Derivatives of a run: a table for the terminal, a CSV file, and a section of the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from markupsafe import Markup
from rich.console import Console
from rich.text import Text

from modalprep.atomic import write_columns
from modalprep.report.body_page.section import Section, paragraph
from modalprep.report.body_page.table import Table
from modalprep.report.run_page.curves import curves
from modalprep.report.terminal import plain_table, print_table, right_aligned
from modalprep.sensitivity.gradient import Gradient
from modalprep.sensitivity.run_sensitivities import RunSensitivities

LARGEST = "largest d {}"
SAID = (
    "Derivatives along the steps of this run, by one parameter at a time. The curves are derivatives times the value "
    "of the parameter, or times one where that is zero: what a channel would change by if the parameter were doubled "
    "and all were linear."
)


def derivatives_table(
    histories: RunSensitivities | None, objective: str, gradient: Gradient | None, console: Console
) -> None:
    """Print the largest derivative of each channel, and those of one number, a row for each parameter.

    Examples
    --------
    >>> found = RunSensitivities(time=np.arange(2.0), channels=("hinge.angle",), parameters=("hinge.stiffness",),
    ...                          at=np.ones(1), values=np.zeros((2, 1)), derivatives=np.full((1, 2, 1), 3.0))
    >>> derivatives_table(found, "", None, Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Derivatives of the run
    parameter...
    hinge.stiffness      1                      3
    """
    head, rows = _table(histories, objective, gradient)
    table = plain_table(head[0], *right_aligned(*head[1:], no_wrap=False))
    for row in rows:
        table.add_row(Text(str(row[0])), *(f"{value:.6g}" for value in row[1:]))
    console.print(Text("Derivatives of the run", "bold"))
    print_table(table, console)


def _table(
    histories: RunSensitivities | None, objective: str, gradient: Gradient | None
) -> tuple[list[str], list[tuple]]:
    """Return the head and the rows of the table."""
    head, columns = ["parameter"], []
    if gradient is not None:
        head += ["value", f"d {objective}"]
        columns += [list(gradient.derivatives), gradient.at.tolist(), gradient.vector.tolist()]
    if histories is not None:
        if gradient is None:
            head += ["value"]
            columns += [list(histories.parameters), histories.at.tolist()]
        head += [LARGEST.format(name) for name in histories.channels]
        columns += _largest(histories).T.tolist()
    return head, list(zip(*columns, strict=True))


def _largest(histories: RunSensitivities) -> np.ndarray:
    """Return the derivative (np, nc) of the largest magnitude, with its sign."""
    at = np.abs(histories.derivatives).argmax(axis=1)
    return np.take_along_axis(histories.derivatives, at[:, None, :], axis=1)[:, 0]


def write_derivatives_csv(histories: RunSensitivities, path: Path) -> Path:
    """Write the time, the channels, and a column for each channel and parameter.

    Returns
    -------
    Path
        The file.
    """
    columns = {"time": histories.time}
    for c, channel in enumerate(histories.channels):
        columns[channel] = histories.values[:, c]
        for p, parameter in enumerate(histories.parameters):
            columns[f"d {channel} / d {parameter}"] = histories.derivatives[p, :, c]
    return write_columns(columns, path)


def derivatives_section(
    histories: RunSensitivities | None, objective: str, gradient: Gradient | None, notes: Sequence[str]
) -> Section:
    """Return the section of the report page: curves of each channel, the table, and what is to be said of them."""
    head, rows = _table(histories, objective, gradient)
    table = Table(name="run-sensitivities", columns=tuple(head), rows=rows, caption="Derivatives by each parameter")
    html = paragraph(SAID)
    if gradient is not None:
        html += paragraph(f"The {objective} is {gradient.value:.6g}.")
    if histories is not None:
        sizes = np.where(histories.at == 0, 1.0, np.abs(histories.at))
        for c, channel in enumerate(histories.channels):
            named = zip(histories.parameters, histories.derivatives[:, :, c] * sizes[:, None], strict=True)
            html += curves(histories.time, dict(named), f"change of {channel}", "")
    html += table.html()
    said = [paragraph(f"{note[0].upper()}{note[1:]}.") for note in notes]
    return Section(title="Derivatives", anchor="run-sensitivities", html=html + Markup("").join(said))
