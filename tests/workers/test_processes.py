"""Local processes: limits of time and memory, retries."""

import time

import pytest
from tasks import Odd, Once

from modalprep.workers.processes import Processes
from modalprep.workers.team import Limits

GIB = 2**30


def outcomes(team, jobs):
    waiting, found = list(jobs), {}
    latest = time.monotonic() + 60.0
    while len(found) < len(jobs):
        assert time.monotonic() < latest
        while waiting and team.free:
            team.submit(waiting.pop(0))
        found |= dict(team.collect(0.5))
    return found


@pytest.mark.parametrize(
    ("job", "limits", "cause"),
    [
        (("take", GIB), Limits(memory=GIB / 2), "more than 0.5 GiB of memory, the limit of a job"),
        (("sleep", 1000.0), Limits(seconds=3.0), "ended after 3 s, the limit of a job"),
        (("kill", 0), Limits(retries=1), "SIGKILL"),
    ],
)
def test_a_job_over_its_limit_fails_alone(job, limits, cause):
    team = Processes(2, Odd(), limits)
    try:
        found = outcomes(team, [job, *(("ok", k) for k in range(4))])
        assert cause in found.pop(job)[1]
        assert {what for what, _ in found.values()} == {"ok"}
    finally:
        team.close()


def test_a_process_that_dies_once_is_tried_again(tmp_path):
    """The second try finds what the first has left, and is done."""
    file = tmp_path / "tried"
    team = Processes(1, Once(), Limits(retries=1))
    try:
        assert outcomes(team, [("kill once", str(file))]) == {("kill once", str(file)): "done"}
    finally:
        team.close()
