"""Every field and parameter of a keyword that is read changes the mesh, is noted, or is refused; others are listed.

The lists have what says nothing of stiffness, mass and constraints: temperatures, strength, output, and choices between
solvers. A field that is dropped without a word fails here.
"""

import dataclasses

import numpy as np
import pytest
from fe.ansys_decks import STEEL, UNIT_CUBE, eblock, nblock
from fe.ansys_decks import deck as ansys_deck
from fe.decks import free
from fe.readers.abaqus.test_fuzz import DECK

import modalprep as mp
from modalprep.fe.readers.ansys.options import IDLE, REFUSED, USED


def content(value):
    """All that a mesh holds, to be compared."""
    if dataclasses.is_dataclass(value):
        fields = (field.name for field in dataclasses.fields(value) if field.name != "sha256")
        return type(value).__name__, *((name, content(getattr(value, name))) for name in fields)
    if isinstance(value, dict):
        return tuple((key, content(own)) for key, own in value.items())
    if isinstance(value, tuple | list):
        return tuple(map(content, value))
    return np.asarray(value).tobytes() if isinstance(value, np.ndarray) else repr(value)


def outcome(path, text):
    """What a deck becomes: its mesh and notes, or why it is refused."""
    path.write_text(text)
    try:
        return content(mp.read_mesh(path))
    except mp.InputError as error:
        return str(error)


# ---- Nastran: card, what stands with it, and another value of each field by its place behind the name

CASE = "SOL 103\nCEND\nSPC=3\nMPC=3\nLOAD=3\nMETHOD=3\nBEGIN BULK\n"
CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0.5, 0.5, 3)]
GRIDS = "".join(f"GRID,{k},,{x}.,{y}.,{z}.\n" for k, (x, y, z) in enumerate(CORNERS, 1)).replace("0.5.", ".5")
GRIDS += "CORD2R,4,,0.,0.,0.,0.,1.,0.\n,1.,0.,0.\nMAT1,7,2.+11,,.3,8000.\n"
ROD, QUAD = "CROD,90,60,1,2\nPROD,60,7,.01\n", "CQUAD4,10,91,1,2,3,4\n"
SHELL, PLIES = QUAD + "PSHELL,91,7,.01,7,,7\n", "PSHELL,91,8,.01,8,,8\nMAT8,8,2.+11,1.+10,.3,5.+9,4.+9,3.+9,1600.\n"
BRICK, BAR = "CHEXA,1,92,1,2,3,4,5,6,+\n+,7,8\n", "CBAR,11,50,1,2,0.,1.,0.\n"
PBAR, PBEAM = "PBAR,50,7,.01,3.-6,2.-6,4.-6\n", "PBEAM,50,7,.01,3.-6,2.-6,,4.-6\n"
CARDS = {
    "MAT1,8,2.+11,,.3,8000.": (QUAD + "PSHELL,91,8,.01,8,,8\n", {1: "3.+11", 2: "8.+10", 3: ".2", 4: "3.", 7: ".02"}),
    "MAT2,8,2.+11,6.+10,,2.+11,,7.+10,8000.": (
        QUAD + "PSHELL,91,8,.01,8,,8\n",
        {1: "3.+11", 2: "5.+10", 3: "1.+9", 4: "3.+11", 5: "1.+9", 6: "8.+10", 7: "9.", 12: ".02"},
    ),
    "MAT8,8,2.+11,1.+10,.3,5.+9,4.+9,3.+9,1600.": (
        QUAD + "PSHELL,91,8,.01,8,,8\n",
        {1: "3.+11", 2: "2.+10", 3: ".2", 4: "6.+9", 5: "5.+9", 6: "2.+9", 7: "1.", 16: ".02"},
    ),
    "MAT9,8,2.+11,1.+11,1.+11,,,,2.+11,1.+11,,,,2.+11,,,,5.+10,,,5.+10,,5.+10,8000.": (
        BRICK + "PSOLID,92,8\n",
        {k: "3.+9" for k in range(1, 22)} | {22: "7.", 30: ".02"},
    ),
    "PSHELL,91,7,.01,7,1.,7,.833,5.": (QUAD, {2: ".02", 3: "", 4: "2.", 5: "", 6: ".5", 7: "6.", 10: "7"}),
    "PCOMP,91,,,,,,,,7,.001,0.,YES,7,.002,45.,YES": (
        QUAD,
        {1: "-.001", 2: "5.", 6: ".02", 7: "SYM", 9: ".003", 10: "30."},
    ),
    "PBAR,50,7,.01,3.-6,2.-6,4.-6,2.,,.1,.1": (
        BAR,
        {2: ".02", 3: "4.-6", 4: "3.-6", 5: "5.-6", 6: "3.", 8: ".3", 9: ".3", 15: ".2"}
        | {16: ".5", 17: ".5", 18: "1.-6"},
    ),
    "PBARL,50,7,,BAR,,,,,.1,.2,3.": (BAR, {8: ".2", 9: ".3", 10: "4."}),
    "PROD,60,7,.01,1.-6,.1,2.": ("CROD,90,60,1,2\n", {2: ".02", 3: "2.-6", 5: "3."}),
    "PTUBE,61,7,.1,.01,2.": ("CTUBE,90,61,1,2\n", {2: ".2", 3: ".02", 4: "3.", 5: ".2"}),
    "PSOLID,92,7": (BRICK, {3: "3", 6: "PFLUID"}),
    "PSHEAR,93,7,.01,2.": ("CSHEAR,1,93,1,2,3,4\n", {2: ".02", 3: "3.", 4: ".5", 5: ".5"}),
    "PBUSH,94,K,1.+5,1.+5,1.+5,1.,1.,1.": (
        "CBUSH,1,94,1,2,,,,0\n",
        {k: "2.+5" for k in range(2, 8)},
    ),
    "PBUSH,94,K,1.+5,,,,,,,B,,,,,,,,GE,,,,,,,,M": (
        "CBUSH,1,94,1,2,,,,0\n",
        {10: "2.", 18: ".02", 26: "3."},
    ),
    "PELAS,95,1.+5": ("CELAS1,1,95,1,1,2,1\n", {1: "2.+5", 2: ".2"}),
    "CBAR,11,50,1,2,0.,1.,0.,,": (
        PBAR,
        {4: ".5", 6: ".5", 8: "4", 9: "4", **{k: ".1" for k in range(10, 16)}},
    ),
    "CBEAM,11,50,1,2,0.,1.,0.,,": (
        PBEAM,
        {4: ".5", 6: ".5", 8: "4", 9: "4", **{k: ".1" for k in range(10, 16)}, 16: "5", 17: "5"},
    ),
    "CQUAD4,10,91,1,2,3,4": (PLIES, {6: "30.", 7: ".1", 10: ".02", 11: ".02", 12: ".02", 13: ".02"}),
    "CTRIA3,10,91,1,2,3": (PLIES, {5: "30.", 6: ".1", 10: ".02", 11: ".02", 12: ".02"}),
    "CBUSH,1,94,1,2,,,,0,,4,.1": (
        "PBUSH,94,K,1.+5,2.+5,3.+5,1.,2.,3.\n",
        {7: "4", 9: "-1", 10: ".3", 11: ".3", 12: ".3"},
    ),
    "CELAS2,1,1.+5,1,1,2,1": ("", {1: "2.+5", 3: "2", 5: "3", 6: ".1"}),
    "CONM2,1,1,,5.,,.1,,,1.,,2.,,,3.": (
        ROD,
        {2: "4", 3: "6.", 4: ".2", 5: ".2", 6: ".1", **{k: ".3" for k in range(8, 14)}},
    ),
    "CONROD,1,1,2,7,.01,1.-6,.1": ("", {4: ".02", 5: "2.-6", 7: "3."}),
    "RBE2,30,9,123456,3,4": (SHELL, {2: "123", 4: "8"}),
    "RBE3,30,,9,123456,1.,123,2,3,4": (SHELL, {3: "123", 4: "2.", 8: "8"}),
    "RBAR,30,3,4,123456": (SHELL, {3: "123", 4: "456", 6: "123"}),
    "MPC,3,3,1,1.,4,1,-1.": (SHELL, {2: "2", 3: "2.", 5: "2", 6: "-2."}),
    "SPC1,3,123,1": (SHELL, {1: "12"}),
    "SPC,3,1,123,0.,2,12,0.": (SHELL, {3: ".1", 6: ".1"}),
    "FORCE,3,2,,10.,0.,1.,0.": (SHELL, {2: "4", 3: "11."}),
    "PLOAD4,3,10,6.,,,,,,4,0.,0.,1.": (SHELL, {3: "7.", 8: "0", 9: "2.", 10: "1.", 12: "LINE"}),
    "GRAV,3,4,9.81,0.,0.,-1.": (SHELL, {1: "0", 2: "1."}),
    "EIGRL,3,1.,100.,10": (SHELL, {1: "2.", 2: "50.", 3: "5"}),
    "PARAM,CK1,1.": (SHELL, {1: "2."}),
    "PARAM,WTMASS,1.": (SHELL, {1: "2."}),
}  # fmt: skip


@pytest.mark.parametrize("card", CARDS)
def test_fields_of_nastran(tmp_path, card):
    rest, others = CARDS[card]
    path = tmp_path / "deck.bdf"

    def read(fields):
        return outcome(path, CASE + GRIDS + rest + ("" if "," in rest else ROD) + free(fields) + "ENDDATA\n")

    name, *fields = card.split(",")
    first = read([name, *fields])
    assert isinstance(first, tuple), first
    silent = []
    for k, value in others.items():
        changed = [*fields, *[""] * (k + 1 - len(fields))]
        changed[k] = value
        silent += [k] if read([name, *changed]) == first else []
    if silent:
        pytest.fail(f"{name}: fields {silent} are dropped without a word")


# ---- Abaqus and CalculiX

FRAMES = ("HEADING", "END", "STEP", "STATIC", "SUBSTRUCTURE GENERATE")  # what they ask for is not the model's


KEYWORDS = {k: text.lstrip("*").split(",")[0] for k, text in enumerate(DECK.splitlines()) if text.startswith("*")}


@pytest.mark.parametrize("line", [k for k, keyword in KEYWORDS.items() if not keyword.startswith(FRAMES)])
def test_a_parameter_that_nobody_knows_is_said(tmp_path, line):
    lines, keyword = DECK.splitlines(), KEYWORDS[line]
    lines[line] += ", XYZZY=1"
    path = tmp_path / "deck.inp"
    path.write_text("\n".join(lines) + "\n")
    mesh = mp.read_mesh(path)
    assert any(
        f"parameter XYZZY of *{keyword}" in said for said in [*mesh.notes, *(s for c in mesh.cases for s in c.said)]
    )


OTHERS = {  # keyword of the deck: parameters that make it say something else
    "NODE": "SYSTEM=C|SYSTEM=S",
    "NFILL": "BIAS=2.|SINGULAR=1|TWO STEP",
    "NCOPY": "REFLECT=LINE|POLE|MULTIPLE=3",
    "ELEMENT": "OFFSET=100",
    "ELCOPY": "REFLECT",
    "ORIENTATION": "DEFINITION=NODES|DEFINITION=OFFSET TO NODES|SYSTEM=SPHERICAL|SYSTEM=USER",
    "SOLID SECTION": "COMPOSITE|ORDER=3|REF NODE=1|STACK DIRECTION=1",
    "SHELL SECTION": "DENSITY=5.|OFFSET=SNEG|OFFSET=.3|THICKNESS MODULUS=1.|SYMMETRIC|NODAL THICKNESS",
    "BEAM SECTION": "LUMPED=NO|ROTARY INERTIA=ISOTROPIC|BEAM OFFSET=1",
    "SURFACE": "TYPE=NODE|COMBINE=UNION|CROP|TRIM=YES",
    "TIE": "TYPE=NODE TO SURFACE|NO ROTATION|TIED NSET=low|CONSTRAINT RATIO=.5",
    "COUPLING": "INFLUENCE RADIUS=.1|ALPHA=1",
    "RIGID BODY": "TIE NSET=low|ELSET=b|POSITION=CENTER OF MASS",
    "MPC": "MODE=NODE|USER",
    "TRANSFORM": "TYPE=R|TYPE=Q",
    "ELASTIC": "TYPE=ORTHOTROPIC|TYPE=LAMINA|TYPE=TRACTION|TYPE=SHORT FIBER|MODULI=LONG TERM|COMPRESSION FACTOR=.5",
    "DENSITY": "PORE FLUID",
    "BOUNDARY": "TYPE=VELOCITY|USER|PHANTOM=NODE|SUBMODEL|SCALE=2",
    "MASS": "ALPHA=.1|ORIENTATION=o|TYPE=ANISOTROPIC",
    "SPRING": "NONLINEAR|COMPLEX STIFFNESS|ORIENTATION=o",
    "CLOAD": "AMPLITUDE=a|SECTOR=2|USER|CYCLIC MODE=1|IMAGINARY|LOAD CASE=2|SUBMODEL",
    "DLOAD": "ORIENTATION=o|CONSTANT RESULTANT=YES|REF NODE=1|AMPLITUDE=a|SECTOR=2|IMAGINARY|LOAD CASE=2",
    "DSLOAD": "ORIENTATION=o|CONSTANT RESULTANT=YES|REF NODE=1|AMPLITUDE=a|IMAGINARY",
    "MODAL DAMPING": "RAYLEIGH|STRUCTURAL|DEFINITION=FREQUENCY RANGE|MODAL=COMPOSITE|VISCOUS=COMPOSITE",
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return outcome(tmp_path_factory.mktemp("whole") / "deck.inp", DECK)


@pytest.mark.parametrize("keyword", OTHERS)
def test_parameters_of_abaqus(tmp_path, keyword, whole):
    lines = DECK.splitlines()
    k = next(k for k, text in enumerate(lines) if text.split(",")[0] == f"*{keyword}")
    head, *given = (part.strip() for part in lines[k].split(","))
    silent = []
    for parameter in OTHERS[keyword].split("|"):
        kept = [part for part in given if part.split("=")[0] != parameter.split("=")[0]]
        changed = [*lines[:k], ", ".join([head, *kept, parameter]), *lines[k + 1 :]]
        silent += [parameter] if outcome(tmp_path / "deck.inp", "\n".join(changed) + "\n") == whole else []
    if silent:
        pytest.fail(f"*{keyword}: {silent} are dropped without a word")


# ---- Ansys

TYPES = {"181": range(1, 5), "185": range(1, 9), "188": (1, 2), "63": range(1, 5), "180": (1, 2)}
CONSTANTS = ["R,1,.01,.01,.01,.01", "SECTYPE,1,SHELL", "SECDATA,.01,1"]


@pytest.mark.parametrize("number", TYPES)
def test_options_of_elements_of_ansys(tmp_path, number):
    """KEYOPT(1) to (20): each is used, changes nothing by our list, is noted or is refused."""
    section = ["SECTYPE,1,BEAM,RECT", "SECDATA,.02,.05"] if number == "188" else CONSTANTS
    section = ["SECTYPE,1,LINK", "SECDATA,.01"] if number == "180" else section
    nodes = [*nblock(UNIT_CUBE), *eblock(TYPES[number])]

    def read(*options):
        path = ansys_deck(tmp_path, [f"ET,1,{number}", *options, *STEEL, *section, *nodes])
        return outcome(path, path.read_text())

    first = read()
    assert isinstance(first, tuple), first
    for option in range(1, 21):
        for value in (1, 2):
            silent = read(f"KEYOPT,1,{option},{value}") == first
            assert not silent or option in IDLE.get(number, ()) or option in USED.get(number, ())
            assert (number, option, value) not in REFUSED or not silent


# ---- what was once dropped without a word

CUBE = [*nblock(UNIT_CUBE), *eblock(range(1, 9))]


def ansys_mesh(folder, *lines, number="185", nodes=CUBE):
    return mp.read_mesh(ansys_deck(folder, [f"ET,1,{number}", *STEEL, *nodes, *lines]))


@pytest.mark.parametrize("card", ["BCTSET", "BCONP", "BCTABLE", "BGSET", "TIE", "RBE2GS", "CPLSTN4", "CSPOT"])
def test_contact_glue_and_other_elements_of_nastran_are_refused(tmp_path, card):
    message = outcome(tmp_path / "deck.bdf", CASE + GRIDS + ROD + f"{card},77,1,2\nENDDATA\n")
    assert f"{card} 77" in message
    assert f"ignore = ['{card}']" in message


def test_a_row_behind_the_last_of_a_pbeam_is_refused(tmp_path):
    rows = ",,,,,,,,\n" * 3  # C1 to F2, K1 to CW, M1 to N2
    text = CASE + GRIDS + BAR.replace("CBAR", "CBEAM") + PBEAM + rows
    assert isinstance(outcome(tmp_path / "deck.bdf", text + "ENDDATA\n"), tuple)
    assert "behind its last row" in outcome(tmp_path / "deck.bdf", text + ",5.,5.\nENDDATA\n")


def test_commands_of_ansys_on_ranges_of_nodes(tmp_path):
    """NODE, NEND and NINC: D, F and M act on nodes 1, 3, 5 and 7, not on the first alone."""
    mesh = ansys_mesh(tmp_path, "D,1,UX,0,,7,2,UY", "F,1,FX,5.,,7,2", "M,1,UX,7,2")
    held, load = mesh.supports["held"], mesh.loads["forces"]
    assert mesh.labels[held.nodes].tolist() == mesh.labels[load.nodes].tolist() == [1, 3, 5, 7]
    assert held.components.sum(axis=0).tolist() == [4, 4, 0, 0, 0, 0]
    assert load.forces.sum(axis=0).tolist() == [20, 0, 0]
    assert len(mesh.groups["master"]["vertex"]) == 4
    with pytest.raises(mp.InputError, match="from 3 to 1"):
        ansys_mesh(tmp_path, "D,3,UX,0,,1")


@pytest.mark.parametrize("command", ["DDELE,1,ALL", "CEDELE,1", "EKILL,1", "MPCHG,2,1", "ENDRELEASE,,-1,BALL"])
def test_commands_of_ansys_that_take_back_are_refused(tmp_path, command):
    with pytest.raises(mp.InputError, match="changes what stands before it"):
        ansys_mesh(tmp_path, command)


def test_a_pipe_of_ansys_weighs_what_it_holds(tmp_path):
    """SECDATA: outer diameter, wall, ..., materials of contents and insulation, thickness of the insulation."""
    nodes = [*nblock([(0, 0, 0), (1, 0, 0), (0, 0, 1)]), *eblock((1, 2, 3))]
    section = ["SECTYPE,1,PIPE", "SECDATA,.1,.01,8,,,2,3,.02", "MP,DENS,2,1000.", "MP,DENS,3,200."]
    pipe = next(iter(ansys_mesh(tmp_path, *section, number="288", nodes=nodes).properties.values()))
    assert pipe.nsm == pytest.approx(np.pi * (1000 * 0.04**2 + 200 * (0.07**2 - 0.05**2)), rel=1e-14)
    with pytest.raises(mp.InputError, match="material 2 of its contents or insulation has no DENS"):
        ansys_mesh(tmp_path, *section[:2], number="288", nodes=nodes)


def test_what_ansys_says_of_the_analysis_is_said(tmp_path):
    bar = [*nblock([(0, 0, 0), (1, 0, 0)]), *eblock((1, 2))]
    notes = ansys_mesh(tmp_path, "R,1,.01,,1", "TB,SDAMP,1,,,STRU", number="180", nodes=bar).notes
    assert any("bears both" in note for note in notes)
    assert any("TB,SDAMP" in note for note in notes)
    assert "PSTRES" in str(ansys_mesh(tmp_path, "PSTRES,ON").cases)
    assert ansys_mesh(tmp_path, "PSTRES,OFF").cases == ()


BAR_OF_ABAQUS = "*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n*ELEMENT, TYPE=SPRINGA, ELSET=k\n1, 1, 2\n"


@pytest.mark.parametrize("blank", ["\n", ",\n"])
def test_of_several_stiffnesses_of_a_spring_the_first_holds(tmp_path, blank):
    path = tmp_path / "deck.inp"
    path.write_text(BAR_OF_ABAQUS + f"*SPRING, ELSET=k\n{blank}5., , 20.\n7., , 100.\n")
    mesh = mp.read_mesh(path)
    assert mesh.properties["k"].translation == (5, 0, 0)
    assert any("of its 2 values the first holds" in note for note in mesh.notes)


MODES = "*FREQUENCY\n5\n*END STEP\n"


@pytest.mark.parametrize(
    ("first", "second", "dialect", "said"),
    [
        ("*STEP, NLGEOM=YES\n", "*STEP\n", "abaqus", True),
        ("*STEP\n", "*STEP, PERTURBATION\n", "calculix", True),
        ("*STEP\n", "*STEP, PERTURBATION\n", "abaqus", False),
        ("*STEP, NLGEOM=NO\n", "*STEP\n", None, False),
    ],
)
def test_modes_under_load_are_said(tmp_path, first, second, dialect, said):
    path = tmp_path / "deck.inp"
    path.write_text(BAR_OF_ABAQUS + first + "*STATIC\n*CLOAD\n2, 1, 5.\n*END STEP\n" + second + MODES)
    assert ("under the loads of the steps before" in str(mp.read_mesh(path, dialect=dialect).cases)) == said


def test_stresses_of_the_start_are_said(tmp_path):
    path = tmp_path / "deck.inp"
    path.write_text(BAR_OF_ABAQUS + "*INITIAL CONDITIONS, TYPE=STRESS\n1, 5.\n")
    assert any("TYPE=STRESS" in note for note in mp.read_mesh(path).notes)


def test_a_modulus_whose_products_are_no_numbers_is_refused(tmp_path):
    """1 / (E A) of such a modulus is infinite."""
    text = CASE + GRIDS + BAR + PBAR.replace("50,7", "50,8") + "MAT1,8,2.1-320,,.3,8000.\nENDDATA\n"
    assert "must be between 1e-60 and 1e+60" in outcome(tmp_path / "deck.bdf", text)
