"""The [simulation] of a pipeline file: its runs, its ensemble and their files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from modalprep.atomic import refuse_folder
from modalprep.errors import InputError
from modalprep.extras import need
from modalprep.formats.resultfile import write_csv, write_envelopes, write_result
from modalprep.multibody.deploying.simulate import simulate_deployment
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.free_body.flight import simulate_free_system
from modalprep.multibody.model.system import System
from modalprep.multibody.results.envelopes import Envelope, envelopes
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import audits, body_warnings
from modalprep.multibody.simulate import simulate
from modalprep.pipeline.building.build import made_bodies
from modalprep.pipeline.building.sources import (
    mark_source,
    needed_files,
    output_folder,
    refuse_overwriting,
    refuse_shared_folders,
)
from modalprep.pipeline.console import Reporter, says_compiling
from modalprep.pipeline.schema.changing import read_events
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.pipeline.schema.system import SimulationTable, Theory
from modalprep.pipeline.systems.checkpoints import checkpoint_file, simulate_on
from modalprep.pipeline.systems.outline import refuse_before_work, refuse_channels
from modalprep.pipeline.systems.read import in_theory, read_system
from modalprep.pipeline.systems.start import read_start
from modalprep.report.tables import envelope_table

if TYPE_CHECKING:
    from modalprep.ensemble.record import Ensemble
    from modalprep.pipeline.schema.pipeline import Pipeline
    from modalprep.pipeline.systems.derivatives import Differentiated
    from modalprep.verdicts.verdict import Requirement

LABELS: dict[Theory, str] = {
    "consistent": "with geometric stiffness",
    "no_geometric_stiffness": "conventional theory (without)",
    "ruthless": "linearised in the modes",
}


@dataclass(frozen=True)
class Simulated:
    """The system, its runs by label (the main one first), files, the audits of the main run, the ensemble.

    `envelopes` are those of the recoveries in the main run, `derivatives` those of [run_sensitivities].
    """

    system: System | DeployingSystem
    runs: dict[str, Result]
    files: list[Path]
    audits: tuple[Requirement, ...] = ()
    ensemble: Ensemble | None = None
    envelopes: tuple[Envelope, ...] = ()
    derivatives: Differentiated | None = None

    @property
    def main(self) -> Result:
        """The main run."""
        return next(iter(self.runs.values()))

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the bodies, on each run, on the ensemble and on the derivatives."""
        runs = [f"{label}: {note}" for label, run in self.runs.items() for note in run.notes]
        more = [note for part in (self.ensemble, self.derivatives) if part for note in part.notes]
        return (*body_warnings(self.system.bodies), *runs, *more)


@says_compiling
def simulate_pipeline(
    path: str | Path | Loaded,
    output: Path | None,
    reporter: Reporter,
    *,
    target: Path | None = None,
    geometric_stiffness: bool = True,
    reference: bool = False,
) -> Simulated:
    """Run the simulation part of a pipeline file, then its ensemble and its derivatives; write HDF5 and CSV.

    The run is written to `target`, by default ``<name>-run.h5`` in the folder of the file's outputs.

    Raises
    ------
    InputError
        When the file has no [simulation], or names something unknown.
    SimulationError
        When the integration fails.
    """
    source = load(path)
    path, pipeline = source.path, source.pipeline
    simulation = pipeline.simulation
    if simulation is None:
        raise InputError(f"{path} has no [simulation]: add one with t_end")
    if any(table.response is None for table in pipeline.srs.values()):
        need("pyyeti", f"{path}: [srs]")
    if target is None:
        refuse_shared_folders(source, output)
    folder = target.parent if target else output_folder(path, output)
    stem = folder / path.stem
    file = target or folder / f"{path.stem}-run.h5"
    refuse_overwriting(_files(pipeline, file, stem), [*needed_files(source), *made_bodies(source, output)])
    refuse_before_work(source)
    system = read_system(source, output, reporter)
    refuse_channels(source, system)
    variants = {LABELS[theory]: in_theory(system, theory) for theory in _theories(simulation, geometric_stiffness)}
    start = read_start(simulation, source.folder, system)
    begin = {"start": start, "period": simulation.period, "events": read_events(pipeline.events)}
    runs = _run(source, simulation, variants, begin | {"reference": reference}, stem, reporter)
    if target is None:
        mark_source(folder, path)
    main = next(iter(runs.values()))
    extremes = envelopes(main, system.bodies)
    files = _write(runs, extremes, file, simulation.output)
    if extremes:
        envelope_table(extremes, reporter.console)
    for written in files:
        reporter.wrote(written)
    varied = next(iter(variants.values()))
    ensemble = _ensemble(source, varied, simulation.steps | begin, main, stem, reporter)
    derivatives = _derivatives(source, varied, simulation.steps | begin, stem, reporter)
    audited = _audits(system, main, simulation.rtol, ensemble)
    return Simulated(system, runs, files, audited, ensemble, extremes, derivatives)


def _files(pipeline: Pipeline, target: Path, stem: Path) -> list[Path]:
    """Return the files that the runs may write."""
    found = [target, _csv_beside(target), _envelopes_beside(target), target.with_suffix(".html")]
    if pipeline.ensemble is not None:
        from modalprep.pipeline.systems.ensembles import ensemble_files  # its imports take as long as a short run

        found += ensemble_files(pipeline.ensemble, stem)
    if pipeline.run_sensitivities is not None:
        from modalprep.pipeline.systems.derivatives import derivative_files

        found += derivative_files(pipeline.run_sensitivities, stem)
    return found


def _write(runs: dict[str, Result], extremes: tuple[Envelope, ...], target: Path, channels: list[str]) -> list[Path]:
    """Write the main run with the one that it is compared with, its table and its envelopes; return the files."""
    main = next(iter(runs.values()))
    compared = {"conventional": runs[LABELS["no_geometric_stiffness"]]} if len(runs) > 1 else {}
    files = [write_result(main, target, compared), write_csv(main, _csv_beside(target), channels)]
    if extremes:
        files.append(write_envelopes(extremes, _envelopes_beside(target)))
    return files


def _theories(table: SimulationTable, geometric_stiffness: bool) -> list[Theory]:
    """Return the theories of the runs, that of the main run first."""
    theory = table.chosen_theory
    if theory == "consistent" and not geometric_stiffness:
        theory = "no_geometric_stiffness"
    return [theory, "no_geometric_stiffness"] if table.compare_conventional else [theory]


def _envelopes_beside(target: Path) -> Path:
    return target.with_name(f"{target.stem}-envelopes.csv")


def _csv_beside(target: Path) -> Path:
    refuse_folder(target)
    return target.with_suffix(".csv") if target.suffix != ".csv" else target.with_name(f"{target.stem}-table.csv")


def _run(
    source: Loaded,
    table: SimulationTable,
    variants: Mapping[str, System | DeployingSystem],
    options: dict[str, Any],
    stem: Path,
    reporter: Reporter,
) -> dict[str, Result]:
    """Return the run of each variant, by its label."""
    runs = {}
    for number, (label, variant) in enumerate(variants.items()):
        with reporter.progress(f"{source.path.name}: {label}", table.t_end, unit="s") as progress:
            file = checkpoint_file(stem, number)
            runs[label] = _simulate(table, variant, options | {"progress": progress}, file, reporter)
        _report(runs[label], reporter)
    return runs


def _ensemble(
    source: Loaded,
    system: System | DeployingSystem,
    options: dict[str, Any],
    main: Result,
    stem: Path,
    reporter: Reporter,
) -> Ensemble | None:
    table = source.pipeline.ensemble
    if table is None:
        return None
    from modalprep.pipeline.systems.ensembles import simulate_ensemble

    assert isinstance(system, System)  # by the check of the file: [deployments] are not combined with [ensemble]
    return simulate_ensemble(source.path, table, system, options, main, stem, reporter)


def _derivatives(
    source: Loaded, system: System | DeployingSystem, options: dict[str, Any], stem: Path, reporter: Reporter
) -> Differentiated | None:
    table = source.pipeline.run_sensitivities
    if table is None:
        return None
    from modalprep.pipeline.systems.derivatives import differentiate

    assert isinstance(system, System)  # by the check of the file
    return differentiate(source.path, table, system, options, stem, reporter)


def _audits(
    system: System | DeployingSystem, main: Result, rtol: float, ensemble: Ensemble | None
) -> tuple[Requirement, ...]:
    """Return the audits of the main run, and that of the ensemble."""
    found = audits(main, rtol, sum(body.m for body in system.bodies.values()))
    if ensemble is not None:
        from modalprep.pipeline.systems.ensembles import ensemble_audit

        found.append(ensemble_audit(ensemble))
    return tuple(found)


def _simulate(
    table: SimulationTable,
    system: System | DeployingSystem,
    options: dict[str, Any],
    file: Path,
    reporter: Reporter,
) -> Result:
    """Return one run; the options are those of `simulate` beside the table's, `file` is that of its checkpoints."""
    if isinstance(system, DeployingSystem):
        if options["reference"]:
            raise InputError("[deployments] have no reference implementation; leave out --reference")
        if table.checkpoint is not None:
            raise InputError("[simulation] checkpoint: runs with [deployments] have none; leave it out")
        return simulate_deployment(system, **table.steps, progress=options["progress"])
    if table.variables == "joint":
        if table.checkpoint is not None:
            return simulate_on(system, table.steps | options, file, table.checkpoint, reporter)
        return simulate(system, **table.steps, **options)
    if options["reference"]:
        raise InputError(f"variables = {table.variables!r} have no reference implementation; leave out --reference")
    return simulate_free_system(system, **table.model_dump(include={"t_end", "output_step", "rtol", "variables"}))


def _report(run: Result, reporter: Reporter) -> None:
    momenta = f", momenta kept to {run.stats['momentum_error']:.0e}" if "momentum_error" in run.stats else ""
    reporter.say(
        f"  {run.message}; {run.stats['steps']:.0f} steps, "
        f"energy balance to {run.stats['energy_error']:.0e} of its largest part{momenta}"
    )
    reporter.notes(run.notes)
