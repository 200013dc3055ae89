"""Small decks that once went wrong, and the mass that their first comment or their sections say."""

import math

import pytest
from shared_data import DATA

import modalprep as mp

DECKS = DATA.parent / "repro" / "decks"
pytestmark = pytest.mark.skipif(not DECKS.is_dir(), reason=f"the decks are not in {DECKS} (set MODALPREP_DATA)")
CUBE = 7800.0  # kg, of 1 m
MASSES = {
    "beam_nodthick.inp": 0.2**2 * 7800,
    "beam_offset_ccx.inp": 0.1**2 * 7800,
    "circ_ccx.inp": math.pi / 4 * 0.01**2 * 2 * 7800,
    "chexa_left.bdf": CUBE,
    "cont_order.bdf": 2.0,
    "cquad8_nomid.bdf": 78.0,
    "distcoup.inp": CUBE,
    "dmi_aero.bdf": 0.78,
    "dupgrid.bdf": 0.1,
    "free_blank.bdf": 0.78,
    "include_lines.bdf": 0.78,
    "kin_orient.inp": 2 * CUBE,  # on a square with a diagonal of 2 m
    "mcid_normal.bdf": 400.0,
    "nsm1.bdf": 2 * 0.01 * 1000 + 5,
    "r5.cdb": CUBE,
    "rbar_appendage.bdf": 0.78,
    "rotnode.inp": 78.0,
    "spc1_free13.bdf": 7 * 0.78,
    "stick_E1.bdf": 10.0,
    "tie_noadjust.inp": 2 * CUBE,
    "unbl.cdb": CUBE,
    "unbl_mp.cdb": CUBE,
}
COUPLED = {"kin_orient.inp": 9}  # the reference node, whose rigid motion all other ways to hold it would double


def read(name):
    if not (DECKS / name).is_file():
        pytest.skip(f"{name} is not there")
    return mp.read_mesh(DECKS / name, dialect="calculix" if name == "circ_ccx.inp" else None)


@pytest.mark.parametrize("name", MASSES)
def test_mass(name):
    mesh = read(name)
    kind = next(kind for kind in mesh.cells if kind != "vertex")
    node = mp.Interface(node=COUPLED.get(name, int(mesh.labels[mesh.cells[kind][0][0]])), kind="node")
    group = mp.Interface(group=next(name for name, own in mesh.groups.items() if kind in own), kind="rbe3")
    root = group if kind.startswith("hexahedron") and name not in COUPLED else node
    model = mp.assemble(mesh, {}, {"root": root})
    assert model.rigid.m == pytest.approx(MASSES[name], rel=1e-9, abs=1e-9)


def test_continuations_go_to_the_card_of_their_marker():
    mesh = read("cont_order.bdf")
    assert [mesh.properties[f"conm2_{k}"].inertia[:3] for k in (10, 11)] == [(7, 7, 7), (5, 5, 5)]


@pytest.mark.parametrize(("name", "hertz"), [("tube_c3d20r.inp", 1294.0)])
def test_reduced_integration_of_thin_walls(name, hertz):
    """Full integration locks: 1963 Hz."""
    held = {"own": mp.Support(set="boundary")}
    model = mp.assemble(read(name), {}, {"root": mp.Interface(kind="support")}, supports=held)
    assert mp.craig_bampton(model, modes=2, truncation=[]).frequency[0] == pytest.approx(hertz, rel=1e-3)


def test_an_orientation_along_its_beam_is_refused():
    """The card of free11.bdf with twelve fields is read; its beam then lies along y, as its orientation does."""
    with pytest.raises(mp.InputError, match="CBAR 1: it has no length, or its orientation is parallel to it"):
        read("free11.bdf")
