"""The [ensemble] of a pipeline file: its cases, its files, its tables and plots."""

from __future__ import annotations

import multiprocessing
import sys
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.ensemble.cases import draw_cases
from modalprep.ensemble.collect import Collected
from modalprep.ensemble.file import Keeper, write_ensemble
from modalprep.ensemble.record import Ensemble
from modalprep.ensemble.simulate import identity, plan, run_cases
from modalprep.ensemble.task import CaseTask
from modalprep.errors import InputError
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.analysis import EnsembleTable
from modalprep.pipeline.schema.base import naming
from modalprep.program import program
from modalprep.report.ensemble import band_plot, statistics_table, write_cases, write_statistics
from modalprep.verdicts.verdict import FAILED, PASSED, Requirement

PRINTED = 5  # largest number of failures, and of notes, on the console


def ensemble_files(table: EnsembleTable, stem: Path) -> list[Path]:
    """Return the files that an ensemble writes, those with numbers first; `stem` is the folder and the file's name."""
    names = [".h5", ".csv", "-cases.csv", *(f"{suffix}.png" for suffix in _suffixes(len(table.channels)))]
    return [stem.with_name(f"{stem.name}-ensemble{name}") for name in names]


def _suffixes(count: int) -> list[str]:
    return [""] if count == 1 else [f"-{number + 1}" for number in range(count)]


def simulate_ensemble(
    path: Path,
    table: EnsembleTable,
    system: System,
    options: dict[str, Any],
    nominal: Result,
    stem: Path,
    reporter: Reporter,
) -> Ensemble:
    """Run the cases of the ensemble of the pipeline file at `path`, write its files, and print its table.

    `options` are those of `simulate`, `nominal` is the main run. Finished cases of an interrupted ensemble, and of one
    with failed cases, are taken from its file.

    Raises
    ------
    InputError
        When a distribution cannot be used.
    """
    files = ensemble_files(table, stem)
    with naming(path), naming("[ensemble]"):
        task = plan(system, ensemble_cases(table), table.channels, options)
    task_identity = identity(task) | {"program": program()["sources_sha256"]}
    keeper = Keeper(files[0], task_identity)
    collected = _finished_before(task, keeper, reporter)
    with reporter.progress(f"{path.name}: ensemble of {table.count} cases", table.count, unit="cases") as progress:
        ensemble = run_cases(task, collected, keeper, **_workers(table), progress=progress)
    _report(ensemble, table, reporter)
    reporter.wrote(write_ensemble(ensemble, files[0], levels=table.percentiles, identity=task_identity))
    reporter.wrote(write_statistics(ensemble, files[1], table.percentiles))
    reporter.wrote(write_cases(ensemble, files[2]))
    for channel, file in zip(table.channels, files[3:], strict=True):
        reporter.wrote(band_plot(ensemble, channel, file, levels=table.percentiles, nominal=nominal))
    return ensemble


def ensemble_cases(table: EnsembleTable) -> dict[str, np.ndarray]:
    """Return the values of each parameter, those drawn and those listed.

    Raises
    ------
    InputError
        When a distribution cannot be used.
    """
    laws = {name: values.given for name, values in table.parameters.items() if not isinstance(values, list)}
    drawn = draw_cases(laws, table.count, seed=table.seed, sampling=table.sampling) if laws else {}
    return {name: drawn[name] if name in drawn else np.array(values) for name, values in table.parameters.items()}


def _workers(table: EnsembleTable) -> dict[str, Any]:
    """Return pool, workers and scheduler of the cases; a job of a batch has its own threads only."""
    if multiprocessing.parent_process() is not None or _on_cluster():
        return {}
    return {"pool": table.pool, "workers": table.workers, "scheduler": table.scheduler}


def _on_cluster() -> bool:
    """Whether this is a worker of a Dask cluster."""
    distributed = sys.modules.get("distributed")
    try:
        return distributed is not None and distributed.get_worker() is not None
    except ValueError:
        return False


def _finished_before(task: CaseTask, keeper: Keeper, reporter: Reporter) -> Collected:
    """Return the cases that were finished in an earlier run; a file of another ensemble is replaced."""
    collected = Collected(task)
    try:
        collected.adopt(keeper.read())
    except InputError:
        return collected
    if collected.finished:
        reporter.say(f"  {collected.finished} cases were finished before")
    return collected


def _report(ensemble: Ensemble, table: EnsembleTable, reporter: Reporter) -> None:
    counts = ", ".join(f"{ensemble.status.count(name)} {name}" for name in sorted(set(ensemble.status)))
    reporter.say(f"  {len(ensemble)} cases: {counts}")
    for failure in ensemble.failures[:PRINTED]:
        reporter.say(f"  {failure}")
    if len(ensemble.failures) > PRINTED:
        reporter.say(f"  and {len(ensemble.failures) - PRINTED} more, see the file of cases")
    reporter.notes(ensemble.notes[:PRINTED])
    statistics_table(ensemble, reporter.console, table.percentiles)


def ensemble_audit(ensemble: Ensemble) -> Requirement:
    """Return the requirement that no case failed or diverged, and that their energies balance."""
    failures = ensemble.failures
    if not failures:
        return Requirement(name="ensemble", result=PASSED, says=f"{len(ensemble)} cases")
    says = f"{len(failures)} of {len(ensemble)} cases of the ensemble failed, the first: {failures[0]}"
    return Requirement(name="ensemble", result=FAILED, says=says)
