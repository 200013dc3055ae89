"""The frame of a page: title, box of the verdict, contents, sections, sign-off, styles and scripts in one file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from typing import Any

from markupsafe import Markup

from modalprep.report.body_page.box import verdict_box
from modalprep.report.body_page.section import Section
from modalprep.report.body_page.table import part, texts
from modalprep.verdicts.verdict import Verdict

ROLES = ("Prepared", "Checked", "Approved")  # of the last section, to be filled in on paper


def page_text(
    name: str,
    kind: str,
    lead: str,
    sections: Sequence[Section],
    verdict: Verdict,
    data: Mapping[str, Any] | None = None,
) -> str:
    """Return a page with the box of the verdict at the top and a sign-off at the end.

    Parameters
    ----------
    kind : str
        What the page is about, in its title and at the head of its sheets, such as "modal body".
    lead : str
        A sentence below the title.
    data : {id: data}, optional
        What the scripts of the page read.
    """
    date = now()
    signed = part("sign_off.html", roles=ROLES, subject=f"{name}: {kind}", date=date)
    found = [*sections, Section(title="Sign-off", anchor="sign-off", html=signed)]
    box = verdict_box(verdict)
    return framed(name, kind, lead, date, box, found, data=data, scripts=("viewer.js",) if data else ())


def now() -> str:
    """Return date and time of a page."""
    return datetime.now(UTC).isoformat(timespec="seconds")


def framed(
    name: str,
    kind: str,
    lead: str,
    date: str,
    box: Markup,
    sections: Sequence[Section],
    *,
    data: Mapping[str, Any] | None = None,
    scripts: Sequence[str] = (),
    styles: Sequence[str] = (),
) -> str:
    """Return a page with a box at the top; further scripts and styles are files of `modalprep.report`."""
    return part(
        "page.html",
        ".",
        name=name,
        kind=kind,
        lead=lead,
        date=date,
        box=box,
        sections=sections,
        data=data or {},
        style=texts("page.css", "body_page/paper.css", *styles) + _margins(f"{name}: {kind}", date),
        script=texts("page.js", *scripts),
    )


def _margins(head: str, date: str) -> Markup:
    """Return the header and the footer of the sheets; every sign of a name but letters and digits is escaped."""
    text = re.sub(r"[^A-Za-z0-9]", lambda sign: f"\\{ord(sign[0]):x} ", head)
    return Markup(f"@page {{ @top-left {{ content: '{text}'; }} @bottom-left {{ content: '{date}'; }} }}\n")
