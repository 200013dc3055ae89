"""Charts by matplotlib: effective masses and time histories."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from modalprep.atomic import atomic_path
from modalprep.multibody.result import Result
from modalprep.reduction.table import DIRECTIONS, ModeTable

# colour-blind safe (Okabe and Ito)
COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
GREY = "#444444"


def effective_mass_plot(table: ModeTable, path: str | Path) -> Path:
    """Draw, per direction, how much of the body's mass each kept mode carries, stacked.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> effective_mass_plot(uniform_beam(modes=4).modes, Path(tempfile.mkdtemp()) / "m.png").suffix
    '.png'
    """
    figure = Figure(figsize=(8.0, 3.6), layout="constrained")
    axes = figure.add_subplot()
    share = np.nan_to_num(table.fraction)
    rows = [k for k in np.flatnonzero(table.kept) if np.any(share[k] > 0)]
    left = np.zeros(6)
    for rank, k in enumerate(rows):
        colour = COLOURS[rank % len(COLOURS)]
        axes.barh(DIRECTIONS, 100 * share[k], left=100 * left, color=colour, edgecolor="white", linewidth=0.6)
        for place in np.flatnonzero(share[k] > 0.04):
            x = 100 * (left[place] + share[k, place] / 2)
            axes.text(x, place, str(k + 1), ha="center", va="center", color="white", fontsize=8)
        left += share[k]
    axes.invert_yaxis()
    axes.set_xlim(0, 100 * max(1.0, left.max(initial=0.0)))
    axes.set_xlabel("effective mass of the kept vectors, % of the body (numbers: row of the table)")
    _plain(axes, grid="x")
    return _save(figure, path)


def history_plot(
    results: dict[str, Result],
    channels: Sequence[str],
    path: str | Path,
    *,
    title: str = "",
    ylabel: str = "",
    reference: Sequence[dict[str, Any]] = (),
) -> Path:
    """Draw channels of one or more runs over time.

    The limits follow the runs that did not diverge; a diverging run leaves the frame, with a note where.

    Parameters
    ----------
    results : {label: Result}
    channels : sequence of str
    reference : sequence of {"label": str, "t": list, "y": list}
        Known points, drawn as markers.
    """
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    axes = figure.add_subplot()
    whole = [run for run in results.values() if run.status != "diverged"]
    margin = 0.06 if len(whole) == len(results) else 0.35  # room to see a diverging curve leave
    limits = _limits([run[c] for run in whole for c in channels], margin)
    styles = iter(zip(COLOURS * 3, (["-"] * 6 + ["--"] * 6 + [":"] * 6), strict=True))
    for label, run in results.items():
        for channel in channels:
            colour, line = next(styles)
            shown = ", ".join(x for x in (channel if len(channels) > 1 else "", label if len(results) > 1 else "") if x)
            axes.plot(run.time, run[channel], line, color=colour, linewidth=2.0, label=shown or channel)
            if run.status == "diverged" and limits:
                _note_exit(axes, run.time, run[channel], limits, colour)
    for point in reference:
        axes.plot(
            point["t"],
            point["y"],
            "o",
            color=GREY,
            markerfacecolor="white",
            markersize=7,
            label=point["label"],
        )
    axes.set_xlim(0, max(run.time[-1] for run in results.values()))
    if limits:
        axes.set_ylim(*limits)
    axes.set_xlabel("time (s)")
    axes.set_ylabel(ylabel or ", ".join(channels))
    axes.set_title(title, loc="left", fontsize=13, fontweight="bold")
    if len(results) * len(channels) + len(reference) > 1:
        axes.legend(frameon=False, loc="best")
    _plain(axes, grid="both")
    return _save(figure, path)


def _limits(values: list[np.ndarray], margin: float) -> tuple[float, float] | None:
    if not values:
        return None
    low, high = min(v.min() for v in values), max(v.max() for v in values)
    room = margin * (high - low) or 1.0
    return low - room, high + room


def _note_exit(axes: Axes, time: np.ndarray, y: np.ndarray, limits: tuple[float, float], colour: str) -> None:
    """Mark where a diverging curve leaves the frame."""
    outside = np.flatnonzero((y < limits[0]) | (y > limits[1]))
    if not len(outside):
        return
    t, down = time[outside[0]], y[outside[0]] < limits[0]
    edge = limits[0] if down else limits[1]
    inward = (limits[1] - limits[0]) * (0.05 if down else -0.1)
    text = f"diverges: leaves the frame at t = {t:.1f} s,\nreaches {y[-1]:.3g} at t = {time[-1]:.1f} s"
    arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.5}
    axes.annotate(text, xy=(t, edge), xytext=(t + 0.12 * time[-1], edge + inward), color=colour, arrowprops=arrow)


def _plain(axes: Axes, grid: str) -> None:
    axes.spines[["top", "right"]].set_visible(False)
    axes.grid(axis=grid, color="#dddddd", linewidth=0.7)
    axes.set_axisbelow(True)


def _save(figure: Figure, path: str | Path) -> Path:
    with atomic_path(path) as temporary:
        figure.savefig(temporary, dpi=180)
    return Path(path)
