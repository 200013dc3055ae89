"""Responses of a body: a table of their peaks, and a plot of their largest channels."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.ticker import FuncFormatter, LogFormatterSciNotation, LogLocator, NullFormatter, StrMethodFormatter
from rich.console import Console
from rich.text import Text

from modalprep.report.charts.figures import Axes, Figure, named, save_figure
from modalprep.report.charts.plots import add_head, curve_style, plain_axes
from modalprep.report.numbers import number, quantity, shown_unit
from modalprep.report.tables import hertz, margin_of_safety, prefixed
from modalprep.report.terminal import print_rows
from modalprep.response.result import Peak, Response

if TYPE_CHECKING:
    from matplotlib.axis import Axis

HEADS = {  # columns of `peak_rows` by the figures of a kind
    "harmonic": ("peak", "at_hz", "phase_deg"),
    "random": ("rms", "three_sigma", "apparent_hz", "at_hz"),
    "sweep": ("peak", "at_hz", "at_s", "steady"),
    "transient": ("highest", "at_s", "lowest", "lowest_at_s"),
}
WORDS = {
    "peak": "peak",
    "at_hz": "at",
    "phase_deg": "phase",
    "rms": "RMS",
    "three_sigma": "3 sigma",
    "apparent_hz": "apparent",
    "at_s": "time",
    "steady": "steady state",
    "highest": "largest",
    "lowest": "smallest",
    "lowest_at_s": "time",
}
SUFFIX = {"at_hz": "Hz", "apparent_hz": "Hz", "phase_deg": "°", "at_s": "s", "lowest_at_s": "s"}
PANELS, DRAWN = 4, 6  # of a plot, and curves in each
FEW = 10  # points that are marked
MEANING = {
    "harmonic": "Amplitudes",
    "sweep": "Largest magnitudes of the sweep; steady state dotted",
    "random": "Power spectral densities",
    "transient": "Histories",
}
QUANTITIES = {
    "N": "force",
    "N m": "moment",
    "m/s^2": "acceleration",
    "m/s": "velocity",
    "m": "displacement",
    "rad": "rotation",
    "rad/s^2": "angular acceleration",
    "rad/s": "angular velocity",
    "Pa": "stress",
    "N/m": "force per length",
}
PREFIXED = ("N", "N m", "m", "J")  # axes in decades have their labels in these units with SI prefixes
NOTHING = 1e-9  # of the largest of a unit: round-off in a direction that nothing drives
ALIKE = {"N m": "N", "rad/s^2": "m/s^2", "rad": "m"}  # at an arm of 1 m


def peak_columns(response: Response) -> list[str]:
    """Return the heads of `peak_rows`.

    Examples
    --------
    >>> peak_columns(_example())
    ['channel', 'peak', 'at', 'phase', 'margin']
    """
    return ["channel", *(WORDS[key] for key in HEADS[response.kind]), "margin"]


def peak_rows(response: Response) -> list[tuple[str, ...]]:
    """Return the largest peak of each component as texts with units, those with a margin first.

    Components that are round-off are left out.

    Examples
    --------
    >>> peak_rows(_example())
    [('tip.acceleration.x', '3 m/s² (0.3059 g)', '7 Hz', '90 °', '')]
    """
    return [(*peak_cells(peak, response.kind), margin_of_safety(peak.margin)) for peak in listed_peaks(response)]


def listed_peaks(response: Response) -> list[Peak]:
    """Return the largest peak of each component, those with a margin first, without round-off."""
    return sorted(notable(response.worst()), key=lambda x: np.isnan(x.margin))


def peak_cells(peak: Peak, kind: str) -> tuple[str, ...]:
    """Return channel and figures of a peak in a response of a kind, as texts with units."""
    return (peak.channel, *(_cell(key, peak) for key in HEADS[kind]))


def notable(peaks: list[Peak]) -> list[Peak]:
    """Return the peaks that are more than round-off beside the largest of their unit."""
    top: dict[str, float] = {}
    for peak in peaks:
        unit = ALIKE.get(peak.unit, peak.unit)
        top[unit] = max(top.get(unit, 0.0), peak.largest)
    return [peak for peak in peaks if peak.largest > NOTHING * top[ALIKE.get(peak.unit, peak.unit)]]


def _cell(key: str, peak: Peak) -> str:
    value = peak.figures.get(key, np.nan)
    if np.isnan(value):
        return ""
    if SUFFIX.get(key) == "Hz":
        return f"{hertz(value)} Hz"
    return f"{number(value)} {SUFFIX[key]}" if key in SUFFIX else quantity(value, peak.unit)


def peak_table(name: str, response: Response, console: Console) -> None:
    """Print `peak_rows`; negative margins are red.

    Examples
    --------
    >>> peak_table("shaker", _example(), Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Response shaker (harmonic)
    ...
    """
    console.print(Text.assemble("Response ", (name, "bold"), f" ({response.kind})"))
    rows = peak_rows(response)
    print_rows(peak_columns(response), rows, console, [row[-1].startswith("-") for row in rows], ("channel",))


def response_plot(response: Response, path: str | Path) -> Path:
    """Draw the channels with the largest peaks, a panel for each unit.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> response_plot(_example(), Path(tempfile.mkdtemp()) / "r.png").name
    'r.png'
    """
    panels = largest_panels(response)
    figure = Figure(figsize=(9.0, 0.8 + 3.2 * max(1, len(panels))), layout="constrained")
    axes = figure.subplots(max(1, len(panels)), 1, sharex=True, squeeze=False)[:, 0]
    draw_response(list(axes), response, panels)
    return save_figure(figure, path)


def draw_response(all_axes: Sequence[Axes], response: Response, panels: Mapping[str, list[str]]) -> None:
    """Draw the channels of each unit into axes of their own."""
    for axes, (unit, names) in zip(all_axes, panels.items(), strict=False):
        _panel(axes, response, unit, names)
    all_axes[-1].set_xlabel("time (s)" if response.kind == "transient" else "frequency (Hz)")


def chosen_panels(response: Response, channels: Sequence[str]) -> dict[str, list[str]]:
    """Return channels by unit: those with these names or beginnings, in their order.

    Raises
    ------
    InputError
        When there is no such curve.

    Examples
    --------
    >>> chosen_panels(_example(), ["tip"])
    {'m/s^2': ['tip.acceleration.x']}
    """
    panels: dict[str, list[str]] = {}
    for channel in channels:
        inside = [name for name in response.names if name == channel or name.startswith(f"{channel}.")]
        if not inside:
            response[channel]  # says which there are
        for name in inside:
            panels.setdefault(response.units[response.names.index(name)], []).append(name)
    return panels


def largest_panels(response: Response) -> dict[str, list[str]]:
    """Return the channels to draw by unit: of each component its largest, the largest first."""
    found: dict[str, list[Peak]] = {}
    for peak in notable(response.worst()):
        if peak.channel in response.names:
            found.setdefault(peak.unit, []).append(peak)
    units = sorted(found, key=lambda unit: unit.startswith("rad"))  # rotations last
    drawn = {unit: sorted(found[unit], key=lambda x: -x.largest)[:DRAWN] for unit in units}
    return {unit: [peak.channel for peak in peaks] for unit, peaks in list(drawn.items())[:PANELS]}


def _panel(axes: Axes, response: Response, unit: str, names: list[str]) -> None:
    random = response.kind == "random"
    factor, shown = shown_unit(unit)
    factor = factor**2 if random else factor
    curves = [factor * (response[name] if response.kind == "transient" else np.abs(response[name])) for name in names]
    steady = [] if response.steady is None else [factor * response.steady[:, response.names.index(n)] for n in names]
    for k, (name, y) in enumerate(zip(names, curves, strict=True)):
        style = curve_style(k)
        mark = "o" if len(response.axis) < FEW else ""
        axes.plot(response.axis, y, label=named(name), linewidth=1.8, marker=mark, **style)
        if steady:
            label = "steady state" if k == 0 else None
            axes.plot(response.axis, steady[k], color=style["color"], linewidth=1.0, linestyle=":", label=label)
    if response.kind != "transient":
        axes.set_xscale("log")
        axes.set_yscale("log")
        plain_decades(axes.xaxis)
        largest = max(float(values.max()) for values in (*curves, *steady))
        bottom = max(1e-6 * largest, 0.5 * min(map(_smallest, curves)))
        if largest > 0:
            axes.set_ylim(bottom, 2 * largest)
        axes.yaxis.set_major_formatter(LogFormatterSciNotation() if random else FuncFormatter(_decade(shown)))
        shown = shown if random or shown not in PREFIXED else ""
    else:
        prefix, shown = prefixed(shown, max(float(np.abs(y).max()) for y in curves))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: number(prefix * y)))
    at = response.axis if response.kind == "transient" else response.axis[response.axis > 0]
    if len(at) > 1:
        axes.set_xlim(at[0], at[-1])
    axes.set_ylabel(_quantity(names, unit, shown, random=random))
    add_head(axes, "")
    plain_axes(axes, grid="both")


def _quantity(names: list[str], unit: str, shown: str, *, random: bool) -> str:
    """Return what an axis shows, with the unit unless its ticks have it; a single curve has no legend, so its name."""
    text = shown.replace("^2", "²")
    if random:
        text = squared(text)
    what = names[0] if len(names) == 1 else QUANTITIES.get(unit, "")
    return f"{what} ({text})" if what and text else what or text


def squared(unit: str) -> str:
    """Return the unit of a power spectral density.

    Examples
    --------
    >>> squared("g"), squared("rad/s²")
    ('g²/Hz', '(rad/s²)²/Hz')
    """
    return f"{unit}²/Hz" if unit.isalpha() else f"({unit})²/Hz"


def _decade(unit: str) -> Callable[[float, int], str]:
    """Return what labels the decades of an axis: with SI prefixes where the unit takes them, else as numbers."""
    if unit not in PREFIXED:
        return lambda value, _: number(value)
    least = 0.0 if unit == "m" else 1.0  # there are millimetres, but no millinewtons

    def label(value: float, _: int) -> str:
        factor, name = prefixed(unit, max(value, least))
        return f"{number(factor * value)} {name}"

    return label


def plain_decades(axis: Axis) -> None:
    """Label a logarithmic axis with 1, 2 and 5 of each decade, as plain numbers."""
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axis.set_minor_formatter(NullFormatter())


def _smallest(values: np.ndarray) -> float:
    return float(values[values > 0].min(initial=np.inf))


def _example() -> Response:
    figures = {"peak": 3.0, "at_hz": 7.0, "phase_deg": 90.0}
    peak = Peak("tip", "acceleration", "x", "m/s^2", 3.0, figures, np.nan)
    values = np.array([[1.0 + 0j], [3j]])
    return Response(
        kind="harmonic",
        axis=np.array([1.0, 7.0]),
        names=(peak.channel,),
        units=("m/s^2",),
        values=values,
        peaks=(peak,),
        inputs=("base.x",),
        input_values=np.ones((2, 1)),
    )
