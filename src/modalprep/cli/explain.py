"""The command that puts an output file into words."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from modalprep.cli.common import Json, app, print_json


@app.command()
def explain(
    file: Annotated[
        Path,
        typer.Argument(help="Modal file, result or response (.h5), batch.json, or the folder of a batch."),
    ],
    as_json: Json = False,
) -> None:
    """Explain a body, run, response or batch in plain words.

    The sentences say what moves, what dominates, what is not trustworthy and why, and what to change.
    """
    from modalprep.pipeline.console import Reporter
    from modalprep.report.explain.file import explain_file

    sentences = explain_file(file)
    if as_json:
        print_json({"file": str(file), "sentences": sentences})
        return
    for sentence in sentences:
        Reporter().say(sentence)
