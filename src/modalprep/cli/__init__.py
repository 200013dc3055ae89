"""Command line: next to nothing is imported before Ctrl-C is heeded."""

from __future__ import annotations

import os
import sys

INTERRUPTED = 130  # exit code of a program ended by SIGINT


def main(argv: list[str] | None = None) -> int:
    """Run the command line; return the exit code: 0 done, 1 the work failed, 2 bad input, 130 interrupted."""
    try:
        from modalprep.cli.interrupt import insistent

        with insistent():
            from modalprep.cli.commands import perform

            code = perform(sys.argv[1:] if argv is None else argv)
        if code != INTERRUPTED:  # click's own way of saying it
            return code
    except KeyboardInterrupt:
        pass
    print("modalprep: interrupted", file=sys.stderr)
    return INTERRUPTED


def entry() -> None:
    """Console script; what has ended is not interrupted any more."""
    code = main()
    import signal
    from contextlib import suppress

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if code == INTERRUPTED:  # libraries that were interrupted while they were loaded may crash the interpreter's end
        with suppress(OSError):
            sys.stdout.flush()
        os._exit(code)
    sys.exit(code)
