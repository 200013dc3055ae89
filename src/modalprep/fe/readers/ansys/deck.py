"""What an Ansys input file says, by numbers of the file and in its own units."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from modalprep.errors import InputError
from modalprep.fe.readers.systems import System


class Element(NamedTuple):
    """An element with its attributes: numbers of type, material, real constants, section and coordinate system."""

    label: int
    type: int
    material: int
    real: int
    section: int
    system: int
    nodes: tuple[int, ...]
    line: int


@dataclass(slots=True)
class ElementType:
    """Number of the element in Ansys' library, and its options by number."""

    name: str
    options: dict[int, int] = field(default_factory=dict)


@dataclass(slots=True)
class SectionData:
    """A section as its commands give it."""

    kind: str
    shape: str
    line: int
    values: list[float] = field(default_factory=list)
    plies: list[list[float]] = field(default_factory=list)
    place: str = ""
    offset: tuple[float, float] = (0.0, 0.0)


class FixedDof(NamedTuple):
    """One DOF of a node that D holds at a value."""

    node: int
    label: str
    value: float
    line: int


@dataclass
class Deck:
    """The content read so far."""

    path: Path
    points: dict[int, list[float]] = field(default_factory=dict)
    angles: dict[int, list[float]] = field(default_factory=dict)
    elements: dict[int, Element] = field(default_factory=dict)
    types: dict[int, ElementType] = field(default_factory=dict)
    materials: dict[int, dict[str, float]] = field(default_factory=dict)
    reals: dict[int, list[float]] = field(default_factory=dict)
    sections: dict[int, SectionData] = field(default_factory=dict)
    systems: dict[int, System] = field(default_factory=dict)
    node_sets: dict[str, list[int]] = field(default_factory=dict)
    element_sets: dict[str, list[int]] = field(default_factory=dict)
    fixed: list[FixedDof] = field(default_factory=list)
    equations: dict[int, dict[str, Any]] = field(default_factory=dict)
    couples: dict[int, dict[str, Any]] = field(default_factory=dict)
    forces: dict[tuple[int, int], float] = field(default_factory=dict)  # by node and component
    said: dict[str, list[float]] = field(default_factory=dict)  # numbers of commands of the analysis
    unread: list[tuple[str, str]] = field(default_factory=list)  # of the analysis
    attributes: dict[str, int] = field(default_factory=dict)  # of the elements that follow
    section: int = 0  # the one that SECDATA means
    table: tuple[int, str] = (0, "")  # material and kind of the table that TBDATA means
    notes: list[str] = field(default_factory=list)
    skipped: list[tuple[str, str]] = field(default_factory=list)

    def note(self, text: str) -> None:
        """Add a note once."""
        if text not in self.notes:
            self.notes.append(text)

    def error(self, element: Element, what: str) -> InputError:
        """Return an error that names an element and the line of the file."""
        return InputError(f"mesh file {self.path}, line {element.line}: element {element.label}: {what}")
