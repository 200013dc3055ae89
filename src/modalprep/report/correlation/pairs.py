"""Correlation of two sets of modes: a table for the terminal, and a picture of the MAC."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.correlation.pairing import Correlation
from modalprep.report.charts.figures import Figure, save_figure
from modalprep.report.charts.plots import INK
from modalprep.report.tables import hertz
from modalprep.report.terminal import plain_table, print_table, print_text, right_aligned

WRITTEN = 20  # maximum number of modes of a side with values written in the cells
WORST = 5  # listed components of the lowest COMAC
DISAGREES = 0.9  # COMAC below which a component is listed

HEADS = (
    "test",
    "analysis",
    "test Hz",
    "analysis Hz",
    "diff. %",
    "MAC",
    "orthogonality",
    "test damping %",
    "analysis damping %",
)


def correlation_table(correlation: Correlation, console: Console) -> None:
    """Print a row for each pair of modes, the modes without partner, and the components that disagree most.

    Examples
    --------
    >>> from modalprep.correlation import body_modes, correlate
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=2))
    >>> correlation_table(correlate(modes, modes), Console(width=100, color_system=None))  # doctest: +ELLIPSIS
    Pairs of modes of beam (test) and beam (analysis)
    ...analysis
    test  analysis  test Hz  analysis Hz  diff. %    MAC  orthogonality  test damping %        damping %
    ...
    """
    names = f" of {correlation.test.name} (test) and {correlation.analysis.name} (analysis)"
    console.print(Text.assemble(("Pairs of modes", "bold"), names))
    rich = plain_table(*right_aligned(*HEADS, no_wrap=False))
    for row in correlation.rows():
        test, analysis, f_test, f_analysis, off, mac, cross, d_test, d_analysis = row.values()
        rich.add_row(
            str(test),
            str(analysis),
            hertz(f_test),
            hertz(f_analysis),
            _known(off, "+.2f"),
            f"{mac:.3f}",
            _known(cross, ".3f"),
            _known(d_test, ".2f"),
            _known(d_analysis, ".2f"),
        )
    print_table(rich, console)
    worst = [f"{sensor}{component} {value}" for sensor, component, value in worst_components(correlation, WORST)]
    for text in (*unpaired(correlation), *([f"lowest COMAC: {', '.join(worst)}"] if worst else [])):
        console.print(Text(text))
    for note in correlation.notes:
        print_text(Text(f"note: {note}"), console)


def _known(value: float, form: str) -> str:
    return format(value, form) if np.isfinite(value) else "."


def unpaired(correlation: Correlation) -> list[str]:
    """Return a sentence for each side that has modes without a partner."""
    said = []
    sides = (
        ("test", correlation.test, correlation.pairs[:, 0]),
        ("analysis", correlation.analysis, correlation.pairs[:, 1]),
    )
    for side, modes, paired in sides:
        alone = [f"{k + 1} ({hertz(modes.frequency[k])} Hz)" for k in range(modes.n) if k not in paired]
        said += [f"{side} modes without a partner: {', '.join(alone)}"] if alone else []
    return said


def worst_components(correlation: Correlation, count: int) -> list[tuple[str, str, str]]:
    """Return sensor, component and COMAC of those with the lowest COMAC below `DISAGREES`."""
    order = np.argsort(np.nan_to_num(correlation.comac, nan=1.0), axis=None)[:count]
    places = np.stack(np.unravel_index(order, correlation.comac.shape), axis=1).tolist()
    return [
        (str(correlation.test.labels[p]), "xyz"[axis], f"{correlation.comac[p, axis]:.2f}")
        for p, axis in places
        if correlation.comac[p, axis] < DISAGREES
    ]


def mac_plot(correlation: Correlation, path: str | Path) -> Path:
    """Draw the MAC of all test and analysis modes; pairs have a frame.

    Returns
    -------
    Path
        The file.
    """
    n, m = correlation.mac.shape
    figure = Figure(figsize=(min(12, 2.8 + 0.42 * m), min(10, 1.8 + 0.36 * n)), layout="constrained")
    axes = figure.add_subplot()
    image = axes.imshow(correlation.mac, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for i, j in correlation.pairs.tolist():
        axes.plot(
            [j - 0.5, j + 0.5, j + 0.5, j - 0.5, j - 0.5],
            [i - 0.5, i - 0.5, i + 0.5, i + 0.5, i - 0.5],
            color="#D55E00",
        )
    if max(n, m) <= WRITTEN:
        for i, j in np.argwhere(correlation.mac >= 0.05):
            ink = "white" if correlation.mac[i, j] > 0.6 else INK
            axes.text(j, i, f"{correlation.mac[i, j]:.2f}", ha="center", va="center", color=ink, fontsize=8)
    for axis, modes, place in ((axes.yaxis, correlation.test, n), (axes.xaxis, correlation.analysis, m)):
        step = max(1, place // 30)
        axis.set_ticks(range(0, place, step), [f"{k + 1}: {hertz(modes.frequency[k])}" for k in range(0, place, step)])
    axes.tick_params(axis="x", rotation=90)
    axes.set_ylabel(f"{correlation.test.name} (test): mode, Hz")
    axes.set_xlabel(f"{correlation.analysis.name} (analysis): mode, Hz")
    axes.set_title("Modal assurance criterion; pairs are framed", loc="left", fontweight="bold", color=INK)
    figure.colorbar(image, ax=axes, label="MAC")
    return save_figure(figure, path)
