"""The command that shows a body, a run or a mesh in the browser."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from modalprep.cli.common import Json, Output, Quiet, app, open_page, print_json

if TYPE_CHECKING:
    pass


@app.command()
def view(
    file: Annotated[Path, typer.Argument(help="Modal file or result file (HDF5), or a mesh.")],
    target: Annotated[
        Path | None, typer.Option("-o", help="Page to write (.html); the default is a temporary file.")
    ] = None,
    pipeline: Annotated[
        Path | None,
        typer.Option("--pipeline", help="Of a run: its pipeline file, where it does not lie as it did when it ran."),
    ] = None,
    output: Output = None,
    length_unit: Annotated[
        str | None, typer.Option("--length-unit", help="Of a mesh: unit of its lengths, such as mm; the default is m.")
    ] = None,
    show: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in the browser.")] = True,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Show a body, a run or a mesh in the browser.

    Bodies have their modes, a run its time; all can be turned. The page is one file that needs no network and can be
    sent to others.
    """
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.view import default_page, view_file

    reporter = Reporter(quiet=as_json or quiet)
    page = target or default_page(file)
    kind = view_file(file, page, reporter, pipeline=pipeline, output=output, length_unit=length_unit)
    reporter.wrote(page)
    if as_json:
        print_json({"kind": kind, "page": str(page)})
    if show and not as_json:
        open_page(page, reporter)
