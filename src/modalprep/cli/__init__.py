"""Command line: every command imports what it needs when it runs, so that ``--help`` is instant."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Annotated

import typer

from modalprep.cli import bodies, jobs, meshes
from modalprep.cli.common import app
from modalprep.cli.interrupt import insistent

__all__ = ["app", "bodies", "entry", "jobs", "main", "meshes"]

INTERRUPTED = 130  # exit code of a program ended by SIGINT


def _version(wanted: bool) -> None:
    if wanted:
        from modalprep import __version__

        print(f"modalprep {__version__}")
        raise typer.Exit


@app.callback()
def _options(
    version: Annotated[bool, typer.Option("--version", callback=_version, is_eager=True, help="Print it.")] = False,
) -> None: ...


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command line; return the exit code: 0 done, 1 the work failed, 2 bad input."""
    from modalprep.errors import ModalprepError

    try:
        with insistent():
            code = app(args=list(sys.argv[1:] if argv is None else argv), prog_name="modalprep", standalone_mode=False)
        if code == INTERRUPTED:  # click's own way of saying it
            raise KeyboardInterrupt
        return int(code or 0)
    except ModalprepError as error:
        print(f"modalprep: {' '.join(str(error).split())}", file=sys.stderr)
        return error.exit_code
    except OSError as error:  # of reading; what cannot be written is an InputError
        place = "" if error.filename is None else f"{error.filename}: "
        print(f"modalprep: {place}{error.strerror or error}; check the path and who may read it", file=sys.stderr)
        return 2
    except MemoryError as error:
        print(f"modalprep: not enough memory ({error}); ask for less or use a larger machine", file=sys.stderr)
        return 1
    except typer.Exit as error:
        return error.exit_code
    except (typer.Abort, KeyboardInterrupt):
        print("modalprep: interrupted", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        if hasattr(error, "format_message"):  # a wrong option or argument
            print(f"modalprep: {error.format_message()}; see modalprep --help", file=sys.stderr)
            return 2
        raise


def entry() -> None:
    """Console script."""
    sys.exit(main())
