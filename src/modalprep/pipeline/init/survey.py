"""What a file of a part holds, as far as a first pipeline file needs it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.features.groups import structural_groups
from modalprep.fe.features.openings import Opening, openings
from modalprep.fe.features.planes import PlaneFace, plane_faces
from modalprep.fe.features.skin import named_patches, skin_of
from modalprep.fe.mesh.analysis import AnalysisCase
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.abaqus.dialect import Dialect
from modalprep.fe.readers.cad import CAD
from modalprep.pipeline.init.case import chosen_case
from modalprep.pipeline.init.interfaces import proposals
from modalprep.pipeline.init.proposal import Proposal
from modalprep.pipeline.init.units import Read, read_with_units
from modalprep.records import Record

PLANE = "plane"  # supports of plane stress, which carry no frame
CONSTRAINTS = re.compile(r"(spc|boundary)", re.IGNORECASE)  # sets that hold a part, before constraints of its grids


@dataclass(frozen=True, eq=False, kw_only=True)
class Survey(Record):
    """What a file holds.

    Attributes
    ----------
    file : Path
    read : Read
        The mesh and its units.
    structure : {group: dimension}
        Groups that need a property.
    openings : list of Opening
    planes : list of PlaneFace
    interfaces : list of Proposal
        Those that are likely first, the root first of all.
    notes : tuple of str
        What the file says, or could not be guessed.
    case : AnalysisCase or None
        What a deck says of its analysis.
    in_band : int or None
        How many modes the clamped model has in the band of a deck that gives no count; None where not counted.
    """

    file: Path
    read: Read
    structure: dict[str, int]
    openings: list[Opening]
    planes: list[PlaneFace]
    interfaces: list[Proposal]
    notes: tuple[str, ...]
    case: AnalysisCase | None = None
    in_band: int | None = None

    @property
    def mesh(self) -> Mesh:
        """The mesh."""
        return self.read.mesh

    @property
    def supported(self) -> str | None:
        """The set of supports of a deck that the root interface takes."""
        if self.case is not None and self.case.supports:
            return self.case.supports[0]
        held = [name for name in self.mesh.supports if name != PLANE]
        return min(held, key=lambda name: not CONSTRAINTS.match(name), default=None)

    @property
    def active(self) -> list[Proposal]:
        """The interfaces that the pipeline file has, besides the supports."""
        held = self.mesh.supports[self.supported].nodes if self.supported else []
        return [one for one in self.interfaces if one.likely and not np.isin(one.nodes, held).any()]


def survey(
    file: Path,
    length_unit: str | None = None,
    mass_unit: str | None = None,
    size: float | None = None,
    dialect: Dialect | None = None,
    subcase: int | None = None,
) -> Survey:
    """Read a mesh, a deck or a CAD file and find what a first pipeline file needs.

    Raises
    ------
    InputError
        When the file cannot be read, has no elements of structure, or not that subcase.
    """
    read = read_with_units(file, length_unit, mass_unit, size, dialect)
    mesh = read.mesh
    case = chosen_case(mesh, subcase)
    skin = skin_of(read.mesh)
    if not any(cell_dimension(kind) for kind in mesh.cells):
        raise InputError(f"mesh file {file} has no elements; save the mesh with them")
    structure, left = structural_groups(mesh)
    patches = named_patches(mesh, skin).values() if file.suffix.lower() in CAD else ()
    rounds = openings(mesh, skin, patches)
    planes = plane_faces(skin)
    found = proposals(mesh, structure, rounds, planes)
    notes = [*mesh.notes, *(case.said if case else ())]
    if left:
        notes.append(f"{left} elements are in no group that can have a property; they are left out")
    if not mesh.supports and ("PLACEHOLDER" in found[0].what or found[0].name.startswith("plane_")):
        notes.append(
            "no interface was found: no named set, round opening or rigid element; those of the file are the ends of "
            "the part, and must be chosen by hand"
        )
    return Survey(
        file=file,
        read=read,
        structure=structure,
        openings=rounds,
        planes=planes,
        interfaces=found,
        notes=tuple(notes),
        case=case,
    )
