"""The application with its commands: each imports what it needs when it runs, so that ``--help`` is instant."""

from __future__ import annotations

import errno
import sys
from collections.abc import Sequence
from copy import copy
from functools import cache
from typing import Annotated

import typer

from modalprep.cli import batch, bodies, compare, doctor, explain, film, jobs, meshes, simulate, view
from modalprep.cli.common import app

__all__ = [
    "app",
    "batch",
    "bodies",
    "compare",
    "doctor",
    "explain",
    "film",
    "jobs",
    "meshes",
    "perform",
    "simulate",
    "view",
]


def _version(wanted: bool) -> None:
    if wanted:
        from modalprep import __version__

        print(f"modalprep {__version__}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _options(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version and exit.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help())


@cache
def _command(name: str):
    """Return the command line, of one command where the name is that of one: making them all takes longer than many."""
    only = copy(app)
    only.registered_commands = [made for made in app.registered_commands if _name(made) == name]
    return typer.main.get_command(only if only.registered_commands else app)


def _advice(error: Exception) -> str:
    """Say what to do about a wrong option: it may be a key of the pipeline file."""
    key = getattr(error, "option_name", "").lstrip("-").replace("-", "_")
    context = getattr(error, "ctx", None)
    if context and any("--set" in each.opts for each in context.command.params):
        from modalprep.pipeline.schema.reduction import ReductionTable
        from modalprep.pipeline.schema.system import SimulationTable

        for table, kind in (("reduction", ReductionTable), ("simulation", SimulationTable)):
            if key in kind.model_fields:
                return f"--set {table}.{key}=VALUE replaces the value of the pipeline file"
    return "see modalprep --help"


def _name(made: typer.models.CommandInfo) -> str:
    return made.name or getattr(made.callback, "__name__", "").replace("_", "-")


def perform(argv: Sequence[str]) -> int:
    """Perform a command; return its exit code.

    Raises
    ------
    KeyboardInterrupt
    """
    from modalprep.errors import ModalprepError
    from modalprep.verdicts.notes import silent

    try:
        with silent():
            command = _command(argv[0] if argv else "")
            return int(command(args=list(argv), prog_name="modalprep", standalone_mode=False) or 0)
    except ModalprepError as error:
        print(f"modalprep: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_code
    except OSError as error:  # of reading; errors of writing are OutputErrors
        place = "" if error.filename is None else f"{error.filename}: "
        advice = "make room" if error.errno == errno.ENOSPC else "check the path and its permissions"
        print(f"modalprep: {place}{error.strerror or error}; {advice}", file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f"modalprep: not enough memory ({error}); reduce the problem or use a larger machine", file=sys.stderr)
        return 1
    except typer.Exit as error:
        return error.exit_code
    except typer.Abort:
        raise KeyboardInterrupt from None
    except Exception as error:
        if says := getattr(error, "format_message", None):  # a wrong option or argument
            print(f"modalprep: {says()}; {_advice(error)}", file=sys.stderr)
            return 2
        raise
