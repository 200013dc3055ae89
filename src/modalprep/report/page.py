"""The report of a body as one self-contained HTML page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from modalprep.atomic import write_text
from modalprep.body.flexible_body import FlexibleBody
from modalprep.report.body_page import parts
from modalprep.report.body_page.frame import page_text
from modalprep.report.body_page.inputs import Inputs, energy_section, inputs_section
from modalprep.report.body_page.mass import mass_section
from modalprep.report.body_page.requirements import body_verdict
from modalprep.report.body_page.section import Section
from modalprep.report.explain.body import describe_body
from modalprep.report.mac import mac_chart
from modalprep.report.numbers import number
from modalprep.report.viewer.still import drawable
from modalprep.verdicts.verdict import Requirement, Verdict

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.multibody.results.envelopes import Envelope


@dataclass(frozen=True)
class BodyPage:
    """What the page of a body shows.

    Attributes
    ----------
    body : FlexibleBody
    pictures : {mode: picture file}
        Of the body's own modes, counted from 1.
    mesh_picture : Path or None
        The mesh, with its interfaces.
    plots : sequence of (title, picture file)
    checks : sequence of Check
        Of the body.
    notes : sequence of str
        Messages for the user; warnings stand in the box.
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
    requirements : sequence of Requirement
        Further ones for the box at the top, such as the audit of a run.
    verdict : Verdict, optional
        Of the whole, for the box; by default that of the checks, notes, extremes, errors, sections and requirements.
    error_limits : {label: float}, optional
        Of `errors`; others are not checked.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> BodyPage(uniform_beam(modes=2), notes=["its mass is implausible"]).judgement.word
    'PASS WITH WARNINGS'
    """

    body: FlexibleBody
    _: KW_ONLY
    pictures: Mapping[int, Path] | None = None
    mesh_picture: Path | None = None
    plots: Sequence[tuple[str, Path]] = ()
    checks: Sequence[Check] = ()
    notes: Sequence[str] = ()
    errors: Mapping[str, tuple[Any, Any]] | None = None
    error_axes: tuple[str, str] = ("frequency (Hz)", "relative error")
    mass_plot: Path | None = None
    nodal_mass: np.ndarray | None = None
    envelopes: Sequence[Envelope] = ()
    sections: Sequence[Section] = ()
    inputs: Inputs = field(default_factory=Inputs)
    requirements: Sequence[Requirement] = ()
    verdict: Verdict | None = None
    error_limits: Mapping[str, float] | None = None

    @cached_property
    def judgement(self) -> Verdict:
        """The verdict of the box at the top."""
        met = [*self.requirements, *_of_sections(self.sections)]
        errors = {"errors": self.errors, "error_limits": self.error_limits, "envelopes": self.envelopes}
        return self.verdict or body_verdict(checks=self.checks, notes=self.notes, requirements=met, **errors)


def write_page(shown: BodyPage | FlexibleBody, path: str | Path) -> Path:
    """Write the page: a box with the verdict, contents, inputs, modes, MAC, recoveries, errors, checks, provenance.

    The page is one file; it loads no script, style or picture from elsewhere.

    Parameters
    ----------
    shown : BodyPage or FlexibleBody
        Of a body alone the page shows what the body holds.
    path : str or Path

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
    shown = shown if isinstance(shown, BodyPage) else BodyPage(shown)
    body, inputs, verdict = shown.body, shown.inputs, shown.judgement
    drawn = drawable(body)
    chart = mac_chart(body, shown.nodal_mass)
    found = [
        parts.in_short(describe_body(body), verdict),
        parts.overview(body, shown.notes, shown.mesh_picture),
        mass_section(body),
        *parts.requirements(verdict),
        inputs_section(inputs),
        *parts.modes(body, drawn, shown.pictures or {}),
        parts.selection(body.modes, shown.mass_plot),
        *energy_section(inputs),
        *parts.mac(chart),
        *parts.recoveries(body),
        *parts.simulation(shown.plots, shown.envelopes),
        *shown.sections,
        *parts.errors(shown.errors, shown.error_axes),
        *parts.checks(shown.checks),
        *parts.provenance({"Files (SHA-256)": inputs.files, "Program": inputs.made, "Body": body.provenance}),
    ]
    data = {"scene": drawn[0], "mac-values": chart and _values(chart)}
    text = page_text(body.name, "modal body", _lead(body), found, verdict, data)
    return write_text(text, path)


def _lead(body: FlexibleBody) -> str:
    table = body.modes
    kept = f"Of {len(table.kept)} candidate vectors of the reduction {table.kept.sum()} were kept."
    return f"Modal body with {body.n} modes, {number(body.m, 6)} kg. {kept}"


def _of_sections(sections: Sequence[Section]) -> list[Requirement]:
    """Return the requirements of the sections, with links to them."""
    return [replace(r, anchor=r.anchor or section.anchor) for section in sections for r in section.requirements]


def _values(chart: dict[str, Any]) -> dict[str, Any]:
    return {"values": chart["values"], "frequencies": chart["frequencies"]}
