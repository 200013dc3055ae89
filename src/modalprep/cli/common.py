"""Shared by all commands: the application, common options, JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated, Any

import typer

app = typer.Typer(
    no_args_is_help=True,
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # help texts name tables such as [grid], which are no markup
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    help="Turn finite-element meshes into flexible bodies for multibody dynamics, and simulate them.",
)

Output = Annotated[
    Path | None, typer.Option("--output", help="Folder for the outputs; the default is 'output' beside the file.")
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
PipelineFile = Annotated[Path, typer.Argument(help="Pipeline file (TOML).")]
ModalFile = Annotated[Path, typer.Argument(help="Modal file (HDF5).")]


def print_json(data: dict[str, Any]) -> None:
    """Print one JSON object."""
    print(json.dumps(data, indent=1))
