"""Ensembles: percentile bands over time, tables of statistics and of cases."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.atomic import write_table
from modalprep.ensemble.record import PERCENTILES, Ensemble, statistics_head
from modalprep.multibody.results.result import Result
from modalprep.report.charts import plots
from modalprep.report.charts.figures import Axes, Figure, named, save_figure
from modalprep.report.terminal import plain_table, print_table, right_aligned

BAND, STEP = 0.2, 0.16  # opacity of the widest band, and what each one inside adds


def band_plot(
    ensemble: Ensemble,
    channel: str,
    path: str | Path,
    *,
    levels: Sequence[float] = PERCENTILES,
    nominal: Result | None = None,
    title: str = "",
) -> Path:
    """Draw percentiles of a channel over time: bands between the outer ones, a line for that in the middle.

    Parameters
    ----------
    channel : str
        Each of its components has a colour.
    levels : sequence of float
        Percent.
    nominal : Result or None
        A run to draw as a broken line.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When there is no such channel.

    Examples
    --------
    >>> import tempfile
    >>> some = Ensemble(cases={"a.b": np.ones(3)}, time=np.arange(4.0), channels={"x": np.arange(12.0).reshape(3, 4)},
    ...                 status=("done",) * 3, message=("",) * 3, end=np.ones(3), energy_error=np.zeros(3))
    >>> band_plot(some, "x", Path(tempfile.mkdtemp()) / "x.png").name
    'x.png'
    """
    figure = Figure(figsize=(9.0, 5.0), layout="constrained")
    draw_bands(figure.add_subplot(), ensemble, channel, levels=levels, nominal=nominal, title=title)
    return save_figure(figure, path)


def draw_bands(
    axes: Axes,
    ensemble: Ensemble,
    channel: str,
    *,
    levels: Sequence[float] = PERCENTILES,
    nominal: Result | None = None,
    title: str = "",
) -> None:
    """Draw the chart of `band_plot` into axes."""
    levels = sorted(levels)
    components = ensemble.table([channel])
    for number, name in enumerate(components):
        _bands(axes, ensemble, name, levels, plots.CURVES[number % len(plots.CURVES)], several=len(components) > 1)
    if nominal is not None:
        for number, name in enumerate(components):
            axes.plot(
                nominal.time,
                nominal[name],
                color=plots.INK,
                linewidth=1.4,
                linestyle=plots.LINES[1],
                zorder=4,
                label="nominal" if number == 0 else None,
            )
    axes.set_xlim(0, ensemble.time[-1] or 1.0)
    axes.margins(y=plots.ROOM)
    axes.set_xlabel("time (s)")
    axes.set_ylabel(channel)
    drawn = f": {', '.join(reversed(_words(levels)))}" if len(components) > 1 else ""
    plots.add_head(axes, title or f"{channel} of {len(ensemble)} cases{drawn}")
    plots.plain_axes(axes, grid="both")
    axes.ticklabel_format(axis="y", style="sci", scilimits=(-4, 8), useOffset=False)


def _bands(axes: Axes, ensemble: Ensemble, name: str, levels: Sequence[float], colour: str, *, several: bool) -> None:
    """Draw the percentiles of one component; of several, each has its name in the legend, else each band its own."""
    values = ensemble.percentiles(levels, [name])[name]
    pairs = len(levels) // 2
    for k, words in enumerate(_words(levels)[:pairs]):
        label = words if not several else named(name) if k == 0 and not len(levels) % 2 else None
        axes.fill_between(
            ensemble.time,
            values[k],
            values[-1 - k],
            color=colour,
            alpha=BAND + STEP * k,
            linewidth=0,
            label=label,
            zorder=2,
        )
    if len(levels) % 2:
        label = named(name) if several else _words(levels)[-1]
        axes.plot(ensemble.time, values[pairs], color=colour, linewidth=2.2, label=label, zorder=3)


def _words(levels: Sequence[float]) -> list[str]:
    """Name the bands, the widest first, and the line in the middle."""
    pairs = len(levels) // 2
    bands = [f"{levels[k]:g} to {levels[-1 - k]:g} %" for k in range(pairs)]
    line = ["median" if levels[pairs] == 50 else f"{levels[pairs]:g} %"] if len(levels) % 2 else []
    return bands + line


def statistics_table(
    ensemble: Ensemble, console: Console, levels: Iterable[float] = PERCENTILES, channels: Sequence[str] = ()
) -> None:
    """Print mean, deviation and percentiles of the final, smallest and largest values.

    Examples
    --------
    >>> some = Ensemble(cases={"a.b": np.ones(2)}, time=np.arange(2.0), channels={"x": np.array([[0, 1.0], [0, 3]])},
    ...                 status=("done",) * 2, message=("",) * 2, end=np.ones(2), energy_error=np.zeros(2))
    >>> statistics_table(some, Console(width=80, color_system=None), [50])
    Statistics of 2 cases
    channel  value     mean  deviation  p50
    ───────────────────────────────────────
    x        final        2      1.414    2
             smallest     0          0    0
             largest      2      1.414    2
    """
    levels = list(levels)
    channel, value, *figures = statistics_head(levels)
    rich = plain_table(channel, value, *right_aligned(*figures, no_wrap=False))
    last = ""
    for name, kind, *numbers in ensemble.statistics(levels, channels):
        rich.add_row(Text("" if name == last else str(name)), str(kind), *(f"{number:.4g}" for number in numbers))
        last = name
    known = sum(bool(np.isfinite(end)) for end in ensemble.end)
    console.print(Text(f"Statistics of {known} cases", "bold"))
    print_table(rich, console)


def write_statistics(ensemble: Ensemble, path: str | Path, levels: Iterable[float] = PERCENTILES) -> Path:
    """Write the table of statistics as a CSV file.

    Returns
    -------
    Path
        The file.
    """
    levels = list(levels)
    return write_table(statistics_head(levels), ensemble.statistics(levels), path)


def write_cases(ensemble: Ensemble, path: str | Path) -> Path:
    """Write a row for each case as a CSV file: values, status, cause of a failure, end, and its outcomes.

    Returns
    -------
    Path
        The file.
    """
    outcomes = ensemble.outcomes()
    head = ["case", *ensemble.cases, "status", "message", "end", "energy_error"]
    columns = [*ensemble.cases.values(), ensemble.status, _causes(ensemble), ensemble.end, ensemble.energy_error]
    if np.isfinite(ensemble.momentum_error).any():
        head, columns = [*head, "momentum_error"], [*columns, ensemble.momentum_error]
    rows = zip(range(len(ensemble)), *columns, *outcomes.values(), strict=True)
    return write_table([*head, *(f"{name} {kind}" for name, kind in outcomes)], rows, path)


def _causes(ensemble: Ensemble) -> list[str]:
    rows = zip(ensemble.status, ensemble.message, ensemble.audit, strict=True)
    return [why if status == "done" else message for status, message, why in rows]
