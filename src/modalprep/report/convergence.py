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
from modalprep.report.plots import CURVES, INK, LINES, plain_axes, save_figure
from modalprep.report.tables import hertz

COLUMNS = 8  # numbers of modes in the table, at most
CHART = 12  # recoveries in the chart, at most
FLOOR = 1e-9  # what is left below counts as nothing


def convergence_section(found: Convergence) -> Markup:
    """Return the section: what the first modes leave of each recovery, as a table and a chart.

    Examples
    --------
    >>> left = np.array([[1.0, 0.2, 0.01]])
    >>> found = Convergence(recoveries=("strut",), methods=("acceleration",), frequency=np.array([3.0, 9.0]),
    ...     displacement=left, acceleration=0.1 * left, up_to=2.0)
    >>> "<h2>Convergence of the recoveries</h2>" in convergence_section(found)
    True
    """
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(files("modalprep.report").joinpath("convergence.html").read_text("utf-8"))
    with tempfile.TemporaryDirectory() as folder:
        chart = convergence_plot(found, Path(folder) / "chart.png").read_bytes()
    return Markup(
        template.render(
            head=convergence_head(found),
            rows=convergence_rows(found),
            up_to=hertz(found.up_to),
            chart=f"data:image/png;base64,{base64.b64encode(chart).decode()}",
            more=len(found.recoveries) - CHART,
        )
    )


def shown_counts(n: int) -> list[int]:
    """Return the numbers of modes in the table, from none to all n.

    Examples
    --------
    >>> shown_counts(3), shown_counts(60)
    ([0, 1, 2, 3], [0, 1, 2, 4, 8, 16, 30, 60])
    """
    if n < COLUMNS:
        return list(range(n + 1))
    return [0, *sorted({round(n / 2**k) for k in range(COLUMNS - 1)})]


def convergence_head(found: Convergence) -> list[str]:
    """Return the titles of the columns of `convergence_rows`."""
    counts = shown_counts(len(found.frequency))
    return ["recovery", "method", *(f"{n} mode{'' if n == 1 else 's'}" for n in counts)]


def convergence_rows(found: Convergence) -> list[list[str]]:
    """Return a row for each recovery and method: its name, the method, what is left in %.

    Examples
    --------
    >>> left = np.array([[1.0, 0.2]])
    >>> found = Convergence(recoveries=("strut",), methods=("displacement",), frequency=np.array([3.0]),
    ...     displacement=left, acceleration=0.1 * left, up_to=2.0)
    >>> convergence_rows(found)
    [['strut', 'displacement, used', '100', '20'], ['strut', 'acceleration', '10', '2']]
    """
    counts, rows = shown_counts(len(found.frequency)), []
    for i, (name, used) in enumerate(zip(found.recoveries, found.methods, strict=True)):
        for method, left in (("displacement", found.displacement[i]), ("acceleration", found.acceleration[i])):
            if not np.all(np.isnan(left)):
                rows.append([name, f"{method}{', used' if method == used else ''}", *map(_percent, left[counts])])
    return rows


def _percent(value: float) -> str:
    return "" if np.isnan(value) else "0" if value < FLOOR else f"{100 * value:.3g}"


def convergence_plot(found: Convergence, path: Path) -> Path:
    """Draw what is left of each recovery over the number of modes, by both methods.

    Returns
    -------
    Path
        The file.
    """
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    number = np.arange(len(found.frequency) + 1)
    for k, name in enumerate(found.recoveries[:CHART]):
        for left, line, what in ((found.displacement[k], 0, ""), (found.acceleration[k], 1, ", acceleration")):
            if not np.all(np.isnan(left)):
                style = {"color": CURVES[k % len(CURVES)], "linestyle": LINES[line + 2 * (k // len(CURVES) % 2)]}
                mark = "o" if len(number) <= 60 else ""
                shown = np.where(left > FLOOR, 100 * left, np.nan)
                axes.plot(number, shown, marker=mark, markersize=4, linewidth=2.0, label=f"{name}{what}", **style)
    axes.set_yscale("log")
    axes.xaxis.get_major_locator().set_params(integer=True)
    axes.set_xlabel("kept modes, in ascending order of frequency")
    axes.set_ylabel("left of the static response, %", color=INK)
    axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), frameon=False, fontsize=9.5)
    plain_axes(axes, grid="both")
    return save_figure(figure, path)
