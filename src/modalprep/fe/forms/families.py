"""Registry of the plain forms: which weak forms the elements of a family have."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.elements.block import Block
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.solid import SolidBlock
from modalprep.fe.elements.truss import TrussBlock
from modalprep.fe.forms.basis import DofMap
from modalprep.fe.forms.beam import PlainBeam, PlainThreeNodeBeam
from modalprep.fe.forms.block import FormBlock
from modalprep.fe.forms.curved_shell import PlainCurvedShell
from modalprep.fe.forms.flat_shell import PlainFlatShell
from modalprep.fe.forms.plain import Plain
from modalprep.fe.forms.solid import PlainSolid
from modalprep.fe.forms.truss import PlainTruss

PLAIN: Mapping[type[Block], Callable[[Any, DofMap], Plain]] = {
    BeamBlock: PlainBeam,
    ThreeNodeBeamBlock: PlainThreeNodeBeam,
    TrussBlock: PlainTruss,
    ShellBlock: PlainFlatShell,
    CurvedShellBlock: PlainCurvedShell,
    SolidBlock: PlainSolid,
}


def plain(block: Block, dofmap: DofMap) -> Plain | None:
    """Return the weak forms of a block; None for point masses and springs, which have no inside."""
    if isinstance(block, FormBlock):
        return block.forms(dofmap)
    family = PLAIN.get(type(block))
    return None if family is None else family(block, dofmap)
