"""Console output of a batch: a progress bar on a terminal, a line per job in a log, and a final table."""

from __future__ import annotations

import itertools
import time
from collections import Counter
from collections.abc import Sequence
from typing import Any

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeElapsedColumn
from rich.progress import Progress as Bar
from rich.table import Column
from rich.text import Text

from modalprep.pipeline.batch.job import DONE, Job, Record
from modalprep.pipeline.console import Reporter
from modalprep.report.terminal import VERDICT_STYLE, clock, plain_table, print_table, print_text, right_aligned
from modalprep.verdicts.verdict import read_verdict
from modalprep.workers.team import Team

STYLE = {DONE: "green", "failed": "bold red"}
SHOWN = 3  # jobs named beside the bar
MOST, NAMED = 200, 20  # jobs with a row of their own, and failed ones with a line of their own where there are more


class Progress:
    """Reports ended jobs and estimates the remaining time from the mean time of a job.

    Parameters
    ----------
    reporter : Reporter
    total : int
        Jobs to run.
    team : Team
        Their workers, which may come and go.
    """

    def __init__(self, reporter: Reporter, total: int, team: Team) -> None:
        self._reporter, self._total, self._team = reporter, total, team
        self._begun: dict[str, float] = {}
        self._ended, self._seconds = 0, 0.0
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
        self._ended, self._seconds = self._ended + 1, self._seconds + record["seconds"]
        rest = f"; about {clock(self.seconds_left())} left" if self._ended < self._total else ""
        cause = f": {record['cause']}" if record["cause"] else ""
        what = f"[{self._ended}/{self._total}] {job.name} {record['status']} in {record['seconds']:.1f} s{rest}{cause}"
        self._reporter.say(what)

    def tick(self) -> None:
        """Move the bar, and say what the workers have to say."""
        for line in self._team.news():
            self._reporter.say(line)
        names = list(itertools.islice(self._begun, SHOWN))
        more = f" and {len(self._begun) - SHOWN} more" if len(self._begun) > SHOWN else ""
        left = f"about {clock(self.seconds_left())} left" if self._ended else ""
        self._bar.update(self._task, completed=self._ended, description=", ".join(names) + more or "jobs", left=left)

    def seconds_left(self) -> float:
        """Return the estimated remaining time: the mean of ended jobs, less the time of those that already run."""
        mean = self._seconds / self._ended
        now = time.perf_counter()
        first = itertools.islice(self._begun.values(), self._team.size)  # the others wait at a scheduler
        spent = sum(min(mean, now - begun) for begun in first)
        return max(0.0, (self._total - self._ended) * mean - spent) / self._team.size


def jobs_table(rows: Sequence[dict[str, Any]], console: Console) -> None:
    """Print a row per job: grid values, status, verdict, time, time saved; then a line per failure or reason.

    Of more than 200 jobs only a summary and the first failures are printed.

    Examples
    --------
    >>> row = {"job": "a", "pipeline": "a.toml", "values": {}, "ran": True, "status": "failed", "cause": "no mesh"}
    >>> jobs_table([row], Console(width=80, color_system=None))  # doctest: +ELLIPSIS
    <BLANKLINE>
    ...a failed: no mesh
    """
    if len(rows) > MOST:
        _summary(rows, console)
        return
    keys = list(dict.fromkeys(key for row in rows for key in row["values"]))
    texts = (Column(Text(head)) for head in ("job", *keys, "state", "verdict"))
    table = plain_table(*texts, *right_aligned("time", "saved", no_wrap=False))
    for row in rows:
        table.add_row(*map(Text, [row["job"], *(row["values"].get(key, "") for key in keys)]), *_ending(row))
    console.print()
    print_table(table, console)
    for row in rows:
        if row["cause"]:
            print_text(_failed(row), console)
        elif row.get("verdict"):
            for reason in read_verdict(row["verdict"]).reasons:
                print_text(f"{row['job']}: {reason}", console)


def _summary(rows: Sequence[dict[str, Any]], console: Console) -> None:
    """Print how many jobs ended how, and the first that failed: the page of the batch has them all."""
    console.print()
    states = Counter(row["status"] for row in rows)
    verdicts = Counter(row["verdict"]["word"] for row in rows if row.get("verdict"))
    print_text(", ".join(f"{count} jobs {state}" for state, count in states.most_common()), console)
    if verdicts:
        said = ", ".join(f"{count} {word}" for word, count in verdicts.most_common())
        print_text(f"verdicts: {said}", console)
    failed = [row for row in rows if row["cause"]]
    for row in failed[:NAMED]:
        print_text(_failed(row), console)
    if len(failed) > NAMED:
        print_text(f"and {len(failed) - NAMED} more failed", console)


def _failed(row: dict[str, Any]) -> str:
    cause = row["cause"].removeprefix(row["pipeline"]).lstrip(":, ")
    return f"{row['job']} failed: {cause}"


def _ending(row: dict[str, Any]) -> list[Text]:
    state = row["status"] if row["ran"] else f"{row['status']} before"
    taken = f"{row['seconds']:.1f} s" if "seconds" in row else ""
    saved = f"{row['cache']['saved_seconds']:.1f} s" if row.get("cache") else ""
    word = row["verdict"]["word"] if row.get("verdict") else ""
    styles = STYLE.get(row["status"], ""), VERDICT_STYLE.get(word, "")
    return [Text(state, styles[0]), Text(word, styles[1]), Text(taken), Text(saved)]
