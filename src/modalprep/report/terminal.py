"""Tables and sentences in the width of a terminal, their words whole."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from rich import box
from rich.console import Console, RenderableType
from rich.measure import Measurement
from rich.padding import Padding
from rich.table import Column, Table
from rich.text import Text

from modalprep.verdicts.verdict import FAIL, PASS, WARNED, Verdict

VERDICT_STYLE = {PASS: "bold green", WARNED: "bold dark_orange", FAIL: "bold red"}
GAP = 2  # spaces between columns
INSET = 2  # of the further lines of a row that does not fit
SHORT = 30  # letters of a cell that shares its line with others


def plain_table(*columns: str | Column) -> Table:
    """Return a table without frame, its head bold over a line."""
    return Table(
        *columns, box=box.SIMPLE_HEAD, header_style="bold", pad_edge=False, show_edge=False, padding=(0, 1, 0, 0)
    )


def right_aligned(*heads: str | Text, no_wrap: bool = True) -> list[Column]:
    """Return columns of numbers."""
    return [Column(head, justify="right", no_wrap=no_wrap) for head in heads]


def print_table(table: Table, console: Console, *, indent: int = 0) -> None:
    """Print a `plain_table`; where its words are wider than the console, print each row as cells behind their heads.

    Examples
    --------
    >>> table = plain_table("kind", "reason")
    >>> table.add_row("truncation", "static response")
    >>> print_table(table, Console(width=20, color_system=None))
    kind        reason
    ────────────────────
    truncation  static
                response
    >>> print_table(table, Console(width=18, color_system=None))
    kind: truncation
      reason: static
      response
    """
    widths = fitted([_widths(column, console) for column in table.columns], console.width - indent)
    if widths is None:
        _print_lines(table, console)
        return
    for column, width in zip(table.columns, widths, strict=True):
        column.width, column.ratio, column.overflow = width, None, "fold"
    console.print(Padding(table, (0, 0, 0, indent), expand=False))


def print_rows(
    heads: Sequence[str], rows: Sequence[Sequence[str]], console: Console, bad: Sequence[bool], texts: Collection[str]
) -> None:
    """Print rows of texts, bad ones in red; all columns but those of `texts` have numbers.

    Examples
    --------
    >>> print_rows(["channel", "damage"], [["a", "2"]], Console(width=20, color_system=None), [True], ["channel"])
      channel  damage
      ───────────────
      a             2
    <BLANKLINE>
    """
    table = plain_table(*(Column(head, justify="left" if head in texts else "right") for head in heads))
    for row, fails in zip(rows, bad, strict=True):
        table.add_row(*row, style="red" if fails else None)
    print_table(table, console, indent=2)
    console.print()


def fitted(ranges: Sequence[tuple[int, int]], width: int) -> list[int] | None:
    """Return the widths of columns between the least and the most of each, or None where they do not fit.

    Examples
    --------
    >>> fitted([(2, 4), (3, 30), (5, 50)], 40), fitted([(2, 4), (3, 30)], 6)
    ([4, 16, 16], None)
    """
    room = width - GAP * (len(ranges) - 1)
    found = [least for least, _ in ranges]
    while (spare := room - sum(found)) > 0:
        open_ones = [k for k, (_, most) in enumerate(ranges) if found[k] < most]
        if not open_ones:
            break
        narrowest = min(open_ones, key=lambda k: found[k])
        above = [found[k] for k in open_ones if found[k] > found[narrowest]]
        step = min([ranges[narrowest][1], *above]) - found[narrowest]
        found[narrowest] += max(1, min(step, spare // len(open_ones)))
    return found if spare >= 0 else None


def _widths(column: Column, console: Console) -> tuple[int, int]:
    """Return the least width of a column, that of its longest word or of a cell that must not wrap, and its most."""
    sizes = [Measurement.get(console, console.options, cell) for cell in (column.header, *column.cells)]
    most = max(size.maximum for size in sizes)
    return (most if column.no_wrap else max(size.minimum for size in sizes)), most


def _print_lines(table: Table, console: Console) -> None:
    heads = [str(column.header).strip() for column in table.columns]
    for cells, row in zip(zip(*(column.cells for column in table.columns), strict=True), table.rows, strict=True):
        named = [_named(head, cell, str(row.style or "")) for head, cell in zip(heads, cells, strict=True)]
        short = [text for text in named if text is not None and len(text) <= SHORT]
        long = [text for text in named if text is not None and len(text) > SHORT]
        lines = [Text("  ").join(short), *long] if short else long
        for number, text in enumerate(lines):
            _print_hanging(text, console, INSET * min(number, 1))


def _named(head: str, cell: RenderableType, style: str) -> Text | None:
    """Return a cell behind its head, or None of an empty one."""
    text = cell if isinstance(cell, Text) else Text(str(cell))
    if not text.plain.strip():
        return None
    return Text.assemble(f"{head}: " if head else "", text, style=style)


def _print_hanging(text: Text, console: Console, indent: int) -> None:
    lines = text.wrap(console, console.width - indent - INSET, overflow="fold")
    for number, line in enumerate(lines):
        console.print(Padding(line, (0, 0, 0, indent + INSET * min(number, 1)), expand=False))


def print_text(text: str | Text, console: Console) -> None:
    """Print a sentence: on a terminal in lines of whole words, in a log as one line.

    Examples
    --------
    >>> print_text("a sentence that goes on", Console(width=10, color_system=None))
    a sentence that goes on
    """
    whole = Text.assemble(text)
    for line in whole.divide(_breaks(whole.plain, console.width)) if console.is_terminal else [whole]:
        line.rstrip()
        console.print(line, soft_wrap=True)


def _breaks(text: str, width: int) -> list[int]:
    """Return where lines of whole words begin, the first apart; a longer word has a line of its own.

    Examples
    --------
    >>> _breaks("a sentence that goes on", 10), _breaks("of /a/long/path/alone here", 6)
    ([11, 21], [3, 22])
    """
    found = []
    start = 0
    ends = 0
    for word in re.finditer(r"\S+", text):
        if word.end() - start > width and ends > start:
            start = word.start()
            found.append(start)
        ends = word.end()
    return found


def print_verdict(verdict: Verdict, console: Console) -> None:
    """Print a verdict: the word with its counts, then a line for each reason.

    Examples
    --------
    >>> print_verdict(Verdict((), ("its size is implausible",)), Console(width=80, color_system=None))
    PASS WITH WARNINGS: 0 requirements met, 0 not met, 0 not checked, 1 warning
      warning: its size is implausible
    """
    first, *reasons = verdict.lines
    print_text(Text(first, VERDICT_STYLE.get(verdict.word, "")), console)
    for reason in reasons:
        print_text(reason, console)


def clock(seconds: float) -> str:
    """Return a duration as text.

    Examples
    --------
    >>> clock(7.4), clock(75), clock(3700)
    ('7 s', '1:15 min', '1:01 h')
    """
    whole = round(seconds)
    if whole < 60:
        return f"{whole} s"
    return f"{whole // 60}:{whole % 60:02d} min" if whole < 3600 else f"{whole // 3600}:{whole % 3600 // 60:02d} h"
