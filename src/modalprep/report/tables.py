"""Tables for the terminal: the mode selection and a summary of the body."""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from modalprep.body.flexible_body import FlexibleBody
from modalprep.reduction.table import DIRECTIONS, ModeTable

NARROW = 100  # columns; below, the rotations are dropped


def mode_table(table: ModeTable, console: Console) -> None:
    """Print one row per candidate: kind, frequency, effective masses in % of the body, kept, reason.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> mode_table(uniform_beam(modes=1).modes, Console(width=120, color_system=None))  # doctest: +ELLIPSIS
                                                  Mode selection...
    """
    shown = 3 if console.width < NARROW else 6
    rich = Table(title="Mode selection: effective mass in % of the body", header_style="bold", pad_edge=False)
    rich.add_column("", justify="right")
    rich.add_column("kind")
    rich.add_column("Hz", justify="right")
    for direction in DIRECTIONS[:shown]:
        rich.add_column(direction, justify="right")
    rich.add_column("kept")
    rich.add_column("reason", overflow="fold")
    for k, kind in enumerate(table.kind):
        masses = [percent(value) for value in table.fraction[k, :shown]]
        mark = "yes" if table.kept[k] else "no"
        rich.add_row(str(k + 1), kind, hertz(table.frequency[k]), *masses, mark, table.reason[k],
                     style=None if table.kept[k] else "dim")  # fmt: skip
    rich.add_section()
    sums = [percent(value) for value in carried(table)[:shown]]
    rich.add_row("", "sum of kept", "", *sums, f"{table.kept.sum()}/{len(table.kept)}", "of candidates")
    console.print(rich)


def carried(table: ModeTable) -> np.ndarray:
    """Return the share (6,) of the body's mass and inertia that the kept rows carry together.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> print(carried(uniform_beam(modes=4).modes)[1].round(2))
    0.8
    """
    return np.nansum(table.fraction[table.kept], axis=0)


def body_summary(body: FlexibleBody, console: Console) -> None:
    """Print mass, centre, inertia, interfaces and frequencies of a body."""
    rich = Table(title=f"Body {body.name!r}", show_header=False, title_justify="left", pad_edge=False)
    for name, value in summary_rows(body):
        rich.add_row(name, value)
    console.print(rich)


def summary_rows(body: FlexibleBody) -> list[tuple[str, str]]:
    """Return (name, text) rows that describe a body.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> summary_rows(uniform_beam(modes=1))[0]
    ('mass', '12 kg')
    """
    J = np.trace(body.E0) - np.diag(body.E0)
    rows = [
        ("mass", f"{body.m:.6g} kg"),
        ("centre of mass", f"{_vector(body.s0 / body.m)} m"),
        ("moments of inertia about the root", f"{_vector(J)} kg m^2"),
    ]
    for k, (name, place) in enumerate(zip(body.interface_name, body.interface_position, strict=True)):
        rows.append((f"interface {name}" + (" (root)" if k == 0 else ""), f"{_vector(place)} m"))
    if body.n:
        first = ", ".join(f"{f:.4g}" for f in body.frequency[:6])
        more = f", ... {body.frequency[-1]:.4g}" if body.n > 6 else ""
        rows.append((f"{body.n} modal coordinates, root clamped", f"{first}{more} Hz"))
    rows.append(("geometric stiffness", "stored" if body.has_geometric_stiffness else "none"))
    return rows


def _vector(v: np.ndarray) -> str:
    scale = np.abs(v).max(initial=0.0)
    return "(" + ", ".join(f"{0.0 if abs(x) < 1e-9 * scale else x:.5g}" for x in v) + ")"


def percent(value: float) -> str:
    """Write a fraction in %; a dot for almost nothing, nothing for NaN.

    Examples
    --------
    >>> percent(0.613), percent(1e-6), percent(float("nan"))
    ('61.3', '.', '')
    """
    return "" if np.isnan(value) else f"{100 * value:.1f}" if value >= 5e-4 else "."


def hertz(value: float) -> str:
    """Write a frequency; nothing for NaN.

    Examples
    --------
    >>> hertz(0.60440)
    '0.6044'
    """
    return "" if np.isnan(value) else f"{value:.5g}"
