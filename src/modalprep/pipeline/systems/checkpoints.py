"""The checkpoint of a run of a pipeline file, from which it goes on after an interruption."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from modalprep.ensemble.identity import fingerprint
from modalprep.errors import InputError
from modalprep.formats.resultfile import read_result, stated_identity, write_result
from modalprep.multibody.checkpoints import join_runs
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.multibody.simulate import simulate
from modalprep.pipeline.console import Reporter
from modalprep.program import program


def checkpoint_file(stem: Path, number: int) -> Path:
    """Return the file of the checkpoints of one of the runs of a pipeline file.

    Examples
    --------
    >>> checkpoint_file(Path("output/arm/arm"), 0).as_posix()
    'output/arm/arm-checkpoint.h5'
    """
    return stem.with_name(f"{stem.name}-checkpoint{number or ''}.h5")


def simulate_on(system: System, options: dict[str, Any], file: Path, every: float, reporter: Reporter) -> Result:
    """Simulate with checkpoints every so many seconds; a run that was interrupted goes on from its file.

    Notes on functions of time and closures are those of the second part; the file is deleted in the end.

    Raises
    ------
    InputError
        As `simulate`.
    """
    known = {name: value for name, value in options.items() if name != "progress"}
    identity = fingerprint(system, known, program()["sources_sha256"])
    before = _before(file, identity, reporter)

    def keep(run: Result) -> None:
        write_result(run if before is None else join_runs(before, run), file, identity=identity)

    if before is not None:
        options = options | {"start": before}
    run = simulate(system, **options, checkpoint=keep, checkpoint_every=every)
    file.unlink(missing_ok=True)
    return run if before is None else join_runs(before, run)


def _before(file: Path, identity: str, reporter: Reporter) -> Result | None:
    """Return what an earlier run of the same system and options left."""
    if not file.is_file():
        return None
    try:
        if stated_identity(file) == identity:
            run = read_result(file)
            reporter.say(f"  goes on at t = {run.time[-1]:.6g} s from {file}")
            return run
    except InputError as error:
        reporter.say(f"  {error}: the run begins anew")
        return None
    reporter.say(f"  {file} is of another system, options or program: the run begins anew")
    return None
