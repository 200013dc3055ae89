"""Curves over time as drawings inside the page: cheap to make, and in the colours of the page."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from modalprep.report.charts.plots import CURVES
from modalprep.report.numbers import number

WIDTH, HEIGHT, LEFT, BELOW, ABOVE, RIGHT = 900, 230, 84, 34, 14, 16
MOST = 450  # pairs of points of a curve; of those between them the smallest and the largest is drawn
TICKS = 5
ROOM = 0.06  # of the range of the values, above and below
ROW = Markup('<line class="grid" x1="{}" x2="{}" y1="{y}" y2="{y}"/><text x="{}" y="{}" text-anchor="end">{}</text>')
COLUMN = Markup(
    '<line class="grid" x1="{x}" x2="{x}" y1="{}" y2="{}"/><text x="{x}" y="{}" text-anchor="middle">{}</text>'
)
FLAT = 1e-9  # of the values: a range that is round-off


def curves(time: np.ndarray, series: Mapping[str, np.ndarray], title: str, unit: str) -> Markup:
    """Return a figure of named curves over time (s), with what they show below.

    Examples
    --------
    >>> t = np.linspace(0.0, 1.0, 5)
    >>> drawn = curves(t, {"hinge.angle": t**2}, "hinge.angle", "rad")
    >>> drawn.count("<path"), "hinge.angle (rad)" in drawn
    (1, True)
    """
    low, high = _range(series)
    start = float(time[0])
    end = float(time[-1]) if time[-1] > time[0] else float(time[0]) + 1.0
    parts = [_axes(start, end, low, high)]
    for k, values in enumerate(series.values()):
        path = _path(time, values, (start, end), (low, high))
        parts.append(Markup('<path d="{}" fill="none" stroke="{}" stroke-width="1.8"/>').format(path, _colour(k)))
    said = f"{title} ({unit})" if unit else title
    svg = Markup('<svg viewBox="0 0 {} {}" role="img" aria-label="{} over time">{}</svg>').format(
        WIDTH, HEIGHT, said, Markup("").join(parts)
    )
    return Markup('<figure class="curves">{}<figcaption>{}{}</figcaption></figure>').format(svg, said, _key(series))


def _colour(k: int) -> str:
    return CURVES[k % len(CURVES)]


def _key(series: Mapping[str, np.ndarray]) -> Markup:
    """Return the names of several curves behind their colours."""
    if len(series) < 2:
        return Markup("")
    names = (
        Markup('<span><i style="background: {}"></i>{}</span>').format(_colour(k), n) for k, n in enumerate(series)
    )
    return Markup("").join(names)


def _range(series: Mapping[str, np.ndarray]) -> tuple[float, float]:
    known = np.concatenate([values[np.isfinite(values)] for values in series.values()])
    if not known.size:
        return 0.0, 1.0
    low = float(known.min())
    high = float(known.max())
    if high - low <= FLAT * max(abs(low), abs(high)):
        span = max(abs(low), abs(high)) or 1.0
        return low - span, high + span
    return low - ROOM * (high - low), high + ROOM * (high - low)


def _path(time: np.ndarray, values: np.ndarray, across: tuple[float, float], along: tuple[float, float]) -> str:
    """Return the finite points of a curve; where there are more than can be seen, the extremes among neighbours."""
    rows = np.flatnonzero(np.isfinite(values))
    if len(rows) > 2 * MOST:
        groups = np.array_split(rows, MOST)
        rows = np.unique([k for own in groups for k in (own[np.argmin(values[own])], own[np.argmax(values[own])])])
    x = LEFT + (WIDTH - LEFT - RIGHT) * (time[rows] - across[0]) / (across[1] - across[0])
    y = ABOVE + (HEIGHT - ABOVE - BELOW) * (along[1] - values[rows]) / (along[1] - along[0])
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True)) if len(rows) else ""


def _axes(start: float, end: float, low: float, high: float) -> Markup:
    """Return grid and numbers of the axes."""
    bottom = HEIGHT - BELOW
    parts = []
    for value in _ticks(low, high):
        y = round(ABOVE + (bottom - ABOVE) * (high - value) / (high - low), 1)
        parts.append(ROW.format(LEFT, WIDTH - RIGHT, LEFT - 6, y + 4, number(value, 5), y=y))
    for value in _ticks(start, end):
        x = round(LEFT + (WIDTH - LEFT - RIGHT) * (value - start) / (end - start), 1)
        parts.append(COLUMN.format(ABOVE, bottom, bottom + 17, f"{number(value, 5)} s", x=x))
    return Markup("").join(parts)


def _ticks(low: float, high: float) -> list[float]:
    """Return round numbers between two numbers.

    Examples
    --------
    >>> _ticks(0.0, 1.0), _ticks(-0.3, 12.0)
    ([0.0, 0.2, 0.4, 0.6, 0.8, 1.0], [0.0, 2.5, 5.0, 7.5, 10.0])
    """
    rough = (high - low) / TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 2.5, 5, 10) if power * factor >= 0.999 * rough)
    first = math.ceil(low / step - 1e-9)
    last = math.floor(high / step + 1e-9)
    return [round(k * step, 12 - math.floor(math.log10(step))) for k in range(first, last + 1)]
