"""The text of Nastran decks: formats of fields and numbers, continuations, includes, and decks that are wrong."""

import contextlib
import math

import numpy as np
import pytest
from fe.decks import BAR, GRIDS, PBAR, STEEL, free

from modalprep.errors import InputError
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.deck import ADVICE, read_nastran

# ---------------------------------------------------------------- text


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1.5-6", 1.5e-6),
        ("2.9+7", 2.9e7),
        ("1.D3", 1e3),
        ("-.5E-2", -5e-3),
        ("3", 3.0),
        ("+7.E+1", 70.0),
        ("1.+3", 1e3),
    ],
)
def test_number_formats(text, value):
    assert Card("X", [text], "f", 1).real(0, "A") == value


@pytest.mark.parametrize("text", ["abc", "nan", "inf", "1_0.", "1..2", "1.E", "1.+999", "--1."])
def test_what_is_no_number(text):
    with pytest.raises(InputError, match="f line 1: X: A is .*, not a number that can be used; give a number"):
        Card("X", [text], "f", 1).real(0, "A")


def fixed(width, *fields):
    """Write a card in small (8) or large (16) field with continuation lines."""
    name, *values = fields
    per_line = 64 // width
    lines = [values[i : i + per_line] for i in range(0, len(values), per_line)]
    heads = [name + "*" * (width == 16), *["*" if width == 16 else "+"] * (len(lines) - 1)]
    return "".join(
        h.ljust(8) + "".join(v.rjust(width) for v in line) + "\n" for h, line in zip(heads, lines, strict=True)
    )


CARDS = [
    ["GRID", "1", "", "0.", "0.", "0."],
    ["GRID", "2", "", "2.", "0.", "0."],
    ["CBAR", "9", "5", "1", "2", "0.", "1.", "0.", "", "", "", "0.", ".1", "0.", "0.", ".1", "0."],
    ["PBAR", "5", "7", ".01", "3.-6", "2.-6", "4.-6", ".5", *[""] * 9, ".8", ".9"],
    ["MAT1", "7", "2.+11", "", ".3", "8000."],
]


def tabs(card):
    return "".join(
        line[:8].strip() + "".join("\t" + line[i : i + 8].strip() for i in range(8, 72, 8)).rstrip("\t") + "\n"
        for line in fixed(8, *card).splitlines()
    )


def same(a, b):
    assert np.array_equal(a.points, b.points)
    assert a.properties == b.properties
    assert a.cells.keys() == b.cells.keys()
    for kind in a.cells:
        assert np.array_equal(a.cells[kind], b.cells[kind])
    for name in a.data:
        assert all(np.array_equal(a.data[name][k], b.data[name][k], equal_nan=True) for k in a.data[name])


@pytest.mark.parametrize(
    "write",
    [
        lambda card: fixed(8, *card),
        lambda card: fixed(16, *card),
        lambda card: free(card, large=True),
        lambda card: free(card).lower().replace("\n", "   $ a comment, with a comma\r\n"),
        tabs,
        lambda card: "SOL 103\nCEND\n  SUBCASE 1\n begin bulk\n" * (card[1] == "1") + free(card),
    ],
    ids=["small", "large", "large free", "lower case, comments, CRLF", "tabs", "executive section"],
)
def test_every_field_format_gives_the_same_mesh(read, write):
    reference = read("".join(free(card) for card in CARDS))
    assert reference.properties["pbar_5"].kz == 0.8
    assert reference.data["ends"]["line"].tolist() == [[[0, 0.1, 0], [0, 0.1, 0]]]
    same(read("".join(write(card) for card in CARDS)), reference)


def test_continuation_with_markers_in_field_ten(read):
    text = f"{'PBAR*':8}{'5':>16}{'7':>16}{'.01':>16}{'3.-6':>16}*P1\n{'*P1':8}{'2.-6':>16}{'4.-6':>16}\n"
    mesh = read(GRIDS + BAR + STEEL + text)
    assert (mesh.properties["pbar_5"].Iz, mesh.properties["pbar_5"].J) == (2e-6, 4e-6)


def offset_mass(number, marker):
    """A mass of 1 at grid 2 whose inertia stands in the line with the marker."""
    return f"CONM2   {number:<8}{2:<8}{'':8}{'1.':40}{marker}\n"


def inertia(marker, value):
    return f"{marker:8}{value:16}{value}\n"


@pytest.mark.parametrize(
    "parts",
    [("first", "A", "second", "B"), ("first", "second", "B", "A"), ("first", "B", "second", "A")],
    ids=["as they come", "the second first", "before its card"],
)
@pytest.mark.parametrize("sign", ["+", "*"])
def test_continuations_belong_to_the_card_with_their_marker(read, parts, sign):
    """Each of two masses keeps its own inertia."""
    text = {"first": offset_mass(11, sign + "A"), "second": offset_mass(12, "+B")}
    text |= {"A": inertia("+A", ".1"), "B": inertia("+B", ".2")}
    mesh = read(GRIDS + BAR + PBAR + STEEL + "".join(text[part] for part in parts))
    assert mesh.properties["conm2_11"].inertia[:2] == (0.1, 0.1)
    assert mesh.properties["conm2_12"].inertia[:2] == (0.2, 0.2)


def test_a_chain_of_continuations_out_of_order(read):
    """Three lines of a CHEXA of 20 nodes, the last one first."""
    cube = "".join(f"GRID,{k},,{x}.,{y}.,{z}.\n" for k, (x, y, z) in enumerate(CUBE, 1))
    lines = [
        f"CHEXA   {9:<8}{3:<8}" + "".join(f"{k:<8}" for k in range(1, 7)) + "+X1",
        f"+X1     {7:<8}{8:<8}" + " " * 48 + "+X2",
        f"+X2     {'':8}",
    ]
    deck = cube + "PSOLID,3,7\n" + STEEL.strip() + "\nGRID    99" + " " * 62 + "+ZZ\n"
    ordered = read(deck + "\n".join(lines) + "\n")
    same(read(deck + "\n".join(lines[k] for k in (2, 0, 1)) + "\n"), ordered)
    same(read(deck + "\n".join(lines[k] for k in (2, 1, 0)) + "\n"), ordered)


CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
WRONG = {
    "before its card": (inertia("+A", ".1") + offset_mass(11, "+A"), r"\+A stands behind a card without a marker and"),
    "no card": (
        "GRID    5               1.                                              +YY\n+ZZ             2.\n",
        r"the continuation \+ZZ belongs to no card",
    ),
    "two cards": (
        offset_mass(11, "+A") + offset_mass(12, "+A") + f"GRID    9{'':63}+C\n" + inertia("+A", ".1"),
        r"the continuation \+A belongs to CONM2 in line \d+ and CONM2 in line",
    ),
    "replication": (
        offset_mass(11, "+A") + offset_mass(12, "+B") + "+A      =\n",
        "in a continuation of another card",
    ),
    "twice": ("GRID    5" + " " * 63 + "+Y\n+Z      .1\n+Z      .2\n", r"the continuation \+Z is there twice"),
    "surplus": ("GRID,5,,1.,2.,3.\n,7.\n", "GRID 5: it has 9 fields and can have 8"),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG)
def test_continuations_without_one_card_are_refused(read, text, message):
    with pytest.raises(InputError, match=message):
        read(GRIDS + BAR + PBAR + STEEL + text)


def test_free_fields_of_more_than_ten_and_between_blanks(read):
    """A line goes on without a marker, and blanks separate as commas do."""
    cord = "CORD2R,3,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,5,3,9.,0.,0.\n"
    reference = read(GRIDS + BAR + PBAR + STEEL + cord + "SPC1,1,123456,1,2,3,4,1,2,3,4\n")
    for system in ("CORD2R,3,,0.,0.,0.,0.,0.,1.,1.,0.,0.\n", "CORD2R, 3 0  0. 0. 0., 0. 0. 1.,1. 0. 0.\n"):
        text = cord.replace("CORD2R,3,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\n", system)
        found = read(
            GRIDS
            + BAR
            + PBAR.replace(",", " ").replace(" ", ", ", 1)
            + STEEL
            + text
            + "SPC1,1,123456,1 2 3 4 1 2,3,4\n"
        )
        same(found, reference)
        assert len(found.supports["spc_1"].nodes) == 4


def test_a_number_in_the_tenth_field_is_no_marker(read):
    mesh = read(GRIDS + "GRID,5,,5.\nGRID,6,,6.\nGRID,7,,7.\n" + BAR + PBAR + STEEL + "SPC1,1,123456,1,2,3,4,5,6,7\n")
    assert len(mesh.supports["spc_1"].nodes) == 7


def test_the_name_of_an_included_file_goes_on_over_lines(read, tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "grids.blk").write_text(GRIDS)
    same(read("INCLUDE 'sub/\n   grids.blk'\n" + BAR + PBAR + STEEL), read(GRIDS + BAR + PBAR + STEEL))
    with pytest.raises(InputError, match="INCLUDE file 'sub/"):
        read("INCLUDE 'sub/\n" + GRIDS)


@pytest.mark.parametrize(
    "line",
    [
        "SPC1,1,123456,1,THRU,3",
        "SPC1           1  1234561 THRU 3",
        "SPC1,1,654321,1,2,3",
        "SPC,1,1,123456,,2,123456\nSPC,1,3,123,,3,456",
    ],
)
def test_node_sets_and_ranges(read, line):
    mesh = read(GRIDS + BAR + PBAR + STEEL + line + "\nSPCADD,8,1\nASET1,123456,2,THRU,99\nSUPORT,1,123,4,3\n")
    assert mesh.nodes("spc_1").tolist() == [0, 1, 2] == mesh.nodes("spc_8").tolist()
    assert mesh.nodes("aset").tolist() == [1, 2, 3]  # THRU passes over what is not there
    assert mesh.nodes("suport").tolist() == [0, 3]


def test_small_field_continues_a_large_field_line_in_the_next_row(read):
    """Nastran counts rows of eight fields: one large line is half a row, a small line starts the next."""
    text = f"{'PBARL*':8}{'':16}{'7':>16}{'':16}{'TUBE':16}\n{'+':8}{'.2':>8}{'.1':>8}\n".replace(
        " " * 16, f"{'5':>16}", 1
    )
    mesh = read(GRIDS + "CBAR,5,,1,2,0.,1.,0.\n" + STEEL + text)  # blank PID is the element's number
    assert mesh.properties["pbarl_5"].A == pytest.approx(math.pi * 0.03)


def test_include_is_relative_to_its_file_and_hashed(tmp_path, read):
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "a.inc").write_text("INCLUDE 'b.inc'\n" + BAR)
    (tmp_path / "sub" / "b.inc").write_text(PBAR + STEEL)
    first = read("INCLUDE 'not_there.v2005'\nCEND\nBEGIN BULK\n" + GRIDS + "include 'sub\\a.inc'\n")
    same(first, read(GRIDS + BAR + PBAR + STEEL))
    (tmp_path / "sub" / "b.inc").write_text(PBAR + STEEL + "$ more\n")
    assert first.sha256 != read_nastran(tmp_path / "deck.bdf", 1.0, 1.0).sha256


def test_deck_without_sections_has_groups_without_properties(read):
    mesh = read(GRIDS + "CQUAD4,1,6,1,2,3,4\nCBAR,2,1,1,2,0.,0.,0.\n")
    assert set(mesh.groups) == {"pshell_6", "pbar_1"}
    assert not mesh.properties
    assert "no property cards" in mesh.notes[0]


def test_unknown_cards_are_counted_and_loads_are_not(read):
    mesh = read(GRIDS + BAR + PBAR + STEEL + "FOO,1\nFOO,2\nBAZ,1\nFORCE,1,2,,1.,0.,0.,1.\nPLOTEL,1,1,2\n", end="")
    assert mesh.notes == (
        f"left out: 2 FOO (first in deck.bdf line 8), 1 BAZ (deck.bdf line 10); {ADVICE}",
        "the deck has no ENDDATA; if it was cut short, elements are missing",
    )


CORNERS = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
HEX = "".join(f"GRID,{k},,{x}.,{y}.,{z}.\n" for k, (x, y, z) in enumerate(CORNERS, 1))
WATER = "".join(f"GRID,{k},,{k % 2}.,{k // 2 % 2}.,{1 + k // 4 % 2}.,-1\n" for k in range(12, 20))
WATER += "PSOLID,9,10,,,,,PFLUID\nMAT10,10,2.2+9,1000.\nCHEXA,2,9,12,13,15,14,16,17,+\n+,19,18\nSPC1,3,1,16,17\n"


def test_a_fluid_is_left_out_with_a_note(read):
    structure = HEX + "CHEXA,1,6,1,2,3,4,5,6,+\n+,7,8\nPSOLID,6,7\n" + STEEL
    mesh = read(structure + WATER)
    assert len(mesh.cells["hexahedron"]) == 1
    assert mesh.notes == ("left out: 1 elements of the fluid; neither its mass nor its pressure acts",)


def test_a_fluid_point_carries_no_structure(read):
    with pytest.raises(InputError, match=r"grid 12 is a point of the fluid \(CD = -1\)"):
        read(GRIDS + BAR + PBAR + STEEL + WATER + "CONM2,5,12,,3.\n")


# ---------------------------------------------------------------- bad decks

GOOD = GRIDS + BAR + PBAR + STEEL
BAD = [
    ("CBAR,9,5,1,2\n" + PBAR + STEEL, "has no GRID; give"),
    (GRIDS + STEEL, "has no elements that can be read"),
    ("", "has no GRID"),
    ("\0\x01binary\xff\n" * 5, "has no GRID"),
    (GOOD + "GRID,1,,9.\n", "line 8: GRID 1: another GRID in line 1 has this id; keep one"),
    (GOOD + "CBAR,9,5,2,3,0.,0.,1.\n", "line 8: CBAR 9: another CBAR in line 5"),
    (GOOD + "GRID,5,,1.0x\n", "line 8: GRID 5: X1 is '1.0X', not a number"),
    (GOOD + "GRID,x\n", "line 8: GRID: its id is 'X', not a number"),
    (GOOD + "GRID,-5\n", "GRID -5: its id is '-5'"),
    (GOOD + "GRID,5,77\n", "GRID 5: coordinate system 77 is not in the deck; add its CORD2R"),
    (GOOD + "CBAR,10,5,1\n", "CBAR 10: GB is missing .blank, or the card is cut short"),
    (GOOD + "CBAR,10,5,1,99,0.,1.,0.\n", "CBAR 10: grid 99 is not in the deck"),
    (GOOD + "CBAR,10,6,1,2,0.,1.,0.\n", "CBAR 10: property 6 is not in the deck; add its PBAR"),
    (GOOD + "CBAR,10,5,1,2,1.,0.,0.\n", "orientation is parallel to it; give another"),
    (GOOD + "CBAR,10,5,1,2\n", "CBAR 10: its orientation is missing"),
    (GOOD + "CBAR,10,5,1,1,0.,1.,0.\n", "CBAR 10: it names a grid twice"),
    (GOOD + "CBAR,10,5,1,2,1.,0.,0.,GOO,+\n+,,,.1\n", "CBAR 10: it has no length, or its orientation is parallel"),
    (GOOD.replace("MAT1,7", "MAT1,8"), "line 6: PBAR 5: material 7 is not in the deck; add its MAT1"),
    (GOOD.replace(",2.+11,", ",,"), "MAT1 7: E = 0, G = 0"),
    (GOOD.replace(".01", "-.01"), "PBAR 5: beam section A = -0.01 must be positive"),
    (
        GOOD.replace(PBAR, "PBARL,5,7,,TUBE,,,,,+\n+,1.+200,1.\n"),
        "CBAR 9: its numbers or those of its property overflow",
    ),
    (GOOD.replace(PBAR, "PBARL,5,7,,HUT,,,,,+\n+,1.,1.\n"), "section 'HUT' is not known"),
    (GOOD.replace(PBAR, "PBARL,5,7,,BOX,,,,,+\n+,1.,1.\n"), "PBARL 5: DIM3 is missing"),
    (GOOD.replace("2.,1.,0.", "2.+308,1.,0."), "GRID 3: X1 is '2.+308', not a number that can be used"),
    (GOOD.replace("GRID,2,,2.", "GRID,2,,1.+300"), "CBAR 9: its numbers or those of its property overflow"),
    (
        GOOD + "CORD2R,3,4,0.,0.,0.,0.,0.,1.,+\n+,1.\nCORD2R,4,3,0.,0.,0.,0.,0.,1.,+\n+,1.\n",
        "CORD2R 3: it is defined through itself",
    ),
    (GOOD + "CORD2R,3,3,0.,0.,0.,0.,0.,1.,+\n+,1.\n", "CORD2R 3: it is defined through itself"),
    (GOOD + "CORD1R,3,5,2,3\nGRID,5,3\n", "CORD1R 3: it is defined through itself"),
    (GOOD + "CORD2R,3,,0.,0.,0.,0.,0.,1.,+\n+,0.,0.,2.\n", "CORD2R 3: its three points lie on one line"),
    (GOOD + "CORD2R,3,9,0.,0.,0.,0.,0.,1.,+\n+,1.\n", "CORD2R 3: coordinate system 9 is not in the deck"),
    (GOOD + "CHEXA,3,2,1,2,3,4,5\nPSOLID,2,7\n", "CHEXA 3: it has 5 grids and needs 8 or 20"),
    (GOOD + "CTETRA,3,2,1,2,3,4\nPSOLID,2,8\nMAT8,8\n", "PSOLID 2: material 8 is MAT8; use MAT1 or MAT9 or MAT11 here"),
    (GOOD + "CTRIA6,3,2,1,2\n", "CTRIA6 3: G3 is missing"),
    (GOOD + "CPYRAM,3,2,1,2,3,4\n", "CPYRAM 3: it has 4 grids and needs 5 or 13"),
    (GOOD + "CQUAD4,3,2,1,2,3,4\nPSHELL,2,8,.1\nMAT9,8\n", "PSHELL 2: material 8 is MAT9; use MAT1 or MAT2 or MAT8"),
    (GOOD + "CQUAD4,3,2,1,2,3,4\nPSHELL,2,,.1,7\n", "PSHELL 2: needs MID1"),
    (GOOD + "CQUAD4,3,2,1,2,3,4,,,+\n+,,,.2\nPCOMP,2\n+,7,.1\n", "CQUAD4 3: its corners have a thickness, but"),
    (GOOD + "CQUAD4,3,2,1,2,3,4\nPCOMP,2\n", "PCOMP 2: it has no plies"),
    (GOOD + "CQUAD4,3,2,1,2,3,4\nPCOMP,2,,,,,,,MEM\n", "PCOMP 2: LAM = MEM is not read"),
    (GOOD + "CELAS2,3,1.,1,1,2,2\n", "CELAS2 3: it joins no grid or unlike components"),
    (GOOD + "CELAS1,3,4,1,1\n", "CELAS1 3: property 4 is not in the deck; add its PELAS"),
    (GOOD + "CBUSH,3,4,1\nPBUSH,4,K,1.\n", "CBUSH 3: its grids coincide or GB is blank and CID is missing"),
    (GOOD + "CBUSH,3,4,1,2\nPBUSH,4,K,0.\n", "PBUSH 4: spring with translation"),
    (GOOD + "CBUSH,3,4,1,2\n", "CBUSH 3: property 4 is not in the deck; add its PBUSH"),
    (GOOD + "CONM1,3,1,,1.,0.,2.,0.,0.,+\n+,1.\n", "CONM1 3: its matrix is not that of a rigid body"),
    (GOOD + "CONM2,3,1,,-5.\n", "CONM2 3: point mass of -5 kg"),
    (GOOD + "CONM2,3,1,8,5.\n", "CONM2 3: coordinate system 8"),
    (GOOD + "RBE2,3,1,123456\n", "RBE2 3: it joins no grids"),
    (GOOD + "RBE2,3,1,123456,2,1\n", "RBE2 3: it joins no grids, or one grid twice"),
    (GOOD + "RBE2,3,1,1278,2\n", "RBE2 3: components '1278'"),
    (GOOD + "RBE2,3,1,123456,2,THRU\n", "RBE2 3: GM is missing"),
    (GOOD + "RBAR,3,1,2,123,123\n", "RBAR 3: its six independent components do not determine"),
    (GOOD + "RBE3,3,,1,123456,123,2,3\n", "RBE3 3: the weight before its components"),
    (GOOD + "SPC1,1,123,1,55\n", "SPC1 1: grid 55 is not in the deck"),
    (GOOD + "PARAM,WTMASS,0.\n", "PARAM: WTMASS = 0 must be positive"),
    (GOOD + "INCLUDE 'none.inc'\n", "line 8: INCLUDE file 'none.inc' does not exist beside the deck"),
    (GOOD + "INCLUDE 'deck.bdf'\n", "INCLUDE goes round in circles"),
    ("+,1.\n" + GOOD, "line 1: a continuation without a card"),
    ("CEND\n" + GOOD, "CEND but no BEGIN BULK"),
    (GOOD + "SPC1,1,123,1,2,3,4,1,2,+3,4\n", "line 8: more fields behind the marker"),
]


@pytest.mark.parametrize(("text", "message"), BAD, ids=range(len(BAD)))
def test_bad_decks_are_named_in_one_message(read, text, message):
    with pytest.raises(InputError, match=message) as caught:
        read(text)
    assert "deck.bdf" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_components_in_a_displacement_system(read):
    """Those of links and springs keep their axes: 12 of a system whose x is the basic y."""
    deck = GOOD + "CORD2R,3,,0.,0.,0.,0.,0.,1.,+\n+,0.,1.,0.\nGRID,5,,9.,0.,0.,3\n"
    assert read(deck + "RBE2,3,1,12,5\n").links[0].axes[0, 0].tolist() == [0, 1, 0]
    with pytest.raises(InputError, match="CELAS2 3: its grids have displacement systems CD of different axes"):
        read(deck + "CELAS2,3,1.,5,1,1,1\n")
    spring = read(deck + "CELAS2,3,1.,5,1\n")
    assert spring.data["frame"]["vertex"][0] == pytest.approx(np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]))
    assert read(deck + "RBE2,3,1,123,5\n").links[0].components.sum() == 3


def test_a_deck_cut_anywhere_is_read_or_refused(read):
    """No prefix of a deck, whatever it ends in, raises anything but the error for the user."""
    text = "".join(fixed(16, *card) for card in CARDS) + "RBE3,21,,2,123456,1.5,123,1\n"
    for end in range(len(text)):
        with contextlib.suppress(InputError):
            read(text[:end], end="")


def test_a_card_cut_at_its_continuation_is_refused(read):
    whole = GOOD + f"{'GRID*':8}{'5':>16}{'':16}{'1.':>16}{'2.':>16}*G5\n"
    with pytest.raises(
        InputError, match="line 8: GRID 5: the file ends where a continuation of this card should follow"
    ):
        read(whole, end="")


def test_a_long_chain_of_systems_in_reverse_order_is_resolved(read):
    chain = "".join(f"CORD2R,{i},{i - 1},1.,0.,0.,1.,0.,1.,+\n+,2.,0.,0.\n" for i in range(300, 0, -1))
    mesh = read(GOOD + chain + "GRID,5,300\n")
    assert mesh.points[mesh.labels == 5][0] == pytest.approx([300, 0, 0])
