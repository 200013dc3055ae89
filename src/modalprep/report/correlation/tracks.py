"""Modes followed over a study: a table for the terminal, and a chart in which a mode keeps its colour."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.correlation.study import Study
from modalprep.report.charts.figures import Axes, Figure, save_figure
from modalprep.report.charts.plots import INK, curve_style, plain_axes
from modalprep.report.tables import hertz
from modalprep.report.terminal import plain_table, print_table, print_text, right_aligned

SAID = 8  # uncertain numbers in the terminal
PANELS = 12
LOGARITHMIC = 20  # highest over lowest frequency from which the axis is logarithmic
APART = 0.035  # of the height of a panel, between the labels of curves
PATH_RING = "#b3261e"


def track_table(study: Study, console: Console) -> None:
    """Print a row for each mode, and where its number is uncertain.

    Examples
    --------
    >>> from modalprep.correlation import body_modes, track_modes
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=2))
    >>> cases = {(0,): modes, (1,): modes}
    >>> study = Study(name="beam", parameters=("E",), levels=((1, 2),), modes=cases, tracks=track_modes(cases))
    >>> track_table(study, Console(width=100, color_system=None))  # doctest: +ELLIPSIS
    Modes of beam over E, followed by their shapes
    mode  cases  Hz from      to  places  smallest MAC
    ...
    """
    title = f" of {study.name} over {', '.join(study.parameters)}, followed by their shapes"
    console.print(Text.assemble(("Modes", "bold"), title))
    table = plain_table(*right_aligned("mode", "cases", "Hz from", "to", "places", "smallest MAC"))
    for row in study.summary():
        places = sorted({row["first_place"], row["last_place"]})
        table.add_row(
            str(row["mode"]),
            str(row["cases"]),
            hertz(row["lowest_Hz"]),
            hertz(row["highest_Hz"]),
            " to ".join(map(str, places)),
            f"{row['mac']:.2f}",
            style="yellow" if row["uncertain"] else None,
        )
    print_table(table, console)
    said = study.uncertainties()
    for text in said[:SAID]:
        print_text(Text(f"note: {text}"), console)
    if len(said) > SAID:
        print_text(Text(f"note: {len(said) - SAID} more uncertain numbers are in the CSV file"), console)


def track_plot(study: Study, path: str | Path) -> Path:
    """Draw the frequencies over the parameter with most values, in a panel for each combination of the others.

    A mode has one colour and number everywhere. A hollow mark has a low MAC with its neighbour; the number
    of a ringed one depends on the way through the study.

    Returns
    -------
    Path
        The file.
    """
    along = int(np.argmax([len(levels) for levels in study.levels]))
    others = [k for k in range(len(study.parameters)) if k != along]
    panels = list(itertools.product(*(range(len(study.levels[k])) for k in others)))
    shown = panels[:PANELS]
    columns = min(len(shown), 3)
    rows = -(-len(shown) // columns)
    size = (9.0, 5.6) if len(shown) == 1 else (4.6 * columns, 0.8 + 4.2 * rows)
    figure = Figure(figsize=size, layout="constrained")
    grid = figure.subplots(rows, columns, sharex=True, sharey=True, squeeze=False)
    ends = []
    for axes, panel in zip(grid.flat, shown, strict=False):
        fixed = dict(zip(others, panel, strict=True))
        ends.append(_panel(axes, study, along, fixed))
        axes.set_title(", ".join(_level(study, k, place) for k, place in fixed.items()), fontsize=10, color=INK)
    figure.supylabel("frequency (Hz)", fontsize=10)
    figure.supxlabel(study.parameters[along], fontsize=10)
    left_out = f"; {len(panels) - PANELS} of {len(panels)} panels are left out" if len(panels) > PANELS else ""
    marks = "hollow: low MAC, ringed: path-dependent" if study.uncertainties() else "none uncertain"
    head = f"Modes of {study.name}, followed by their shapes ({marks}{left_out})"
    figure.suptitle(head, x=0.01, ha="left", fontsize=12, fontweight="bold", color=INK)
    for axes in grid.flat[len(shown) :]:
        axes.set_visible(False)
    _scale(grid[0, 0], ends)
    figure.draw_without_rendering()
    for axes, own in zip(grid.flat, ends, strict=False):
        _labels(axes, own)
    return save_figure(figure, path)


def _level(study: Study, axis: int, place: int) -> str:
    value = study.levels[axis][place]
    return f"{study.parameters[axis]} = {value:g}" if isinstance(value, int | float) else f"{value}"


def _panel(axes: Axes, study: Study, along: int, fixed: dict[int, int]) -> dict[int, tuple[float, float]]:
    """Draw the modes over one parameter, the others being held; return the end of each curve."""
    levels = study.levels[along]
    torn = study._torn()
    ends = {}
    numeric = all(isinstance(value, int | float) and not isinstance(value, bool) for value in levels)
    at = np.asarray(levels, dtype=float) if numeric else np.arange(len(levels))
    hollow = {(place, int(study.tracks.number[place][k])) for place, k in study.tracks.low_mac}
    for mode in range(study.tracks.count):
        style = {"linewidth": 1.8, **curve_style(mode)}
        curve = np.full(len(levels), np.nan)
        for k in range(len(levels)):
            place = tuple(fixed.get(axis, k) for axis in range(len(study.parameters)))
            row = np.flatnonzero(study.tracks.number.get(place, np.zeros(0)) == mode)
            if len(row):
                curve[k] = study.modes[place].frequency[row[0]]
                face = "white" if (place, mode) in hollow else style["color"]
                axes.plot(at[k], curve[k], "o", markersize=4.5, color=style["color"], markerfacecolor=face, zorder=3)
                if (place, mode) in torn:
                    axes.plot(at[k], curve[k], "o", markersize=10, color=PATH_RING, markerfacecolor="none", zorder=2)
                ends[mode] = at[k], curve[k]
        axes.plot(at, curve, **style)
    if not numeric:
        axes.set_xticks(at, [str(value) for value in levels])
    axes.margins(x=0.12)
    plain_axes(axes, grid="both")
    return ends


def _scale(axes: Axes, ends: list[dict[int, tuple[float, float]]]) -> None:
    values = [y for own in ends for _, y in own.values() if y > 0]
    if values and max(values) > LOGARITHMIC * min(values):
        axes.set_yscale("log")


def _labels(axes: Axes, ends: dict[int, tuple[float, float]]) -> None:
    """Write the number of each mode beside the end of its curve, apart from each other."""
    to_axes = (axes.transData + axes.transAxes.inverted()).transform
    placed: list[np.ndarray] = []
    for mode, end in sorted(ends.items(), key=lambda own: own[1][1]):
        at = to_axes(end)
        near = [other[1] for other in placed if abs(other[0] - at[0]) < APART]
        at[1] = max([at[1], *(height + APART for height in near)])
        placed.append(at)
        axes.annotate(
            str(mode + 1),
            (at[0], at[1]),
            xytext=(7, 0),
            xycoords="axes fraction",
            textcoords="offset points",
            va="center",
            fontsize=9,
            color=curve_style(mode)["color"],
            fontweight="bold",
            annotation_clip=False,
        )
