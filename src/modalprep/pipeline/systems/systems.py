"""From a pipeline file to a multibody system and its simulation."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

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
from modalprep.pipeline.systems.outline import refuse_before_work, refuse_channels
from modalprep.pipeline.systems.read import in_theory, read_system
from modalprep.report.tables import envelope_table

if TYPE_CHECKING:
    from modalprep.ensemble.record import Ensemble
    from modalprep.verdicts.verdict import Requirement

LABELS = {
    "consistent": "with geometric stiffness",
    "no_geometric_stiffness": "conventional theory (without)",
    "ruthless": "linearised in the modes",
}


@dataclass(frozen=True)
class Simulated:
    """The system, its runs by label (the main one first), files, the audits of the main run, the ensemble.

    `envelopes` are those of the recoveries in the main run.
    """

    system: System | DeployingSystem
    runs: dict[str, Result]
    files: list[Path]
    audits: tuple[Requirement, ...] = ()
    ensemble: Ensemble | None = None
    envelopes: tuple[Envelope, ...] = ()

    @property
    def main(self) -> Result:
        """The main run."""
        return next(iter(self.runs.values()))

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know about the bodies, about each run and about the ensemble."""
        runs = [f"{label}: {note}" for label, run in self.runs.items() for note in run.notes]
        return (*body_warnings(self.system.bodies), *runs, *(self.ensemble.notes if self.ensemble else ()))


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
    """Run the simulation part of a pipeline file, then its ensemble; write HDF5 and CSV.

    Raises
    ------
    InputError
        When the file has no [simulation] or names what is not there.
    SimulationError
        When the integration cannot go on.
    """
    source = load(path)
    path, pipeline = source.path, source.pipeline
    if pipeline.simulation is None:
        raise InputError(f"{path} has no [simulation]: add one with t_end")
    if any(table.response is None for table in pipeline.srs.values()):
        need("pyyeti", f"{path}: [srs]")
    if target is None:
        refuse_shared_folders(source, output)
    folder = target.parent if target else output_folder(path, output)
    own = target is None
    target = target or folder / f"{path.stem}-run.h5"
    stem = folder / path.stem
    written = (target, _csv_beside(target), _envelopes_beside(target), target.with_suffix(".html"))
    if pipeline.ensemble is not None:  # what it imports takes as long as a short run
        from modalprep.pipeline.systems.ensembles import ensemble_audit, ensemble_files, simulate_ensemble

        written += tuple(ensemble_files(pipeline.ensemble, stem))
    refuse_overwriting(written, [*needed_files(source), *made_bodies(source, output)])
    refuse_before_work(source)
    system = read_system(source, output, reporter)
    refuse_channels(source, system)
    theory = pipeline.simulation.chosen_theory
    if theory == "consistent" and not geometric_stiffness:
        theory = "no_geometric_stiffness"
    others = ["no_geometric_stiffness"] if pipeline.simulation.compare_conventional else []
    variants = {LABELS[name]: in_theory(system, name) for name in [theory, *others]}
    runs = {label: _simulate(source, label, variant, reporter, reference) for label, variant in variants.items()}
    main = next(iter(runs.values()))
    compared = {"conventional": runs[LABELS["no_geometric_stiffness"]]} if len(runs) > 1 else {}
    if own:
        mark_source(folder, path)
    files = [write_result(main, target, compared)]
    files.append(write_csv(main, _csv_beside(target), pipeline.simulation.output))
    extremes = envelopes(main, system.bodies)
    if extremes:
        files.append(write_envelopes(extremes, _envelopes_beside(target)))
        envelope_table(extremes, reporter.console)
    for file in files:
        reporter.wrote(file)
    audited = audits(main, pipeline.simulation.rtol, sum(body.m for body in system.bodies.values()))
    ensemble = None
    if pipeline.ensemble is not None:
        ensemble = simulate_ensemble(source, next(iter(variants.values())), main, stem, reporter)
        audited.append(ensemble_audit(ensemble))
    return Simulated(system, runs, files, tuple(audited), ensemble, extremes)


def _envelopes_beside(target: Path) -> Path:
    return target.with_name(f"{target.stem}-envelopes.csv")


def _csv_beside(target: Path) -> Path:
    refuse_folder(target)
    return target.with_suffix(".csv") if target.suffix != ".csv" else target.with_name(f"{target.stem}-table.csv")


def _simulate(
    source: Loaded, label: str, system: System | DeployingSystem, reporter: Reporter, reference: bool
) -> Result:
    s = source.pipeline.simulation
    with reporter.progress(f"{source.path.name}: {label}", s.t_end, unit="s") as progress:
        if isinstance(system, DeployingSystem):
            if reference:
                raise InputError("[deployments] have no reference implementation; leave out --reference")
            run = simulate_deployment(system, **s.steps, progress=progress)
        elif s.variables == "joint":
            events = read_events(source.pipeline.events)
            run = simulate(system, **s.steps, events=events, reference=reference, progress=progress)
        elif reference:
            raise InputError(f"variables = {s.variables!r} have no reference implementation; leave out --reference")
        else:
            run = simulate_free_system(system, **s.model_dump(include={"t_end", "output_step", "rtol", "variables"}))
    momenta = f", momenta kept to {run.stats['momentum_error']:.0e}" if "momentum_error" in run.stats else ""
    reporter.say(
        f"  {run.message}; {run.stats['steps']:.0f} steps, "
        f"energy balance to {run.stats['energy_error']:.0e} of its largest part{momenta}"
    )
    for note in run.notes:
        reporter.note(note)
    return run
