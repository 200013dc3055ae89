"""Sections of the page, by which other parts of the program add what they computed."""

from __future__ import annotations

import mimetypes
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from markupsafe import Markup

from modalprep.errors import InputError
from modalprep.report.body_page.table import data_address
from modalprep.verdicts.verdict import Requirement


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
    requirements : sequence of Requirement
        What this section checks; the box at the top of the page counts and names them.

    Examples
    --------
    >>> from modalprep.report import Table
    >>> strut = Table(name="strut-forces", columns=("strut", "N (N)"), rows=[("left", 12.5)])
    >>> section = Section(title="Strut forces", anchor="struts", html=paragraph("At 3 sigma.") + strut.html(),
    ...                   requirements=[Requirement(name="margin of the left strut", result="passed", says="+0.2")])
    >>> section.html[:18]
    Markup('<p>At 3 sigma.</p>')
    """

    title: str
    anchor: str
    html: Markup
    requirements: Sequence[Requirement] = ()


def anchor_of(kind: str, name: str) -> str:
    """Return the anchor of the section of a response, a shock spectrum or a damage.

    Examples
    --------
    >>> anchor_of("response", "Sine Z")
    'response-sine-z'
    """
    return f"{kind}-{re.sub(r'[^a-z0-9]+', '-', name.lower()).strip('-')}"


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
