"""Sections of the responses of a body: the peaks of its components, their margins, a plot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np
from markupsafe import Markup

from modalprep.report.body_page.requirements import of_damage, of_response
from modalprep.report.body_page.section import Section, anchor_of, chart, paragraph
from modalprep.report.body_page.table import Table
from modalprep.report.numbers import quantity
from modalprep.report.responses import MEANING, listed_peaks, notable, peak_cells, peak_columns
from modalprep.report.strength import FATIGUE, NOTCH, fatigue_rows, notch_rows
from modalprep.report.tables import margin_of_safety
from modalprep.response.fatigue import Fatigue
from modalprep.response.limits import NotchedInput
from modalprep.response.modal import BASE
from modalprep.response.result import PARTS, Peak, Response

WHOLE = (
    "Of each vector and each recovery the component with the largest value is listed at the place where it has it; "
    "all channels are in the CSV files beside this page."
)
MARGIN = "Margin of safety: allowable / peak - 1 (three sigma of a random response); a negative one is red."
INTERFACE_FORCES = (
    "Interface forces: the force and the moment that the support exerts on the root, about the root, without round-off."
)
NOTCHED = (
    "Notches: the input is lowered where a response would exceed its limit, so that it is at the limit there; the "
    "peaks above are those of the notched input."
)


def response_section(
    name: str, response: Response, plot: Path, cut: NotchedInput | None = None, notch_plot: Path | None = None
) -> Section:
    """Return the section of a response; components with an allowable are requirements.

    Examples
    --------
    >>> from modalprep.report.responses import _example
    >>> response_section("shaker", _example(), "gone.png")
    Traceback (most recent call last):
    modalprep.errors.InputError: the picture gone.png cannot be read: No such file or directory
    """
    anchor = anchor_of("response", name)
    said = f"{response.kind.capitalize()} response to {', '.join(response.inputs)}. {WHOLE}"
    html = paragraph(said) + peaks_table(anchor, response).html() + forces_table(anchor, response).html()
    html += chart(plot, f"{MEANING[response.kind]} of the largest channels")
    html += _notches(anchor, cut, notch_plot) if cut is not None and notch_plot is not None else ""
    return Section(title=f"Response {name}", anchor=anchor, html=html, requirements=of_response(name, response))


def peaks_table(anchor: str, response: Response) -> Table:
    """Return the peaks of components with allowable and margin of safety; those at the base are in `forces_table`.

    Examples
    --------
    >>> from modalprep.report.responses import _example
    >>> peaks_table("sine", _example()).columns
    ('channel', 'peak', 'at', 'phase', 'allowable', 'margin of safety')
    """
    rows = [
        (*peak_cells(peak, response.kind), _allowable(peak), margin_of_safety(peak.margin))
        for peak in listed_peaks(response)
        if not _is_interface_force(peak)
    ]
    columns = (*peak_columns(response)[:-1], "allowable", "margin of safety")
    return Table(name=f"{anchor}-peaks", columns=columns, rows=rows, caption=MARGIN)


def _is_interface_force(peak: Peak) -> bool:
    return peak.block == BASE and peak.place in ("force", "moment")


def _allowable(peak: Peak) -> str:
    """Return what is allowed: for recoveries, which may lack it; nothing for the base and interfaces."""
    if np.isnan(peak.margin):
        return "" if peak.place in PARTS else "none given"
    return quantity(peak.largest * (1 + peak.margin), peak.unit)


def forces_table(anchor: str, response: Response) -> Table:
    """Return the peaks of the forces and moments at the root, whether they were asked for or not.

    Examples
    --------
    >>> from modalprep.report.responses import _example
    >>> forces_table("sine", _example()).rows
    []
    """
    own = [peak for peak in response.peaks if _is_interface_force(peak)]
    rows = [peak_cells(peak, response.kind) for peak in notable(own)]
    return Table(
        name=f"{anchor}-interface-forces", columns=peak_columns(response)[:-1], rows=rows, caption=INTERFACE_FORCES
    )


def _notches(anchor: str, cut: NotchedInput, plot: Path) -> Markup:
    drawn = chart(plot, "Input and limited responses, before and after notching")
    if not cut.notches:
        return paragraph("No response reaches its limit; the input has no notch.") + drawn
    table = Table(name=f"{anchor}-notches", columns=NOTCH, rows=notch_rows(cut), caption=NOTCHED)
    return table.html() + drawn


def shock_section(name: str, plot: Path) -> Section:
    """Return the section of shock response spectra."""
    says = "The largest responses of damped oscillators that stand where the channel is recorded, over their frequency."
    html = paragraph(says) + chart(plot, f"Shock response spectra of {name} (maximax)")
    return Section(title=f"Shock spectrum {name}", anchor=anchor_of("srs", name), html=html)


def fatigue_section(name: str, damage: Mapping[str, Fatigue]) -> Section:
    """Return the section of the damage of channels; a damage below 1 is a requirement."""
    anchor = anchor_of("fatigue", name)
    table = Table(name=anchor, columns=FATIGUE, rows=fatigue_rows(damage))
    says = "Miner's sum of each channel; 1 is failure. The life is that under the same load for ever."
    return Section(
        title=f"Fatigue {name}",
        anchor=anchor,
        html=paragraph(says) + table.html(),
        requirements=[of_damage(name, damage)],
    )
