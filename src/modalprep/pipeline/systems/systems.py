"""From a pipeline file to a multibody system and its simulation."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np

from modalprep.atomic import refuse_folder
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.resultfile import write_csv, write_result
from modalprep.multibody.deploying.simulate import deployment_channels, simulate_deployment
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.free_body.flight import simulate_free_system
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.multibody.results.validity import failures
from modalprep.multibody.simulate import check_span, simulate, start_channels
from modalprep.pipeline.build.build import made_bodies, output_folder, read_bodies
from modalprep.pipeline.build.sources import needed_files, refuse_overwriting
from modalprep.pipeline.console import Reporter, says_compiling
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.events import read_events
from modalprep.pipeline.schema.force_elements import ForceElements
from modalprep.pipeline.schema.load import load_pipeline
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.reduction import rotation_matrix
from modalprep.pipeline.schema.system import JointTable, SimulationTable, Theory
from modalprep.pipeline.systems.constraints import read_closures
from modalprep.pipeline.systems.depletions import read_depletions
from modalprep.pipeline.systems.loads import hinge_elements, prescribed_motion, read_deployment, read_loads, read_orbit
from modalprep.suggest import refuse_unknown

TOTALS = ("energy", "power", "momentum")  # channels of the whole system begin so
LABELS = {
    "consistent": "with geometric stiffness",
    "no_geometric_stiffness": "conventional theory (without)",
    "ruthless": "linearised in the modes",
}


@dataclass(frozen=True)
class Simulated:
    """The system, its runs by label (the main one first), the files written, and why the main run failed its audit."""

    system: System | DeployingSystem
    runs: dict[str, Result]
    files: list[Path]
    failures: tuple[str, ...] = ()

    @property
    def notes(self) -> tuple[str, ...]:
        """What the user should know about the validity of each run."""
        return tuple(f"{label}: {note}" for label, run in self.runs.items() for note in run.notes)


@says_compiling
def simulate_pipeline(
    path: Path,
    output: Path | None,
    reporter: Reporter,
    *,
    target: Path | None = None,
    geometric_stiffness: bool = True,
    reference: bool = False,
) -> Simulated:
    """Run the simulation part of a pipeline file; write HDF5 and CSV.

    Raises
    ------
    InputError
        When the file has no [simulation] or names what is not there.
    SimulationError
        When the integration cannot go on.
    """
    pipeline = load_pipeline(path)
    if pipeline.simulation is None:
        raise InputError(f"{path} has no [simulation]: add one with t_end")
    target = target or output_folder(path, output) / f"{path.stem}-run.h5"
    refuse_overwriting((target, _csv_beside(target)), [*needed_files(path), *made_bodies(path, output)])
    refuse_before_work(pipeline, path)
    system = read_system(pipeline, path, output, reporter)
    _refuse_unknown_channels(pipeline, system, path)
    theory = pipeline.simulation.chosen_theory
    if theory == "consistent" and not geometric_stiffness:
        theory = "no_geometric_stiffness"
    others = ["no_geometric_stiffness"] if pipeline.simulation.compare_conventional else []
    variants = {LABELS[name]: in_theory(system, name) for name in [theory, *others]}
    runs = {
        label: _simulate(path, label, variant, pipeline, reporter, reference) for label, variant in variants.items()
    }
    main = next(iter(runs.values()))
    compared = {"conventional": runs[LABELS["no_geometric_stiffness"]]} if len(runs) > 1 else {}
    files = [write_result(main, target, compared)]
    files.append(write_csv(main, _csv_beside(target), pipeline.simulation.output))
    for file in files:
        reporter.wrote(file)
    weight = sum(body.m for body in system.bodies.values())
    found = failures(main, pipeline.simulation.rtol, weight)
    return Simulated(system, runs, files, tuple(f"{path}: {why}" for why in found))


def in_theory(system: System | DeployingSystem, theory: Theory) -> System | DeployingSystem:
    """Return the system with its bodies by a theory of deformation.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> in_theory(arm, "no_geometric_stiffness").bodies["arm"].has_geometric_stiffness
    False
    """
    if theory == "consistent":
        return system
    if isinstance(system, DeployingSystem):
        raise InputError("[deployments] are of rigid rods, which have no geometric stiffness to leave out")
    return system.ruthless() if theory == "ruthless" else system.conventional()


def _csv_beside(target: Path) -> Path:
    refuse_folder(target)
    return target.with_suffix(".csv") if target.suffix != ".csv" else target.with_name(f"{target.stem}-table.csv")


def _simulate(
    path: Path, label: str, system: System | DeployingSystem, pipeline: Pipeline, reporter: Reporter, reference: bool
) -> Result:
    s = pipeline.simulation
    with reporter.progress(f"{path.name}: {label}", s.t_end) as progress:
        span = {"t_end": s.t_end, "output_step": s.output_step, "rtol": s.rtol}
        if isinstance(system, DeployingSystem):
            if reference:
                raise InputError("[deployments] have no reference implementation; leave out --reference")
            run = simulate_deployment(system, **span, atol=s.atol, method=s.method, progress=progress)
        elif s.variables == "joint":
            events = read_events(pipeline.events)
            run = simulate(
                system, **span, atol=s.atol, method=s.method, events=events, reference=reference, progress=progress
            )  # fmt: skip
        else:
            run = simulate_free_system(system, **span, variables=s.variables)
    reporter.say(
        f"  {run.message}; {run.stats['steps']:.0f} steps, "
        f"energy balance to {run.stats['energy_error']:.0e} of its largest part"
    )
    for note in run.notes:
        reporter.say(f"  note: {note}")
    return run


def _refuse_unknown_channels(pipeline: Pipeline, system: System, path: Path) -> None:
    with naming(path):
        known = _first_channels(pipeline.simulation, system)
        plotted = [name for plot in pipeline.plots for name in plot.channels]
        plotted += [f"{plot.relative_to}.origin" for plot in pipeline.plots if plot.relative_to is not None]
        for name in [*pipeline.simulation.output, *plotted]:
            known[name]


def _first_channels(table: SimulationTable, system: System) -> Result:
    if isinstance(system, DeployingSystem):
        return deployment_channels(system)
    if table.variables == "joint":
        return start_channels(system, table.t_end)
    step = min(table.output_step, table.t_end)
    return simulate_free_system(
        in_theory(system, table.chosen_theory), t_end=step, output_step=step, variables=table.variables
    )


def read_system(pipeline: Pipeline, path: Path, output: Path | None, reporter: Reporter) -> System | DeployingSystem:
    """Return the system a pipeline file describes, its bodies read or built."""
    joints = read_joints(pipeline, path)
    bodies = read_bodies(pipeline, path, output, reporter)
    with naming(path):
        bodies = _shared(bodies)
        loads = read_loads(pipeline, bodies, path.parent)
        gravity = pipeline.environment.gravity
        uniform = np.array(gravity if isinstance(gravity, list) else [0.0, 0.0, 0.0])
        closures = read_closures(pipeline.closures, pipeline.couplers, path.parent)
        depletions, jets = read_depletions(pipeline, bodies, path.parent)
        parts = {"bodies": bodies, "joints": joints, "gravity": uniform, "loads": (*loads, *jets)}
        parts["orbit"] = read_orbit(pipeline.environment.orbit)
        if pipeline.deployments:
            found = tuple(read_deployment(name, table, path.parent) for name, table in pipeline.deployments.items())
            return DeployingSystem(**parts, deployments=found)
        return System(**parts, closures=closures, depletions=depletions)


def _body_names(pipeline: Pipeline, path: Path) -> list[str]:
    return [*pipeline.bodies, *([pipeline.name or path.stem] if pipeline.has_body else [])]


def read_joints(pipeline: Pipeline, path: Path) -> tuple[Joint, ...]:
    """Return the joints of a pipeline file; their bodies must be there, but need not be built.

    Raises
    ------
    InputError
        When a joint names no body, or its table contradicts itself.
    """
    bodies = dict.fromkeys(_body_names(pipeline, path))
    with naming(path):
        for name, table in pipeline.joints.items():
            for what, end in () if pipeline.deployments else (("parent", table.parent), ("child", table.child)):
                if end != "ground" or what == "child":
                    refuse_unknown(end.partition(".")[0], bodies, f"joint {name!r}: {what} body")
        return tuple(_joint(name, table, path.parent) for name, table in pipeline.joints.items())


def refuse_before_work(pipeline: Pipeline, path: Path) -> None:
    """Refuse a wrong time span, and joints and channels of what is not there, before any body is built.

    Raises
    ------
    InputError
        Which says what is wrong.
    """
    read_joints(pipeline, path)
    if pipeline.simulation is None:
        return
    s = pipeline.simulation
    named = ("joints", "closures", "couplers", *ForceElements.model_fields)
    with naming(path):
        check_span(s.t_end, s.output_step, s.rtol, s.atol, s.method)
        known = [*_body_names(pipeline, path), *(name for field in named for name in getattr(pipeline, field))]
        for channel in s.output if not pipeline.deployments else ():
            first = channel.partition(".")[0]
            if first not in TOTALS:
                refuse_unknown(first, known, f"channel {channel!r} of output:")


def _shared(bodies: dict[str, FlexibleBody]) -> dict[str, FlexibleBody]:
    """Use one record for equal bodies, so that the kernel stores their arrays once."""
    first: dict[tuple, FlexibleBody] = {}
    return {
        name: first.setdefault((body.name, *sorted(body.provenance.items())), body) if body.provenance else body
        for name, body in bodies.items()
    }


def _joint(name: str, table: JointTable, folder: Path) -> Joint:
    with naming(f"joint {name!r}"):
        known = {field.name for field in fields(Joint)}
        given = {key: value for key, value in [*table, *table.start] if key in known}
        given["rotation"] = rotation_matrix(table.rotation)
        given["motion"] = prescribed_motion(table, folder)
        arrays = {key: np.array(value) if isinstance(value, list) else value for key, value in given.items()}
        return Joint(name=name, elements=hinge_elements(table, folder), **arrays)
