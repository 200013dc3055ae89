"""Records that draw themselves: the one place from which lower packages reach `report`, at run time only."""

from __future__ import annotations

import base64
import html
from importlib import import_module
from pathlib import Path
from typing import Any

from modalprep.atomic import atomic_path
from modalprep.errors import InputError


class Film:
    """An animation that a notebook plays; `data` has the bytes of the file, `kind` is ``webp`` or ``gif``.

    Examples
    --------
    >>> Film(b"GIF89a", "gif")._repr_html_()
    '<img src="data:image/gif;base64,R0lGODlh" alt="animation">'
    """

    def __init__(self, data: bytes, kind: str) -> None:
        self.data = data
        self.kind = kind

    def __repr__(self) -> str:
        """Kind and size of the file."""
        return f"Film({self.kind}, {len(self.data)} bytes)"

    def _repr_html_(self) -> str:
        text = base64.b64encode(self.data).decode("ascii")
        return f'<img src="data:image/{self.kind};base64,{text}" alt="animation">'

    def save(self, path: str | Path) -> Path:
        """Write the file.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            When the file is of another kind.
        """
        path = Path(path)
        if path.suffix.lower() != f".{self.kind}":
            raise InputError(f"cannot write {path}: this film is a .{self.kind}; animate() takes kind='gif' or 'webp'")
        with atomic_path(path) as temporary:
            temporary.write_bytes(self.data)
        return path


class Page:
    """A page that a notebook shows in a frame, to turn and to play; `html` has its text.

    It needs no further package and no server.

    Examples
    --------
    >>> Page("<p>a & b</p>")._repr_html_()[:52]
    '<iframe srcdoc="&lt;p&gt;a &amp; b&lt;/p&gt;" style='
    """

    def __init__(self, html: str) -> None:
        self.html = html

    def __repr__(self) -> str:
        """Size of the page."""
        return f"Page({len(self.html)} characters)"

    def _repr_html_(self) -> str:
        style = "width: 100%; height: 680px; border: 0"
        return f'<iframe srcdoc="{html.escape(self.html)}" style="{style}" title="view in three dimensions"></iframe>'

    def save(self, path: str | Path) -> Path:
        """Write the page, which a browser opens.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        InputError
            When the file is no .html.
        """
        path = Path(path)
        if path.suffix.lower() not in (".html", ".htm"):
            raise InputError(f"cannot write {path}: the page is an .html file")
        with atomic_path(path) as temporary:
            temporary.write_text(self.html, encoding="utf-8")
        return path


def draw(kind: str, *args: Any, **options: Any) -> Any:
    """Call a function of `modalprep.report.show`, which is loaded at the first drawing.

    Examples
    --------
    >>> from modalprep.reduction.table import ModeTable
    >>> import numpy as np
    >>> draw("effective_mass", ModeTable.empty(np.ones(6)), None).get_xlabel()[:14]
    'effective mass'
    """
    return getattr(import_module("modalprep.report.show"), kind)(*args, **options)
