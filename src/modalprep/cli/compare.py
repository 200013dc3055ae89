"""The command that compares modes with those of a test or of another model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modalprep.cli.common import Json, app, print_json
from modalprep.report import summary

if TYPE_CHECKING:
    from modalprep.correlation.mode_set import ModeSet
    from modalprep.correlation.pairing import Correlation
    from modalprep.pipeline.console import Reporter
    from modalprep.report.correlation.drawn import Drawn


@app.command()
def compare(
    file: Annotated[Path, typer.Argument(help="Modal file (HDF5) of the analysis.")],
    test: Annotated[Path, typer.Argument(help="Modes of a test (.uff, .unv), or another modal file.")],
    target: Annotated[
        Path | None,
        typer.Option("-o", help="Picture of the MAC (.png); a table (.csv) and a page (.html) are beside it."),
    ] = None,
    boundary: Annotated[
        str, typer.Option("--boundary", help="Modes of the body: clamped at its root, or free.")
    ] = "clamped",
    modes: Annotated[int | None, typer.Option("--modes", help="Number of analysis modes; the default is all.")] = None,
    origin: Annotated[
        str, typer.Option("--origin", help="X,Y,Z of the body's frame in the axes of the test, in m.")
    ] = "0,0,0",
    axes: Annotated[
        str, typer.Option("--axes", help="Axes x, y, z of the body in those of the test, such as y,-x,z.")
    ] = "x,y,z",
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance", help="Largest distance of a sensor from its node in m; the default is 5 % of the size."
        ),
    ] = None,
    film: Annotated[
        Path | None, typer.Option("--animate", help="Animation (.gif, .webp, .mp4) of a pair side by side.")
    ] = None,
    pair: Annotated[int | None, typer.Option("--pair", help="Its number in the table; the default is 1.")] = None,
    length_unit: Annotated[
        str | None, typer.Option("--length-unit", help="Of the test file; the default is what the file says, or m.")
    ] = None,
    smallest_mac: Annotated[float, typer.Option("--mac", help="Smallest MAC of a pair.")] = 0.5,
    as_json: Json = False,
) -> None:
    """Compare modes with those of a test or of another model.

    Modes are paired by the MAC at the sensors; their frequencies, damping and orthogonality and the COMAC are compared.
    The page shows the pairs moving side by side.
    """
    from modalprep.atomic import write_table
    from modalprep.correlation import correlate
    from modalprep.correlation.axes import turned_axes
    from modalprep.pipeline.build.sources import refuse_overwriting
    from modalprep.pipeline.console import Reporter
    from modalprep.report.correlation.page import write_pairs_page
    from modalprep.report.correlation.pairs import correlation_table, mac_plot

    reporter = Reporter(quiet=as_json)
    target = target or file.with_name(f"{file.stem}-against-{test.stem}.png")
    table, page = target.with_suffix(".csv"), target.with_suffix(".html")
    refuse_overwriting([target, table, page, *([film] if film else [])], [file, test])
    pair = _pair_of(film, pair)
    analysis = _modes_of_body(file, boundary, modes)
    measured = _measured(test, boundary, length_unit)
    place = {"origin": _three(origin), "rotation": turned_axes(axes), "tolerance": tolerance}
    found = correlate(measured, analysis, **place, smallest_mac=smallest_mac)
    correlation_table(found, reporter.console)
    reporter.wrote(mac_plot(found, target))
    rows = found.rows()
    if rows:
        reporter.wrote(write_table(rows[0], [list(row.values()) for row in rows], table))
    drawn = _drawn(found, analysis, file, test)
    reporter.wrote(write_pairs_page(found, drawn, page))
    if film:
        _film(film, drawn, pair, reporter)
    if as_json:
        print_json(summary.correlation(found, reporter))


def _pair_of(film: Path | None, pair: int | None) -> int:
    from modalprep.errors import InputError
    from modalprep.report.pictures.animation import check_target

    if film is not None:
        check_target(film)
    elif pair is not None:
        raise InputError("--pair is the pair of an animation; name its file with --animate, or leave it out")
    return 1 if pair is None else pair


def _drawn(found: Correlation, analysis: ModeSet, file: Path, test: Path) -> Drawn | None:
    from modalprep.formats.modalfile import read_body
    from modalprep.report.correlation.drawn import draw_pairs

    if not len(found.pairs):
        return None
    return draw_pairs(found, analysis, read_body(file).cells, read_body(test).cells if test.suffix == ".h5" else None)


def _film(film: Path, drawn: Drawn | None, pair: int, reporter: Reporter) -> None:
    from modalprep.errors import InputError, RenderError
    from modalprep.report.pictures.animation import animate_mode

    count = drawn.n if drawn else 0
    if not 1 <= pair <= count:
        raise InputError(f"--pair {pair}: there are {count} pairs; choose another one, or a smaller --mac")
    try:
        reporter.wrote(animate_mode(drawn, pair, film, title=drawn.titles[pair - 1]))
    except RenderError as error:
        reporter.say(f"  not drawn: {error}")


def _modes_of_body(file: Path, boundary: str, count: int | None) -> ModeSet:
    import numpy as np

    from modalprep.correlation import body_modes
    from modalprep.errors import InputError
    from modalprep.formats.modalfile import read_body

    found = body_modes(read_body(file), boundary)
    if count is not None and not 1 <= count <= found.n:
        raise InputError(f"--modes {count}: the body of {file} has {found.n} modes")
    return found.select(np.arange(found.n if count is None else count))


def _measured(test: Path, boundary: str, length_unit: str | None) -> ModeSet:
    from modalprep.correlation import read_test_modes
    from modalprep.errors import InputError
    from modalprep.fe.readers.read import LENGTH_UNITS, refuse_units

    if test.suffix == ".h5":
        if length_unit:
            raise InputError(f"--length-unit is of a universal file, and {test} is a modal file in SI; leave it out")
        return _modes_of_body(test, boundary, None)
    if length_unit:
        refuse_units(length_unit, None)
    return read_test_modes(test, length=LENGTH_UNITS[length_unit] if length_unit else None)


def _three(text: str) -> list[float]:
    from modalprep.errors import InputError

    try:
        found = [float(part) for part in text.split(",")]
    except ValueError:
        found = []
    if len(found) != 3:
        raise InputError(f"--origin {text!r} is not X,Y,Z, such as 0.1,0,0.25")
    return found
