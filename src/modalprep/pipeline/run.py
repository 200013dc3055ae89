"""The main job: one pipeline file from mesh to modal file, report, pictures, simulation and plots."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.errors import RenderError
from modalprep.extras import need
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.loaded import Loaded, load
from modalprep.verdicts.notes import silent

if TYPE_CHECKING:
    from modalprep.correlation.derivatives import Sensitivities
    from modalprep.pipeline.build.built import Built
    from modalprep.pipeline.build.cache import Cache
    from modalprep.pipeline.build.synthesis import Synthesised
    from modalprep.pipeline.pictures import Pictures
    from modalprep.pipeline.responses.respond import Responded
    from modalprep.pipeline.responses.strength import Strength
    from modalprep.pipeline.schema.analysis import CollectTable
    from modalprep.pipeline.schema.responses.require import RequireTable
    from modalprep.pipeline.systems.analysis import Analysed
    from modalprep.pipeline.systems.systems import Simulated
    from modalprep.report.body_page.section import Section
    from modalprep.verdicts.verdict import Requirement, Verdict


@dataclass
class Outcome:
    """Results of a run."""

    folder: Path
    built: Built | None = None
    sensitivities: Sensitivities | None = None
    synthesised: Synthesised | None = None
    analysed: Analysed | None = None
    simulated: Simulated | None = None
    responses: list[Responded] = field(default_factory=list)
    strength: Strength | None = None
    mass_plot: Path | None = None
    film: Path | None = None
    plots: list[tuple[str, Path]] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    sections: list[Section] = field(default_factory=list)  # of the report page
    limits: dict[str, float] = field(default_factory=dict)  # of the errors against the full model
    require: RequireTable | None = None
    collect: CollectTable | None = None

    @property
    def audits(self) -> tuple[Requirement, ...]:
        """Whether analyses and runs are what their equations say."""
        return tuple(audit for part in (self.analysed, self.simulated) if part for audit in part.audits)

    @property
    def verdict(self) -> Verdict:
        """PASS, PASS WITH WARNINGS or FAIL, with the reasons; the same on the page, in JSON and in the terminal."""
        from modalprep.report.body_page.requirements import (
            body_verdict,
            of_damage,
            of_envelopes,
            of_errors,
            of_response,
        )
        from modalprep.verdicts.notes import warnings_of
        from modalprep.verdicts.verdict import Verdict

        margins = [met for found in self.responses for met in of_response(found.name, found.response)]
        damages = [of_damage(*found) for found in self.strength.fatigue.items()] if self.strength else []
        envelopes = self.simulated.envelopes if self.simulated else ()
        extremes = of_envelopes(envelopes)
        met = [*self._required(), *self.audits, *extremes, *margins, *damages]
        built = self.built
        if built is None:
            return Verdict.of(met, warnings_of(self.notes))
        errors, limits = built.error_curves, self.limits
        static = of_errors({"static responses": ((), built.error.static)}, limits) if built.error else []
        return body_verdict(
            checks=built.checks, notes=self.notes, errors=errors, error_limits=limits, requirements=[*static, *met]
        )

    @property
    def margins(self) -> dict[str, float]:
        """Margin of the worst place of each recovered component, and of the peaks of responses; NaN where none is."""
        envelopes = self.simulated.envelopes if self.simulated else ()
        rows = [row for envelope in envelopes for row in envelope.worst()]
        found = {f"{row['body']}.{row['recovery']}.{row['place']}.{row['component']}": row["margin"] for row in rows}
        return found | {
            f"{found.name}.{peak.channel}": peak.margin for found in self.responses for peak in found.response.worst()
        }

    def _required(self) -> list[Requirement]:
        """Return the requirements of [require]; those on the body only where it was built."""
        if self.require is None:
            return []
        from modalprep.pipeline.responses.required import required_margin, required_of_body

        of_body = required_of_body(self.require, self.built.body, self.built.error) if self.built else []
        return [*of_body, *required_margin(self.require, self.margins.values())]


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
    path : Path
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
    from modalprep.pipeline.build.sources import output_folder, refuse_shared_folders
    from modalprep.pipeline.pictures import pictures_beside

    source = load(path)
    path, pipeline = source.path, source.pipeline
    refuse_shared_folders(source, output)
    if not pictures:
        pipeline = pipeline.model_copy(update={"output": pipeline.output.model_copy(update={"pictures": "none"})})
    if pipeline.joints or pipeline.simulation is not None:
        from modalprep.pipeline.systems.outline import refuse_before_work

        refuse_before_work(source)
    if pipeline.srs:
        need("pyyeti", f"{path}: [srs]")
    if pipeline.response:
        from modalprep.pipeline.responses.respond import refuse_responses

        refuse_responses(source)
    asked = {"limits": pipeline.reduction.limits, "require": pipeline.require, "collect": pipeline.collect}
    outcome = Outcome(folder=output_folder(path, output), **asked)
    with silent(), pictures_beside(pipeline.output.pictures if pipeline.has_body else 0) as drawn:
        if pipeline.has_body:
            _body(source, outcome, reporter, cache)
            drawn.begin(outcome.built.body, outcome.built.file)
            _body_charts(source, outcome, reporter)
        _systems(source, output, outcome, reporter)
        if outcome.built is not None:
            _page(source, outcome, reporter, drawn, report)
        if outcome.simulated is not None and report:
            _run_page(source, outcome, reporter)
    return outcome


def _systems(source: Loaded, output: Path | None, outcome: Outcome, reporter: Reporter) -> None:
    """Do what the file asks for after its body."""
    if source.pipeline.sensitivities is not None:
        _sensitivities(source, outcome, reporter)
    if source.pipeline.synthesis is not None:
        _synthesis(source, output, outcome, reporter)
    if source.pipeline.analysis is not None:
        from modalprep.pipeline.systems.analysis import analyse_pipeline

        outcome.analysed = analyse_pipeline(source, output, reporter)
        outcome.notes += outcome.analysed.notes
    if source.pipeline.simulation is not None:
        _simulation(source, output, outcome, reporter)
    if source.pipeline.srs or source.pipeline.fatigue:
        _strength(source, outcome, reporter)


def _body(source: Loaded, outcome: Outcome, reporter: Reporter, cache: Cache | None) -> None:
    from modalprep.pipeline.build.build import build_body

    outcome.built = build_body(source, outcome.folder, reporter, cache)


def _body_charts(source: Loaded, outcome: Outcome, reporter: Reporter) -> None:
    """Print, export and draw the body, and compute its responses."""
    from modalprep.formats.export import export_body, known_export, lost_in
    from modalprep.report.charts.mass_chart import effective_mass_plot
    from modalprep.report.tables import body_summary, mode_table

    body = outcome.built.body
    body_summary(body, reporter.console)
    mode_table(body.modes, reporter.console)
    _tell(outcome.built.notes, outcome.notes, reporter)
    for name in source.pipeline.output.export:
        target = outcome.built.file.with_suffix(known_export(name).suffix)
        reporter.wrote(export_body(body, name, target))
        _tell((f"{target.name}: {text}" for text in lost_in(body, name)), outcome.notes, reporter)
    outcome.mass_plot = effective_mass_plot(body.modes, outcome.folder / f"{source.path.stem}-effective-mass.png")
    reporter.wrote(outcome.mass_plot)
    if source.pipeline.response:
        from modalprep.pipeline.responses.respond import respond
        from modalprep.report.body_page.responses import response_section

        outcome.responses = respond(source, body, outcome.folder, reporter)
        for found in outcome.responses:
            section = response_section(found.name, found.response, found.plot, found.cut, found.notch_plot)
            outcome.sections.append(section)
            _tell((f"response {found.name}: {note}" for note in found.response.notes), outcome.notes, reporter)


def _sensitivities(source: Loaded, outcome: Outcome, reporter: Reporter) -> None:
    from modalprep.atomic import write_table
    from modalprep.pipeline.build.sensitivity import pipeline_sensitivities
    from modalprep.report.correlation.sensitivity import sensitivity_plot, sensitivity_section, sensitivity_table

    found = outcome.sensitivities = pipeline_sensitivities(source)
    sensitivity_table(found, reporter.console)
    outcome.notes += found.notes
    rows, table, chart = (
        found.rows(),
        *(outcome.folder / f"{source.path.stem}-sensitivities.{kind}" for kind in ("csv", "png")),
    )
    reporter.wrote(write_table(rows[0], [list(row.values()) for row in rows], table))
    reporter.wrote(sensitivity_plot(found, chart))
    outcome.sections.append(sensitivity_section(found, chart))


def _tell(said: Iterable[str], notes: list[str], reporter: Reporter) -> None:
    for note in said:
        notes.append(note)
        reporter.note(note)


def _synthesis(source: Loaded, output: Path | None, outcome: Outcome, reporter: Reporter) -> None:
    from modalprep.pipeline.build.synthesis import strain_fractions, synthesise_pipeline
    from modalprep.pipeline.pictures import counted, not_drawn
    from modalprep.report.synthesis import draw_modes, strain_plot, synthesis_table

    found = outcome.synthesised = synthesise_pipeline(source, output, reporter)
    shares = strain_fractions(found.modes)
    synthesis_table(found.modes, shares, reporter.console, None if found.damping is None else found.damping.achieved)
    _tell(found.notes, outcome.notes, reporter)
    reporter.wrote(strain_plot(found.modes, shares, outcome.folder / f"{source.path.stem}-strain-energy.png"))
    count = counted(source.pipeline.output.pictures, len(found.modes.frequency))
    try:
        pictures = draw_modes(found.modes, source.path.stem, outcome.folder, count)
    except RenderError as error:
        not_drawn(error, outcome.notes, reporter)
    else:
        reporter.files += pictures
        reporter.say(f"  wrote {len(pictures)} mode pictures {source.path.stem}-system-mode-*.png")


def _simulation(source: Loaded, output: Path | None, outcome: Outcome, reporter: Reporter) -> None:
    from modalprep.pipeline.drawn_runs import film_run, plot_runs
    from modalprep.pipeline.systems.systems import simulate_pipeline

    outcome.simulated = simulate_pipeline(source, output, reporter)
    outcome.notes += outcome.simulated.notes
    outcome.plots += plot_runs(source, outcome.simulated, outcome.folder, reporter)
    outcome.film = film_run(source, outcome.simulated, outcome.folder, reporter, outcome.notes)


def _strength(source: Loaded, outcome: Outcome, reporter: Reporter) -> None:
    from modalprep.pipeline.responses.strength import strength

    run = next(iter(outcome.simulated.runs.values())) if outcome.simulated else None
    responses = {found.name: found.response for found in outcome.responses}
    outcome.strength = strength(source, responses, run, outcome.folder, reporter)
    outcome.notes += outcome.strength.notes
    outcome.sections += strength_sections(outcome.strength)


def strength_sections(found: Strength) -> list[Section]:
    """Return the sections of shock spectra and of damage."""
    from modalprep.report.body_page.responses import fatigue_section, shock_section

    shocks = [shock_section(name, plot) for name, plot in found.plots.items()]
    return [*shocks, *(fatigue_section(name, damage) for name, damage in found.fatigue.items())]


def _page(source: Loaded, outcome: Outcome, reporter: Reporter, drawn: Pictures, report: bool) -> None:
    from modalprep.pipeline.build.described import body_inputs
    from modalprep.report.body_page.convergence import convergence_section
    from modalprep.report.page import write_page

    built = outcome.built
    mesh_picture, pictures = drawn.draw(built.body, built.file, reporter, outcome.notes)
    if not report:
        return
    page = outcome.folder / f"{built.file.stem}.html"
    convergence = [convergence_section(built.convergence)] if built.convergence else []
    write_page(
        built.body,
        page,
        pictures=pictures,
        mesh_picture=mesh_picture,
        plots=outcome.plots,
        checks=built.checks,
        notes=outcome.notes,
        errors=built.error_curves or None,
        mass_plot=outcome.mass_plot,
        envelopes=outcome.simulated.envelopes if outcome.simulated else (),
        sections=[*convergence, *outcome.sections],
        inputs=body_inputs(source, built),
        verdict=outcome.verdict,
    )
    reporter.wrote(page)


def _run_page(source: Loaded, outcome: Outcome, reporter: Reporter) -> None:
    """Write the page of the main run; its damage stands there where there is no page of a body."""
    from modalprep.pipeline.systems.page import page_of_run

    more = {"plots": outcome.plots, "film": outcome.film, "sections": [] if outcome.built else outcome.sections}
    page_of_run(source, outcome.simulated, reporter, verdict=outcome.verdict, **more)
