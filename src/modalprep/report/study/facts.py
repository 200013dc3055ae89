"""What the page of a study says first: how the jobs ended, what failed and why, the extremes of each quantity."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple

from modalprep.report.numbers import number
from modalprep.report.study.data import is_number, varying
from modalprep.report.terminal import clock
from modalprep.verdicts.verdict import FAIL, FAILED, OPEN, PASS, WARNED

GROUPS, NAMED = 12, 4  # kinds of failures that are listed, and jobs that are named with each
KINDS = ("failed", "not met", "warning")
NUMBER = re.compile(r"\d[\d.]*(?:[eE][-+]?\d+)?")
DONE, WAITING = "done", "waiting"
Rows = Sequence[Mapping[str, Any]]


class Counts(NamedTuple):
    """Numbers of jobs: done, failed, waiting, and done without meeting what was required."""

    done: int
    failed: int
    waiting: int
    not_met: int

    @property
    def ended(self) -> int:
        """Those that are done or failed."""
        return self.done + self.failed

    @property
    def style(self) -> str:
        """Of the box of the page."""
        if self.failed or self.not_met:
            return "fail"
        return "open-box" if self.waiting else "pass"

    @property
    def words(self) -> str:
        """In a few words, the worst first."""
        said = [f"{count} {what}" for count, what in ((self.failed, "failed"), (self.not_met, "not met")) if count]
        so_far = f"{self.done} of {sum(self[:3])} done" if self.waiting else f"all {self.done} done"
        return ", ".join(said) or so_far


class Group(NamedTuple):
    """Jobs with the same trouble, by their rows."""

    kind: str
    says: str
    jobs: list[int]

    @property
    def name(self) -> str:
        """Kind and sentence."""
        return f"{self.kind}: {self.says}"

    @property
    def first(self) -> list[int]:
        """Those that are named."""
        return self.jobs[:NAMED]


def counts(rows: Rows) -> Counts:
    """Return how many jobs are done, failed and waiting.

    Examples
    --------
    >>> counts([{"status": "done"}, {"status": "waiting"}]).words
    '1 of 2 done'
    """
    status = Counter(row.get("status") for row in rows)
    done, waiting = status[DONE], status[WAITING]
    return Counts(done, len(rows) - done - waiting, waiting, sum(_unmet(row) for row in rows))


def _unmet(row: Mapping[str, Any]) -> bool:
    return row.get("status") == DONE and _word(row) == FAIL


def _word(row: Mapping[str, Any]) -> str:
    return (row.get("verdict") or {}).get("word", "")


def facts(rows: Rows) -> list[tuple[str, str]]:
    """Return the facts of a study with their names: counts, verdicts, times.

    Examples
    --------
    >>> facts([{"job": "a", "status": "done", "seconds": 75.0, "verdict": {"word": "PASS"}}])
    [('done', '1'), ('failed', '0'), ('waiting', '0'), ('verdicts', '1 PASS'), ('time of all jobs', '1:15 min')]
    """
    number_of = counts(rows)
    words = Counter(filter(None, map(_word, rows)))
    found = [(name, str(getattr(number_of, name))) for name in ("done", "failed", "waiting")]
    verdicts = ", ".join(f"{words[word]} {word}" for word in (FAIL, WARNED, PASS, OPEN) if words[word])
    found += [("verdicts", verdicts)] if verdicts else []
    return [*found, *_times(rows)]


def _times(rows: Rows) -> list[tuple[str, str]]:
    timed = [row for row in rows if row.get("seconds")]
    if not timed:
        return []
    spent = sum(row["seconds"] for row in timed)
    found = [("time of all jobs", clock(spent))]
    if len(timed) > 1:
        slow = max(timed, key=lambda row: row["seconds"])
        found.append(("a job in the mean", f"{number(spent / len(timed), 3)} s"))
        found.append(("the longest", f"{number(slow['seconds'], 3)} s, {slow['job']}"))
    return found


def troubles(rows: Rows) -> list[Group]:
    """Return causes of failures, then requirements that are not met, then warnings, each kind with the most jobs first.

    Sentences that differ in numbers only are one, said by the first of its jobs.

    Examples
    --------
    >>> failed = {"job": "a", "status": "failed", "cause": "a.toml: no mesh", "pipeline": "a.toml"}
    >>> troubles([failed])
    [Group(kind='failed', says='no mesh', jobs=[0])]
    """
    found: dict[tuple[str, str], Group] = {}
    for k, row in enumerate(rows):
        for kind, says in _troubles(row):
            found.setdefault((kind, NUMBER.sub("#", says)), Group(kind, says, [])).jobs.append(k)
    groups = sorted(found.values(), key=lambda group: -len(group.jobs))
    return [group for kind in KINDS for group in _most([group for group in groups if group.kind == kind])]


def _troubles(row: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    verdict = row.get("verdict") or {}
    if row.get("cause"):
        yield KINDS[0], row["cause"].removeprefix(str(row.get("pipeline"))).lstrip(":, ")
    elif row.get("status") == DONE:
        yield from ((KINDS[1], each["name"]) for each in verdict.get("requirements", ()) if each["result"] == FAILED)
    yield from ((KINDS[2], text) for text in verdict.get("warnings", ()))


def _most(groups: Sequence[Group]) -> list[Group]:
    rest = groups[GROUPS:]
    if len(rest) < 2:
        return list(groups)
    jobs = sorted({k for group in rest for k in group.jobs})
    return [*groups[:GROUPS], Group(rest[0].kind, f"{len(rest)} other sentences", jobs)]


class Extreme(NamedTuple):
    """Smallest and largest value of a quantity, with the rows that have them."""

    name: str
    smallest: str
    at_smallest: int
    largest: str
    at_largest: int


def extremes(columns: Mapping[str, Sequence[Any]], parameters: Sequence[str]) -> list[Extreme]:
    """Return the extremes of the quantities that vary.

    Examples
    --------
    >>> extremes({"job": ["a", "b"], "mass_kg": [2.0, 1.5]}, ())
    [Extreme(name='mass_kg', smallest='1.5', at_smallest=1, largest='2', at_largest=0)]
    """
    found = []
    for name, values in columns.items():
        if name in parameters or not is_number(values) or not varying(values):
            continue
        known = [k for k, value in enumerate(values) if value is not None]
        low = min(known, key=values.__getitem__)
        high = max(known, key=values.__getitem__)
        found.append(Extreme(name, number(values[low], 5), low, number(values[high], 5), high))
    return found
