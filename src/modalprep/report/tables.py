"""Tables for the terminal: the mode selection and a summary of the body."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.padding import Padding
from rich.table import Column, Table
from rich.text import Text

from modalprep.body.flexible_body import FlexibleBody
from modalprep.multibody.results.envelopes import Envelope
from modalprep.reduction.table import ATTACHMENT, CONSTRAINT, DIRECTIONS, FIXED, FREE, PROJECTED, TRUNCATION, ModeTable
from modalprep.report.numbers import number, quantity
from modalprep.report.terminal import plain_table, print_rows, print_table, right_aligned

WIDE = 105  # columns; with fewer, each row names its largest directions only
LISTED = 40  # maximum number of listed frequencies and stress points
LEGEND = ": effective mass in % of the body"
SUM = "; sum: of the kept rows so far, in the row's largest direction"
HELD = (
    "Fixed-interface modes have these frequencies with every fixed interface held; the body, which its root alone "
    "holds, has others."
)
PREFIXABLE = ("m", "Pa", "N", "J", "Hz", "W", "rad")  # begin the units that take a prefix
NOUNS = {
    FIXED: "modes with fixed interfaces",
    FREE: "modes of the floating body",
    CONSTRAINT: "constraint modes",
    ATTACHMENT: "attachment modes",
    TRUNCATION: "truncation vectors",
    PROJECTED: "projected directions",
}


def mode_table(table: ModeTable, console: Console) -> None:
    """Print one row per candidate: kind, frequency, effective mass in % of the body, kept, reason.

    A console of `WIDE` columns shows all six directions and the running sum over the kept rows in the
    row's largest direction; a narrower one the largest mass and the largest inertia of each row.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> mode_table(uniform_beam(modes=1).modes, Console(width=120, color_system=None))  # doctest: +ELLIPSIS
    Mode selection...
    1 of 1 candidate vectors kept: 1 of 1 modes with fixed interfaces.
    """
    wide = console.width >= WIDE
    rich = _empty_table(wide)
    for k in range(len(table.kind)):
        cells = [str(k + 1), table.kind[k], hertz(table.frequency[k]), *_mass_cells(table, k, wide)]
        mark = Text("yes", "bold green") if table.kept[k] else Text("no")
        rich.add_row(*map(Text, cells), mark, Text(table.reason[k]), style="" if table.kept[k] else "dim")
    sums = [percent(value) for value in kept_fraction(table)]
    if wide:
        rich.add_section()
        rich.add_row("", "sum of kept", "", *sums, "", "", "", style="bold")
    console.print(Text.assemble(("Mode selection", "bold"), (LEGEND + SUM * wide, "dim")))
    print_table(rich, console)
    if not wide:
        shares = "   ".join(f"{name} {value}" for name, value in zip(DIRECTIONS, sums, strict=True))
        console.print(Text(f"sum of kept, %:  {shares}", "bold"))
    console.print(Text(_kept_counts(table)))
    if is_held_elsewhere(table):
        console.print(Text(HELD, "dim"))


def is_held_elsewhere(table: ModeTable) -> bool:
    """Whether the frequencies of the table differ from those of the body: further interfaces are fixed in its modes.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> is_held_elsewhere(uniform_beam(modes=1).modes)
    False
    """
    return {FIXED, CONSTRAINT} <= set(table.kind)


def _empty_table(wide: bool) -> Table:
    masses = (*DIRECTIONS, "sum") if wide else ("mass", "inertia")
    kind, kept = (Column(head, no_wrap=True) for head in ("kind", "kept"))
    return plain_table(*right_aligned(""), kind, *right_aligned("Hz", *masses), kept, "reason")


def _mass_cells(table: ModeTable, k: int, wide: bool) -> list[str]:
    """Return the effective masses of row k with the running sum, or its largest mass and inertia."""
    share = table.fraction[k]
    if np.isnan(share).all():
        return [""] * (7 if wide else 2)
    if not wide:
        return [_largest(share, slice(0, 3)), _largest(share, slice(3, 6))]
    top = int(np.nanargmax(share))
    running = np.nansum(table.fraction[: k + 1][table.kept[: k + 1], top])
    return [*map(percent, share), percent(running) if table.kept[k] else ""]


def _largest(share: np.ndarray, part: slice) -> str:
    top = int(np.nanargmax(share[part]))
    text = percent(share[part][top])
    return f"{text} {DIRECTIONS[part][top]}" if text != "." else text


def _kept_counts(table: ModeTable) -> str:
    """Print how many candidates of each kind were kept."""
    kind = np.array(table.kind)
    parts = [
        f"{(table.kept & (kind == name)).sum()} of {(kind == name).sum()} {noun}"
        for name, noun in NOUNS.items()
        if (kind == name).any()
    ]
    return f"{table.kept.sum()} of {len(kind)} candidate vectors kept: {', '.join(parts) or 'there are none'}."


def kept_fraction(table: ModeTable) -> np.ndarray:
    """Return the total effective mass (6,) of the kept rows, as a fraction of the body's mass and inertia.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> print(kept_fraction(uniform_beam(modes=4).modes)[1].round(2))
    0.8
    """
    return np.nansum(table.fraction[table.kept], axis=0)


def body_summary(body: FlexibleBody, console: Console) -> None:
    """Print mass, centre, inertia, interfaces and frequencies of a body.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body_summary(uniform_beam(modes=1), Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    Body beam
      mass  12 kg...
    """
    grid = Table.grid(padding=(0, 2))
    grid.add_column(style="dim", no_wrap=True)
    grid.add_column(overflow="fold")
    for name, value in summary_rows(body):
        grid.add_row(Text(name), Text(value))
    console.print(Text.assemble("Body ", (body.name, "bold")))
    console.print(Padding(grid, (0, 0, 1, 2), expand=False))


def summary_rows(body: FlexibleBody) -> list[tuple[str, str]]:
    """Return (name, text) rows that describe a body in its frame B.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> summary_rows(uniform_beam(modes=1))[0]
    ('mass', '12 kg')
    """
    rows = [
        ("mass", f"{body.m:.6g} kg"),
        ("centre of mass", f"{_vector(body.s0 / body.m)} m"),
        *_inertia_rows(body.E0),
    ]
    for k, (name, place) in enumerate(zip(body.interface_name, body.interface_position, strict=True)):
        rows.append((f"interface {name}" + (" (root)" if k == 0 else ""), f"{_vector(place)} m"))
    if body.n:
        listed = ", ".join(hertz(f) for f in body.frequency[:LISTED])
        more = f", ... {hertz(body.frequency[-1])}" if body.n > LISTED else ""
        rows.append((f"{body.n} modes, root clamped", f"{listed}{more} Hz"))
    rows.append(("geometric stiffness", "stored" if body.has_geometric_stiffness else "none"))
    if body.T is not None:
        rows.append(("second order of modal mass", "stored"))
    if body.recovery:
        rows.append(("recovery of", ", ".join(f"{key} ({block.kind})" for key, block in body.recovery.items())))
    if body.stress:
        names = list(body.stress)
        rows.append(
            ("stress at", ", ".join(names[:LISTED]) + f" and {len(names) - LISTED} more" * (len(names) > LISTED))
        )
    return rows


def _inertia_rows(E0: np.ndarray) -> list[tuple[str, str]]:
    """Moments about the root, and products where the axes are not principal: J = tr(E0) - E0."""
    moments = np.trace(E0) - np.diag(E0)
    products = -E0[[0, 0, 1], [1, 2, 2]]
    rows = [("inertia about root, xx yy zz", f"{_vector(moments)} kg m²")]
    if np.abs(products).max() > 1e-6 * moments.max():
        rows.append(("products, xy xz yz", f"{_vector(products)} kg m²"))
    return rows


def _vector(v: np.ndarray) -> str:
    """Write to five digits of the largest component; smaller ones are mesh noise."""
    scale = np.abs(v).max(initial=0.0)
    return "(" + ", ".join(number(0.0 if abs(x) < 5e-6 * scale else x, 5) for x in v) + ")"


def percent(value: float) -> str:
    """Write a fraction in %; a dot if negligible, an empty text for NaN.

    Examples
    --------
    >>> percent(0.613), percent(1e-6), percent(float("nan"))
    ('61.3', '.', '')
    """
    return "" if np.isnan(value) else f"{100 * value:.1f}" if value >= 5e-4 else "."


def hertz(value: float) -> str:
    """Write a frequency to five digits, without an exponent up to 10 MHz; an empty text for NaN.

    Examples
    --------
    >>> hertz(0.60440), hertz(231403.2)
    ('0.6044', '231403')
    """
    return "" if np.isnan(value) else f"{value:.0f}" if 1e4 <= value < 1e7 else f"{value:.5g}"


def margin_of_safety(value: float) -> str:
    """Write a margin with its sign; those above 1000 only as such, an empty text for NaN.

    Examples
    --------
    >>> margin_of_safety(-0.25), margin_of_safety(8e18)
    ('-0.25', '> 1000')
    """
    return "" if np.isnan(value) else "> 1000" if value > 1000 else f"{value:+.3g}"


ENVELOPE = ("recovery", "component", "largest", "smallest", "at", "time", "margin")  # columns of `envelope_rows`


def envelope_rows(envelopes: Sequence[Envelope]) -> list[tuple[str, ...]]:
    """Return `ENVELOPE` of each recovered component over a run: extremes, where and when the larger is, the margin.

    Examples
    --------
    >>> strut = Envelope(body="a", name="strut", places=("1",), components=("N",), units=("N",),
    ...     highest=np.array([[3.0]]), lowest=np.array([[-4.0]]), highest_time=np.ones((1, 1)),
    ...     lowest_time=np.zeros((1, 1)), allowable=5.0)
    >>> envelope_rows([strut])
    [('a.strut', 'N', '3 N', '-4 N', '1', '0 s', '+0.25')]
    """
    found = []
    for row in (row for envelope in envelopes for row in envelope.worst()):
        highest = float(row["highest"])
        lowest = float(row["lowest"])
        time = float(row["at_s"] if highest >= -lowest else row["lowest_at_s"])
        extremes = (quantity(value, str(row["unit"])) for value in (highest, lowest))
        name = f"{row['body']}.{row['recovery']}"
        margin = margin_of_safety(float(row["margin"]))
        found.append((name, str(row["component"]), *extremes, str(row["place"]), f"{number(time)} s", margin))
    return found


def envelope_table(envelopes: Sequence[Envelope], console: Console) -> None:
    """Print `envelope_rows`; negative margins are red."""
    console.print(Text("Recovered over the run", "bold"))
    rows = envelope_rows(envelopes)
    print_rows(ENVELOPE, rows, console, [row[-1].startswith("-") for row in rows], ("recovery", "component", "at"))


def shapes_table(generators: Iterable[Any], console: Console) -> None:
    """Print the parametric shapes of `modalprep mesh`: parameters with units and defaults, and the groups they make."""
    table = plain_table("shape", "parameter", "default", "meaning")
    for g in generators:
        table.add_row(Text(g.name), "", "", Text(f"{g.meaning}; groups {', '.join(g.groups)}"), style="bold")
        for p in g.parameters.values():
            choices = f" ({', '.join(map(str, p.choices))})" if p.choices else ""
            table.add_row(*map(Text, ("", p.name, f"{p.default} {p.unit}".strip(), p.meaning + choices)))
        table.add_section()
    print_table(table, console)


def prefixed(unit: str, largest: float) -> tuple[float, str]:
    """Return the factor and the name of the SI unit with the prefix that suits a value.

    Examples
    --------
    >>> prefixed("Pa", 2.5e6), prefixed("m", 0.0), prefixed("kg", 1e-3), prefixed("m/s^2", 0.02)
    ((1e-06, 'MPa'), (1.0, 'm'), (1.0, 'kg'), (1000.0, 'mm/s^2'))
    """
    if not largest > 0 or not unit.startswith(PREFIXABLE):
        return 1.0, unit
    power = min(3, max(-3, math.floor(math.log10(largest) / 3 + 1e-9)))
    return 10.0 ** (-3 * power), f"{('n', 'u', 'm', '', 'k', 'M', 'G')[power + 3]}{unit}"
