"""Command line; signal handling is installed before anything else is imported."""

from __future__ import annotations

import os
import sys

INTERRUPTED = 130  # exit code of a program ended by SIGINT
COLLECTION = (500_000, 10, 10)  # of cyclic garbage, of which a short run makes little: searching took a tenth of it


def main(argv: list[str] | None = None) -> int:
    """Run the command line; return the exit code: 0 success, 1 failure, 2 bad input, 130 interrupted."""
    try:
        from modalprep.cli.interrupt import repeated_interrupts

        with repeated_interrupts():
            from modalprep.cli.commands import perform

            code = perform(sys.argv[1:] if argv is None else argv)
        if code != INTERRUPTED:  # click reports an interrupt by this code
            return code
    except KeyboardInterrupt:
        pass
    print("modalprep: interrupted", file=sys.stderr)
    return INTERRUPTED


def _print_plainly_where_needed() -> None:
    """Print what a terminal cannot show by its plain letters, ``m²`` as ``m2``."""
    import codecs
    import io
    import unicodedata

    def plain(error: UnicodeError) -> tuple[str, int]:
        if not isinstance(error, UnicodeEncodeError):
            raise error
        text = unicodedata.normalize("NFKD", error.object[error.start : error.end])
        return text.encode("ascii", "replace").decode(), error.end

    codecs.register_error("plain", plain)
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="plain")


def entry() -> None:
    """Console script; interrupts are ignored once the command has ended."""
    import atexit
    import gc
    import warnings

    ended: list[int] = []
    atexit.register(_leave, ended)  # first here, so that it is the last there
    os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # the search reads every installed package
    os.environ.setdefault("OPENBLAS_THREAD_TIMEOUT", "18")  # 2^18 ticks: idle threads kept a core busy for 2^26
    gc.set_threshold(*COLLECTION)
    warnings.simplefilter("ignore", RuntimeWarning)  # of numpy: what is not finite gets its own sentence
    _print_plainly_where_needed()
    ended.append(main())
    import signal

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if INTERRUPTED in ended:  # libraries interrupted while loading may crash the interpreter at exit
        _leave(ended)
    sys.exit(*ended)


def _leave(ended: list[int]) -> None:
    """End the process without taking its modules apart, which takes an eighth of a short run."""
    from contextlib import suppress

    if ended:
        with suppress(OSError):  # the reader is gone
            sys.stdout.flush()
            sys.stderr.flush()
        os._exit(*ended)
