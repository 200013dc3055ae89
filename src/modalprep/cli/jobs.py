"""Commands that run pipeline files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from modalprep.cli.common import (
    Json,
    Output,
    Pdf,
    PipelineFile,
    Quiet,
    Report,
    Settings,
    app,
    end_with,
    open_page,
    print_json,
)
from modalprep.report import summary

if TYPE_CHECKING:
    from modalprep.pipeline.schema.pipeline import Pipeline


@app.command()
def run(
    file: PipelineFile,
    output: Output = None,
    settings: Settings = None,
    pictures: Annotated[bool, typer.Option("--pictures/--no-pictures", help="Draw the mesh and the modes.")] = True,
    report: Report = True,
    show: Annotated[bool, typer.Option("--open", help="Open the report page in the browser.")] = False,
    pdf: Pdf = False,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Build the body of a pipeline file, analyse and simulate it.

    Each part is done when the file asks for it. The body and the run come with a page each, the body with pictures.
    The last line is the verdict: PASS, PASS WITH WARNINGS, or FAIL with exit code 1, where an audit fails, a margin is
    negative, a damage is 1 or more, or a requirement of [require] is not met.
    """
    from modalprep.errors import InputError
    from modalprep.pipeline.batch.settings import with_settings
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.run import run_pipeline
    from modalprep.report.body_page.printing import find_browser, print_page

    reporter = Reporter(quiet=as_json or quiet)
    source, output = with_settings(file, settings or [], output)
    wanted = "--open" if show else "--pdf" if pdf else ""
    if wanted and not (report and _has_page(source.pipeline)):
        why = "it has neither a body nor a [simulation]" if report else "--no-report is given"
        raise InputError(f"{wanted}: this pipeline file makes no report page, as {why}; leave {wanted} out")
    browser = find_browser() if pdf else None
    outcome = run_pipeline(source, output, reporter, pictures=pictures, report=report)
    pages = [path for path in reporter.files if path.suffix == ".html"]
    if browser:
        for page in pages:
            reporter.wrote(print_page(page, browser))
    if as_json:
        from modalprep.pipeline.study.quantities import quantities

        print_json(summary.outcome(outcome, reporter) | {"quantities": quantities(outcome)})
    else:
        reporter.say(f"outputs are in {outcome.folder}")
    if show:
        open_page(pages[0], reporter)
    end_with(outcome.verdict, reporter, source.path)


def _has_page(pipeline: Pipeline) -> bool:
    return pipeline.has_body or pipeline.simulation is not None


@app.command()
def analyse(
    file: PipelineFile,
    output: Output = None,
    settings: Settings = None,
    quiet: Quiet = False,
    as_json: Json = False,
) -> None:
    """Compute what the [analysis] table of a pipeline file asks for.

    This can be the equilibrium, the modes, the linearised equations, the frequency response, and the joint forces of a
    prescribed motion.
    """
    from modalprep.pipeline.batch.settings import with_settings
    from modalprep.pipeline.console import Reporter
    from modalprep.pipeline.systems.analysis import analyse_pipeline

    reporter = Reporter(quiet=as_json or quiet)
    source, output = with_settings(file, settings or [], output)
    found = analyse_pipeline(source, output, reporter)
    if as_json:
        print_json(found.summary() | {"files": [str(f) for f in reporter.files]})
    end_with(found.verdict, reporter, source.path)


@app.command()
def warmup() -> None:
    """Compile the assembly of elements and the solver in advance.

    Where the installation brings compiled code there is nothing to do.
    """
    import signal
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    from modalprep.exercise import jobs
    from modalprep.pipeline.console import Reporter

    interrupts = {"initializer": signal.signal, "initargs": (signal.SIGINT, signal.SIG_DFL)}  # end without a traceback
    with ProcessPoolExecutor(2, mp_context=get_context("spawn"), **interrupts) as pool:
        list(pool.map(compile_job, jobs()))
    Reporter().say("the solver is compiled")


def compile_job(name: str) -> None:
    """Make the calls of a job of `exercise.jobs`, and say so where they compile anything."""
    from functools import partial

    from modalprep.compiler.jit import when_compiling
    from modalprep.exercise import jobs
    from modalprep.pipeline.console import Reporter
    from modalprep.verdicts.notes import silent

    say = partial(Reporter().say, f"compiling for {name} ...")
    with silent(), when_compiling(say, "modalprep"):
        jobs()[name]()
