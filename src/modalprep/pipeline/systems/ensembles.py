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
from modalprep.pipeline.schema.changing import read_events
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.program import program
from modalprep.report.ensemble import band_plot, statistics_table, write_cases, write_statistics
from modalprep.verdicts.verdict import FAILED, PASSED, Requirement

TOLD = 5  # cases that failed and are named on the console


def ensemble_files(table: EnsembleTable, stem: Path) -> list[Path]:
    """Return the files that an ensemble writes, those with numbers first; `stem` is the folder and the file's name."""
    names = [".h5", ".csv", "-cases.csv", *(f"{suffix}.png" for suffix in _suffixes(len(table.channels)))]
    return [stem.with_name(f"{stem.name}-ensemble{name}") for name in names]


def _suffixes(count: int) -> list[str]:
    return [""] if count == 1 else [f"-{number + 1}" for number in range(count)]


def simulate_ensemble(source: Loaded, system: System, nominal: Result, stem: Path, reporter: Reporter) -> Ensemble:
    """Run the cases of an ensemble, write its files, and print its table.

    Finished cases of an interrupted ensemble, and of one that had failed cases, are taken from its file.

    Raises
    ------
    InputError
        When a distribution cannot be used.
    """
    path, table = source.path, source.pipeline.ensemble
    files = ensemble_files(table, stem)
    with naming(path), naming("[ensemble]"):
        task = plan(system, ensemble_cases(table), table.channels, _options(source.pipeline))
    whose = identity(task) | {"program": program()["sources_sha256"]}
    keeper = Keeper(files[0], whose)
    collected = _begun(task, keeper, reporter)
    with reporter.progress(f"{path.name}: ensemble of {table.count} cases", table.count, unit="cases") as progress:
        found = run_cases(task, collected, keeper, **_where(table), progress=progress)
    _tell(found, table, reporter)
    reporter.wrote(write_ensemble(found, files[0], levels=table.percentiles, identity=whose))
    reporter.wrote(write_statistics(found, files[1], table.percentiles))
    reporter.wrote(write_cases(found, files[2]))
    for channel, file in zip(table.channels, files[3:], strict=True):
        reporter.wrote(band_plot(found, channel, file, levels=table.percentiles, nominal=nominal))
    return found


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


def _options(pipeline: Pipeline) -> dict[str, Any]:
    return pipeline.simulation.steps | {"events": read_events(pipeline.events)}


def _where(table: EnsembleTable) -> dict[str, Any]:
    """Return where the cases run; those of a job of a batch in its own threads, as its neighbours have the others."""
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


def _begun(task: CaseTask, keeper: Keeper, reporter: Reporter) -> Collected:
    """Return the cases with those finished before; a file of another ensemble is replaced."""
    collected = Collected(task)
    try:
        collected.adopt(keeper.read())
    except InputError:
        return collected
    if collected.finished:
        reporter.say(f"  {collected.finished} cases were finished before")
    return collected


def _tell(found: Ensemble, table: EnsembleTable, reporter: Reporter) -> None:
    counts = ", ".join(f"{found.status.count(name)} {name}" for name in sorted(set(found.status)))
    reporter.say(f"  {len(found)} cases: {counts}")
    for sentence in found.failures[:TOLD]:
        reporter.say(f"  {sentence}")
    if len(found.failures) > TOLD:
        reporter.say(f"  and {len(found.failures) - TOLD} more, see the file of cases")
    for sentence in found.notes[:TOLD]:
        reporter.note(sentence)
    statistics_table(found, reporter.console, table.percentiles)


def ensemble_audit(found: Ensemble) -> Requirement:
    """Return the requirement that no case failed or diverged, and that their energies balance."""
    why = found.failures
    if not why:
        return Requirement(name="ensemble", result=PASSED, says=f"{len(found)} cases")
    says = f"{len(why)} of {len(found)} cases of the ensemble failed, the first: {why[0]}"
    return Requirement(name="ensemble", result=FAILED, says=says)
