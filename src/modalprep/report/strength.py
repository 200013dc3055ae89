"""Notches, shock spectra and fatigue: tables and plots."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.multibody.results.result import component_names
from modalprep.report.charts.figures import Axes, Figure, named, save_figure
from modalprep.report.charts.plots import CURVES, GREY, LINES, add_head, curve_style, label_beyond, plain_axes
from modalprep.report.numbers import number, quantity, shown_unit
from modalprep.report.responses import plain_decades, squared
from modalprep.report.tables import hertz
from modalprep.report.terminal import print_rows
from modalprep.response.fatigue import Fatigue
from modalprep.response.limits import NotchedInput
from modalprep.response.power import PowerSpectrum
from modalprep.response.shock import ShockSpectrum

NOTCH = ("from", "to", "deepest at", "depth", "ruled by")  # columns of `notch_rows`
FATIGUE = ("channel", "cycles", "largest amplitude", "damage", "life")
DRAWN, FLOOR = 6, 1e-3  # curves in a panel, and their lowest value beside the largest
HOUR = 3600.0
LONGEST, SLIGHTEST = 1e6, 1e-6  # h and damage, beyond which a number says nothing more


def notch_rows(cut: NotchedInput) -> list[tuple[str, ...]]:
    """Return the notches as texts with units.

    Examples
    --------
    >>> notch_rows(_example())
    [('20 Hz', '20 Hz', '20 Hz', '12.0 dB', 'base.force.z (limit)')]
    """
    return [
        (
            *(f"{hertz(x)} Hz" for x in (n.start, n.end, n.frequency)),
            f"{n.depth:.1f} dB{', the most allowed' * n.limited}",
            n.reason,
        )
        for n in cut.notches
    ]


def notch_table(name: str, cut: NotchedInput, console: Console) -> None:
    """Print `notch_rows`, or that there are none.

    Examples
    --------
    >>> notch_table("sine", _example(), Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Notches of response sine
    ...
    """
    if not cut.notches:
        console.print(Text(f"Response {name} needs no notch: all limits are kept."))
        return
    console.print(Text.assemble("Notches of response ", (name, "bold")))
    print_rows(NOTCH, notch_rows(cut), console, [False] * len(cut.notches), ("from", "ruled by"))


def fatigue_rows(fatigues: Mapping[str, Fatigue]) -> list[tuple[str, ...]]:
    """Return cycles, largest amplitude, damage and life of each channel as texts.

    Examples
    --------
    >>> from modalprep.response import SNCurve, rainflow_damage
    >>> curve = SNCurve(stress=2.0, cycles=100.0, slope=3.0)
    >>> fatigue_rows({"a": rainflow_damage(np.arange(3.0), np.array([2.0, -2.0, 2.0]), curve)})
    [('a', '1', '2', '0.01', '0.0556 h')]
    """
    return [
        (name, number(x.cycles), quantity(x.largest, x.unit), _damage(x.damage), _hours(x.life))
        for name, x in fatigues.items()
    ]


def _damage(damage: float) -> str:
    return number(damage, 3) if damage == 0 or damage >= SLIGHTEST else "below 10⁻⁶"


def _hours(life: float) -> str:
    if not np.isfinite(life):
        return "no damage"
    return f"{number(life / HOUR, 3)} h" if life < LONGEST * HOUR else "over 10⁶ h"


def fatigue_table(name: str, fatigues: Mapping[str, Fatigue], console: Console) -> None:
    """Print `fatigue_rows`; what fails is red.

    Examples
    --------
    >>> fatigue_table("weld", {}, Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Fatigue weld
    ...
    """
    console.print(Text.assemble("Fatigue ", (name, "bold")))
    print_rows(FATIGUE, fatigue_rows(fatigues), console, [x.damage >= 1 for x in fatigues.values()], ("channel",))


def notch_plot(cut: NotchedInput, path: str | Path, unit: str = "m/s²") -> Path:
    """Draw the input before and after notching, and the responses over their limits.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> notch_plot(_example(), Path(tempfile.mkdtemp()) / "n.png").name
    'n.png'
    """
    figure = Figure(figsize=(9.0, 6.4), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    factor, unit = shown_unit(unit.replace("²", "^2"))
    factor = factor**2 if cut.density else factor
    unit = unit.replace("^2", "²")
    above.plot(cut.frequency, factor * cut.given, color=GREY, linewidth=1.4, linestyle=LINES[1], label="given input")
    above.plot(cut.frequency, factor * cut.notched, color=CURVES[0], linewidth=1.8, label="notched input")
    above.set_ylabel(f"input ({squared(unit)})" if cut.density else f"input ({unit})")
    before, after = _shares(cut)
    for k, name in enumerate(sorted(before, key=lambda x: -before[x].max())[:DRAWN]):
        colour = CURVES[k % len(CURVES)]
        below.plot(cut.frequency, before[name], color=colour, linewidth=1.0, linestyle=LINES[2])
        below.plot(cut.frequency, after[name], color=colour, linewidth=1.8, label=named(name))
    below.axhline(1.0, color=GREY, linewidth=1.0)
    label_beyond(below, 1.0, "limit")
    below.set_ylabel("amplitude / limit (dotted: not notched)")
    below.set_xlabel("frequency (Hz)")
    largest = max((float(x.max()) for x in before.values()), default=1.0)
    below.set_ylim(FLOOR * max(largest, 1.0), 2 * max(largest, 1.0))
    for axes in (above, below):
        _logarithmic(axes, cut.frequency)
        plain_decades(axes.yaxis)
    return save_figure(figure, path)


def _shares(cut: NotchedInput) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Return the amplitudes over their limits before and after notching."""
    power = 0.5 if cut.density else 1.0
    share = np.divide(cut.notched, cut.given, out=np.ones_like(cut.given), where=cut.given > 0) ** power
    after = {name: (x / cut.limits[name]) ** power for name, x in cut.responses.items()}
    return {name: x / np.where(share > 0, share, 1.0) for name, x in after.items()}, after


def shock_plot(spectra: Mapping[str, ShockSpectrum], units: Mapping[str, str], path: str | Path) -> Path:
    """Draw the maximax spectra of several channels; `units` are those of the spectra.

    Returns
    -------
    Path
        The file.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.response import shock_spectrum
    >>> one = shock_spectrum(np.arange(100) / 1e3, np.sin(np.arange(100) / 9), np.array([5.0, 50.0]))
    >>> shock_plot({"tip": one}, {"tip": "m/s²"}, Path(tempfile.mkdtemp()) / "s.png").name
    's.png'
    """
    figure = Figure(figsize=(9.0, 4.4), layout="constrained")
    draw_shock(figure.add_subplot(), spectra, units)
    return save_figure(figure, path)


def draw_shock(axes: Axes, spectra: Mapping[str, ShockSpectrum], units: Mapping[str, str]) -> None:
    """Draw the chart of `shock_plot` into axes."""
    for k, (name, one) in enumerate(spectra.items()):
        factor, _ = shown_unit(units[name].replace("²", "^2"))
        axes.plot(one.frequency, factor * one.maximax, linewidth=1.8, label=named(name), **curve_style(k))
    first = next(iter(spectra.values()))
    axes.set_xlabel("frequency of the oscillator (Hz)")
    unit = ", ".join(dict.fromkeys(shown_unit(unit.replace("²", "^2"))[1] for unit in units.values()))
    axes.set_ylabel(f"{first.kind.replace('_', ' ')}, Q = {first.Q:g}" + (f" ({unit})" if unit else ""))
    _logarithmic(axes, first.frequency, "" if len(spectra) > 1 else next(iter(spectra)))


def split_shock(spectrum: ShockSpectrum, label: str = "") -> dict[str, ShockSpectrum]:
    """Return the spectrum of each column of a history, by the label and the component.

    Examples
    --------
    >>> three = ShockSpectrum(frequency=np.ones(1), positive=np.ones((1, 3)), negative=np.ones((1, 3)),
    ...                       kind="pseudo_velocity", Q=10.0)
    >>> list(split_shock(three, "tip"))
    ['tip.x', 'tip.y', 'tip.z']
    """
    if spectrum.positive.ndim == 1:
        return {label: spectrum}
    both = zip(spectrum.positive.T, spectrum.negative.T, strict=True)
    names = component_names(label, spectrum.positive.shape[1])
    found = {name: spectrum.with_(positive=up, negative=down) for name, (up, down) in zip(names, both, strict=True)}
    return {f"{label}.{name}".removeprefix("."): one for name, one in found.items()}


def draw_power(axes: Axes, spectrum: PowerSpectrum, label: str = "", unit: str = "") -> None:
    """Draw a power spectral density; `unit` is that of the history."""
    columns = spectrum.density.reshape(len(spectrum.frequency), -1)
    names = [label] if spectrum.density.ndim == 1 else component_names(label, columns.shape[1])
    factor, shown = shown_unit(unit.replace("²", "^2"))
    for k, (name, density) in enumerate(zip(names, columns.T, strict=True)):
        axes.plot(spectrum.frequency[1:], factor**2 * density[1:], linewidth=1.8, label=named(name), **curve_style(k))
    axes.set_xlabel("frequency (Hz)")
    axes.set_ylabel(f"power spectral density ({squared(shown.replace('^2', '²')) if unit else 'unit²/Hz'})")
    _logarithmic(axes, spectrum.frequency[1:], label)


def _logarithmic(axes: Axes, frequency: np.ndarray, title: str = "") -> None:
    axes.set_xscale("log")
    axes.set_yscale("log")
    plain_decades(axes.xaxis)
    axes.set_xlim(frequency[0], frequency[-1])
    add_head(axes, title)
    plain_axes(axes, grid="both")


def _example() -> NotchedInput:
    from modalprep.response.limits import notch

    one = np.ones(3)
    transfer = np.array([100.0, 2000.0, 50.0])
    name = "base.force.z (limit)"
    return notch(np.array([10.0, 20.0, 30.0]), one, {name: transfer}, {name: 500.0}, density=False)
