"""The report of a body as one self-contained HTML page."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jinja2 import Environment, StrictUndefined, Template
from markupsafe import Markup

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.report.body_page import parts
from modalprep.report.body_page.inputs import Inputs, energy_section, inputs_section
from modalprep.report.body_page.section import Section, Verdict
from modalprep.report.body_page.verdicts import of_checks, of_envelopes, of_errors, verdict_box
from modalprep.report.mac import mac_chart
from modalprep.report.scene import drawable

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.multibody.results.envelopes import Envelope


def write_page(
    body: FlexibleBody,
    path: str | Path,
    *,
    pictures: Mapping[int, Path] | None = None,
    mesh_picture: Path | None = None,
    plots: Sequence[tuple[str, Path]] = (),
    checks: Sequence[Check] = (),
    notes: Sequence[str] = (),
    errors: Mapping[str, tuple[Any, Any]] | None = None,
    error_axes: tuple[str, str] = ("frequency (Hz)", "relative error"),
    mass_plot: Path | None = None,
    nodal_mass: np.ndarray | None = None,
    envelopes: Sequence[Envelope] = (),
    sections: Sequence[Section] = (),
    inputs: Inputs | None = None,
    verdicts: Sequence[Verdict] = (),
    error_limits: Mapping[str, float] | None = None,
) -> Path:
    """Write the page: a box of PASS or FAIL, contents, inputs, modes, MAC, recoveries, errors, checks, provenance.

    The page is one file; it loads no script, style or picture from elsewhere.

    Parameters
    ----------
    pictures : {mode: picture file}
        Of the body's own modes, counted from 1.
    plots : sequence of (title, picture file)
    notes : sequence of str
        Messages for the user, sorted into notes, approximations and warnings.
    errors : {label: (x, y)}, optional
        Curves of a section on errors; without, there is no such section.
    error_axes : (str, str)
        Labels of its axes.
    mass_plot : Path or None
        The chart of `effective_mass_plot`, where it is drawn already.
    nodal_mass : (n_points,), optional
        Weights of the nodes where modes are compared; default: equal weights.
    envelopes : sequence of Envelope
        Of the recoveries in a run.
    sections : sequence of Section
        Further sections, such as responses, before the checks.
    inputs : Inputs, optional
        What the body was made of.
    verdicts : sequence of Verdict
        Further requirements for the box at the top, such as the audit of a run.
    error_limits : {label: float}, optional
        Of `errors`; others are not checked.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When a picture cannot be read, or the page not be written.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> import tempfile
    >>> page = write_page(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.html")
    >>> "Mode selection" in page.read_text(encoding="utf-8")
    True
    """
    drawn, inputs, chart = drawable(body), inputs or Inputs(), mac_chart(body, nodal_mass)
    found = [
        parts.overview(body, notes, mesh_picture),
        inputs_section(inputs),
        *parts.modes(body, drawn, pictures or {}),
        parts.selection(body.modes, mass_plot),
        *energy_section(inputs),
        *parts.mac(chart),
        *parts.recoveries(body),
        *parts.simulation(plots, envelopes),
        *sections,
        *parts.errors(errors, error_axes),
        *parts.checks(checks),
        *parts.provenance({"Files (SHA-256)": inputs.files, "Program": inputs.made, "Body": body.provenance}),
    ]
    said = [
        *of_checks(checks),
        *of_envelopes(envelopes),
        *of_errors(errors, error_limits or {}),
        *verdicts,
        *_of_sections(sections),
    ]
    text = _frame(body, found, said, {"scene": drawn[0], "mac-values": chart and _values(chart)})
    with atomic_path(path) as temporary:
        temporary.write_text(text, encoding="utf-8")
    return Path(path)


def _of_sections(sections: Sequence[Section]) -> list[Verdict]:
    """Return the verdicts of the sections, with links to them."""
    return [replace(v, anchor=v.anchor or section.anchor) for section in sections for v in section.verdicts]


def _values(chart: dict[str, Any]) -> dict[str, Any]:
    return {"values": chart["values"], "frequencies": chart["frequencies"]}


def _frame(body: FlexibleBody, sections: Sequence[Section], verdicts: Sequence[Verdict], data: dict[str, Any]) -> str:
    date = datetime.now(UTC).isoformat(timespec="seconds")
    return _template().render(
        body=body,
        table=body.modes,
        date=date,
        box=verdict_box(verdicts),
        sections=sections,
        data=data,
        style=Markup(_file("page.css") + _file("body_page/paper.css") + _margins(body.name, date)),
        script=Markup(_file("page.js") + _file("viewer.js")),
    )


@cache
def _template() -> Template:
    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    return environment.from_string(_file("page.html"))


def _margins(name: str, date: str) -> str:
    """Return the header and the footer of the sheets; every sign of a name but letters and digits is escaped."""
    text = re.sub(r"[^A-Za-z0-9]", lambda sign: f"\\{ord(sign[0]):x} ", f"{name}: modal body")
    return f"@page {{ @top-left {{ content: '{text}'; }} @bottom-left {{ content: '{date}'; }} }}\n"


def _file(name: str) -> str:
    return files("modalprep.report").joinpath(name).read_text(encoding="utf-8")
