"""Nonstructural mass by NSM, NSM1, NSML, NSML1 and NSMADD: sums by hand over lengths and areas."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError

# two plates of 2 m^2 and 1 m^2 with thickness .01 and 1000 kg/m^3, and two bars of 2 m and 1 m with area 1e-3
DECK = (
    "GRID,1\nGRID,2,,2.\nGRID,3,,2.,1.\nGRID,4,,0.,1.\nGRID,5,,3.\nGRID,6,,3.,1.\n"
    "CQUAD4,1,91,1,2,3,4\nCQUAD4,2,91,2,5,6,3\nCTRIA3,3,92,2,5,6\n"
    "CBAR,11,5,1,2,0.,0.,1.\nCBAR,12,5,2,5,0.,0.,1.\n"
    "PSHELL,91,7,.01,7,,7\nPSHELL,92,7,.01,7,,7\nPBARL,5,7,,BAR\n,.05,.02\nMAT1,7,2.+11,,.3,1000.\n"
)
BARE = 1000 * (0.01 * 3.5 + 1e-3 * 3)


def mass_of(mesh):
    return mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")}).rigid.m


CASES = {
    "NSM,7,PSHELL,91,5.": 5 * 3,
    "NSM,7,PSHELL,91,5.,92,2.": 5 * 3 + 2 * 0.5,
    "NSM,7,PBARL,5,4.": 4 * 3,
    "NSM,7,PBAR,5,4.": 4 * 3,
    "NSM1,7,PSHELL,5.,91,92": 5 * 3.5,
    "NSM1,7,PSHELL,5.,91,THRU,99": 5 * 3.5,
    "NSM1,7,PSHELL,5.,91,THRU,99,BY,4": 5 * 3,
    "NSM1,7,PSHELL,5.,ALL": 5 * 3.5,
    "NSM1,7,ELEMENT,5.,1,3": 5 * 2.5,
    "NSM,7,ELEMENT,2,5.,11,4.": 5 * 1 + 4 * 2,
    "NSML,7,PSHELL,91,6.,92,2.": 8,
    "NSML,7,ELEMENT,12,2.": 2,
    "NSML1,7,PSHELL,6.,91,92": 6,
    "NSML1,7,ELEMENT,6.,1,2": 6,
    "NSM1,7,PSHELL,5.,91\nNSML1,7,PBARL,6.,5": 5 * 3 + 6,
    "NSM1,7,PSHELL,5.,91\nNSML1,8,PBARL,6.,5\nNSMADD,9,7,8": 5 * 3 + 6,
}


@pytest.mark.parametrize(("cards", "more"), CASES.items(), ids=CASES)
def test_the_mass_of_every_card(read, cards, more):
    assert mass_of(read(DECK + cards + "\n")) == pytest.approx(BARE + more, rel=1e-12)


def test_the_mass_stands_on_the_elements_that_are_named(read):
    """An element of a group becomes a group of its own: the centre of 1 kg on the second plate is its middle."""
    plain, mesh = read(DECK), read(DECK + "NSML1,7,ELEMENT,1.,2\n")
    assert set(mesh.groups) == {*plain.groups, "pshell_91_nsm1"}
    first, second = (mp.assemble(m, {}, {"root": mp.Interface(node=1, kind="node")}).rigid for m in (plain, mesh))
    np.testing.assert_allclose(second.s0 - first.s0, [2.5, 0.5, 0.0], atol=1e-12)


def test_masses_in_the_units_of_the_deck(tmp_path):
    """In mm and t: 2e-9 t/mm^2 are 2 kg/m^2, and a lumped mass of .003 t is 3 kg."""
    for cards, more in (("NSM,7,PSHELL,91,2.-9", 2e-9 * 3 * 1e3), ("NSML1,7,PBARL,.003,5", 0.003 * 1e3)):
        (tmp_path / "deck.bdf").write_text(DECK + cards + "\nENDDATA\n")
        mesh = mp.read_mesh(tmp_path / "deck.bdf", "mm", "t")
        bare = BARE * 1e3  # of densities in t/mm^3
        assert mass_of(mesh) == pytest.approx(bare + more, rel=1e-12)


def test_the_case_control_selects_a_set(read):
    cards = "NSM1,7,PSHELL,5.,91\nNSM1,8,PSHELL,1.,91\n"
    control = "SOL 103\nCEND\n{}BEGIN BULK\n"
    assert mass_of(read(control.format("NSM = 8\n") + DECK + cards)) == pytest.approx(BARE + 3, rel=1e-12)
    none = read(control.format("") + DECK + cards)
    assert mass_of(none) == pytest.approx(BARE, rel=1e-12)
    assert any("NSM sets 7, 8 are left out, because the case control selects none" in note for note in none.notes)
    with pytest.raises(InputError, match="of the NSM sets 7, 8 none is selected"):
        read(DECK + cards)
    assert mass_of(read("BEGIN BULK\n" + DECK + cards.splitlines()[0] + "\n")) == pytest.approx(BARE + 15, rel=1e-12)


REFUSED = {
    "no property": ("NSM1,7,PSHELL,5.,95\n", "no element of the deck belongs to PSHELL"),
    "no element": ("NSM1,7,ELEMENT,5.,77\n", "element 77 is not in the deck"),
    "a solid": (
        "GRID,7,,2.,.5,1.\nCTETRA,9,3,1,2,3,7\nPSOLID,3,7\nNSM1,7,ELEMENT,5.,9\n", "neither lines nor surfaces",
    ),
    "no value": ("NSM1,7,PSHELL,,91\n", "VALUE is missing"),
}  # fmt: skip


@pytest.mark.parametrize(("cards", "message"), REFUSED.values(), ids=REFUSED)
def test_masses_of_nothing_are_refused(read, cards, message):
    with pytest.raises(InputError, match=message):
        read(DECK + cards)
