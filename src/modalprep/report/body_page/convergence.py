"""Section of the page on the convergence of recoveries with the number of modes: a table and a chart."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.ticker import MaxNLocator

from modalprep.reduction.recoveries.convergence import Convergence
from modalprep.report.body_page.section import Section, chart, paragraph
from modalprep.report.body_page.table import Table
from modalprep.report.charts.figures import Figure, named, save_figure
from modalprep.report.charts.plots import curve_style, plain_axes
from modalprep.report.tables import hertz

CHART = 12  # recoveries in the chart, at most
FLOOR = 1e-9  # an error below counts as none


def convergence_section(convergence: Convergence) -> Section:
    """Return the section: the error of each recovery with the first modes, as a table and a chart.

    Examples
    --------
    >>> found = Convergence(recoveries=("strut",), methods=("acceleration",), share=np.ones(1), count=np.arange(3),
    ...     frequency=np.array([0.0, 3.0, 9.0]), error=np.array([[1.0, 0.1, 0.0]]), up_to=2.0)
    >>> convergence_section(found).title
    'Convergence of the recoveries'
    """
    with tempfile.TemporaryDirectory() as folder:
        drawn = chart(convergence_plot(convergence, Path(folder) / "chart.png"), "Errors over the number of modes")
    html = paragraph(_said(convergence)) + convergence_table(convergence).html() + drawn
    if len(convergence.recoveries) > CHART:
        html += paragraph(
            f"The chart leaves out {len(convergence.recoveries) - CHART} more recoveries, which the table has."
        )
    return Section(title="Convergence of the recoveries", anchor="convergence", html=html)


SAYS = (
    "Error of each recovery, in %, with the first of the kept modes against all of them: the largest difference of a "
    "peak or a root mean square below {0} Hz, over the largest of the recovery in that unit, {1}. Constraint modes and "
    "truncation vectors are there whatever the number of modes. Errors against the full model are in the notes, where "
    "up_to is given."
)
UNIT_LOADS = "under unit accelerations of the root and unit loads on the other interfaces with 1 % damping"


def _said(convergence: Convergence) -> str:
    more = " Of large recoveries evenly chosen places are followed." if np.any(convergence.share < 1) else ""
    loads = (
        f"under the inputs of the responses {', '.join(convergence.loads)}, not notched"
        if convergence.loads
        else UNIT_LOADS
    )
    return SAYS.format(hertz(convergence.up_to), loads) + more


def convergence_table(convergence: Convergence) -> Table:
    """Return the table: a column for each number of modes, with the frequency up to which they reach."""
    reach = [
        f" (up to {hertz(f)} Hz)" if n else "" for n, f in zip(convergence.count, convergence.frequency, strict=True)
    ]
    heads = [f"{n} modes{to}" for n, to in zip(convergence.count, reach, strict=True)]
    rows = convergence_rows(convergence)
    return Table(
        name="convergence-table", columns=("recovery", "method", *heads), rows=rows, forms=dict.fromkeys(heads, ".3g")
    )


def convergence_rows(convergence: Convergence) -> list[list[Any]]:
    """Return a row for each recovery: its name, the method, the error in % with each number of modes.

    Examples
    --------
    >>> found = Convergence(recoveries=("strut",), methods=("displacement",), share=np.ones(1), count=np.arange(2),
    ...     frequency=np.array([0.0, 3.0]), error=np.array([[1.0, 0.0123]]), up_to=2.0)
    >>> convergence_rows(found)
    [['strut', 'displacement', 100.0, 1.23]]
    """
    rows = []
    for name, method, share, error in zip(
        convergence.recoveries, convergence.methods, convergence.share, convergence.error, strict=True
    ):
        shown = method if share == 1 else f"{method}, {100 * share:.2g} % of its places"
        rows.append([name, shown, *(0.0 if value < FLOOR else 100 * float(value) for value in error)])
    return rows


def convergence_plot(convergence: Convergence, path: Path) -> Path:
    """Draw the error of each recovery over the number of modes.

    Returns
    -------
    Path
        The file.
    """
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    for k, name in enumerate(convergence.recoveries[:CHART]):
        shown = np.where(convergence.error[k] > FLOOR, 100 * convergence.error[k], np.nan)
        label = f"{name}, none" if np.all(np.isnan(shown)) else name
        style = {"marker": "o", "markersize": 5, "linewidth": 2.0, **curve_style(k)}
        axes.plot(convergence.count, shown, label=named(label), **style)
    axes.set_yscale("log")
    axes.set_xlim(-0.02 * convergence.count[-1], 1.02 * convergence.count[-1])
    axes.xaxis.set_major_locator(MaxNLocator("auto", steps=[1, 2, 2.5, 5, 10], integer=True))
    axes.set_xlabel("kept modes, in ascending order of frequency")
    axes.set_ylabel("error of peaks and RMS, % of the largest")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9.5)
    plain_axes(axes, grid="both")
    return save_figure(figure, path)
