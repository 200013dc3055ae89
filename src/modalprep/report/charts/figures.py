"""Files of charts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import figure as plain
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text
from matplotlib.ticker import LogFormatterSciNotation

from modalprep.atomic import atomic_path

if TYPE_CHECKING:
    from PIL import Image

DPI = 180
COLOURS, WHITE = 128, 0xFFFFFFFF  # of a picture; opaque white in RGBA
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


class Figure(plain.Figure):
    """A figure whose texts are shown as they are: a name with a ``$`` is no formula."""

    def draw(self, renderer: Any) -> None:
        """Draw all texts letter by letter."""
        show_verbatim(self)
        super().draw(renderer)


def show_verbatim(artist: Artist) -> None:
    """Show the texts of a chart as they are; matplotlib reads what stands between two ``$`` as a formula."""
    for text in artist.findobj(Text):
        if "$" in text.get_text():
            text.set_parse_math(False)


def named(label: str) -> str:
    """Return a name as a label of a curve; legends leave out those that begin with an underscore.

    Examples
    --------
    >>> named("arm"), named("_arm") == "\N{ZERO WIDTH SPACE}_arm"
    ('arm', True)
    """
    return f"\N{ZERO WIDTH SPACE}{label}" if label.startswith("_") else label


def save_figure(figure: Figure, path: str | Path) -> Path:
    """Write a chart, as a PNG in 128 colours; the file is written completely or not at all."""
    for axes in figure.axes:
        _plain_powers(axes)
    with atomic_path(path) as temporary:
        if temporary.suffix.lower() == ".png":  # `savefig` would draw twice, once for the layout alone
            _drawn(figure).save(temporary, compress_level=3)  # half the time, a quarter larger
        else:
            figure.savefig(temporary, dpi=DPI)
    return Path(path)


def _drawn(figure: Figure) -> Image.Image:
    """Return a chart in few colours, which takes a third of the space; white, most of it, stays as it is."""
    from PIL import Image

    figure.set_dpi(DPI)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    pixels = np.asarray(canvas.buffer_rgba()).view(np.uint32)[..., 0]
    marked = np.append(np.flatnonzero(pixels != WHITE), 0)  # never empty
    row = Image.frombuffer("RGBA", (len(marked), 1), pixels.ravel()[marked]).convert("RGB")
    row = row.quantize(COLOURS - 1, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    index = np.full(pixels.shape, COLOURS - 1, np.uint8)
    index.ravel()[marked] = np.asarray(row)[0]
    picture = Image.fromarray(index)
    colours = (row.getpalette() or [])[: 3 * (COLOURS - 1)]
    picture.putpalette(colours + [255] * (3 * COLOURS - len(colours)))
    return picture


def _plain_powers(axes: Axes) -> None:
    """Write powers of ten as plain text, which looks the same: formulas take as long as all the rest of a chart."""
    for axis in (axes.xaxis, axes.yaxis):
        if isinstance(axis.get_major_formatter(), LogFormatterSciNotation):
            axis.set_major_formatter(_PlainPowers())
        if isinstance(axis.get_minor_formatter(), LogFormatterSciNotation):
            axis.set_minor_formatter(_PlainPowers())


class _PlainPowers(LogFormatterSciNotation):
    def __call__(self, x: float, pos: int | None = None) -> str:
        text = super().__call__(x, pos).removeprefix(r"$\mathdefault{").removesuffix("}$")
        base, _, power = text.removesuffix("}").partition("^{")
        return base.replace(r"\times", " \N{MULTIPLICATION SIGN} ") + power.translate(RAISED)
