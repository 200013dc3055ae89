"""What a Nastran deck says and the reader cannot keep: it is refused, or a note names card, line and remedy."""

import pytest
from fe.decks import BAR, GRIDS, PBAR, STEEL
from shared_data import DATA

import modalprep as mp
from modalprep.errors import InputError

needs_data = pytest.mark.skipif(not (DATA / "isat").is_dir(), reason="the folder of foreign decks is not there")
GOOD = GRIDS + BAR + PBAR + STEEL


def test_a_set_that_holds_some_components_is_a_group_of_its_own(read):
    """Grid 3 is held in 123456 by two cards together; the others would be clamped by an interface of ``spc_1``."""
    mesh = read(GOOD + "SPC1,1,123456,1\nSPC1,1,3,2,4\nSPC,1,3,123,,3,456\n")
    assert mesh.nodes("spc_1").tolist() == [0, 2]
    assert mesh.nodes("spc_1_3").tolist() == [1, 3]
    assert mesh.notes == (
        "spc_1 holds only components 3 of 2 grids, the first is grid 2: they are the group spc_1_3 and not in spc_1, "
        "because an interface holds all six; a support by set 'spc_1' holds them by component",
    )


def test_sets_joined_by_spcadd_hold_what_their_parts_hold_together(read):
    mesh = read(GOOD + "SPC1,1,123,1,2\nSPC1,2,456,1\nSPCADD,8,1,2\n")
    assert mesh.nodes("spc_8").tolist() == [0]
    assert mesh.nodes("spc_8_123").tolist() == [1]
    assert mesh.nodes("spc_1_123").tolist() == [0, 1]
    with pytest.raises(InputError, match="spc_1_123"):
        mp.assemble(mesh, {}, {"root": mp.Interface(group="spc_1")})


@needs_data
def test_supports_of_a_deck_with_two_kinds_of_components():
    """Of set 123456, grids 22 to 25 are clamped; 5 to 13 keep their translations."""
    mesh = mp.read_mesh(DATA / "nastran_modes" / "mode_solid_shell_bar.bdf", "m", "kg")
    assert mesh.labels[mesh.nodes("spc_123456")].tolist() == [22, 23, 24, 25]
    assert mesh.labels[mesh.nodes("spc_123456_456")].tolist() == list(range(5, 14))


def test_an_enforced_displacement_is_noted(read):
    mesh = read(GOOD + "SPC,1,1,123456,0.,2,123456,.5\n")
    assert mesh.nodes("spc_1").tolist() == [0, 1]
    assert mesh.notes == ("SPC 1 (deck.bdf line 8): the displacement 0.5 of grid 2 is left out; give it as a motion",)


def test_permanent_constraints_of_grids_and_their_default(read):
    """GRDSET gives a blank PS; a zero on the grid itself frees it."""
    text = "GRDSET,,,,,,,1345\n" + GRIDS.replace("GRID,3,,2.,1.,0.", "GRID,3,,2.,1.,0.,,0") + BAR + PBAR + STEEL
    mesh = read(text.replace("GRID,4,,0.,1.,0.", "GRID,4,,0.,1.,0.,,123456"))
    assert mesh.nodes("grid_ps_1345").tolist() == [0, 1]
    assert mesh.nodes("grid_ps").tolist() == [3]
    assert mesh.notes[0].startswith("grid_ps holds only components 1345 of 2 grids, the first is grid 1: they are")


@needs_data
def test_grdset_of_a_real_deck_is_announced():
    """NASTRAN_CoFE's cantilever is plane by GRDSET alone."""
    mesh = mp.read_mesh(DATA / "superelements" / "noReduction.dat", "in", "slinch")
    assert len(mesh.nodes("grid_ps_1345")) == len(mesh.points)
    assert any(note.startswith("grid_ps holds only components 1345") for note in mesh.notes)


def test_components_of_supports_are_digits(read):
    with pytest.raises(InputError, match="line 8: SPC 1: components '' are not made of the digits 1 to 6"):
        read(GOOD + "SPC,1,3\n")
    with pytest.raises(InputError, match="line 1: GRID 1: components '7' are not made of the digits 1 to 6"):
        read(GOOD.replace("GRID,1,,0.,0.,0.", "GRID,1,,0.,0.,0.,,7"))


def test_what_is_left_out_has_its_first_line_and_a_remedy(read):
    mesh = read(GOOD + "CDAMP5,1,1.,1,1\nFOO,3\nMATT1,4,1\nFOO,1\n")
    assert mesh.notes == (
        "left out: 2 FOO (first in deck.bdf line 9); the reader does not know these cards; replace by cards that are "
        "read, such as RBE2, RBE3, CONM2, CBUSH, what of these carries mass, stiffness or constraints",
        "left out: 1 CDAMP5 (deck.bdf line 8), 1 MATT1 (deck.bdf line 10); they carry no stiffness, mass or "
        "constraints",
    )


def test_what_carries_stiffness_is_refused_unless_it_is_named(read):
    text = GOOD + "CFAST,3,1,1,2\nRJOINT,4,1,2\nCFAST,4,1,1,2\nCWELD,5\n"
    message = (
        r"deck.bdf line 8: CFAST 3: This element has no counterpart here. The deck has 2 CFAST, 1 CWELD, 1 RJOINT; "
        r"replace them, or leave them out by ignore = \['CFAST', 'CWELD', 'RJOINT'\]"
    )
    with pytest.raises(InputError, match=message):
        read(text)
    with pytest.raises(InputError, match=r"CWELD 5: .*The deck has 1 CWELD; .*ignore = \['CWELD'\]"):
        read(text, ignore=["cfast", "RJOINT"])
    mesh = read(text, ignore=["cfast", "RJOINT", "CWELD"])
    assert mesh.notes == (
        "left out: 2 CFAST (first in deck.bdf line 8), 1 RJOINT (deck.bdf line 9), 1 CWELD (deck.bdf line 11); the "
        "ignore of this mesh names them",
    )


@pytest.mark.parametrize(("element", "property_card"), [("CBAR", "PBARL"), ("CBEAM", "PBEAML")])
def test_a_section_by_its_shape_says_what_it_takes_for_shear(read, element, property_card):
    mesh = read(GRIDS + BAR.replace("CBAR", element) + f"{property_card},5,7,,BAR\n,.1,.2\n" + STEEL)
    assert mesh.properties[f"{property_card.lower()}_5"].theory == "timoshenko"
    assert mesh.notes == (
        f"{property_card} BAR: torsion constant and shear factors are those of the textbook for this shape; Nastran's "
        "own may differ",
    )


def test_baror_gives_a_blank_property_number(read):
    """A bar whose PID is blank takes that of BAROR, not its own number."""
    mesh = read(GRIDS + "BAROR,,5\nCBAR,9,,1,2,0.,1.,0.\nPBAR,9,7,.02,3.-6,2.-6,4.-6\n" + PBAR + STEEL)
    assert set(mesh.groups) == {"pbar_5"}


def test_damping_parameters_and_superelements_are_noted(read):
    """What the cards say besides, and the model does not have; parameters of the output and zeros are no news."""
    damped = STEEL.rstrip("\n").split(",")
    damped = ",".join([*damped, *[""] * (8 - len(damped)), ".02"]) + "\n"  # GE is the eighth field of MAT1
    text = GRIDS.replace("GRID,4,,0.,1.,0.", "GRID,4,,0.,1.,0.,,,5") + BAR + PBAR + damped
    mesh = read(text + "PARAM,K6ROT,100.\nPARAM,POST,-1\nPARAM,COUPMASS,1\nPARAM,G,.01\nPARAM,COUPMASS,-1\n")
    assert mesh.notes == (
        "left out: 1 SEID of GRID (deck.bdf line 4), 1 GE of MAT1 (deck.bdf line 7), 1 PARAM,K6ROT (deck.bdf line 8), "
        "1 PARAM,G (deck.bdf line 11), 1 PARAM,COUPMASS (deck.bdf line 12); damping is given in the pipeline file, "
        "elements count once (CK1, CM1), superelements are one structure here, sections do not warp, drilling "
        "stiffness and normals of shells are those of the elements, and the mass is consistent unless mass = 'nastran'",
    )


def test_wtmass_applies_to_all_masses(read):
    """Weights over g: PARAM,WTMASS multiplies densities, further masses and point masses alike."""
    text = GRIDS + BAR + PBAR + STEEL + "CONM2,8,2,,3.\n"
    masses = []
    for wtmass in ("", "PARAM,WTMASS,.5\n"):
        mesh = read(text + wtmass)
        masses.append((mesh.properties["pbar_5"].material.rho, mesh.properties["conm2_8"].mass))
    assert masses[1] == pytest.approx([x / 2 for x in masses[0]])
