"""Tables of records in notebooks."""

from __future__ import annotations

import html
from collections.abc import Iterable, Sequence


def html_table(caption: str, header: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Return a table as HTML; all text is escaped, numbers have four digits.

    Examples
    --------
    >>> html_table("a & b", ["name"], [["<x>"], [0.123456]])[:65]
    '<table><caption>a &amp; b</caption><tr><th>name</th></tr><tr><td>'
    """
    lines = [_row("th", header), *(_row("td", row) for row in rows)]
    return f"<table><caption>{html.escape(caption).replace(chr(10), '<br>')}</caption>{''.join(lines)}</table>"


def _row(tag: str, values: Iterable[object]) -> str:
    texts = (f"{value:.4g}" if isinstance(value, float) else str(value) for value in values)
    return f"<tr>{''.join(f'<{tag}>{html.escape(text)}</{tag}>' for text in texts)}</tr>"
