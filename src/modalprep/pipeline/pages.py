"""The pages of a run: of its body, and of its simulation."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.pipeline.console import Reporter
from modalprep.pipeline.outcome import Outcome
from modalprep.pipeline.schema.load import Loaded
from modalprep.program import file_digest
from modalprep.report.body_page.section import Section
from modalprep.report.numbers import number

if TYPE_CHECKING:
    from modalprep.pipeline.schema.system import SimulationTable
    from modalprep.pipeline.systems.systems import Simulated


def page_of_body(source: Loaded, outcome: Outcome, reporter: Reporter) -> Path:
    """Write the page of the body of a pipeline file beside its modal file, as ``NAME.html``."""
    from modalprep.pipeline.building.described import body_inputs
    from modalprep.report.page import BodyPage, write_page

    built, exported = outcome.built, outcome.exported
    drawn, run = outcome.body_drawn, outcome.run_drawn
    assert built is not None  # of a file with a body
    assert drawn is not None
    assert exported is not None
    shown = BodyPage(
        built.body,
        pictures=drawn.modes,
        mesh_picture=drawn.mesh,
        plots=run.plots if run else (),
        checks=built.checks,
        notes=outcome.notes,
        errors=built.error_curves or None,
        mass_plot=exported.mass_plot,
        envelopes=outcome.simulated.envelopes if outcome.simulated else (),
        sections=_sections(source, outcome),
        inputs=body_inputs(source, built),
        verdict=outcome.verdict,
    )
    return reporter.wrote(write_page(shown, outcome.folder / f"{built.file.stem}.html"))


def _sections(source: Loaded, outcome: Outcome) -> list[Section]:
    """Return the sections of a page of what the file asks for besides its body and its run."""
    from modalprep.report.body_page.convergence import convergence_section
    from modalprep.report.body_page.responses import fatigue_section, response_section, shock_section
    from modalprep.report.correlation.sensitivity import sensitivity_section
    from modalprep.report.cyclic import cyclic_section

    found = [convergence_section(outcome.built.convergence)] if outcome.built and outcome.built.convergence else []
    found += [response_section(x.name, x.response, x.plot, x.cut, x.notch_plot) for x in outcome.responses]
    if outcome.sensitivities is not None:
        chart = outcome.folder / f"{source.path.stem}-sensitivities.png"
        found.append(sensitivity_section(outcome.sensitivities, chart))
    if outcome.cyclic is not None:
        found.append(cyclic_section(outcome.cyclic, outcome.folder / f"{source.path.stem}-nodal-diameters.png"))
    if outcome.strength is not None:
        found += [shock_section(name, plot) for name, plot in outcome.strength.plots.items()]
        found += [fatigue_section(name, damage) for name, damage in outcome.strength.fatigue.items()]
    return found


def page_of_run(source: Loaded, outcome: Outcome, reporter: Reporter) -> Path:
    """Write the page of the main run of a pipeline file beside its results, as ``NAME-run.html``.

    Its damage stands there where there is no page of a body.
    """
    from modalprep.pipeline.building.inputs import page_inputs
    from modalprep.report.run_page.page import RunPage, write_run_page

    pipeline = source.pipeline
    simulated, drawn = outcome.simulated, outcome.run_drawn
    table = pipeline.simulation
    assert simulated is not None  # of a file with a run
    assert table is not None
    assert drawn is not None
    plots = drawn.plots
    result = simulated.files[0]
    stem = f"{source.path.stem}-ensemble"
    cases = [file for file in reporter.files if file.suffix == ".png" and stem in file.name]
    shown = RunPage(
        simulated.main,
        name=source.body_name,
        system=simulated.system,
        rtol=table.rtol,
        settings=_settings(table, simulated),
        channels=table.output,
        plots=[*plots, *((f"cases of the ensemble: {file.name}", file) for file in cases)],
        plotted=[channel for plot in pipeline.plots for channel in plot.channels] if plots else (),
        film=drawn.film,
        envelopes=simulated.envelopes,
        notes=simulated.notes,
        sections=[*_derivatives(simulated), *([] if outcome.built else _sections(source, outcome))],
        inputs=page_inputs(source, {result.name: file_digest(result)}),
        verdict=outcome.verdict,
    )
    return reporter.wrote(write_run_page(shown, result.with_suffix(".html")))


def _derivatives(simulated: Simulated) -> list[Section]:
    """Return the section of [run_sensitivities], none without."""
    found = simulated.derivatives
    if found is None:
        return []
    from modalprep.report.run_page.derivatives import derivatives_section

    return [derivatives_section(found.histories, found.objective, found.gradient, found.notes)]


def _settings(table: SimulationTable, simulated: Simulated) -> dict[str, str]:
    """Return what the file asks of the integration, and what else was run."""
    asked = {"absolute tolerance": number(table.atol), "method asked for": table.method}
    asked |= {"output step": f"{number(table.output_step)} s", "theory": ", ".join(simulated.runs)}
    if table.variables != "joint":
        asked["variables"] = table.variables
    if simulated.ensemble is not None:
        asked["ensemble"] = f"{len(simulated.ensemble)} cases besides this run"
    return asked
