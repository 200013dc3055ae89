"""A batch in plain sentences."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import Any

from modalprep.report.terminal import clock
from modalprep.verdicts.verdict import FAIL, WARNED, read_verdict

SHOWN = 3  # jobs or warnings that are named


def explain_batch(results: Mapping[str, Any]) -> list[str]:
    """Return how many jobs there are, their verdicts, what failed, and which warnings are most frequent.

    Examples
    --------
    >>> explain_batch({"jobs": [{"job": "a", "status": "done", "cause": ""}], "seconds": 75.0})[0]
    'The batch has 1 job, of which 1 is done; it took 1:15 min.'
    """
    jobs = results["jobs"]
    done = sum(job["status"] == "done" for job in jobs)
    plural = "" if len(jobs) == 1 else "s"
    start = f"The batch has {len(jobs)} job{plural}, of which {done} {'is' if done == 1 else 'are'} done; it took "
    return [start + f"{clock(results['seconds'])}.", *_verdicts(jobs), *_failures(jobs), *_slowest(jobs)]


def _verdicts(jobs: list[dict[str, Any]]) -> list[str]:
    known = {job["job"]: read_verdict(job["verdict"]) for job in jobs if job.get("verdict")}
    if not known:
        return ["No job has a verdict."]
    counts = Counter(verdict.word for verdict in known.values())
    said = [f"The verdicts are {', '.join(f'{count} {word}' for word, count in counts.most_common())}."]
    failed = [f"{name} ({verdict.reasons[0]})" for name, verdict in known.items() if verdict.word == FAIL]
    if failed:
        said.append(f"Not met: {'; '.join(failed[:SHOWN])}{_and_others(failed)}.")
    warned = Counter(
        warning for verdict in known.values() if verdict.word in (FAIL, WARNED) for warning in verdict.warnings
    )
    said += [f"{count} job{'s' * (count > 1)}: {text}." for text, count in warned.most_common(SHOWN)]
    return said


def _failures(jobs: list[dict[str, Any]]) -> list[str]:
    failed = [f"{job['job']} ({job['cause']})" for job in jobs if job["status"] != "done"]
    return [f"Not done: {'; '.join(failed[:SHOWN])}{_and_others(failed)}; the others can be used."] if failed else []


def _slowest(jobs: list[dict[str, Any]]) -> list[str]:
    timed = [job for job in jobs if "seconds" in job]
    if len(timed) < 2:
        return []
    slow = max(timed, key=lambda job: job["seconds"])
    return [f"The longest job is {slow['job']}, {clock(slow['seconds'])}."]


def _and_others(named: list[str]) -> str:
    return f" and {len(named) - SHOWN} more" if len(named) > SHOWN else ""
