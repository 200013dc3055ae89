"""Ansys input files that cannot be read, and commands without an effect: one sentence each, and never a traceback."""

import contextlib
import random
import re

import pytest
from fe.ansys_decks import SHEET, STEEL, UNIT_CUBE, deck, eblock, nblock
from size import seeds

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.readers.ansys.registry import COMMANDS, REGISTRY


@pytest.fixture
def read(tmp_path):
    return lambda *lines: mp.read_mesh(deck(tmp_path, lines))


CUBE = ["ET,1,185", *STEEL, *nblock(UNIT_CUBE), *eblock(range(1, 9))]
SKIN = ["ET,1,181", *STEEL, *nblock(SHEET), *eblock((1, 2, 3, 4))]
REFUSALS = {
    "an unknown element": (["ET,1,291", *CUBE[1:]], "element 1: element type 291 has no counterpart here; name 291"),
    "contact": (["ET,1,174", *CUBE[1:]], r"CONTA174 cannot be read \(1 elements\): Contact is not linear"),
    "no type": (CUBE[1:], "element 1: its type 1 is not in the deck; add its ET"),
    "no material": ([*CUBE[:1], "MP,DENS,1,1", *CUBE[4:]], "element 1: material 1 has no EX; add its MP or MPDATA"),
    "a missing node": ([*CUBE[:4], *nblock(UNIT_CUBE[:7]), *eblock(range(1, 9))],
                       "element 1: node 8 is not in the deck"),
    "corners in disorder": ([*CUBE[:4], *nblock(UNIT_CUBE), *eblock((1, 1, 3, 4, 5, 6, 7, 8))],
                            "nodes of this hexahedron"),
    "cut elements": ([*CUBE[:-2]], "holds no elements; export the model by CDWRITE"),
    "a cut element": ([*CUBE[:4], *nblock(UNIT_CUBE), "EBLOCK,19,SOLID", "(19i9)", "        1        1"],
                      "EBLOCK: an element has no number of nodes"),
    "a bad format": ([*CUBE[:4], "NBLOCK,6,SOLID", "(what)", "   1"], "its format '.what.' is not understood"),
    "a long row": ([*CUBE[:4], "NBLOCK,6,SOLID", "(3i9,99999999e20.13)", "   1"], "names more fields than a row has"),
    "a word for a number": ([*CUBE, "MP,EX,2,%young%"], "value '%young%' is not a number; export the model by CDWRITE"),
    "two nodes of one number": ([*CUBE, "N,1,5"], "node 1 is there twice and differs"),
    "two elements of one number": ([*CUBE, *CUBE[-4:]], "element 1 is there twice"),
    "no thickness": (SKIN, "element 1: section 1 is no SHEL section of the deck; add its SECTYPE"),
    "empty section": ([*SKIN, "SECTYPE,1,SHELL"], "section 1 has no thickness; add its SECDATA"),
    "negative thickness": ([*SKIN, "SECTYPE,1,SHELL", "SECDATA,-1,1"], "ply thickness = -1 must be positive"),
    "shear stiffness": ([*SKIN, "SECTYPE,1,SHELL", "SECDATA,1,1", "SECCONTROL,1e3"],
                        "SECCONTROL: shear stiffness or added"),
    "orthotropic beam": (["ET,1,180", *STEEL, "MP,EY,1,1e9", "R,1,1", *nblock(SHEET), *eblock((1, 2))],
                         "material 1 is orthotropic; only solids and shells can be made of it"),
    "no system": ([*CUBE[:4], *nblock(UNIT_CUBE), *eblock(range(1, 9), system=12)], "coordinate system 12 is not in"),
    "anisotropic table": ([*CUBE, "TB,ANEL,1,1,21,1"], "TB: material 1: option 1 is not read"),
    "section shape": (["ET,1,188", *STEEL, "SECTYPE,1,BEAM,HATS", "SECDATA,1,1", *nblock(SHEET), *eblock((1, 2))],
                      "beam section HATS is not read"),
    "uneven section": (["ET,1,188", *STEEL, "SECTYPE,1,BEAM,I", "SECDATA,1,2,2,.1,.1,.1", *nblock(SHEET), *eblock((1,
                       2))],
                       "beam section I is not symmetric"),
    "orientation on the axis": (["ET,1,188", *STEEL, "SECTYPE,1,BEAM,RECT", "SECDATA,1,1", *nblock([(0, 0, 0), (1, 0,
                                0),
                                (2, 0, 0)]), *eblock((1, 2, 3))], "its orientation node 3 lies on its axis"),
    "mass by direction": (["ET,1,21", "R,1,1,2,3", *STEEL, *nblock(SHEET), *eblock((1,))], "differ with the direction"),
    "spring without direction": (["ET,1,14", "R,1,1", *nblock([(0, 0, 0), (0, 0, 0)]), *eblock((1, 2)), *STEEL],
                                 "its nodes coincide, so that it has no direction"),
    "a joint": (["ET,1,184", "KEYOPT,1,1,6", *STEEL, *nblock(SHEET), *eblock((1, 2))], "of MPC184 rigid links"),
    "a link of no length": (["ET,1,184", *STEEL, *nblock([(0, 0, 0)] * 2), *eblock((1, 2))], "has no direction"),
    "a foundation": (["ET,1,154", "R,1,0,0,0,5", *nblock(SHEET), *eblock((1, 2, 3, 4))], "its foundation or added"),
    "no real constants": (["ET,1,21", *STEEL, *nblock(SHEET), *eblock((1,))], "real constants 1 are not in the deck"),
    "made nodes": ([*CUBE, "NGEN,2,8,1,8,,1"], "NGEN: it makes what the file does not list"),
    "a rigid region": ([*CUBE, "CERIG,1,2,ALL"], "CERIG: it makes constraint equations from the model"),
    "another file": ([*CUBE, "/INPUT,other,inp"], "/INPUT: it chooses or repeats commands"),
    "a condition": ([*CUBE, "*IF,a,EQ,1,THEN"], r"\*IF: it chooses commands by a parameter"),
    "a local system": ([*CUBE, "CSYS,11"], "CSYS: nodes in a local system cannot be read"),
    "a toroidal system": ([*CUBE, "LOCAL,11,3"], "a coordinate system of kind 3 is not read"),
    "an endless component": ([*CUBE, "CMBLOCK,A,NODE,2", "(8i10)", "         1-999999999"], "is no component"),
    "an equation of nothing": ([*CUBE, "CE,1,0"], r"CE 1 \(line .*\): it has no terms"),
    "an equation of no node": ([*CUBE, "CE,1,0,99,UX,1"], "CE 1 .*: node 99 is not in the deck"),
    "an equation of temperatures": ([*CUBE, "CE,1,0,1,TEMP,1"], "the DOF 'TEMP' is not one of UX"),
    "a coupling of temperatures": ([*CUBE, "CP,1,TEMP,1,2"], "the DOF 'TEMP' is not one of UX"),
    "a support of no node": ([*CUBE, "D,99,ALL"], "D: node 99 is not in the deck"),
    "KEYOPT without ET": (["KEYOPT,5,1,1", *CUBE], "KEYOPT: type 5 is not there"),
}  # fmt: skip


@pytest.mark.parametrize("what", REFUSALS)
def test_what_cannot_be_read_is_refused_in_one_sentence(read, what):
    lines, message = REFUSALS[what]
    with pytest.raises(InputError, match=message):
        read(*lines)


@pytest.mark.parametrize("name", [name for name, entry in COMMANDS.items() if entry.treatment == "refused"])
def test_every_refused_command_is_refused(read, name):
    with pytest.raises(InputError, match=f"line 2: .*{re.escape(name)}.*; or name .* in 'ignore'"):
        read(name, *CUBE)


@pytest.mark.parametrize("name", [name for name, entry in COMMANDS.items() if entry.treatment == "no effect"])
def test_every_quiet_command_is_quiet(read, name):
    assert read(f"{name},1", *CUBE).notes == ()


def test_what_is_ignored_is_counted(tmp_path):
    path = deck(tmp_path, [*CUBE, "ET,2,174", *eblock((1, 2, 3, 4), kind=2, first=2), "CERIG,1,2,ALL"])
    mesh = mp.read_mesh(path, ignore=["CONTA174", "cerig"])
    assert len(mesh.cells) == 1
    assert mesh.notes[0].startswith("left out: 1 CERIG (line 26), 1 elements CONTA174 (line 24)")
    with pytest.raises(InputError, match="has no 'CPINTF' to ignore; .*it has"):
        mp.read_mesh(path, ignore=["CONTA174", "CERIG", "CPINTF"])


def test_unknown_commands_are_counted(read):
    notes = read("GAUGE,1", "GAUGE,2", *CUBE).notes
    assert notes[0].startswith("left out: 2 GAUGE (first in line 2)")


def test_registry_says_something_of_each_entry():
    assert all(entry.treatment == "no effect" or entry.handle or entry.remark for entry in REGISTRY.values())


@pytest.mark.parametrize("seed", seeds(60))
def test_damaged_decks_are_read_or_refused(tmp_path, seed):
    """Cut, changed and deleted characters: an InputError or a mesh, never another exception."""
    rng = random.Random(seed)
    text = "\n".join([*CUBE, "SECTYPE,1,SHELL", "SECBLOCK,1", "1,1,0,3", "CMBLOCK,A,NODE,2", "(8i10)",
                     f"{1:10d}{-8:10d}",
                      "LOCAL,R5.0,LOC,  11,  0,  0,  0,  0", "RLBLOCK,1,1,2,7", "(2i8,6g16.9)",
                          f"{1:8d}{2:8d}{1:16.9g}{2:16.9g}",
                      "MPDATA,R5.0, 1,EX  , 2, 1, 2.1e11,", "D,1,UX,0", "F,8,FX,2.", "ACEL,0,0,9.81",
                      "MODOPT,LANB,8,0,400", "ALPHAD,2.", "M,3,ALL", "SFE,1,2,PRES,1,5."])  # fmt: skip
    if seed % 3 == 0:
        text = text[: rng.randrange(len(text))]
    elif seed % 3 == 1:
        characters = list(text)
        for _ in range(1 + seed % 7):
            characters[rng.randrange(len(text))] = rng.choice("0123456789 -,.E(i\n)")
        text = "".join(characters)
    else:
        a = rng.randrange(len(text))
        text = text[:a] + text[a + rng.randrange(200) :]
    path = tmp_path / "deck.cdb"
    path.write_text(text)
    with contextlib.suppress(InputError):
        assert len(mp.read_mesh(path).points)
