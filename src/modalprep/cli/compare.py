"""The command that compares modes with those of a test or of another model."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal, cast

import typer

from modalprep.cli.common import Json, app, print_json
from modalprep.report import summary

if TYPE_CHECKING:
    import numpy as np

    from modalprep.correlation.mode_set import ModeSet
    from modalprep.correlation.pairing import Correlation
    from modalprep.pipeline.console import Reporter
    from modalprep.report.scene.record import Scene

Cells = dict[str, "np.ndarray"]

Boundary = Annotated[str, typer.Option("--boundary", help="Modes of the body: clamped at its root, or free.")]
Count = Annotated[int | None, typer.Option("--modes", help="Number of analysis modes; the default is all.")]
Origin = Annotated[str, typer.Option("--origin", help="X,Y,Z of the body's frame in the axes of the test, in m.")]
Axes = Annotated[str, typer.Option("--axes", help="Axes x, y, z of the body in those of the test, such as y,-x,z.")]
Tolerance = Annotated[
    float | None,
    typer.Option(
        "--tolerance", help="Largest distance of a sensor from its node in m; the default is 5 % of the body."
    ),
]
Film = Annotated[Path | None, typer.Option("--animate", help="Animation (.gif, .webp, .mp4) of a pair side by side.")]
Pair = Annotated[int | None, typer.Option("--pair", help="Its number in the table; the default is 1.")]
LengthUnit = Annotated[
    str | None, typer.Option("--length-unit", help="Of the test file; the default is what the file says, or m.")
]


@app.command()
def compare(
    file: Annotated[Path, typer.Argument(help="Modal file (HDF5) of the analysis.")],
    test: Annotated[Path, typer.Argument(help="Modes of a test (.uff, .unv), or another modal file.")],
    target: Annotated[
        Path | None,
        typer.Option("-o", help="Picture of the MAC (.png); a table (.csv) and a page (.html) are beside it."),
    ] = None,
    boundary: Boundary = "clamped",
    modes: Count = None,
    origin: Origin = "0,0,0",
    axes: Axes = "x,y,z",
    tolerance: Tolerance = None,
    film: Film = None,
    pair: Pair = None,
    length_unit: LengthUnit = None,
    smallest_mac: Annotated[float, typer.Option("--mac", help="Smallest MAC of a pair.")] = 0.5,
    as_json: Json = False,
) -> None:
    """Compare modes with those of a test or of another model.

    Modes are paired by the MAC at the sensors; their frequencies, damping and orthogonality and the COMAC are compared.
    The page shows the pairs moving side by side.
    """
    from modalprep.correlation import correlate
    from modalprep.correlation.axes import turned_axes
    from modalprep.pipeline.building.sources import claiming, refuse_overwriting
    from modalprep.pipeline.console import Reporter

    picture = target or file.with_name(f"{file.stem}-against-{test.stem}.png")
    files = [picture, picture.with_suffix(".csv"), picture.with_suffix(".html")]
    reporter = Reporter(quiet=as_json)
    refuse_overwriting([*files, *([film] if film else [])], [file, test])
    pair = _pair_of(film, pair)
    analysis, cells = _analysis(file, boundary, modes)
    measured, test_cells = _measured(test, boundary, length_unit)
    place = {"origin": _three(origin), "rotation": turned_axes(axes), "tolerance": tolerance}
    found = correlate(measured, analysis, **place, smallest_mac=smallest_mac)
    drawn = _drawn(found, analysis, cells, test_cells)
    with claiming({} if target else {picture: test, files[-1]: file}):
        _write(found, drawn, files, reporter)
    if film:
        _film(film, drawn, pair, reporter)
    if as_json:
        print_json(summary.correlation(found, reporter))


def _write(correlation: Correlation, drawn: Scene | None, files: Sequence[Path], reporter: Reporter) -> None:
    """Print the pairs, and write the picture of the MAC, the table and the page."""
    from modalprep.atomic import write_table
    from modalprep.report.correlation.page import write_pairs_page
    from modalprep.report.correlation.pairs import correlation_table, mac_plot

    picture, table, page = files
    correlation_table(correlation, reporter.console)
    reporter.wrote(mac_plot(correlation, picture))
    rows = correlation.rows()
    if rows:
        reporter.wrote(write_table(rows[0], [list(row.values()) for row in rows], table))
    reporter.wrote(write_pairs_page(correlation, drawn, page))


def _pair_of(film: Path | None, pair: int | None) -> int:
    from modalprep.errors import InputError
    from modalprep.report.pictures.animation import check_target

    if film is not None:
        check_target(film)
    elif pair is not None:
        raise InputError("--pair is the pair of an animation; name its file with --animate, or leave it out")
    return 1 if pair is None else pair


def _drawn(correlation: Correlation, analysis: ModeSet, cells: Cells, test_cells: Cells | None) -> Scene | None:
    from modalprep.report.correlation.drawn import draw_pairs

    return draw_pairs(correlation, analysis, cells, test_cells) if len(correlation.pairs) else None


def _film(film: Path, drawn: Scene | None, pair: int, reporter: Reporter) -> None:
    from modalprep.errors import InputError, RenderError
    from modalprep.report.pictures.animation import animate_mode

    count = drawn.n if drawn else 0
    if drawn is None or not 1 <= pair <= count:
        raise InputError(f"--pair {pair}: there are {count} pairs; choose another one, or a smaller --mac")
    try:
        reporter.wrote(animate_mode(drawn, pair, film, title=drawn.titles[pair - 1]))
    except RenderError as error:
        reporter.say(f"  not drawn: {error}")


def _analysis(file: Path, boundary: str, count: int | None) -> tuple[ModeSet, Cells]:
    """Return the modes of a modal file, and the cells of its mesh."""
    import numpy as np

    from modalprep.correlation import body_modes
    from modalprep.errors import InputError
    from modalprep.formats.modalfile import read_body

    body = read_body(file)
    found = body_modes(body, cast(Literal["clamped", "free"], boundary))  # others are refused
    if count is not None and not 1 <= count <= found.n:
        raise InputError(f"--modes {count}: the body of {file} has {found.n} modes")
    return found.select(np.arange(found.n if count is None else count)), body.cells


def _measured(test: Path, boundary: str, length_unit: str | None) -> tuple[ModeSet, Cells | None]:
    """Return the modes of a test and no cells, or those of another modal file."""
    from modalprep.correlation import read_test_modes
    from modalprep.errors import InputError
    from modalprep.fe.readers.read import LENGTH_UNITS, refuse_units

    if test.suffix == ".h5":
        if length_unit:
            raise InputError(f"--length-unit is of a universal file, and {test} is a modal file in SI; leave it out")
        return _analysis(test, boundary, None)
    if length_unit:
        refuse_units(length_unit, None)
    return read_test_modes(test, length=LENGTH_UNITS[length_unit] if length_unit else None), None


def _three(text: str) -> list[float]:
    from modalprep.errors import InputError

    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3:
        raise InputError(f"--origin {text!r} is not X,Y,Z, such as 0.1,0,0.25")
    return found
