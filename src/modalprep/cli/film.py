"""The command that draws a finished run."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modalprep.cli.common import Output, PipelineFile, Settings, app


@app.command()
def film(
    file: PipelineFile,
    target: Annotated[
        Path | None,
        typer.Option("-o", help="File to write: an animation (.webp, .gif, .mp4), or a picture (.png, .jpg)."),
    ] = None,
    run: Annotated[
        Path | None, typer.Option("--run", help="Result file (.h5); the default is that of the outputs.")
    ] = None,
    positions: Annotated[int, typer.Option("--positions", help="Number of positions in a picture.", min=1)] = 6,
    strip: Annotated[
        bool, typer.Option("--strip", help="Draw the positions side by side, each with the one before it as a ghost.")
    ] = False,
    output: Output = None,
    settings: Settings = None,
) -> None:
    """Draw a finished run as an animation or a picture.

    A picture shows several positions. The table [film] of the file says how the motion is drawn; --set changes it, such
    as --set film.exaggeration=20.
    """
    from modalprep.pipeline.batch.settings import with_settings
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.film import film_pipeline

    source, output = with_settings(file, settings or [], output)
    reporter = Reporter()
    reporter.wrote(film_pipeline(source, target, run, output, reporter, positions, strip=strip))
