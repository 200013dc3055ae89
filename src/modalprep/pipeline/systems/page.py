"""The page of the simulation of a pipeline file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.pipeline.build.inputs import page_inputs
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.loaded import Loaded
from modalprep.pipeline.systems.systems import Simulated
from modalprep.program import file_digest
from modalprep.report.body_page.section import Section
from modalprep.report.numbers import number
from modalprep.report.run_page.page import write_run_page
from modalprep.verdicts.verdict import Verdict

if TYPE_CHECKING:
    from modalprep.pipeline.schema.system import SimulationTable


def page_of_run(
    source: Loaded,
    simulated: Simulated,
    reporter: Reporter,
    *,
    verdict: Verdict,
    plots: Sequence[tuple[str, Path]] = (),
    film: Path | None = None,
    sections: Sequence[Section] = (),
) -> Path:
    """Write the page of the main run of a pipeline file beside its results, as ``NAME-run.html``.

    Returns
    -------
    Path
        The file.
    """
    pipeline = source.pipeline
    run, result = next(iter(simulated.runs.values())), simulated.files[0]
    cases = [file for file in reporter.files if file.suffix == ".png" and f"{source.path.stem}-ensemble" in file.name]
    page = write_run_page(
        run,
        result.with_suffix(".html"),
        name=source.body_name,
        system=simulated.system,
        rtol=pipeline.simulation.rtol,
        settings=_settings(pipeline.simulation, simulated),
        channels=pipeline.simulation.output,
        plots=[*plots, *((f"cases of the ensemble: {file.name}", file) for file in cases)],
        plotted=[channel for plot in pipeline.plots for channel in plot.channels] if plots else (),
        film=film,
        envelopes=simulated.envelopes,
        notes=simulated.notes,
        sections=sections,
        inputs=page_inputs(source, {result.name: file_digest(result)}),
        verdict=verdict,
    )
    return reporter.wrote(page)


def _settings(table: SimulationTable, simulated: Simulated) -> dict[str, str]:
    """Return what the file asks of the integration, and what else was run."""
    asked = {"absolute tolerance": number(table.atol), "method asked for": table.method}
    asked |= {"output step": f"{number(table.output_step)} s", "theory": ", ".join(simulated.runs)}
    if table.variables != "joint":
        asked["variables"] = table.variables
    if simulated.ensemble is not None:
        asked["ensemble"] = f"{len(simulated.ensemble)} cases besides this run"
    return asked
