"""From a pipeline file to equilibrium, modes, linear equations, frequency response and hinge forces of a system."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.atomic import refuse_unwritable, write_json
from modalprep.errors import InputError
from modalprep.formats.resultfile import write_csv, write_result
from modalprep.formats.statespace import write_state_space
from modalprep.multibody.analysis.equilibrium import Equilibrium, static_equilibrium
from modalprep.multibody.analysis.inverse_dynamics import InverseDynamics, inverse_dynamics
from modalprep.multibody.analysis.linearise import linearise
from modalprep.multibody.analysis.state_space import StateSpace, frequency_response
from modalprep.multibody.analysis.system_modes import SystemModes, system_modes
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.results.result import Result, output_times
from modalprep.pipeline.building.sources import mark_source, output_folder, refuse_shared_folders
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.analysis import AnalysisTable, InverseTable
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.pipeline.schema.time import has_several_values, time_function
from modalprep.pipeline.systems.outline import refuse_before_work
from modalprep.pipeline.systems.read import in_theory, read_system
from modalprep.report.analysis import (
    course,
    most_moved,
    response_plot,
    sweep_plot,
    system_table,
    write_response,
    write_sweep,
)
from modalprep.verdicts.notes import warnings_of
from modalprep.verdicts.verdict import FAILED, PASSED, Requirement, Verdict

LINEAR = 1e-4  # error of the linear equations over their largest entry, above which an analysis fails


@dataclass(frozen=True, kw_only=True)
class Analysed:
    """Results of an analysis; None where not requested."""

    equilibrium: Equilibrium | None
    modes: SystemModes | None
    linear: StateSpace | None
    sweep: dict[float, SystemModes] | None
    swept: tuple[str, ...]
    inverse: InverseDynamics | None
    table: AnalysisTable

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know about the validity of the results."""
        inverse = () if self.inverse is None else self.inverse.notes
        rest = () if self.equilibrium is None else self.equilibrium.notes
        return (*rest, *_instabilities(self.modes), *self.swept, *inverse)

    @property
    def audits(self) -> tuple[Requirement, ...]:
        """Whether the linear equations are accurate; empty without."""
        if self.linear is None:
            return ()
        error = self.linear.error
        if error <= LINEAR:
            says = f"{error:.1e} of their largest entry, limit {LINEAR:.0e}"
            return (Requirement(name="linear equations", result=PASSED, says=says),)
        says = (
            f"the linear equations have errors of {error:.0e} of their largest entry, above {LINEAR:.0e}: "
            "the accelerations are not smooth near this state"
        )
        return (Requirement(name="linear equations", result=FAILED, says=says),)

    @cached_property
    def verdict(self) -> Verdict:
        """PASS, PASS WITH WARNINGS or FAIL, with the reasons."""
        found = Requirement(name="analysis", result=PASSED, says="it found what was asked for")
        return Verdict.of((found, *self.audits), warnings_of(self.notes))

    def summary(self) -> dict[str, Any]:
        """Return the content of the JSON file: SI units, frequencies in Hz, damping ratios, eigenvalues in 1/s."""
        found: dict[str, Any] = {}
        if self.equilibrium is not None:
            rest = self.equilibrium
            kinds = {"joints": rest.joints, "modal": rest.modal, "closures": rest.closures}
            lists = {
                kind: {name: np.asarray(v).tolist() for name, v in values.items()} for kind, values in kinds.items()
            }
            found["equilibrium"] = {"stable": rest.stable, "steps": rest.steps} | lists
        if self.modes is not None:
            kept = slice(self.table.modes)
            names = {"frequency_Hz": self.modes.frequency, "damping_ratio": self.modes.damping}
            found["modes"] = {name: values[kept].tolist() for name, values in names.items()}
            found["modes"]["eigenvalue_1/s"] = [[z.real, z.imag] for z in self.modes.eigenvalue[kept].tolist()]
            found["modes"]["moves_most"] = most_moved(self.modes)[kept]
        if self.linear is not None:
            found["state_space"] = {"states": len(self.linear.A), "error": self.linear.error}
        return found | {"notes": list(self.notes), "verdict": self.verdict.summary()}


def _instabilities(modes: SystemModes | None) -> tuple[str, ...]:
    """Say how many modes of all grow, those included that are not asked for."""
    growing = [z.real for z in modes.eigenvalue.tolist() if course(z).startswith("unstable")] if modes else []
    if not growing:
        return ()
    count = f"{len(growing)} of its modes {'grows' if len(growing) == 1 else 'grow'}"
    return (f"the system is unstable about this state: {count}, the fastest by {max(growing):.4g} 1/s",)


def analyse_pipeline(path: str | Path | Loaded, output: Path | None, reporter: Reporter) -> Analysed:
    """Run the [analysis] of a pipeline file; write ``<name>-analysis.json`` and the requested files.

    Raises
    ------
    InputError
        When the file has no [analysis] or names what is not there.
    SimulationError
        When nothing rests, or the linear equations do not exist.
    """
    source = load(path)
    path, table = source.path, source.pipeline.analysis
    if table is None:
        raise InputError(f"{path} has no [analysis]: add one with modes, response or inverse")
    refuse_shared_folders(source, output)
    stem = output_folder(path, output) / path.stem
    refuse_unwritable(stem.with_name(f"{stem.name}-analysis.json"))
    refuse_before_work(source)
    system = in_theory(read_system(source, output, reporter), table.theory)
    with naming(path), reporter.progress(f"{path.name}: analysis", 1) as done:
        found = _analysed(system, table, path.parent)
        done(1)
    mark_source(stem.parent, path)
    _report(found, stem, reporter)
    return found


def _analysed(system: System, table: AnalysisTable, folder: Path) -> Analysed:
    rest = _rest(system, table, table.time)
    at = (None if rest is None else rest.y, table.time)
    sweep, swept = _sweep(system, table)
    needed = table.inputs or table.outputs or table.state_space
    return Analysed(
        equilibrium=rest,
        modes=system_modes(system, *at) if table.modes else None,
        linear=linearise(system, *at, inputs=table.inputs, outputs=table.outputs) if needed else None,
        sweep=sweep,
        swept=swept,
        inverse=None if table.inverse is None else _inverse(system, table.inverse, folder),
        table=table,
    )


def _rest(system: System, table: AnalysisTable, t: float) -> Equilibrium | None:
    return None if table.about == "start" else static_equilibrium(system, t=t, steady=table.about == "steady")


def _sweep(system: System, table: AnalysisTable) -> tuple[dict[float, SystemModes] | None, tuple[str, ...]]:
    """Return the modes over time and the notes on their equilibria."""
    if table.sweep is None:
        return None, ()
    times = np.linspace(table.time, table.sweep.until, table.sweep.points).tolist()
    rests = {t: _rest(system, table, t) for t in times}
    notes = tuple(note for rest in rests.values() if rest is not None for note in rest.notes)
    return {t: system_modes(system, None if rest is None else rest.y, t) for t, rest in rests.items()}, notes


def _inverse(system: System, table: InverseTable, folder: Path) -> InverseDynamics:
    times = output_times(table.t_end, table.output_step)
    motion = {name: _law(name, value, folder) for name, value in table.motion.items()}
    return inverse_dynamics(system, motion, times, modes=table.modes, rtol=table.rtol)


def _law(name: str, value: Any, folder: Path) -> TimeFunction | list[TimeFunction]:
    with naming(f"motion of joint {name!r}"):
        if has_several_values(value):
            return [time_function("motion", each, folder) for each in value]
        return time_function("motion", value, folder)


def _report(found: Analysed, stem: Path, reporter: Reporter) -> None:
    """Print the equilibrium and the table of modes, write all files."""
    if found.equilibrium is not None:
        how = "stable" if found.equilibrium.stable else "not stable"
        reporter.say(f"  {how} equilibrium after {found.equilibrium.steps} steps")
    for note in found.notes:
        reporter.note(note)
    if found.modes is not None:
        system_table(found.modes, found.table.modes, reporter.console)
    reporter.wrote(write_json(found.summary(), stem.with_name(f"{stem.name}-analysis.json")))
    for kind in found.table.state_space:
        reporter.wrote(write_state_space(found.linear, stem.with_name(f"{stem.name}-state-space.{kind}")))
    if found.table.response is not None:
        _response(found, stem, reporter)
    if found.sweep is not None:
        table = found.table.sweep
        reference = [curve.model_dump() for curve in found.table.sweep.reference]
        reporter.wrote(write_sweep(found.sweep, table.modes, stem.with_name(f"{stem.name}-sweep.csv")))
        target = stem.with_name(f"{stem.name}-sweep.png")
        reporter.wrote(sweep_plot(found.sweep, table.modes, target, label=table.label, reference=reference))
    if found.inverse is not None:
        _forces(found.inverse, stem, reporter)


def _response(found: Analysed, stem: Path, reporter: Reporter) -> None:
    table = found.table.response
    frequency = np.geomspace(table.lowest, table.highest, table.points)
    H = frequency_response(found.linear, frequency)
    for write, suffix in ((write_response, "csv"), (response_plot, "png")):
        reporter.wrote(write(found.linear, frequency, H, stem.with_name(f"{stem.name}-response.{suffix}")))


def _forces(found: InverseDynamics, stem: Path, reporter: Reporter) -> None:
    """Write hinge forces and modal coordinates as channels of a result, and draw the forces."""
    from modalprep.report.charts.plots import history_plot

    forces = {f"{name}.drive": force[:, 0] if force.shape[1] == 1 else force for name, force in found.force.items()}
    modal = {f"{name}.modal": values for name, values in found.modal.items() if values.shape[1]}
    run = Result(time=found.time, channels=forces | modal, status="done", message="inverse dynamics")
    reporter.wrote(write_result(run, stem.with_name(f"{stem.name}-inverse.h5")))
    reporter.wrote(write_csv(run, stem.with_name(f"{stem.name}-inverse.csv")))
    target = stem.with_name(f"{stem.name}-inverse.png")
    reporter.wrote(history_plot({"forces": run}, list(forces), target, ylabel="drive (N, N m)"))
