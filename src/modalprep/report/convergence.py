"""Section of the page on the convergence of recoveries with the number of modes: a table and a chart."""

from __future__ import annotations

import base64
import tempfile
from importlib.resources import files
from pathlib import Path

import numpy as np
from jinja2 import Environment, StrictUndefined
from markupsafe import Markup
from matplotlib.figure import Figure

from modalprep.reduction.recoveries.convergence import Convergence
from modalprep.report.plots import CURVES, LINES, plain_axes, save_figure
from modalprep.report.tables import hertz

CHART = 12  # recoveries in the chart, at most
FLOOR = 1e-9  # an error below counts as none


def convergence_section(found: Convergence) -> Markup:
    """Return the section: the error of each recovery with the first modes, as a table and a chart.

    Examples
    --------
    >>> found = Convergence(recoveries=("strut",), methods=("acceleration",), share=np.ones(1), count=np.arange(3),
    ...     frequency=np.array([0.0, 3.0, 9.0]), error=np.array([[1.0, 0.1, 0.0]]), up_to=2.0)
    >>> "<h2>Convergence of the recoveries</h2>" in convergence_section(found)
    True
    """
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(files("modalprep.report").joinpath("convergence.html").read_text("utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        chart = convergence_plot(found, Path(folder) / "chart.png").read_bytes()
    return Markup(
        template.render(
            head=[(int(n), hertz(f)) for n, f in zip(found.count, found.frequency, strict=True)],
            rows=convergence_rows(found),
            up_to=hertz(found.up_to),
            chart=f"data:image/png;base64,{base64.b64encode(chart).decode()}",
            more=len(found.recoveries) - CHART,
            thinned=bool(np.any(found.share < 1)),
        )
    )


def convergence_rows(found: Convergence) -> list[list[str]]:
    """Return a row for each recovery: its name, the method, the error in % with each number of modes.

    Examples
    --------
    >>> found = Convergence(recoveries=("strut",), methods=("displacement",), share=np.ones(1), count=np.arange(2),
    ...     frequency=np.array([0.0, 3.0]), error=np.array([[1.0, 0.0123]]), up_to=2.0)
    >>> convergence_rows(found)
    [['strut', 'displacement', '100', '1.23']]
    """
    rows = []
    for name, method, share, error in zip(found.recoveries, found.methods, found.share, found.error, strict=True):
        shown = method if share == 1 else f"{method}, {100 * share:.2g} % of its places"
        rows.append([name, shown, *map(_percent, 100 * error)])
    return rows


def _percent(value: float) -> str:
    return "0" if value < 100 * FLOOR else f"{value:.3g}" if value < 100 else f"{value:.0f}"


def convergence_plot(found: Convergence, path: Path) -> Path:
    """Draw the error of each recovery over the number of modes.

    Returns
    -------
    Path
        The file.
    """
    figure = Figure(figsize=(9.0, 4.2), layout="constrained")
    axes = figure.add_subplot()
    for k, name in enumerate(found.recoveries[:CHART]):
        shown = np.where(found.error[k] > FLOOR, 100 * found.error[k], np.nan)
        label = f"{name}, none" if np.all(np.isnan(shown)) else name
        style = {"color": CURVES[k % len(CURVES)], "linestyle": LINES[k // len(CURVES) % len(LINES)]}
        axes.plot(found.count, shown, marker="o", markersize=5, linewidth=2.0, label=label, **style)
    axes.set_yscale("log")
    axes.set_xlim(-0.02 * found.count[-1], 1.02 * found.count[-1])
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("kept modes, in ascending order of frequency")
    axes.set_ylabel("error, % of the response with all of them")
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9.5)
    plain_axes(axes, grid="both")
    return save_figure(figure, path)
