"""Console output of a batch: a progress bar on a terminal, a line per job in a log, and a final table."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.text import Text

from modalprep.pipeline.batch.job import DONE, Job, Record
from modalprep.pipeline.console import Reporter
from modalprep.report.terminal import VERDICT_STYLE, clock, plain_table, print_table, print_text
from modalprep.verdicts.verdict import read_verdict

STYLE = {DONE: "green", "failed": "bold red"}
SHOWN = 3  # jobs named beside the bar


class Progress:
    """Reports ended jobs and estimates the remaining time from the mean time of a job.

    Parameters
    ----------
    reporter : Reporter
    total : int
        Jobs to run.
    workers : int
        Number of concurrent jobs.
    """

    def __init__(self, reporter: Reporter, total: int, workers: int) -> None:
        self._reporter, self._total, self._workers = reporter, total, workers
        self._begun: dict[str, float] = {}
        self._taken: list[float] = []
        live = reporter.console.is_terminal and not reporter.console.quiet
        columns = (
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
        )
        self._bar = Bar(*columns, TextColumn("{task.fields[left]}"), console=reporter.console, disable=not live)
        self._task = self._bar.add_task("jobs", total=total, left="")

    def __enter__(self) -> Progress:
        """Show the bar."""
        self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Remove the bar."""
        self._bar.stop()

    def started(self, job: Job) -> None:
        """Record the start of a job."""
        self._begun[job.name] = time.perf_counter()

    def ended(self, job: Job, record: Record) -> None:
        """Report how a job ended, its time, and the remaining time."""
        del self._begun[job.name]
        self._taken.append(record["seconds"])
        count, left = len(self._taken), self.seconds_left()
        rest = f"; about {clock(left)} left" if count < self._total else ""
        cause = f": {record['cause']}" if record["cause"] else ""
        what = f"[{count}/{self._total}] {job.name} {record['status']} in {record['seconds']:.1f} s{rest}{cause}"
        self._reporter.say(what)

    def tick(self) -> None:
        """Move the bar."""
        names = list(self._begun)
        more = f" and {len(names) - SHOWN} more" if len(names) > SHOWN else ""
        left = f"about {clock(self.seconds_left())} left" if self._taken else ""
        self._bar.update(
            self._task, completed=len(self._taken), description=", ".join(names[:SHOWN]) + more or "jobs", left=left
        )

    def seconds_left(self) -> float:
        """Return the estimated remaining time: the mean of ended jobs, less the time of those that already run."""
        mean = sum(self._taken) / len(self._taken)
        spent = sum(min(mean, time.perf_counter() - begun) for begun in self._begun.values())
        return max(0.0, (self._total - len(self._taken)) * mean - spent) / self._workers


def jobs_table(rows: Sequence[dict[str, Any]], console: Console) -> None:
    """Print a row per job: grid values, status, verdict, time, time saved; then a line per failure or reason.

    Examples
    --------
    >>> row = {"job": "a", "pipeline": "a.toml", "values": {}, "ran": True, "status": "failed", "cause": "no mesh"}
    >>> jobs_table([row], Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    <BLANKLINE>
    ...a failed: no mesh
    """
    keys = list(dict.fromkeys(key for row in rows for key in row["values"]))
    table = plain_table()
    for head in ("job", *keys, "state", "verdict", "time", "saved"):
        table.add_column(Text(head), overflow="fold", justify="right" if head in ("time", "saved") else "left")
    for row in rows:
        table.add_row(*map(Text, [row["job"], *(row["values"].get(key, "") for key in keys)]), *_ending(row))
    console.print()
    print_table(table, console)
    for row in rows:
        if row["cause"]:
            cause = row["cause"].removeprefix(row["pipeline"]).lstrip(":, ")
            print_text(f"{row['job']} failed: {cause}", console)
        elif row.get("verdict"):
            for reason in read_verdict(row["verdict"]).reasons:
                print_text(f"{row['job']}: {reason}", console)


def _ending(row: dict[str, Any]) -> list[Text]:
    state = row["status"] if row["ran"] else f"{row['status']} before"
    taken = f"{row['seconds']:.1f} s" if "seconds" in row else ""
    saved = f"{row['cache']['saved_seconds']:.1f} s" if row.get("cache") else ""
    word = row["verdict"]["word"] if row.get("verdict") else ""
    styles = STYLE.get(row["status"], ""), VERDICT_STYLE.get(word, "")
    return [Text(state, styles[0]), Text(word, styles[1]), Text(taken), Text(saved)]
