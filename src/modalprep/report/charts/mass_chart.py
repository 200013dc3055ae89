"""Chart of the effective masses of the kept vectors."""

from __future__ import annotations

from pathlib import Path
from typing import TypedDict

import numpy as np
from matplotlib.patches import Patch, Rectangle

from modalprep.reduction.table import DIRECTIONS, ModeTable
from modalprep.report.charts.figures import Axes, Figure, save_figure
from modalprep.report.charts.plots import COLOURS, GREY, INK, plain_axes
from modalprep.report.numbers import number

NAMED = 12  # vectors at most that have a colour of their own
LEAST = 4.0  # % in some direction, from which on they have it
OTHERS = "#d5dbe1"
HATCHES = ("", "///", "...")  # of the first six vectors, the next, ...
TARGET = 90.0  # %, the usual least sum of a base-driven structure
HEIGHT = 0.72  # of a bar
LETTER = 1.05  # width of a letter in a bar, % of the body


def effective_mass_plot(table: ModeTable, path: str | Path) -> Path:
    """Draw, per direction, the effective mass of each kept vector, stacked, with a key of their frequencies.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> effective_mass_plot(uniform_beam(modes=4).modes, Path(tempfile.mkdtemp()) / "m.png").suffix
    '.png'
    """
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    draw_effective_mass(figure.add_subplot(), table)
    return save_figure(figure, path)


class Style(TypedDict):
    """Colour and hatching of a vector."""

    facecolor: str
    hatch: str


def draw_effective_mass(axes: Axes, table: ModeTable) -> None:
    """Draw the chart of `effective_mass_plot` into axes: the largest vectors in colours, all others in grey."""
    share = np.where(table.kept[:, None], 100 * np.nan_to_num(table.fraction), 0.0)
    named = _named(share)
    left = np.zeros(6)
    key = []
    for rank, k in enumerate(named):
        style: Style = {"facecolor": COLOURS[rank % len(COLOURS)], "hatch": HATCHES[rank // len(COLOURS)]}
        _stack(axes, share[k], left, style, (f"{k + 1}: {_words(table, k)}", f"{k + 1}"))
        label = f"row {k + 1}: {_words(table, k)}"
        key.append(Patch(facecolor=style["facecolor"], hatch=style["hatch"], edgecolor="white", label=label))
        left += share[k]
    rest = np.delete(share, named, axis=0)
    if rest.any():
        count = int(np.any(rest > 0, axis=1).sum())
        _stack(axes, rest.sum(axis=0), left, {"facecolor": OTHERS, "hatch": ""}, (f"{count} others", ""))
        key.append(Patch(facecolor=OTHERS, label=f"{count} others, each below {np.ceil(10 * rest.max()) / 10:g} %"))
        left += rest.sum(axis=0)
    _frame(axes, left, table.total)
    legend = {"loc": "upper left", "bbox_to_anchor": (-0.06, -0.14), "ncols": 5, "frameon": False, "fontsize": 8.5}
    axes.legend(handles=key, handlelength=1.4, columnspacing=1.2, **legend)


def _named(share: np.ndarray) -> np.ndarray:
    """Return the rows that have a colour of their own, in the order of the table."""
    most = share.max(axis=1, initial=0.0)
    return np.sort(np.argsort(-most, kind="stable")[: min(NAMED, np.count_nonzero(most >= LEAST))])


def _words(table: ModeTable, k: int) -> str:
    """Return the frequency of a vector, or its kind if it has none."""
    return f"{number(table.frequency[k])} Hz" if np.isfinite(table.frequency[k]) else table.kind[k]


def _stack(axes: Axes, share: np.ndarray, left: np.ndarray, style: Style, words: tuple[str, ...]) -> None:
    """Add one vector's piece to the six bars, with the first of the words that has room."""
    ink = "white" if style["facecolor"] in ("#0072B2", "#009E73", "#D55E00") else INK
    box = {"facecolor": style["facecolor"], "edgecolor": "none", "pad": 1.0} if style["hatch"] else None
    for place in np.flatnonzero(share).tolist():
        corner = (left[place], place - HEIGHT / 2)
        bar = Rectangle(corner, share[place], HEIGHT, edgecolor="white", linewidth=0.6, **style)
        axes.add_artist(bar)  # `barh` takes three times as long
        if text := next((word for word in words if share[place] > LETTER * len(word) + 0.8), ""):
            middle = left[place] + share[place] / 2
            axes.text(middle, place, text, ha="center", va="center", color=ink, fontsize=8, bbox=box)


def _frame(axes: Axes, left: np.ndarray, total: np.ndarray) -> None:
    """Write the sums beside the bars, and draw the axes, the whole body and the usual target."""
    for place, reached in enumerate(left):
        text = f"{reached:.1f} %" if total[place] > 0 else "no inertia"
        axes.text(max(101.5, reached + 0.8), place, text, va="center", color=INK, fontsize=9)
    axes.set_yticks(range(6), [*DIRECTIONS[:3], *(f"about {d[1]}" for d in DIRECTIONS[3:])])
    axes.set_ylim(5.6, -0.6)
    axes.set_xlim(0, max(110.0, 1.1 * left.max(initial=0.0)))
    axes.set_xticks([0, 20, 40, 60, 80, TARGET, 100])
    axes.set_xlabel("effective mass of the kept vectors (% of the body)")
    axes.axvline(100, color=GREY, linewidth=1.0)
    axes.axvline(TARGET, color=GREY, linewidth=1.0, linestyle=(0, (4, 3)))
    axes.axhline(2.5, color="#c3ccd4", linewidth=0.8)
    plain_axes(axes, grid="x")
