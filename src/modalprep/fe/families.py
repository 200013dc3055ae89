"""Registry of the element families: which block evaluates a property on which cell type."""

from __future__ import annotations

from collections.abc import Mapping

from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.point import MassBlock, SpringBlock
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.curved_shell import DEGREE as CURVED_SHELLS
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.solid import DEGREE as SOLID_CELLS
from modalprep.fe.elements.solid import SolidBlock
from modalprep.fe.elements.truss import TrussBlock
from modalprep.fe.properties.points import PointMass, Spring
from modalprep.fe.properties.properties import Beam, Property, Shell, Solid, Truss

FAMILIES: Mapping[type[Property], Mapping[str, type[Block]]] = {
    Beam: {"line": BeamBlock, "line3": ThreeNodeBeamBlock},
    Truss: {"line": TrussBlock},
    Shell: {"triangle": ShellBlock, "quad": ShellBlock, **dict.fromkeys(CURVED_SHELLS, CurvedShellBlock)},
    Solid: dict.fromkeys(SOLID_CELLS, SolidBlock),
    PointMass: {"vertex": MassBlock},
    Spring: {"line": SpringBlock, "vertex": SpringBlock},
}
