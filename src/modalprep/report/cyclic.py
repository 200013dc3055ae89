"""Modes of a ring by nodal diameter: a table for the terminal, a chart, a section of the page."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.reduction.cyclic.modes import CyclicModes
from modalprep.report.body_page.section import Section, chart, paragraph
from modalprep.report.body_page.table import Table
from modalprep.report.charts.figures import Axes, Figure, save_figure
from modalprep.report.charts.plots import COLOURS, plain_axes
from modalprep.report.numbers import number
from modalprep.report.tables import hertz
from modalprep.report.terminal import plain_table, print_table, print_text, right_aligned

COLUMNS = 8  # modes of a nodal diameter in the terminal


def cyclic_table(modes: CyclicModes, console: Console) -> None:
    """Print the frequencies, a row for each nodal diameter.

    Examples
    --------
    >>> from modalprep.examples import disc_sector
    >>> from modalprep.reduction.cyclic.modes import cyclic_modes
    >>> mesh, model, cyclic = disc_sector()
    >>> found = cyclic_modes(model, mesh, cyclic, modes=2, nodal_diameters=[0, 1])
    >>> cyclic_table(found, Console(width=80, color_system=None))
    Modes of 8 sectors by nodal diameter, Hz
    nodal diameter       1       2
    ──────────────────────────────
                 0  52.994  333.27
                 1  48.814  351.59
    """
    console.print(Text.assemble((f"Modes of {modes.sectors} sectors by nodal diameter", "bold"), f", Hz{_at(modes)}"))
    rows = {n: modes.frequency[modes.nodal_diameter == n] for n in np.unique(modes.nodal_diameter)}
    count = min(COLUMNS, max(map(len, rows.values())))
    table = plain_table(*right_aligned("nodal diameter", *map(str, range(1, count + 1))))
    for n, own in rows.items():
        table.add_row(str(n), *map(hertz, own[:count]))
    print_table(table, console)
    for note in modes.notes:
        print_text(Text(f"note: {note}"), console)


def _at(modes: CyclicModes) -> str:
    return f", at {number(modes.speed)} rad/s" if modes.speed else ""


def draw_cyclic(axes: Axes, modes: CyclicModes) -> None:
    """Draw the frequencies over the nodal diameter into axes, the modes of one number joined by a line."""
    first = np.searchsorted(modes.nodal_diameter, modes.nodal_diameter)
    place = np.arange(len(first)) - first
    for k in range(place.max(initial=-1) + 1):
        own = place == k
        style = {"color": COLOURS[k % len(COLOURS)], "marker": "o", "markersize": 4}
        axes.plot(modes.nodal_diameter[own], modes.frequency[own], linewidth=1.2, **style)
    axes.set_xlabel("nodal diameter")
    axes.set_ylabel("frequency (Hz)")
    axes.set_xticks(np.unique(modes.nodal_diameter))
    axes.set_ylim(bottom=0.0)
    plain_axes(axes, grid="both")


def cyclic_plot(modes: CyclicModes, path: str | Path) -> Path:
    """Draw the chart of `draw_cyclic`.

    Returns
    -------
    Path
        The file.
    """
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    draw_cyclic(figure.add_subplot(), modes)
    return save_figure(figure, path)


def cyclic_section(modes: CyclicModes, picture: Path) -> Section:
    """Return the section of the report page: the chart and the table of all modes."""
    names = {"nodal_diameter": "nodal diameter", "mode": "mode", "frequency": "frequency (Hz)"}
    names |= {"backward": "backward wave (Hz)", "forward": "forward wave (Hz)"} if modes.speed else {}
    names |= {"multiplicity": "modes of the ring"}
    rows = [tuple(row[key] for key in names) for row in modes.rows()]
    table = Table(name="nodal-diameters", columns=tuple(names.values()), rows=rows, forms={"frequency (Hz)": ".6g"})
    said = f"Modes of the ring of {modes.sectors} sectors with its fixed interfaces held{_at(modes)}."
    if modes.speed:
        said += " Waves include Coriolis forces, in the frame that rotates; frequencies do not."
    html = paragraph(said) + chart(picture, "frequencies over the nodal diameter") + table.html()
    return Section(title="Nodal diameters", anchor="nodal-diameters", html=html)
