"""What is wrong with a system and can be said before its bodies are built, by stand-ins with their interfaces."""

from __future__ import annotations

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
from modalprep.multibody.results.recovered_state import RecoveredState
from modalprep.multibody.results.result import Result
from modalprep.multibody.simulate import channel_names, check_span, check_steps
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

OF_MODES = (  # channels of a body that its stand-in does not have
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


@lru_cache(maxsize=1)  # the stages of a run ask again
def refuse_before_work(source: Loaded) -> None:
    """Refuse a wrong time span or distribution, and names of what is not there, before any body is built.

    Raises
    ------
    InputError
        Which says what is wrong.
    """
    pipeline, s = source.pipeline, source.pipeline.simulation
    with naming(source.path):
        if s is not None:
            check_span(s.t_end, s.output_step, s.rtol, s.atol, s.method)
            check_steps(s.t_end, s.max_step, s.shortest_event)
        if pipeline.ensemble is not None:
            from modalprep.pipeline.systems.ensembles import ensemble_cases  # only here, as it imports what draws

            with naming("[ensemble]"):
                ensemble_cases(pipeline.ensemble)
        made = _made(source)
        if made or pipeline.synthesis is not None:
            outline = replace(source, pipeline=_without_modes(pipeline, made))
            _refuse_names(source, system_of(outline, read_bodies(source, stand_in)), made)


def _made(source: Loaded) -> set[str]:
    """Return the names of the bodies that are made by pipeline files, for which others stand in."""
    own = {source.body_name} if source.pipeline.has_body else set()
    return own | {name for name, table in source.pipeline.bodies.items() if table.pipeline is not None}


def _without_modes(pipeline: Pipeline, made: set[str]) -> Pipeline:
    """Return the file without the tables that need the points or the modes of bodies that are not there yet."""
    forces = {name: table.model_copy(update={"box": None}) for name, table in pipeline.forces.items()}
    depletions = {name: table for name, table in pipeline.depletions.items() if table.body not in made}
    left = pipeline.depletions.keys() - depletions
    jets = {name: table for name, table in pipeline.jets.items() if table.depletion not in left}
    return pipeline.model_copy(update={"forces": forces, "depletions": depletions, "jets": jets})


def _refuse_names(source: Loaded, system: System | DeployingSystem, made: set[str]) -> None:
    """Refuse channels, inputs and expressions of what is not there."""
    pipeline = source.pipeline
    if pipeline.simulation is not None:
        refuse_channels(source, system, made)
    if isinstance(system, System):
        _refuse_expressions(pipeline, system, made)
        if pipeline.analysis is not None:
            _refuse_inputs(pipeline.analysis, system, made)


def _waits(name: str, made: set[str]) -> bool:
    """Whether a channel is known only when the body is there."""
    body, _, part = name.partition(".")
    return body in made and part.partition(".")[0] in OF_MODES


def refuse_channels(source: Loaded, system: System | DeployingSystem, made: set[str] = frozenset()) -> None:
    """Refuse channels and parameters that a run does not have; channels of the modes of stand-ins are not looked at.

    Raises
    ------
    InputError
        Which names the channel or the parameter.
    """
    pipeline = source.pipeline
    with naming(source.path):
        known = _channels(pipeline.simulation, system)
        plotted = [name for plot in pipeline.plots for name in plot.channels]
        plotted += [f"{plot.relative_to}.origin" for plot in pipeline.plots if plot.relative_to is not None]
        kept = [name for table in (pipeline.ensemble, pipeline.collect) if table for name in table.channels]
        for name in [*pipeline.simulation.output, *plotted, *kept]:
            if not _waits(name, made):
                known[name]
        for table in (*pipeline.srs.values(), *pipeline.fatigue.values()):
            for name in table.channels if table.response is None else ():
                if not (_waits(name, made) or matching(known.table(), name)):
                    known[name]
        if isinstance(system, System):
            _refuse_film(pipeline.film, system)
        if pipeline.ensemble is not None:
            Parameters(system, list(pipeline.ensemble.parameters))


def _refuse_film(table: FilmTable, system: System) -> None:
    """Refuse bodies and interfaces of a film that are not there, also where none is drawn."""
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


def _refuse_expressions(pipeline: Pipeline, system: System, made: set[str]) -> None:
    """Refuse events and control laws that cannot be read."""
    events = read_events(pipeline.events)
    check_changes(system, events)
    packed = pack(system)
    loops = Loading(system, packed, pipeline.simulation.t_end).loops if events else None
    others = RecoveredState(system, packed, loops).reader
    texts = [(f"event {event.name!r}", event.when, loops, others) for event in events]
    for name, table in pipeline.controls.items():
        if table.at not in [joint.name for joint in system.joints]:
            locate(system.bodies, table.at, f"control {name!r}")
        values = [*(table.values or ()), *(table.force or ()), *(table.torque or ())]
        texts += [(f"control {name!r}", str(value), None, None) for value in values]
    for what, text, *of in texts:
        if not any(_waits(name, made) for name in CHANNEL.findall(text)):
            channel_expression(system, packed, text, what, *of)


def _refuse_inputs(table: AnalysisTable, system: System, made: set[str]) -> None:
    """Refuse inputs and outputs of linear equations that are not there."""
    evaluator = Evaluator(system.with_(closures=()), table.time)  # which close only when the bodies are there
    for name in table.inputs:
        Input(evaluator, name)
    for name in table.outputs:
        if not _waits(name, made):
            output(evaluator, name, evaluator.start)
