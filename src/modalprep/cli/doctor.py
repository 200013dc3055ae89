"""Command that looks at the installation."""

from __future__ import annotations

from modalprep.cli.common import Json, app, print_json


@app.command()
def doctor(as_json: Json = False) -> None:
    """Say what is installed, and compute what is known in closed form.

    The last line is the verdict: PASS, or FAIL with exit code 1 where the installation computes wrong numbers. What
    a colleague or a maintainer needs to know about a machine is in the output.
    """
    from modalprep.cli import installation as found
    from modalprep.errors import AccuracyError
    from modalprep.pipeline.console import Reporter
    from modalprep.report.terminal import print_text, print_verdict

    reporter = Reporter(quiet=as_json)
    facts, extras = found.installation(), found.extras()
    listed = {"extras": _listed(extras, True), "extras not installed": _listed(extras, False)}
    for name, value in (facts | listed).items():
        print_text(f"{name}: {value}", reporter.console)
    verdict = found.trial()
    for each in verdict.requirements:
        reporter.say(f"{each.result}: {each}")
    if as_json:
        print_json({"installation": facts, "extras": extras, "verdict": verdict.word})
    print_verdict(verdict, reporter.console)
    if verdict.failure:
        raise AccuracyError(f"this installation computes wrong numbers: {verdict.failure}")


def _listed(extras: dict[str, bool], installed: bool) -> str:
    return ", ".join(name for name, here in extras.items() if here == installed) or "none"
