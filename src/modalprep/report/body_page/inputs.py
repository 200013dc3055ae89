"""What a body was made of, as its page shows it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from modalprep.report.body_page.section import Section, paragraph
from modalprep.report.body_page.table import Table, part


@dataclass(frozen=True, kw_only=True)
class Inputs:
    """Inputs of a body and the program that made it; all of them may be missing.

    Attributes
    ----------
    tables : sequence of Table
        Materials, sections, mass by group, elements, links, interfaces, supports, units.
    energies : sequence of Table
        Shares of the groups in the strain and kinetic energy of each mode, %.
    text : str
        Of the pipeline file.
    files : {name: hash}
        SHA-256 of the input files.
    made : {name: text}
        Versions and computer.

    Examples
    --------
    >>> Inputs(text="[mesh]").tables
    ()
    """

    tables: Sequence[Table] = ()
    energies: Sequence[Table] = ()
    text: str = ""
    files: Mapping[str, str] = field(default_factory=dict)
    made: Mapping[str, str] = field(default_factory=dict)


UNKNOWN = (
    "A modal file alone does not hold materials, sections, masses of groups and the shape of elements. The page that "
    "'modalprep run' or 'modalprep modes' writes of its pipeline file has them."
)


def inputs_section(inputs: Inputs) -> Section:
    """Return the section of the tables and of the pipeline file, or of why there are none."""
    known = part("inputs.html", inputs=inputs) if inputs.tables or inputs.text else paragraph(UNKNOWN)
    return Section(title="Inputs", anchor="inputs", html=known)


def energy_section(inputs: Inputs) -> list[Section]:
    """Return the section of strain and kinetic energy by group, none without it."""
    if not inputs.energies:
        return []
    html = part("tables.html", text="", tables=inputs.energies)
    return [Section(title="Energy by group", anchor="energy", html=html)]
