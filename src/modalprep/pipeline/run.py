"""The main job: one pipeline file from mesh to modal file, report, pictures, simulation and plots."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from modalprep.errors import RenderError
from modalprep.extras import need
from modalprep.pipeline.building.build import build_body
from modalprep.pipeline.building.built import Built
from modalprep.pipeline.building.cache import Cache
from modalprep.pipeline.building.sources import output_folder, refuse_shared_folders
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.drawn import Drawn, draw_runs, not_drawn
from modalprep.pipeline.outcome import Outcome
from modalprep.pipeline.schema.load import Loaded, load
from modalprep.verdicts.notes import silent

if TYPE_CHECKING:
    from modalprep.correlation.derivatives import Sensitivities
    from modalprep.pipeline.building.synthesis import Synthesised
    from modalprep.pipeline.responses.respond import Responded
    from modalprep.pipeline.responses.strength import Strength
    from modalprep.pipeline.schema.analysis import SensitivitiesTable
    from modalprep.pipeline.schema.fe import CyclicTable
    from modalprep.pipeline.systems.analysis import Analysed
    from modalprep.pipeline.systems.systems import Simulated
    from modalprep.reduction.cyclic.modes import CyclicModes


def run_pipeline(
    path: str | Path | Loaded,
    output: Path | None,
    reporter: Reporter,
    cache: Cache | None = None,
    *,
    pictures: bool = True,
    report: bool = True,
) -> Outcome:
    """Run all stages of a pipeline file.

    Parameters
    ----------
    path : Path or Loaded
    output : Path or None
        Output folder, with a subfolder for each pipeline. Default ``output`` beside the file.
    reporter : Reporter
    cache : Cache or None
        Cache of previous results.
    pictures : bool
        False draws no mesh and no modes, whatever the file says.
    report : bool
        False writes no HTML pages.

    Raises
    ------
    InputError, AccuracyError, SimulationError
        With one message each; files written before remain intact. An audit that fails raises nothing, nor does a
        negative margin: see `Outcome.verdict`, with which the command ends.
    """
    from modalprep.pipeline.pictures import pictures_beside

    source = load(path)
    refuse(source, output)
    pipeline = source.pipeline
    folder = output_folder(source.path, output)
    wanted = pipeline.output.pictures if pictures else "none"
    with silent(), pictures_beside(wanted if pipeline.has_body else 0) as painter:
        built = build_body(source, folder, reporter, cache) if pipeline.has_body else None
        if built:
            painter.begin(built.body, built.file)
        exported = _exported(source, built, folder, reporter) if built else None
        responses = _responses(source, built, folder, reporter) if built and pipeline.response else ()
        sensitivities = (
            _sensitivities(source, pipeline.sensitivities, folder, reporter) if pipeline.sensitivities else None
        )
        ring = pipeline.cyclic
        cyclic = _cyclic(source, ring, folder, reporter) if ring and ring.nodal_diameters != [] else None
        synthesised = _synthesised(source, output, reporter) if pipeline.synthesis else None
        system_drawn = _system_drawn(source, synthesised, folder, wanted, reporter) if synthesised else None
        analysed = _analysed(source, output, reporter) if pipeline.analysis else None
        simulated = _simulated(source, output, reporter) if pipeline.simulation else None
        run_drawn = draw_runs(source, simulated, folder, reporter) if simulated else None
        strength = strength_of(source, responses, simulated, folder, reporter)
        body_drawn = painter.draw(built.body, built.file, reporter) if built else None
        body = built, exported, responses, sensitivities, cyclic, synthesised, system_drawn
        outcome = Outcome(folder, pipeline, *body, analysed, simulated, run_drawn, strength, body_drawn)
        if report and (built or simulated):
            _pages(source, outcome, reporter)
    return outcome


def refuse(source: Loaded, output: Path | None) -> None:
    """Refuse what can be seen to be wrong before any work is done.

    Raises
    ------
    InputError
        Which says what is wrong.
    """
    pipeline = source.pipeline
    refuse_shared_folders(source, output)
    if pipeline.joints or pipeline.simulation is not None:
        from modalprep.pipeline.systems.outline import refuse_before_work

        refuse_before_work(source)
    if pipeline.srs:
        need("pyyeti", f"{source.path}: [srs]")
    if pipeline.response:
        from modalprep.pipeline.responses.respond import refuse_responses

        refuse_responses(source)


def _exported(source: Loaded, built: Built, folder: Path, reporter: Reporter) -> Drawn:
    """Print a body, write its files for other programs, and draw its effective masses."""
    from modalprep.formats.export import export_body, known_export, lost_in
    from modalprep.report.charts.mass_chart import effective_mass_plot
    from modalprep.report.tables import body_summary, mode_table

    body = built.body
    notes = []
    body_summary(body, reporter.console)
    mode_table(body.modes, reporter.console)
    reporter.notes(built.notes)
    for name in source.pipeline.output.export:
        target = built.file.with_suffix(known_export(name).suffix)
        reporter.wrote(export_body(body, name, target))
        lost = [f"{target.name}: {text}" for text in lost_in(body, name)]
        reporter.notes(lost)
        notes += lost
    chart = effective_mass_plot(body.modes, folder / f"{source.path.stem}-effective-mass.png")
    return Drawn(mass_plot=reporter.wrote(chart), notes=tuple(notes))


def _responses(source: Loaded, built: Built, folder: Path, reporter: Reporter) -> tuple[Responded, ...]:
    from modalprep.pipeline.responses.respond import respond

    found = respond(source, built.body, folder, reporter)
    reporter.notes(note for each in found for note in each.notes)
    return tuple(found)


def _sensitivities(source: Loaded, table: SensitivitiesTable, folder: Path, reporter: Reporter) -> Sensitivities:
    from modalprep.pipeline.building.sensitivity import pipeline_sensitivities
    from modalprep.report.correlation.sensitivity import sensitivity_plot, sensitivity_table

    found = pipeline_sensitivities(source, table)
    sensitivity_table(found, reporter.console)
    name = f"{source.path.stem}-sensitivities"
    _write_rows(found.rows(), folder / f"{name}.csv", reporter)
    reporter.wrote(sensitivity_plot(found, folder / f"{name}.png"))
    return found


def _cyclic(source: Loaded, table: CyclicTable, folder: Path, reporter: Reporter) -> CyclicModes:
    from modalprep.pipeline.building.cyclic import pipeline_cyclic
    from modalprep.report.cyclic import cyclic_plot, cyclic_table

    found = pipeline_cyclic(source, table)
    cyclic_table(found, reporter.console)
    name = f"{source.path.stem}-nodal-diameters"
    _write_rows(found.rows(), folder / f"{name}.csv", reporter)
    reporter.wrote(cyclic_plot(found, folder / f"{name}.png"))
    return found


def _write_rows(rows: Sequence[Mapping[str, Any]], path: Path, reporter: Reporter) -> None:
    """Write a table, its columns by the keys of the first row."""
    from modalprep.atomic import write_table

    reporter.wrote(write_table(rows[0], [list(row.values()) for row in rows], path))


def _synthesised(source: Loaded, output: Path | None, reporter: Reporter) -> Synthesised:
    from modalprep.pipeline.building.synthesis import strain_fractions, synthesise_pipeline
    from modalprep.report.synthesis import synthesis_table

    found = synthesise_pipeline(source, output, reporter)
    achieved = None if found.damping is None else found.damping.achieved
    synthesis_table(found.modes, strain_fractions(found.modes), reporter.console, achieved)
    reporter.notes(found.notes)
    return found


def _system_drawn(
    source: Loaded, synthesised: Synthesised, folder: Path, wanted: str | int, reporter: Reporter
) -> Drawn:
    from modalprep.pipeline.building.synthesis import strain_fractions
    from modalprep.pipeline.pictures import counted
    from modalprep.report.synthesis import draw_modes, strain_plot

    name, modes = source.path.stem, synthesised.modes
    reporter.wrote(strain_plot(modes, strain_fractions(modes), folder / f"{name}-strain-energy.png"))
    try:
        pictures = draw_modes(modes, name, folder, counted(wanted, len(modes.frequency)))
    except RenderError as error:
        return not_drawn(error, reporter)
    reporter.files += pictures
    reporter.say(f"  wrote {len(pictures)} mode pictures {name}-system-mode-*.png")
    return Drawn()


def _analysed(source: Loaded, output: Path | None, reporter: Reporter) -> Analysed:
    from modalprep.pipeline.systems.analysis import analyse_pipeline

    return analyse_pipeline(source, output, reporter)


def _simulated(source: Loaded, output: Path | None, reporter: Reporter) -> Simulated:
    from modalprep.pipeline.systems.systems import simulate_pipeline

    return simulate_pipeline(source, output, reporter)


def strength_of(
    source: Loaded, responses: Iterable[Responded], simulated: Simulated | None, folder: Path, reporter: Reporter
) -> Strength | None:
    """Return the shock spectra and the damage of responses and of a run; None where the file has no tables of them."""
    if not (source.pipeline.srs or source.pipeline.fatigue):
        return None
    from modalprep.pipeline.responses.strength import strength

    histories = {found.name: found.response for found in responses}
    return strength(source, histories | ({None: simulated.main} if simulated else {}), folder, reporter)


def _pages(source: Loaded, outcome: Outcome, reporter: Reporter) -> None:
    from modalprep.pipeline.pages import page_of_body, page_of_run

    if outcome.built:
        page_of_body(source, outcome, reporter)
    if outcome.simulated:
        page_of_run(source, outcome, reporter)
