"""Shared by all commands: the application, common options, JSON."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from modalprep.pipeline.console import Reporter
    from modalprep.verdicts.verdict import Verdict

app = typer.Typer(
    add_completion=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,  # help texts name tables such as [grid], which are no markup
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    help="Turn finite-element meshes into flexible bodies for multibody dynamics, and simulate them.",
)

Output = Annotated[
    Path | None, typer.Option("--output", help="Folder for the outputs; the default is 'output' beside the file.")
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print nothing but errors.")]
Settings = Annotated[
    list[str] | None,
    typer.Option("--set", help="KEY=VALUE that replaces the file's, such as reduction.modes=20; may be repeated."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object instead of text.")]
Report = Annotated[bool, typer.Option("--report/--no-report", help="Write the HTML pages.")]
Pdf = Annotated[bool, typer.Option("--pdf", help="Also print the report page to a PDF file, by a Chromium.")]
PipelineFile = Annotated[Path, typer.Argument(help="Pipeline file (TOML).")]
ModalFile = Annotated[Path, typer.Argument(help="Modal file (HDF5).")]


def print_json(data: Mapping[str, Any]) -> None:
    """Print one JSON object."""
    print(json.dumps(data, indent=1))


def end_with(verdict: Verdict, reporter: Reporter, file: Path) -> None:
    """Print the verdict on a file; with FAIL end with exit code 1 and a sentence of what is not met."""
    from modalprep.errors import AccuracyError
    from modalprep.report.terminal import print_verdict

    print_verdict(verdict, reporter.console)
    if verdict.failure:
        raise AccuracyError(f"{file}: {verdict.failure}")


def open_page(page: Path, reporter: Reporter) -> None:
    """Open a page in the browser, or say that there is none."""
    import webbrowser

    from modalprep.report.show import has_display

    if not (has_display() and webbrowser.open(page.resolve().as_uri())):
        reporter.say(f"  no browser was found to open {page}")
