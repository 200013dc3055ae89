"""Sensitivities of frequencies: a table for the terminal, and a chart."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from markupsafe import Markup
from rich.console import Console
from rich.table import Column
from rich.text import Text

from modalprep.correlation.derivatives import Sensitivities
from modalprep.report.body_page.section import Section, chart, paragraph
from modalprep.report.body_page.table import Table
from modalprep.report.charts.figures import Figure, save_figure
from modalprep.report.charts.plots import INK
from modalprep.report.tables import hertz
from modalprep.report.terminal import plain_table, print_table, print_text, right_aligned

ROWS = 30  # most influential parameters that are shown
COLUMNS = 6  # modes in the terminal
DRAWN = 30  # modes in the chart
LONGEST = 34  # characters of a name


def sensitivity_table(sensitivities: Sensitivities, console: Console) -> None:
    """Print the relative derivatives, a row for each parameter, the most influential first.

    Examples
    --------
    >>> from modalprep.correlation import sensitivities
    >>> from modalprep.examples import cantilever_model
    >>> found = sensitivities(cantilever_model(), modes=2, kinds=["modulus"])
    >>> sensitivity_table(found, Console(width=100, color_system=None))  # doctest: +ELLIPSIS
    Sensitivity of the frequencies, % per %
    ...
    modulus of the material of beam   7e+10 Pa  +0.500  +0.500
    """
    order = _most_influential(sensitivities)
    count = min(COLUMNS, len(sensitivities.frequency))
    console.print(Text.assemble(("Sensitivity of the frequencies", "bold"), ", % per %"))
    modes = [f"{k + 1}: {hertz(sensitivities.frequency[k])}" for k in range(count)]
    table = plain_table(Column("parameter", no_wrap=True), *right_aligned("value", *modes))
    for j in order:
        parameter = sensitivities.parameters[j]
        cells = [f"{value:+.3f}" if abs(value) >= 5e-4 else "." for value in sensitivities.relative[:count, j]]
        table.add_row(_short(parameter.name), f"{parameter.value:.4g} {parameter.unit}", *cells)
    print_table(table, console)
    for text in (*_left_out(sensitivities, len(order), count), *(f"note: {note}" for note in sensitivities.notes)):
        print_text(Text(text), console)


def _most_influential(sensitivities: Sensitivities) -> list[int]:
    return np.argsort(-np.abs(sensitivities.relative).max(axis=0), kind="stable")[:ROWS].tolist()


def _left_out(sensitivities: Sensitivities, rows: int, columns: int) -> list[str]:
    said = []
    if rows < len(sensitivities.parameters):
        said.append(f"{len(sensitivities.parameters) - rows} parameters of less influence are in the CSV file only")
    if columns < len(sensitivities.frequency):
        said.append(f"modes {columns + 1} to {len(sensitivities.frequency)} are in the CSV file only")
    return said


def _short(name: str) -> str:
    return name if len(name) <= LONGEST else f"{name[: LONGEST - 3]}..."


def sensitivity_plot(sensitivities: Sensitivities, path: str | Path) -> Path:
    """Draw the relative derivatives as a field of parameters by modes; blue lowers and red raises the frequency.

    Returns
    -------
    Path
        The file.
    """
    order = _most_influential(sensitivities)
    count = min(DRAWN, len(sensitivities.frequency))
    values = sensitivities.relative[:count, order].T
    rows = len(order)
    largest = np.abs(values).max(initial=1e-12)
    figure = Figure(figsize=(min(14, 4.6 + 0.52 * count), 1.9 + 0.34 * rows), layout="constrained")
    axes = figure.add_subplot()
    axes.imshow(values, cmap="RdBu_r", vmin=-largest, vmax=largest, aspect="auto")
    for i, j in np.argwhere(np.abs(values) >= 5e-3):
        ink = "white" if abs(values[i, j]) > 0.65 * largest else INK
        axes.text(j, i, f"{values[i, j]:+.2f}", ha="center", va="center", fontsize=7.5, color=ink)
    axes.set_yticks(range(rows), [_short(sensitivities.parameters[j].name) for j in order])
    axes.set_xticks(range(count), [f"{k + 1}: {hertz(sensitivities.frequency[k])}" for k in range(count)], rotation=90)
    axes.set_xlabel("mode: Hz")
    axes.set_title("Change of a frequency in % per % of a parameter", loc="left", fontweight="bold", color=INK)
    axes.spines[:].set_visible(False)
    return save_figure(figure, path)


def sensitivity_section(sensitivities: Sensitivities, picture: Path) -> Section:
    """Return the section of the report page: the chart, the relative derivatives, and what is to be said of them."""
    modes = [f"{k}: {hertz(frequency)} Hz" for k, frequency in enumerate(sensitivities.frequency, start=1)]
    table = Table(
        name="sensitivities",
        columns=("parameter", "value", "unit", *modes),
        rows=[
            (p.name, p.value, p.unit, *own)
            for p, own in zip(sensitivities.parameters, sensitivities.relative.T, strict=True)
        ],
        caption="Change of a frequency in % per % of a parameter",
        forms=dict.fromkeys(modes, "+.3f"),
    )
    said = "Exact derivatives of the frequencies of the finite-element model, in % per %, by one parameter at a time."
    notes = [paragraph(f"{note[0].upper()}{note[1:]}.") for note in sensitivities.notes]
    html = paragraph(said) + chart(picture, "change of each frequency by each parameter") + table.html()
    return Section(title="Sensitivity of the frequencies", anchor="sensitivities", html=html + Markup("").join(notes))
