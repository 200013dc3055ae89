"""Sections of the responses of a body: the peaks of its components, their margins, a plot."""

from __future__ import annotations

import re
from pathlib import Path

from modalprep.report.body_page.section import PASSED, Section, Verdict, chart, paragraph
from modalprep.report.body_page.table import Table
from modalprep.report.body_page.verdicts import FAILED
from modalprep.report.responses import MEANING, peak_columns, peak_rows
from modalprep.response.result import Response

WHOLE = (
    "Of each vector and each recovery the component with the largest value is listed at the place where it has it; "
    "all channels are in the CSV files beside this page."
)


def response_section(name: str, response: Response, plot: Path) -> Section:
    """Return the section of a response; components with an allowable are requirements.

    Examples
    --------
    >>> from modalprep.report.responses import _example
    >>> response_section("shaker", _example(), "gone.png")
    Traceback (most recent call last):
    modalprep.errors.InputError: the picture gone.png cannot be read: No such file or directory
    """
    anchor = "response-" + re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
    said = f"{response.kind.capitalize()} response to {', '.join(response.inputs)}. {WHOLE}"
    table = Table(name=f"{anchor}-peaks", columns=peak_columns(response), rows=peak_rows(response))
    html = paragraph(said) + table.html() + chart(plot, f"{MEANING[response.kind]} of the largest channels")
    return Section(title=f"Response {name}", anchor=anchor, html=html, verdicts=_margins(name, response))


def _margins(name: str, response: Response) -> list[Verdict]:
    return [
        Verdict(name=f"margin of {peak.channel} in response {name}", result=PASSED if peak.margin >= 0 else FAILED,
                says=f"{peak.margin:+.3g}")
        for peak in response.worst() if peak.margin == peak.margin
    ]  # fmt: skip
