"""Charts of the page: effective mass of the modes, summed up over frequency."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.reduction.table import DIRECTIONS
from modalprep.report.body_page.modes import participation, totals
from modalprep.report.charts.figures import Figure, save_figure
from modalprep.report.charts.plots import CURVES, GREY, LINES, add_head, label_beyond, plain_axes
from modalprep.report.responses import plain_decades

TARGETS = (90.0, 95.0)  # %, usual targets of the modes of a base-driven structure


def cumulative_mass(body: FlexibleBody) -> np.ndarray:
    """Return the effective mass ``(n, 6)`` of the modes up to each one, in % of the body's mass and inertia.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> cumulative_mass(uniform_beam(modes=4))[:, 1].round(1)
    array([61.3, 61.3, 80.1, 80.1])
    """
    whole = totals(body)
    return 100 * np.cumsum(participation(body) ** 2, axis=0) / np.where(whole > 0, whole, np.inf)


def cumulative_plot(body: FlexibleBody, path: str | Path) -> Path:
    """Draw `cumulative_mass` over frequency, with the lines of the usual targets.

    Returns
    -------
    Path
        The file.

    References
    ----------
    NASA-STD-5002A (2019), section 4.2.4, and ECSS-E-ST-32-11C: 90 % to 95 % of the mass in the modes.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> cumulative_plot(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "sum.png").name
    'sum.png'
    """
    figure = Figure(figsize=(9.0, 3.9), layout="constrained")
    axes = figure.add_subplot()
    moving = body.frequency > 0
    frequency = body.frequency[moving]
    found = cumulative_mass(body)[moving]
    for k, name in enumerate(DIRECTIONS):
        axes.step(
            np.append(frequency[:1], frequency),
            np.append(0 * found[:1, k], found[:, k]),
            where="post",
            linewidth=2,
            label=name if k < 3 else f"about {name[1]}",
            color=CURVES[k % 6],
            linestyle=LINES[k // 3],
        )
    for target in TARGETS:
        axes.axhline(target, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)))
        label_beyond(axes, target, f"{target:.0f} %")
    axes.set_xscale("log")
    plain_decades(axes.xaxis)
    axes.set_ylim(0, 105)
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel("effective mass up to it (% of the body)")
    add_head(axes, "")
    plain_axes(axes, grid="both")
    return save_figure(figure, path)
