"""Console output of a run: a progress bar on a terminal, plain lines in a log, nothing with --json."""

from __future__ import annotations

import itertools
import logging
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Protocol

from rich.console import Console

from modalprep.report.terminal import print_text
from modalprep.verdicts.notes import kind_of

COMPILING = "compiling the solver, "
LOG_WIDTH = 10_000  # columns of a log, more than any table needs: lines of a file are not folded


class Reporter:
    """Prints messages and progress to standard output."""

    def __init__(self, quiet: bool = False) -> None:
        self.console = Console(quiet=quiet, highlight=False, markup=False, emoji=False)
        if not self.console.is_terminal:
            self.console.width = LOG_WIDTH
        self.files: list[Path] = []

    def say(self, text: str) -> None:
        """Print one plain line; on a terminal its words stay whole."""
        print_text(text, self.console)

    def notes(self, texts: Iterable[str]) -> None:
        """Print notes on a result, and say which are warnings."""
        for text in texts:
            self.say(f"  {'note' if kind_of(text) == 'notes' else 'warning'}: {text}")

    def wrote(self, path: Path) -> Path:
        """Record and announce a written file."""
        self.files.append(path)
        self.say(f"  wrote {_short(path)}")
        return path

    @contextmanager
    def _hushed(self) -> Iterator[None]:
        """Keep the lines on long runs back where nothing is to be printed."""
        log = logging.getLogger("modalprep")
        before = log.disabled
        log.disabled = log.disabled or self.console.quiet
        try:
            yield
        finally:
            log.disabled = before

    @contextmanager
    def progress(self, title: str, total: float, *, stage: str = "", unit: str = "") -> Iterator[Reach]:
        """Show a bar from 0 to total with the stage and its time; the times of all stages are printed at its end.

        The yielded function takes the value that is reached, and the name of the stage that begins there.
        """
        self.say(f"{title} ...")
        if self.console.quiet or not self.console.is_terminal:
            with self._hushed():
                yield lambda value, begun="": None
            return
        from modalprep.pipeline.bar import drawn_bar

        with drawn_bar(self.console, total, stage, unit) as (reach, stages):
            yield reach
        self.say(_taken([*stages, ("", time.perf_counter())]))


class Reach(Protocol):
    """What `Reporter.progress` yields."""

    def __call__(self, value: float, begun: str = "", /) -> None:
        """Move the bar to a value, where a stage may begin."""


def _taken(stages: list[tuple[str, float]]) -> str:
    """Return the stages with the time that each took."""
    spans = [(name, end - begin) for (name, begin), (_, end) in itertools.pairwise(stages)]
    return "  " + ", ".join(f"{name} {seconds:.1f} s".strip() for name, seconds in spans)


def says_compiling(job: Callable) -> Callable:
    """Decorate a job ``(path, output, reporter, ...)`` to announce that it compiles the solver first."""

    @wraps(job)
    def saying(path: Path, output: Path | None, reporter: Reporter, *given, **options):
        from modalprep.compiler.jit import when_compiling
        from modalprep.compiler.switch import how_long

        with when_compiling(lambda: reporter.say(f"{COMPILING}{how_long()}"), "modalprep.multibody"):
            return job(path, output, reporter, *given, **options)

    return saying


def _short(path: Path) -> str:
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except ValueError:
        return str(path)
