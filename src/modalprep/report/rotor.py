"""Campbell diagrams and responses to unbalance: tables for the terminal, charts, CSV files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from modalprep.atomic import write_columns, write_table
from modalprep.multibody.rotors.campbell import Campbell
from modalprep.multibody.rotors.unbalance import UnbalanceResponse
from modalprep.multibody.rotors.whirl import kind_of
from modalprep.report.charts.figures import Axes, Figure, named, save_figure
from modalprep.report.charts.plots import CURVES, GREY, INK, add_head, plain_axes
from modalprep.report.numbers import number
from modalprep.report.tables import hertz
from modalprep.report.terminal import plain_table, print_table, right_aligned

RPM = 30 / np.pi  # per rad/s
STYLES = {  # of the motion in most of the diagram
    "forward": {"color": CURVES[0], "linestyle": "-"},
    "backward": {"color": CURVES[1], "linestyle": (0, (5, 2))},
    "planar": {"color": CURVES[2], "linestyle": (0, (5, 2, 1, 2))},
    "axial or torsional": {"color": GREY, "linestyle": (0, (1, 1.5))},
}


def campbell_table(found: Campbell, name: str, console: Console) -> None:
    """Print the critical speeds.

    Examples
    --------
    >>> from modalprep.multibody.rotors.campbell import CriticalSpeed
    >>> none = np.zeros((1, 0))
    >>> critical = CriticalSpeed(speed=100 * np.pi, order=1.0, mode=0, kind="forward", logarithmic_decrement=0.1)
    >>> found = Campbell(speed=np.zeros(1), eigenvalue=none, whirl=none, across=none, certainty=none,
    ...                  critical=(critical,), at=())
    >>> campbell_table(found, "shaft", Console(width=80, color_system=None))
    Critical speeds of rotor shaft
     rpm  order  mode  Hz  whirl    log decrement
    ─────────────────────────────────────────────
    3000      1     1  50  forward            0.1
    """
    console.print(Text.assemble((f"Critical speeds of rotor {name}", "bold")))
    if not found.critical:
        console.print(Text("  none within the speeds of the diagram"))
        return
    table = plain_table(*right_aligned("rpm", "order", "mode", "Hz"), "whirl", *right_aligned("log decrement"))
    for each in found.critical:
        numbers = (
            number(each.rpm, 6),
            f"{each.order:g}",
            str(each.mode + 1),
            hertz(each.order * each.speed / 2 / np.pi),
        )
        table.add_row(*numbers, each.kind, _decrement(each.logarithmic_decrement))
    print_table(table, console)


def _decrement(value: float) -> str:
    return number(value) if abs(value) > 1e-7 else "."


def campbell_summary(found: Campbell) -> dict[str, Any]:
    """Return the critical speeds and the limit of stability, for JSON."""
    critical = [
        {
            "rpm": each.rpm,
            "order": each.order,
            "mode": each.mode + 1,
            "whirl": each.kind,
            "logarithmic_decrement": each.logarithmic_decrement,
        }
        for each in found.critical
    ]
    unstable = found.first_unstable
    return {"critical_speeds": critical, "first_unstable_rpm": None if unstable is None else unstable * RPM}


def draw_campbell(axes: Axes, found: Campbell) -> None:
    """Draw the frequencies over the speed into axes, with the lines of the orders that have critical speeds."""
    rpm = found.speed * RPM
    told: set[str] = set()
    for k in range(found.eigenvalue.shape[1]):
        kind = _mostly(found, k)
        label = None if kind in told else kind
        axes.plot(rpm, found.frequency[:, k], linewidth=1.8, label=label, **STYLES[kind])
        told.add(kind)
    top = np.nanmax(found.frequency, initial=0.0) * 1.05 or 1.0
    for order in sorted({1.0, *(each.order for each in found.critical)}):
        axes.plot(rpm, order * rpm / 60, color=INK, linewidth=0.8, zorder=1)
        end = min(rpm[-1], 60 * top / order)
        axes.annotate(f"{order:g} x speed", (end, order * end / 60), color=INK, fontsize=9, ha="right", va="bottom")
    spots = [(each.rpm, each.order * each.speed / (2 * np.pi)) for each in found.critical]
    if spots:
        axes.plot(*np.transpose(spots), "o", color=INK, markerfacecolor="white", label="critical speeds", zorder=4)
    axes.set(xlabel="speed (rpm)", ylabel="frequency (Hz)", xlim=(rpm[0], rpm[-1] or 1.0), ylim=(0.0, top))
    add_head(axes, "Campbell diagram")
    plain_axes(axes, grid="both")


def _mostly(found: Campbell, mode: int) -> str:
    """Return the kind of motion of a mode at most speeds above zero."""
    kinds = []
    for whirl, across, speed in zip(found.whirl[:, mode], found.across[:, mode], found.speed, strict=True):
        if np.isfinite(whirl) and (speed or len(found.speed) == 1):
            kinds.append(kind_of(whirl, across))
    return max(sorted(set(kinds)), key=kinds.count)


def campbell_plot(found: Campbell, path: str | Path) -> Path:
    """Draw the chart of `draw_campbell`, and the logarithmic decrements below it.

    Returns
    -------
    Path
        The file.
    """
    figure = Figure(figsize=(9.0, 7.0), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    draw_campbell(upper, found)
    upper.set_xlabel("")
    for k in range(found.eigenvalue.shape[1]):
        lower.plot(found.speed * RPM, found.logarithmic_decrement[:, k], linewidth=1.5, **STYLES[_mostly(found, k)])
    lower.axhline(0.0, color=INK, linewidth=0.8)
    lower.set(xlabel="speed (rpm)", ylabel="log decrement")
    plain_axes(lower, grid="both")
    return save_figure(figure, path)


def write_campbell(found: Campbell, path: str | Path) -> Path:
    """Write a row for each speed: of each mode the frequency, the logarithmic decrement and the whirl."""
    parts = ("Hz", "log decrement", "whirl")
    count = found.eigenvalue.shape[1]
    header = ["rpm", *(f"mode {k + 1} {part}" for k in range(count) for part in parts)]
    values = np.stack([found.frequency, found.logarithmic_decrement, found.whirl], axis=2).reshape(len(found.speed), -1)
    return write_table(header, np.column_stack([found.speed * RPM, values]).tolist(), path)


def peaks_table(found: UnbalanceResponse, name: str, console: Console) -> None:
    """Print the peaks of the response of each interface to unbalance."""
    console.print(Text.assemble((f"Response of rotor {name} to unbalance", "bold")))
    rows = [(end, peak) for end in found.motion for peak in found.peaks(end)]
    if not rows:
        console.print(Text("  no peak within the speeds"))
        return
    table = plain_table("interface", *right_aligned("rpm", "amplitude m", "amplification"))
    for end, peak in rows:
        table.add_row(Text(end), number(peak.rpm, 5), number(peak.amplitude), number(peak.amplification))
    print_table(table, console)


def unbalance_summary(found: UnbalanceResponse) -> dict[str, list[dict[str, float | None]]]:
    """Return the peaks of each interface, for JSON."""
    return {
        end: [
            {
                "rpm": peak.rpm,
                "amplitude_m": peak.amplitude,
                "amplification": peak.amplification if np.isfinite(peak.amplification) else None,
            }
            for peak in found.peaks(end)
        ]
        for end in found.motion
    }


def unbalance_plot(found: UnbalanceResponse, path: str | Path) -> Path:
    """Draw the semi-axes of the orbits of all interfaces over the speed, and the phase of their forward circle.

    Returns
    -------
    Path
        The file.
    """
    figure = Figure(figsize=(9.0, 6.2), layout="constrained")
    upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=(2, 1))
    for k, end in enumerate(found.motion):
        style = {"color": CURVES[k % len(CURVES)], "linewidth": 1.8}
        upper.plot(found.speed * RPM, found.orbit(end)[0], label=named(end), **style)
        lower.plot(found.speed * RPM, np.degrees(found.phase(end)), **style)
    upper.set(ylabel="larger semi-axis of the orbit (m)", ylim=(0.0, None))
    lower.set(xlabel="speed (rpm)", ylabel="phase (deg)", yticks=range(-180, 181, 90))
    add_head(upper, "Response to unbalance")
    for axes in (upper, lower):
        plain_axes(axes, grid="both")
    return save_figure(figure, path)


def write_unbalance(found: UnbalanceResponse, path: str | Path) -> Path:
    """Write a row for each speed: semi-axes (m), the second negative against the spin, and phase (deg) by interface."""
    columns = {"rpm": found.speed * RPM}
    for end in found.motion:
        large, small = found.orbit(end)
        columns |= {f"{end} major m": large, f"{end} minor m": small, f"{end} phase deg": np.degrees(found.phase(end))}
    return write_columns(columns, path)
