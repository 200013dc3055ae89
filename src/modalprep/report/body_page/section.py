"""Sections of the page, by which other parts of the program add what they computed."""

from __future__ import annotations

import mimetypes
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from markupsafe import Markup

from modalprep.errors import InputError
from modalprep.report.body_page.table import data_address

PASSED, FAILED, UNCHECKED = "passed", "FAILED", "not checked"


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What the box at the top of a page says of one requirement.

    Attributes
    ----------
    name : str
    result : {"passed", "FAILED", "not checked"}
    says : str
        Value and limit, or why it was not checked.
    anchor : str
        Of the place on the page that has more; those of a section without one lead to the section.
    """

    name: str
    result: Literal["passed", "FAILED", "not checked"]
    says: str = ""
    anchor: str = ""


@dataclass(frozen=True, kw_only=True)
class Section:
    """A section of the page of a body.

    Attributes
    ----------
    title : str
        In the contents and above the section.
    anchor : str
        Unique on the page: small letters, digits and hyphens.
    html : Markup
        What stands below the title; put together from `Table.html`, `chart` and `paragraph`.
    verdicts : sequence of Verdict
        Requirements that this section checks; the box at the top of the page counts and names them.

    Examples
    --------
    >>> from modalprep.report import Table
    >>> strut = Table(name="strut-forces", columns=("strut", "N (N)"), rows=[("left", 12.5)])
    >>> section = Section(title="Strut forces", anchor="struts", html=paragraph("At 3 sigma.") + strut.html(),
    ...                   verdicts=[Verdict(name="margin of the left strut", result="passed", says="+0.2")])
    >>> section.html[:18]
    Markup('<p>At 3 sigma.</p>')
    """

    title: str
    anchor: str
    html: Markup
    verdicts: Sequence[Verdict] = ()


def paragraph(text: str) -> Markup:
    """Return a text as a paragraph.

    Returns
    -------
    Markup
        Escaped.

    Examples
    --------
    >>> paragraph("a < b")
    Markup('<p>a &lt; b</p>')
    """
    return Markup("<p>{}</p>").format(text)


def chart(file: str | Path, title: str) -> Markup:
    """Return a picture file as part of the page; `title` says what it shows.

    Returns
    -------
    Markup
        A figure that holds the picture.

    Raises
    ------
    InputError
        When the picture cannot be read.

    Examples
    --------
    >>> chart("gone.png", "strut forces")
    Traceback (most recent call last):
    modalprep.errors.InputError: the picture gone.png cannot be read: No such file or directory
    """
    return Markup('<figure class="chart"><img src="{}" alt="{}"><figcaption>{}</figcaption></figure>').format(
        embedded(file), title, title
    )


def embedded(file: str | Path) -> str:
    """Return a picture as a data address.

    Raises
    ------
    InputError
        When the picture cannot be read.
    """
    try:
        data = Path(file).read_bytes()
    except OSError as error:
        raise InputError(f"the picture {file} cannot be read: {error.strerror}") from error
    return data_address(data, mimetypes.guess_type(Path(file).name)[0] or "image/png")
