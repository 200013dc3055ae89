"""What the readers of decks do with each keyword or card, by format: the source of the table in the reference."""

from __future__ import annotations

from collections.abc import Mapping

from modalprep.fe.readers.abaqus.registry import REGISTRY as ABAQUS
from modalprep.fe.readers.ansys.registry import REGISTRY as ANSYS
from modalprep.fe.readers.coverage import Entry
from modalprep.fe.readers.nastran.registry import REGISTRY as NASTRAN

REGISTRIES: Mapping[str, Mapping[str, Entry]] = {
    "Abaqus and CalculiX": ABAQUS,
    "Ansys": ANSYS,
    "Nastran": NASTRAN,
}
