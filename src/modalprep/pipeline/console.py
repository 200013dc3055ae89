"""Console output of a run: a progress bar on a terminal, plain lines in a log, nothing with --json."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

COMPILING = "compiling the solver, once: one or two minutes"
LOG_WIDTH = 120  # columns of a log


class Reporter:
    """Prints messages and progress to standard output."""

    def __init__(self, quiet: bool = False) -> None:
        self.console = Console(quiet=quiet, highlight=False, markup=False, emoji=False)
        if not self.console.is_terminal:
            self.console.width = LOG_WIDTH
        self.files: list[Path] = []

    def say(self, text: str) -> None:
        """Print one plain line."""
        self.console.print(text, soft_wrap=True)

    def wrote(self, path: Path) -> Path:
        """Record and announce a written file."""
        self.files.append(path)
        self.say(f"  wrote {_short(path)}")
        return path

    @contextmanager
    def progress(self, title: str, total: float) -> Iterator[Callable[[float], None]]:
        """Show a progress bar from 0 to total; the yielded function takes the current value."""
        if not (self.console.is_terminal and not self.console.quiet):
            self.say(f"{title} ...")
            yield lambda value: None
            return
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TextColumn("{task.percentage:3.0f}%"),
            TimeElapsedColumn(),
        )
        with Progress(*columns, console=self.console) as bar:
            task = bar.add_task(title, total=total)
            yield lambda value: bar.update(task, completed=value)


def says_compiling(job: Callable) -> Callable:
    """Decorate a job ``(path, output, reporter, ...)`` to announce that it compiles the solver first."""

    @wraps(job)
    def saying(path: Path, output: Path | None, reporter: Reporter, *given, **options):
        from modalprep.jit import when_compiling

        with when_compiling(lambda: reporter.say(COMPILING), "modalprep.multibody"):
            return job(path, output, reporter, *given, **options)

    return saying


def _short(path: Path) -> str:
    try:
        return str(path.resolve().relative_to(Path.cwd()))
    except ValueError:
        return str(path)
