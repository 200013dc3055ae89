"""Records that draw themselves, by the painters that `report.show` registers for their types.

`painters` is the one place from which lower packages reach `report`, at run time only.
"""

from __future__ import annotations

import base64
import html
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

from modalprep.atomic import atomic_path, write_text
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
        return write_text(self.html, path)


def painters() -> ModuleType:
    """Return `modalprep.report.show`, which draws each type of record; it is loaded at the first drawing.

    Examples
    --------
    >>> from modalprep.reduction.table import ModeTable
    >>> ModeTable in painters().plot.registry
    True
    """
    return import_module("modalprep.report.show")


class Plotted:
    """A record that can be plotted."""

    def plot(self, *args: Any, **options: Any) -> Any:
        """Show the record in a window or in a notebook; its type says what it takes.

        A mesh and a model
            Nothing: the cells and the interfaces are shown.
        A body
            ``mode`` (int, counted from 1; the undeformed body by default) and its ``colour``, ``displacement`` or
            ``energy``.
        A system
            ``run`` (a `Result` of it; by default the start values of the joints) and ``time`` (s; the nearest sample
            is shown, the last by default).
        A result
            The names of channels, such as ``"hinge.angle"``; ``axes`` of matplotlib (a new figure by default),
            ``title``, ``ylabel``.
        An ensemble
            The name of a channel: its percentiles over time. ``levels`` (percent), ``nominal`` (a `Result` to compare),
            ``axes``, ``title``.
        A response of a body
            The names of channels or their beginnings; the largest by default. Each unit has axes of its own.
        A shock spectrum or a power spectrum
            ``label`` of the history, ``unit`` of the spectrum or of the history, ``axes``.
        A linear system
            ``kind``: ``"bode"``, ``"nyquist"`` or ``"root_locus"``, which closes the loop ``input = -k output``;
            ``input`` and ``output`` (names; all by default), ``frequency`` (Hz), ``gain`` (the values of k). Of an
            undamped resonance the peak in a Bode diagram is as high as the frequencies are close.
        A table of modes
            ``axes``: the effective masses of the kept vectors are stacked for each direction.
        A Campbell diagram
            ``axes``.
        Modes of a ring
            ``axes``: their frequencies over the nodal diameter.

        Returns
        -------
        object
            Of results and tables the axes, of responses and linear systems a list of axes; of the others what
            pyvista's ``show`` returns: the scene in a notebook, None after a window is closed.

        Raises
        ------
        InputError
            When there is no such mode, colour or channel, the run is of another system, or the time lies outside.
        RenderError
            When there is no display, or the machine cannot draw.

        Examples
        --------
        >>> import numpy as np
        >>> from modalprep.multibody.results.result import Result
        >>> t = np.array([0.0, 1.0])
        >>> run = Result(time=t, channels={"a.angle": t**2}, status="done", message="")
        >>> run.plot("a.angle").get_ylabel()
        'a.angle (rad)'
        """
        return painters().plot(self, *args, **options)


class Viewed(Plotted):
    """A record with a page in three dimensions."""

    def view(self, *args: Any, **options: Any) -> Page:
        """Return a page to turn the record and let its modes move, which a notebook shows and a browser opens.

        A system takes a ``run``, a `Result` of it, which the page plays; without it the bodies are where the start
        values of the joints put them. Meshes, models and bodies take nothing.

        Returns
        -------
        modalprep.Page
            A notebook shows it without further packages; ``save`` writes it.

        Raises
        ------
        InputError
            When the run is of another system.
        RenderError
            When a cell type cannot be drawn.
        """
        return painters().view(self, *args, **options)


class Animated(Viewed):
    """A record that moves."""

    def animate(self, *args: Any, **options: Any) -> Film:
        """Draw one period of a mode of a body, or a run of a system, as a film.

        A body
            ``mode`` (int, counted from 1), ``kind``, and the options of `modalprep.report.animate_mode`, such as
            ``colour="energy"`` or ``size=(480, 360)``.
        A system
            ``run`` (a `Result` of it), ``kind``, ``seconds`` (duration), ``frames`` (number of pictures), ``size``
            (pixels), and the fields of `modalprep.report.FilmStyle`, such as ``exaggeration=20`` or
            ``trails=["arm.tip"]``.

        ``kind`` is ``webp`` or ``gif``; a GIF is several times as large.

        Returns
        -------
        modalprep.Film
            An animation, which a notebook plays and ``save`` writes.

        Raises
        ------
        InputError
            When there is no such mode, colour or kind, or the run is of another system.
        RenderError
            When the machine cannot draw.
        """
        return painters().animate(self, *args, **options)
