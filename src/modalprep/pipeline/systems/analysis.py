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
from modalprep.multibody.rotors.campbell import Campbell, campbell
from modalprep.multibody.rotors.unbalance import UnbalanceResponse, unbalance_response
from modalprep.pipeline.building.sources import mark_source, output_folder, refuse_shared_folders
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.analysis import AnalysisTable, InverseTable, RotorTable, SweepTable
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
from modalprep.report.rotor import (
    campbell_plot,
    campbell_summary,
    campbell_table,
    peaks_table,
    unbalance_plot,
    unbalance_summary,
    write_campbell,
    write_unbalance,
)
from modalprep.verdicts.notes import warnings_of
from modalprep.verdicts.verdict import FAILED, PASSED, Requirement, Verdict

LINEAR = 1e-4  # largest error of the linear equations, relative to their largest entry


@dataclass(frozen=True, kw_only=True)
class Analysed:
    """Results of an analysis; None where not requested."""

    equilibrium: Equilibrium | None
    modes: SystemModes | None
    linear: StateSpace | None
    sweep: dict[float, SystemModes] | None
    sweep_notes: tuple[str, ...]
    inverse: InverseDynamics | None
    rotors: dict[str, Campbell]
    unbalance: dict[str, UnbalanceResponse]
    table: AnalysisTable

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the validity of the results."""
        inverse = () if self.inverse is None else self.inverse.notes
        equilibrium = () if self.equilibrium is None else self.equilibrium.notes
        linear = () if self.linear is None else self.linear.notes
        rotors = [f"rotor {name}: {note}" for name, found in self.rotors.items() for note in _rotor_notes(found)]
        rotors += [f"rotor {name}: {note}" for name, found in self.unbalance.items() for note in found.notes]
        rotors = list(dict.fromkeys(rotors))
        return (*equilibrium, *_instabilities(self.modes), *linear, *self.sweep_notes, *inverse, *rotors)

    @property
    def audits(self) -> tuple[Requirement, ...]:
        """Whether the linear equations are accurate; empty without linear equations."""
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
        complete = Requirement(name="analysis", result=PASSED, says="it found what was asked for")
        return Verdict.of((complete, *self.audits), warnings_of(self.notes))

    def summary(self) -> dict[str, Any]:
        """Return the content of the JSON file: SI units, frequencies in Hz, damping ratios, eigenvalues in 1/s."""
        summary: dict[str, Any] = {}
        if self.equilibrium is not None:
            state = self.equilibrium
            kinds = {"joints": state.joints, "modal": state.modal, "closures": state.closures}
            lists = {
                kind: {name: np.asarray(v).tolist() for name, v in values.items()} for kind, values in kinds.items()
            }
            summary["equilibrium"] = {"stable": state.stable, "steps": state.steps} | lists
        if self.modes is not None:
            listed = slice(self.table.modes)
            names = {"frequency_Hz": self.modes.frequency, "damping_ratio": self.modes.damping}
            summary["modes"] = {name: values[listed].tolist() for name, values in names.items()}
            summary["modes"]["eigenvalue_1/s"] = [[z.real, z.imag] for z in self.modes.eigenvalue[listed].tolist()]
            summary["modes"]["moves_most"] = most_moved(self.modes)[listed]
        if self.linear is not None:
            summary["state_space"] = {"states": len(self.linear.A), "error": self.linear.error}
        if self.rotors:
            summary["rotors"] = {name: campbell_summary(found) for name, found in self.rotors.items()}
        for name, response in self.unbalance.items():
            summary["rotors"][name]["unbalance"] = unbalance_summary(response)
        return summary | {"notes": list(self.notes), "verdict": self.verdict.summary()}


def _instabilities(modes: SystemModes | None) -> tuple[str, ...]:
    """Return a note on the number of unstable modes, those that are not listed included."""
    growing = [z.real for z in modes.eigenvalue.tolist() if course(z).startswith("unstable")] if modes else []
    if not growing:
        return ()
    count = f"{len(growing)} of its modes {'grows' if len(growing) == 1 else 'grow'}"
    return (f"the system is unstable about this state: {count}, the fastest by {max(growing):.4g} 1/s",)


def _rotor_notes(found: Campbell) -> list[str]:
    """Return the notes of a Campbell diagram, and where modes grow or could not be followed."""
    notes = list(found.notes)
    if found.first_unstable is not None:
        notes.append(f"unstable at {found.first_unstable * 30 / np.pi:.4g} rpm: a mode grows")
    if lost := int(np.sum(np.any(np.isnan(found.eigenvalue), axis=0))):
        notes.append(f"{lost} of its modes could not be followed over all speeds; give more points or modes")
    return notes


def analyse_pipeline(path: str | Path | Loaded, output: Path | None, reporter: Reporter) -> Analysed:
    """Run the [analysis] of a pipeline file; write ``<name>-analysis.json`` and the requested files.

    Raises
    ------
    InputError
        When the file has no [analysis], or names something unknown.
    SimulationError
        When there is no equilibrium, or the linear equations do not exist.
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
    assert isinstance(system, System)  # by the check of the file: [deployments] are not combined with [analysis]
    with naming(path), reporter.progress(f"{path.name}: analysis", 1) as done:
        analysed = _analysed(system, table, path.parent)
        done(1)
    mark_source(stem.parent, path)
    _report(analysed, stem, reporter)
    return analysed


def _analysed(system: System, table: AnalysisTable, folder: Path) -> Analysed:
    equilibrium = _equilibrium(system, table, table.time)
    y = None if equilibrium is None else equilibrium.y
    t = table.time
    sweep, sweep_notes = _sweep(system, table)
    needed = table.inputs or table.outputs or table.state_space
    return Analysed(
        equilibrium=equilibrium,
        modes=system_modes(system, y, t) if table.modes else None,
        linear=linearise(system, y, t, inputs=table.inputs, outputs=table.outputs) if needed else None,
        sweep=sweep,
        sweep_notes=sweep_notes,
        inverse=None if table.inverse is None else _inverse(system, table.inverse, folder),
        rotors={name: _rotor(system, name, rotor) for name, rotor in table.rotor.items()},
        unbalance={name: _unbalance(system, name, rotor) for name, rotor in table.rotor.items() if rotor.unbalance},
        table=table,
    )


def _equilibrium(system: System, table: AnalysisTable, t: float) -> Equilibrium | None:
    return None if table.about == "start" else static_equilibrium(system, t=t, steady=table.about == "steady")


def _sweep(system: System, table: AnalysisTable) -> tuple[dict[float, SystemModes] | None, tuple[str, ...]]:
    """Return the modes over time and the notes on their equilibria."""
    if table.sweep is None:
        return None, ()
    times = np.linspace(table.time, table.sweep.until, table.sweep.points).tolist()
    states = {t: _equilibrium(system, table, t) for t in times}
    notes = tuple(note for state in states.values() if state is not None for note in state.notes)
    return {t: system_modes(system, None if state is None else state.y, t) for t, state in states.items()}, notes


def _inverse(system: System, table: InverseTable, folder: Path) -> InverseDynamics:
    times = output_times(table.t_end, table.output_step)
    motion = {name: _law(name, value, folder) for name, value in table.motion.items()}
    return inverse_dynamics(system, motion, times, modes=table.modes, rtol=table.rtol)


def _rotor(system: System, name: str, table: RotorTable) -> Campbell:
    with naming(f"[analysis.rotor.{name}]"):
        return campbell(system, table.joint, _speeds(table), axis=table.axis, modes=table.modes, orders=table.orders)


def _unbalance(system: System, name: str, table: RotorTable) -> UnbalanceResponse:
    with naming(f"[analysis.rotor.{name}]"):
        return unbalance_response(system, table.joint, _speeds(table), table.unbalance, axis=table.axis)


def _speeds(table: RotorTable) -> np.ndarray:
    return np.linspace(table.lowest, table.highest, table.points)


def _law(name: str, value: Any, folder: Path) -> TimeFunction | list[TimeFunction]:
    with naming(f"motion of joint {name!r}"):
        if has_several_values(value):
            return [time_function("motion", each, folder) for each in value]
        return time_function("motion", value, folder)


def _report(analysed: Analysed, stem: Path, reporter: Reporter) -> None:
    """Print the equilibrium and the table of modes, write all files."""
    table = analysed.table
    if analysed.equilibrium is not None:
        how = "stable" if analysed.equilibrium.stable else "not stable"
        reporter.say(f"  {how} equilibrium after {analysed.equilibrium.steps} steps")
    reporter.notes(analysed.notes)
    if analysed.modes is not None:
        system_table(analysed.modes, table.modes, reporter.console)
    reporter.wrote(write_json(analysed.summary(), stem.with_name(f"{stem.name}-analysis.json")))
    if analysed.linear is not None:
        _write_linear(analysed.linear, table, stem, reporter)
    if analysed.sweep is not None and table.sweep is not None:
        _write_modes(analysed.sweep, table.sweep, stem, reporter)
    if analysed.inverse is not None:
        _forces(analysed.inverse, stem, reporter)
    for name, found in analysed.rotors.items():
        _write_rotor(found, name, stem, reporter)
    for name, response in analysed.unbalance.items():
        _write_unbalance(response, name, stem, reporter)


def _write_linear(linear: StateSpace, table: AnalysisTable, stem: Path, reporter: Reporter) -> None:
    """Write the linear equations and their frequency response, and draw the response."""
    for kind in table.state_space:
        reporter.wrote(write_state_space(linear, stem.with_name(f"{stem.name}-state-space.{kind}")))
    if table.response is None:
        return
    frequency = np.geomspace(table.response.lowest, table.response.highest, table.response.points)
    H = frequency_response(linear, frequency)
    for write, suffix in ((write_response, "csv"), (response_plot, "png")):
        reporter.wrote(write(linear, frequency, H, stem.with_name(f"{stem.name}-response.{suffix}")))


def _write_modes(sweep: dict[float, SystemModes], table: SweepTable, stem: Path, reporter: Reporter) -> None:
    """Write and draw the frequencies over time."""
    reference = [curve.model_dump() for curve in table.reference]
    reporter.wrote(write_sweep(sweep, table.modes, stem.with_name(f"{stem.name}-sweep.csv")))
    target = stem.with_name(f"{stem.name}-sweep.png")
    reporter.wrote(sweep_plot(sweep, table.modes, target, label=table.label, reference=reference))


def _write_rotor(found: Campbell, name: str, stem: Path, reporter: Reporter) -> None:
    """Print the critical speeds, write and draw the Campbell diagram."""
    campbell_table(found, name, reporter.console)
    own = stem.with_name(f"{stem.name}-rotor-{name}")
    reporter.wrote(write_campbell(found, own.with_name(f"{own.name}.csv")))
    reporter.wrote(campbell_plot(found, own.with_name(f"{own.name}.png")))


def _write_unbalance(found: UnbalanceResponse, name: str, stem: Path, reporter: Reporter) -> None:
    """Print the peaks, write and draw the response."""
    peaks_table(found, name, reporter.console)
    own = stem.with_name(f"{stem.name}-rotor-{name}-unbalance")
    reporter.wrote(write_unbalance(found, own.with_name(f"{own.name}.csv")))
    reporter.wrote(unbalance_plot(found, own.with_name(f"{own.name}.png")))


def _forces(inverse: InverseDynamics, stem: Path, reporter: Reporter) -> None:
    """Write hinge forces and modal coordinates as channels of a result, and draw the forces."""
    from modalprep.report.charts.plots import history_plot

    forces = {f"{name}.drive": force[:, 0] if force.shape[1] == 1 else force for name, force in inverse.force.items()}
    modal = {f"{name}.modal": values for name, values in inverse.modal.items() if values.shape[1]}
    run = Result(time=inverse.time, channels=forces | modal, status="done", message="inverse dynamics")
    reporter.wrote(write_result(run, stem.with_name(f"{stem.name}-inverse.h5")))
    reporter.wrote(write_csv(run, stem.with_name(f"{stem.name}-inverse.csv")))
    target = stem.with_name(f"{stem.name}-inverse.png")
    reporter.wrote(history_plot({"forces": run}, list(forces), target, ylabel="drive (N, N m)"))
