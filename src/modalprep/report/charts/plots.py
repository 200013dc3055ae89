"""Charts by matplotlib: time histories and error curves."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.results.result import Result
from modalprep.report.charts.figures import Axes, Figure, named, save_figure

# colour-blind safe (Okabe and Ito), in an order whose neighbours also differ in lightness
COLOURS = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
CURVES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
LINES = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (5, 2, 1, 2)))
INK, GREY = "#1d2733", "#5c6b7a"
ROOM, EXIT = 0.07, 0.36  # margins of the curves: if all stay in the frame, if one leaves it


def history_plot(
    results: Mapping[str, Result],
    channels: Sequence[str],
    path: str | Path,
    *,
    title: str = "",
    ylabel: str = "",
    reference: Sequence[Mapping[str, Any]] | None = None,
    ylim: tuple[float, float] | None = None,
) -> Path:
    """Draw channels of one or more runs over time.

    The limits follow the runs that did not diverge; a note marks where a diverging run leaves the frame.

    Parameters
    ----------
    results : {label: Result}
    channels : sequence of str
        A channel with several columns is drawn as that many curves.
    reference : sequence of {"label": str, "t": list, "y": list}
        Reference points, drawn as markers.
    ylim : (low, high), optional
        Limits instead of the chosen ones.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When there is no run, or a run has no such channel.

    Examples
    --------
    >>> import tempfile
    >>> t = np.linspace(0, 1)
    >>> run = Result(time=t, channels={"hub.angle": t**2}, status="done", message="")
    >>> history_plot({"run": run}, ["hub.angle"], Path(tempfile.mkdtemp()) / "angle.png").name
    'angle.png'
    """
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    draw_histories(figure.add_subplot(), results, channels, title=title, ylabel=ylabel, reference=reference, ylim=ylim)
    return save_figure(figure, path)


def draw_histories(
    axes: Axes,
    results: Mapping[str, Result],
    channels: Sequence[str],
    *,
    title: str = "",
    ylabel: str = "",
    reference: Sequence[Mapping[str, Any]] | None = None,
    ylim: tuple[float, float] | None = None,
) -> None:
    """Draw the chart of `history_plot` into axes."""
    points = list(reference or ())
    curves = list(_curves(results, channels))
    axes.set_ylim(*(ylim or _frame(curves, points)))
    axes.set_xlim(0, max(run.time[-1] for run in results.values()) or 1.0)
    for order, (label, run, y, style) in enumerate(curves):
        # the first run is the main one: drawn last, on top of the others
        axes.plot(run.time, y, label=named(label), linewidth=2.2, zorder=3 - order / len(curves), **style)
    _note_exits(axes, results, curves)
    for mark, point in zip("osD^v" * len(points), points, strict=False):
        axes.plot(
            point["t"],
            point["y"],
            mark,
            color=INK,
            markerfacecolor="white",
            markersize=7.5,
            markeredgewidth=1.4,
            zorder=4,
            label=named(point["label"]),
        )
    axes.set_xlabel("time (s)")
    axes.set_ylabel(ylabel or ", ".join(channels))
    add_head(axes, title)
    plain_axes(axes, grid="both")
    axes.spines[["left", "bottom"]].set_in_layout(False)  # the labels of their ticks reach farther
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-4, 8), useOffset=False)


def _curves(
    results: Mapping[str, Result], channels: Sequence[str]
) -> Iterator[tuple[str, Result, np.ndarray, dict[str, Any]]]:
    """Yield label, run, values and style: a colour per run, or per channel when there are several."""
    if not results or not channels:
        raise InputError("nothing to plot: give at least one run and one channel")
    for number, (label, run) in enumerate(results.items()):
        names = [name for channel in channels for name in _components(run, channel)]
        for column, name in enumerate(names):
            several = len(names) > 1
            colour = CURVES[(column if several else number) % len(CURVES)]
            line = LINES[number % len(LINES)] if several else "-"
            words = [name] * several + [label] * (len(results) > 1)
            yield ", ".join(words) or name, run, run[name], {"color": colour, "linestyle": line}


def _components(run: Result, channel: str) -> list[str]:
    return [f"{channel}.{name}" for name in run.columns().get(channel, ())] or [channel]


def _frame(curves: list, points: list[Mapping[str, Any]]) -> tuple[float, float]:
    """Return the limits of the runs that did not diverge and the reference; of the first half of each if all did."""
    steady = [y for _, run, y, _ in curves if run.status != "diverged"]
    leaving = [y for _, run, y, _ in curves if run.status == "diverged"]
    values = steady or [y[: max(2, len(y) // 2)] for y in leaving]
    values += [np.asarray(point["y"], dtype=float) for point in points]
    known, out = _finite(values), _finite(leaving)
    if not known.size:
        return 0.0, 1.0
    margins = EXIT if (out < known.min()).any() else ROOM, EXIT if (out > known.max()).any() else ROOM
    return _limits(values, margins) or (0.0, 1.0)


def _limits(values: Sequence[np.ndarray], margin: float | tuple[float, float]) -> tuple[float, float] | None:
    """Limits of `values` with this fraction of their range as margins below and above; None without any."""
    known = _finite(values)
    if not known.size:
        return None
    low = known.min()
    high = known.max()
    # a value constant up to round-off is drawn as a constant
    span = high - low if high - low > 1e-9 * max(abs(low), abs(high)) else max(abs(low), abs(high)) or 1.0
    below, above = np.broadcast_to(margin, 2)
    return low - below * span, high + above * span


def _finite(values: Sequence[np.ndarray]) -> np.ndarray:
    joined = np.concatenate([np.zeros(0), *(np.ravel(v) for v in values)])
    return joined[np.isfinite(joined)]


def _note_exits(axes: Axes, results: Mapping[str, Result], curves: list) -> None:
    """Mark where the first curve of each diverged run finally leaves the frame."""
    diverged = {label: run for label, run in results.items() if run.status == "diverged"}
    for above, (name, run) in enumerate(diverged.items()):
        own = [(_exit(y, axes.get_ylim()), y, style) for _, other, y, style in curves if other is run]
        first, y, style = min(own, key=lambda curve: curve[0])
        if first < len(y):
            colour = style["color"] if len(own) == 1 else INK
            _note(axes, name if len(results) > 1 else "the run", run.time, y, first, colour, above)


def _exit(y: np.ndarray, limits: tuple[float, float]) -> int:
    """Index from which y stays outside the limits; its length if it ends inside."""
    inside = np.flatnonzero((y >= limits[0]) & (y <= limits[1]))
    return int(inside[-1]) + 1 if len(inside) else 0


def _note(axes: Axes, name: str, time: np.ndarray, y: np.ndarray, first: int, colour: str, above: int) -> None:
    """Write a note where the curve of a diverging run leaves; `above` is the number of notes already there."""
    low, high = axes.get_ylim()
    width = axes.get_xlim()[1]
    t = float(time[first])
    down = not y[first] > high
    late = t > 0.6 * width
    step = (high - low) * (0.085 + 0.17 * above)
    end = f",\nreaches {y[-1]:.3g} at t = {time[-1]:.1f} s" if np.isfinite(y[-1]) else ""
    axes.annotate(
        f"{name} diverges:\nleaves the frame at t = {t:.1f} s{end}",
        xy=(t, low if down else high),
        xytext=(t + (-0.05 if late else 0.05) * width, low + step if down else high - step),
        ha="right" if late else "left",
        va="center",
        color=colour,
        arrowprops={"arrowstyle": "-|>", "color": colour, "lw": 1.5, "shrinkB": 0},
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.85, "pad": 2.0},
        zorder=5,
    )


def add_head(axes: Axes, title: str) -> None:
    """Add the title and, below it, the legend in rows above the frame."""
    labels = axes.get_legend_handles_labels()[1]
    widest = max(map(len, labels)) + 8  # characters, with the line before the text
    one_row = len(labels) <= 3 and sum(map(len, labels)) + 8 * len(labels) <= 115
    columns = len(labels) if one_row else max(1, min(3, 115 // widest))
    rows = -(-len(labels) // columns) if len(labels) > 1 else 0
    place = 1.0 if rows else None  # above a legend; else matplotlib looks for the power of ten of the ticks
    axes.set_title(title, loc="left", fontsize=14, fontweight="bold", color=INK, pad=8 + 16 * rows, y=place)
    if rows:
        axes.legend(
            loc="lower left",
            bbox_to_anchor=(-0.008, 1.0),
            ncols=columns,
            frameon=False,
            fontsize=9.5,
            borderaxespad=0.3,
            columnspacing=1.6,
            handlelength=2.0,
            handletextpad=0.6,
        )


def curve_style(number: int) -> dict[str, Any]:
    """Return colour and line of a curve by its number, from 0: the line changes where the colours begin again.

    Examples
    --------
    >>> curve_style(6)
    {'color': '#0072B2', 'linestyle': (0, (5, 2))}
    """
    again, colour = divmod(number, len(CURVES))
    return {"color": CURVES[colour], "linestyle": LINES[again % len(LINES)]}


def label_beyond(axes: Axes, y: float, text: str) -> None:
    """Write a text at the height y beyond the right end of axes."""
    style = {"xycoords": ("axes fraction", "data"), "textcoords": "offset points", "va": "center"}
    axes.annotate(text, (1.0, y), xytext=(4, 0), fontsize=9, color=GREY, **style)


def error_plot(
    curves: Mapping[str, tuple[Any, Any]],
    path: str | Path,
    *,
    xlabel: str = "frequency (Hz)",
    ylabel: str = "relative error",
) -> Path:
    """Draw error curves; on logarithmic axes where the values are positive and span two decades.

    Parameters
    ----------
    curves : {label: (x, y)}

    Raises
    ------
    InputError
        When there is no curve, or x and y of one differ in length.

    Examples
    --------
    >>> import tempfile
    >>> error_plot({"reduced": ([1, 10, 100], [1e-6, 1e-4, 0.1])}, Path(tempfile.mkdtemp()) / "e.png").name
    'e.png'
    """
    pairs = {label: (np.asarray(x, dtype=float), np.asarray(y, dtype=float)) for label, (x, y) in curves.items()}
    wrong = [label for label, (x, y) in pairs.items() if x.ndim != 1 or x.shape != y.shape or not len(x)]
    if wrong or not pairs:
        raise InputError(
            f"error curve {wrong[0]!r} needs as many x as y, and one at least" if wrong else "there is no error curve"
        )
    figure = Figure(figsize=(9.0, 4.6), layout="constrained")
    axes = figure.add_subplot()
    for number, (label, (x, y)) in enumerate(pairs.items()):
        mark = "o" if len(x) <= 60 else ""
        axes.plot(x, y, marker=mark, markersize=4, linewidth=2.0, label=named(label), **curve_style(number))
    axes.set_xscale(_axis_scale([x for x, _ in pairs.values()]))
    axes.set_yscale(_axis_scale([y for _, y in pairs.values()]))
    axes.set_xlabel(xlabel)
    axes.set_ylabel(ylabel)
    add_head(axes, "")
    plain_axes(axes, grid="both")
    return save_figure(figure, path)


def _axis_scale(values: Sequence[np.ndarray]) -> str:
    known = _finite(values)
    return "log" if known.size and known.min() > 0 and known.max() >= 100 * known.min() else "linear"


def plain_axes(axes: Axes, grid: Literal["x", "y", "both"]) -> None:
    """Remove the top and right spines, draw the others in grey under the curves; `grid` is x, y or both."""
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color(GREY)
    axes.tick_params(color=GREY, labelcolor=INK)
    axes.grid(axis=grid, color="#e3e7eb", linewidth=0.8)
    axes.set_axisbelow(True)
