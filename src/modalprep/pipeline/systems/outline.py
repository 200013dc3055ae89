"""Errors of a system that are found before its bodies are built, on rigid stand-ins with the same interfaces."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from functools import lru_cache

from modalprep.ensemble.parameters import Parameters
from modalprep.multibody.analysis.inputs_outputs import Input, output
from modalprep.multibody.deploying.simulate import deployment_channels
from modalprep.multibody.deploying.system import DeployingSystem
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.expressions import CHANNEL, channel_expression
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.free_body.flight import simulate_free_system
from modalprep.multibody.model.events import check_changes
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.preparation import channel_names
from modalprep.multibody.results.recovered_state import RecoveredState
from modalprep.multibody.results.result import Result
from modalprep.multibody.simulate import check_span, check_steps
from modalprep.pipeline.building.build import read_bodies, stand_in
from modalprep.pipeline.schema.analysis import AnalysisTable
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.changing import read_events
from modalprep.pipeline.schema.film import FilmTable
from modalprep.pipeline.schema.load import Loaded
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.pipeline.schema.system import SimulationTable
from modalprep.pipeline.systems.read import in_theory, system_of
from modalprep.suggest import matching, refuse_unknown

OF_MODES = (  # channels of a flexible body that its rigid stand-in lacks
    "modal",
    "stress",
    "mass",
    "recovery",
    "interface_loads",
    "modal_rate",
    "modal_acceleration",
    "frame_acceleration",
    "frame_angular_velocity",
    "frame_angular_acceleration",
)


@lru_cache(maxsize=1)  # several stages of a run call it
def refuse_before_work(source: Loaded) -> None:
    """Refuse a wrong time span or distribution, and unknown names, before any body is built.

    Raises
    ------
    InputError
        Which says what is wrong.
    """
    pipeline = source.pipeline
    simulation = pipeline.simulation
    with naming(source.path):
        if simulation is not None:
            _check_times(simulation)
        if pipeline.ensemble is not None:
            from modalprep.pipeline.systems.ensembles import ensemble_cases  # only here, as it imports what draws

            with naming("[ensemble]"):
                ensemble_cases(pipeline.ensemble)
        pending = _pending(source)
        if pending or pipeline.synthesis is not None:
            outline = replace(source, pipeline=_without_modes(pipeline, pending))
            _refuse_names(source, system_of(outline, read_bodies(source, stand_in)), pending)


def _check_times(table: SimulationTable) -> None:
    check_span(table.t_end, table.output_step, table.rtol, table.atol, table.method)
    check_steps(table.t_end, table.max_step, table.shortest_event)


def _pending(source: Loaded) -> set[str]:
    """Return the names of the bodies that are yet to be built by pipeline files."""
    own = {source.body_name} if source.pipeline.has_body else set()
    return own | {name for name, table in source.pipeline.bodies.items() if table.pipeline is not None}


def _without_modes(pipeline: Pipeline, pending: set[str]) -> Pipeline:
    """Return the file without the tables that need the points or the modes of bodies yet to be built."""
    forces = {name: table.model_copy(update={"box": None}) for name, table in pipeline.forces.items()}
    depletions = {name: table for name, table in pipeline.depletions.items() if table.body not in pending}
    omitted = pipeline.depletions.keys() - depletions
    jets = {name: table for name, table in pipeline.jets.items() if table.depletion not in omitted}
    return pipeline.model_copy(update={"forces": forces, "depletions": depletions, "jets": jets})


def _refuse_names(source: Loaded, system: System | DeployingSystem, pending: set[str]) -> None:
    """Refuse unknown channels, inputs and outputs, and expressions of them."""
    pipeline = source.pipeline
    refuse_channels(source, system, pending)
    if isinstance(system, System):
        _refuse_expressions(pipeline, system, pending)
        if pipeline.analysis is not None:
            _refuse_inputs(pipeline.analysis, system, pending)


def _is_pending(name: str, pending: Collection[str]) -> bool:
    """Whether a channel needs the modes of a body that is yet to be built."""
    body, _, part = name.partition(".")
    return body in pending and part.partition(".")[0] in OF_MODES


def refuse_channels(source: Loaded, system: System | DeployingSystem, pending: Collection[str] = ()) -> None:
    """Refuse channels and parameters that the run does not have, except channels of the modes of `pending` bodies.

    Raises
    ------
    InputError
        Which names the channel or the parameter.
    """
    pipeline, simulation = source.pipeline, source.pipeline.simulation
    if simulation is None:
        return
    with naming(source.path):
        known = _channels(simulation, system)
        plotted = [name for plot in pipeline.plots for name in plot.channels]
        plotted += [f"{plot.relative_to}.origin" for plot in pipeline.plots if plot.relative_to is not None]
        collected = [name for table in (pipeline.ensemble, pipeline.collect) if table for name in table.channels]
        for name in [*simulation.output, *plotted, *collected]:
            if not _is_pending(name, pending):
                known[name]
        for table in (*pipeline.srs.values(), *pipeline.fatigue.values()):
            for name in table.channels if table.response is None else ():
                if not (_is_pending(name, pending) or matching(known.table(), name)):
                    known[name]
        if isinstance(system, System):
            _refuse_film(pipeline.film, system)
            if pipeline.ensemble is not None:
                Parameters(system, list(pipeline.ensemble.parameters))
            if pipeline.run_sensitivities is not None and not pending:
                from modalprep.pipeline.systems.derivatives import refuse_derivatives  # which imports reports

                refuse_derivatives(pipeline.run_sensitivities, system, simulation, known.channels)


def _refuse_film(table: FilmTable, system: System) -> None:
    """Refuse unknown bodies and interfaces of a film, also where no film is drawn."""
    for key, names in (("follow", [table.follow] if table.follow else []), ("boxes", table.boxes)):
        for name in names:
            refuse_unknown(name, system.bodies, f"[film] {key}: body")
    for trail in table.trails:
        locate(system.bodies, trail, "[film] trails")


def _channels(table: SimulationTable, system: System | DeployingSystem) -> Result:
    """Return the channels of a run by name."""
    if isinstance(system, DeployingSystem):
        return deployment_channels(system)
    if table.variables == "joint":
        return channel_names(system, table.t_end)
    return simulate_free_system(in_theory(system, table.chosen_theory), t_end=1e-9, output_step=1e-9)


def _refuse_expressions(pipeline: Pipeline, system: System, pending: set[str]) -> None:
    """Refuse events and control laws that cannot be read."""
    events, simulation = read_events(pipeline.events), pipeline.simulation
    check_changes(system, events)
    packed = pack(system)
    loops = Loading(system, packed, simulation.t_end).loops if simulation and events else None
    others = RecoveredState(system, packed, loops).reader
    for name, table in pipeline.events.items():
        if _is_known(table.when, pending):
            channel_expression(system, packed, table.when, f"event {name!r}", loops, others)
    for name, table in pipeline.fmu.items():
        if table.at not in [joint.name for joint in system.joints]:
            locate(system.bodies, table.at, f"FMU {name!r}")
        for key, text in table.inputs.items():
            if _is_known(str(text), pending):
                channel_expression(system, packed, str(text), f"FMU {name!r}: input {key!r}")
    for name, table in pipeline.controls.items():
        if table.at not in [joint.name for joint in system.joints]:
            locate(system.bodies, table.at, f"control {name!r}")
        for text in map(str, (*(table.values or ()), *(table.force or ()), *(table.torque or ()))):
            if _is_known(text, pending):
                channel_expression(system, packed, text, f"control {name!r}")


def _is_known(text: str, pending: set[str]) -> bool:
    """Whether no channel of an expression needs the modes of a body that is yet to be built."""
    return not any(_is_pending(name, pending) for name in CHANNEL.findall(text))


def _refuse_inputs(table: AnalysisTable, system: System, pending: set[str]) -> None:
    """Refuse unknown inputs and outputs of linear equations."""
    evaluator = Evaluator(system.with_(closures=()), table.time)  # stand-ins cannot close the loops
    for name in table.inputs:
        Input(evaluator, name)
    for name in table.outputs:
        if not _is_pending(name, pending):
            output(evaluator, name)
