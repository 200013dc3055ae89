"""Static loads and subcases of Nastran decks: resultants by hand, and what each subcase says."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError
from modalprep.reduction.loads import Load, nodal_load

PLATE = (
    "GRID,1\nGRID,2,,2.\nGRID,3,,2.,1.\nGRID,4,,0.,1.\nCQUAD4,1,91,1,2,3,4\nPSHELL,91,7,.01,7,,7\n"
    "MAT1,7,2.+11,,.3,1000.\nCORD2R,5,,0.,0.,0.,1.,0.,0.\n,0.,1.,0.\n"  # z of system 5 is x, its x is y
)
CORNERS = "GRID,11\nGRID,12,,2.\nGRID,13,,2.,1.\nGRID,14,,0.,1.\n"
CORNERS += "GRID,15,,0.,0.,3.\nGRID,16,,2.,0.,3.\nGRID,17,,2.,1.,3.\nGRID,18,,0.,1.,3.\n"
BRICK = CORNERS + "CHEXA,2,92,11,12,13,14,15,16,+\n+,17,18\nPSOLID,92,7\n"
TETRA = CORNERS + "CTETRA,2,92,11,12,14,15\nPSOLID,92,7\n"
WEDGE = CORNERS + "CPENTA,2,92,11,12,14,15,16,18\nPSOLID,92,7\n"

STICK = "GRID,21,,5.\nGRID,22,,6.\nCBAR,9,5,21,22,0.,1.,0.\nPBAR,5,7,.01,3.-6,2.-6,4.-6\n"
STICK += "CROD,10,6,21,22\nPROD,6,7,.01\n"

SUMS = {  # card: force, and moment about the origin, of set 3
    "FORCE,3,2,,10.,0.,2.,0.": ((0, 20, 0), (0, 0, 40)),
    "FORCE,3,2,5,10.,0.,0.,1.": ((10, 0, 0), (0, 0, 0)),
    "MOMENT,3,4,,5.,0.,0.,1.": ((0, 0, 0), (0, 0, 5)),
    "FORCE1,3,2,5.,1,3": ((5 * 2 / 5**0.5, 5 / 5**0.5, 0), (0, 0, 10 / 5**0.5)),
    "FORCE2,3,2,5.,1,2,1,4": ((0, 0, 5), (0, -10, 0)),
    "MOMENT1,3,2,5.,1,2": ((0, 0, 0), (5, 0, 0)),
    "MOMENT2,3,2,5.,1,2,1,4": ((0, 0, 0), (0, 0, 5)),
    "PLOAD,3,6.,1,2,3,4": ((0, 0, 12), (6, -12, 0)),
    "PLOAD,3,6.,1,2,3": ((0, 0, 6), (2, -8, 0)),
    "PLOAD2,3,6.,1": ((0, 0, 12), (6, -12, 0)),
    "PLOAD2,3,6.,1,THRU,1": ((0, 0, 12), (6, -12, 0)),
    "PLOAD4,3,1,6.": ((0, 0, 12), (6, -12, 0)),
    "PLOAD4,3,1,6.,0.,0.,6.": ((0, 0, 6), (3, -4, 0)),  # 6 (1 - x/2) N/m^2
    "PLOAD4,3,1,6.,,,,,,+\n+,5,0.,0.,3.": ((12, 0, 0), (0, 0, -6)),
    "PLOAD4,3,1,6.,,,,THRU,9": ((0, 0, 12), (6, -12, 0)),
    "FORCE,4,2,,10.,0.,1.,0.\nLOAD,3,2.,3.,4": ((0, 60, 0), (0, 0, 120)),
}


def read(tmp_path, text, *units):
    (tmp_path / "deck.bdf").write_text(text)
    return mp.read_mesh(tmp_path / "deck.bdf", *units)


def resultant(mesh, name):
    """Force and moment about the origin of a load."""
    load = mesh.loads[name]
    return load.forces.sum(axis=0), (np.cross(mesh.points[load.nodes], load.forces) + load.moments).sum(axis=0)


@pytest.mark.parametrize("card", SUMS)
def test_resultants(tmp_path, card):
    mesh = read(tmp_path, PLATE + card)
    for found, expected in zip(resultant(mesh, "load_3"), SUMS[card], strict=True):
        np.testing.assert_allclose(found, expected, atol=1e-12)


@pytest.mark.parametrize(
    ("deck", "face", "force"),
    [
        (BRICK, "11,13", (0, 0, 2)),  # into the solid
        (BRICK, "12,17", (-3, 0, 0)),
        (BRICK, "18,13", (0, -6, 0)),
        (TETRA, "11,15", (0, 0, 1)),  # the grid that is not on the face
        (TETRA, "12,11", (-1.5, -3, -1)),
        (WEDGE, "11", (0, 0, 1)),
        (WEDGE, "15", (0, 0, -1)),
        (WEDGE, "11,16", (0, 6, 0)),
    ],
)
def test_pressures_on_faces_of_solids(tmp_path, deck, face, force):
    """A pressure of 1 pushes by the area of the face, 2 x 1 x 3 m bricks and halves of them."""
    first, _, other = face.partition(",")
    mesh = read(tmp_path, f"{PLATE}{deck}PLOAD4,3,2,1.,,,,{first},{other}")
    np.testing.assert_allclose(resultant(mesh, "load_3")[0], force, atol=1e-12)


def test_units(tmp_path):
    """In mm and t a force is one newton, a moment a newton-millimetre, gravity mm/s^2."""
    case = "LOAD = 6\nBEGIN BULK\n"
    cards = "FORCE,3,2,,10.,0.,1.,0.\nMOMENT,3,2,,10.,0.,1.,0.\nGRAV,5,,9810.,0.,0.,-1.\nLOAD,6,1.,1.,3,1.,5\n"
    mesh = read(tmp_path, f"CEND\n{case}{PLATE}{cards}", "mm", "t")
    np.testing.assert_allclose(mesh.loads["load_6"].forces, [[0, 10, 0]])
    np.testing.assert_allclose(mesh.loads["load_6"].moments, [[0, 0.01, 0]])
    np.testing.assert_allclose(mesh.cases[0].gravity, [0, 0, -9.81])


BARS = "".join(f"GRID,{k},,{0.5 * (k - 1)}\n" for k in range(1, 6))
BARS += "".join(f"CBAR,{k},5,{k},{k + 1},0.,1.,0.\n" for k in range(1, 5))
BARS += "PBAR,5,7,.01,3.-6,2.-6,4.-6\nMAT1,7,2.+11,,.3,8000.\n"


def test_a_load_of_the_deck_bends_a_cantilever(tmp_path):
    """``F L^3 / 3 E I`` at the end under 10 N along y, exact without shear; PBAR without K1 has none."""
    mesh = read(tmp_path, BARS + "FORCE,3,5,,10.,0.,1.,0.")
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    f = nodal_load(model, mesh, "tip", Load(set="load_3"))
    inside = model.dof[1:5].ravel()
    u = np.linalg.solve(model.K.toarray()[np.ix_(inside, inside)], f[inside])
    assert u[-5] == pytest.approx(10 * 2**3 / (3 * 2e11 * 3e-6), rel=1e-9)


LINES = {  # card: deflection along y of the end of a cantilever of 2 m, over 1 / E I
    "PLOAD1,3,4,FY,FR,1.,10.": 10 * 2**3 / 3,
    "PLOAD1,3,2,FY,LE,.2,10.": 10 * 0.7**2 * (3 * 2 - 0.7) / 6,
    "PLOAD1,3,2,FY,FR,.4,10.,.4,10.": 10 * 0.7**2 * (3 * 2 - 0.7) / 6,
    "\n".join(f"PLOAD1,3,{k},FY,FR,0.,5.,1.,5." for k in (1, 2, 3, 4)): 5 * 2**4 / 8,
    "\n".join(f"PLOAD1,3,{k},FY,LE,0.,{k - 1}.,.5,{k}." for k in (1, 2, 3, 4)): 2 * 11 * 2**5 / 120,  # 2 x N/m
}


@pytest.mark.parametrize("card", LINES)
def test_loads_along_beams(tmp_path, card):
    """The deflection of the exact beam, also by a force within an element."""
    mesh = read(tmp_path, BARS + card)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    f = nodal_load(model, mesh, "wind", Load(set="load_3"))
    inside = model.dof[1:5].ravel()
    u = np.linalg.solve(model.K.toarray()[np.ix_(inside, inside)], f[inside])
    assert u[-5] == pytest.approx(LINES[card] / (2e11 * 3e-6), rel=1e-9)


EI, GJ = 2e11 * 3e-6, 2e11 / 2.6 * 4e-6
TURNED = {  # card: DOF of the end of a cantilever of 2 m, and its value by beam theory
    "PLOAD1,3,4,FYE,FR,1.,10.": (1, 10 * 2**3 / (3 * EI)),
    "PLOAD1,3,4,FZE,FR,1.,10.": (2, 10 * 2**3 / (3 * EI * 2 / 3)),
    "PLOAD1,3,4,MXE,FR,.5,10.": (3, 10 * 1.75 / GJ),
    "PLOAD1,3,2,MZ,LE,.2,10.": (1, 10 * 0.7 * (2 - 0.35) / EI),
    "PLOAD1,3,2,MZE,FR,.4,10.": (5, 10 * 0.7 / EI),
    "PLOAD1,3,2,MYE,FR,.4,10.": (2, -10 * 0.7 * (2 - 0.35) / (EI * 2 / 3)),
    "\n".join(f"PLOAD1,3,{k},MZ,FR,0.,5.,1.,5." for k in (1, 2, 3, 4)): (1, 5 * 2**3 / (3 * EI)),  # m x (L - x) dx
    "\n".join(f"PLOAD1,3,{k},FY,FRPR,0.,5.,1.,5." for k in (1, 2, 3, 4)): (1, 5 * 2**4 / (8 * EI)),
    "\n".join(f"PLOAD1,3,{k},FX,LEPR,0.,5.,.5,5." for k in (1, 2, 3, 4)): (0, 0.0),
}


@pytest.mark.parametrize("card", TURNED)
def test_moments_and_loads_in_the_axes_of_the_beam(tmp_path, card):
    """The exact beam of Euler and Bernoulli: the cubic shapes are its deflection at the nodes."""
    mesh = read(tmp_path, BARS + card)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    f = nodal_load(model, mesh, "wind", Load(set="load_3")) if "load_3" in mesh.loads else np.zeros(model.n_dof)
    inside = model.dof[1:5].ravel()
    u = np.linalg.solve(model.K.toarray()[np.ix_(inside, inside)], f[inside])
    component, value = TURNED[card]
    assert u[component - 6] == pytest.approx(value, rel=1e-9, abs=1e-15)


def test_a_load_on_a_beam_with_offsets_has_its_arm(tmp_path):
    """The axis lies 0.1 m above the grids: a force along it turns about them."""
    bars = BARS.replace("CBAR,2,5,2,3,0.,1.,0.\n", "CBAR,2,5,2,3,0.,1.,0.\n,,,0.,.1,0.,0.,.1,0.\n")
    assert bars != BARS
    mesh = read(tmp_path, bars + "PLOAD1,3,2,FXE,FR,.5,8.")
    load = mesh.loads["load_3"]
    np.testing.assert_allclose(load.forces, [[4, 0, 0], [4, 0, 0]], atol=1e-12)
    np.testing.assert_allclose(load.moments, [[0, 0, -0.4], [0, 0, -0.4]], atol=1e-12)


def test_axes_of_a_bar_with_a_product_of_inertia_are_those_of_the_element(tmp_path):
    """I12 turns the principal axes, and not FYE."""
    mesh = read(tmp_path, BARS.replace("4.-6\n", "4.-6\n,\n,,,1.-6\n", 1) + "PLOAD1,3,2,FYE,FR,.5,8.")
    np.testing.assert_allclose(mesh.loads["load_3"].forces, [[0, 4, 0], [0, 4, 0]], atol=1e-12)


def test_a_load_along_a_beam_stretches_it(tmp_path):
    mesh = read(tmp_path, BARS + "PLOAD1,3,2,FXE,FR,0.,4.,1.,4.")
    np.testing.assert_allclose(mesh.loads["load_3"].forces, [[1, 0, 0], [1, 0, 0]], atol=1e-12)


def test_what_a_load_by_set_refuses(tmp_path):
    mesh = read(tmp_path, BARS + "FORCE,3,5,,10.,0.,1.,0.")
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    with pytest.raises(InputError, match=r"has no load 'load_4'; did you mean 'load_3'"):
        nodal_load(model, mesh, "tip", Load(set="load_4"))
    with pytest.raises(InputError, match="has its own nodes; leave 'group' out"):
        Load(set="load_3", group="tip")
    with pytest.raises(InputError, match="'force' has no effect beside 'set'"):
        Load(set="load_3", force=(1.0, 0, 0))


CONTROL = (
    "SOL 103\nCEND\nTITLE = a plate\nSPC = 1\nSDAMPING = 8\n"
    "SUBCASE 1\n  METHOD(STRUCTURE) = 5 $ modes\nSUBCASE 7\n  LOAD = 3\n  SPC = 2\n  DLOAD = 9\nBEGIN BULK\n"
)
SETS = "SPC1,1,123456,1,4\nSPC1,2,123,1,2\nFORCE,3,2,,10.,0.,1.,0.\nRFORCE,3,1,,1.,1.,0.,0.\n"


def test_subcases(tmp_path):
    """What stands before the first subcase holds in each."""
    damping = "TABDMP1,8,CRIT\n,10.,.02,100.,.01,ENDT\n"
    first, second = read(tmp_path, f"{CONTROL}{PLATE}{SETS}EIGRL,5,3.,200.,12\n{damping}").cases
    assert (first.name, first.supports, first.loads) == ("subcase 1", ("spc_1",), ())
    assert (first.modes, first.lowest, first.highest) == (12, 3.0, 200.0)
    assert first.damping == second.damping == [[10.0, 0.02], [100.0, 0.01]]
    assert (second.number, second.supports, second.loads, second.modes) == (7, ("spc_2",), ("load_3",), None)
    assert second.said[0] == "DLOAD = 9, which is not used"
    assert "of load 3 these are not read" in second.said[1]
    assert "1 RFORCE" in second.said[1]


@pytest.mark.parametrize(
    ("cards", "damping"),
    [
        ("TABDMP1,8,G\n,10.,.02,100.,.01,ENDT", [[10.0, 0.01], [100.0, 0.005]]),  # structural: twice the ratio
        ("TABDMP1,8\n,10.,.02,ENDT", [[10.0, 0.01]]),
        ("TABDMP1,8,Q\n,10.,25.,ENDT", [[10.0, 0.02]]),
        ("PARAM,G,.04", 0.02),
        ("PARAM,G,.04\nPARAM,W3,100.", {"alpha": 0.0, "beta": 4e-4}),
        ("PARAM,ALPHA1,2.\nPARAM,ALPHA2,3.-5", {"alpha": 2.0, "beta": 3e-5}),
        ("", None),
    ],
)
def test_damping(tmp_path, cards, damping):
    [case] = read(tmp_path, f"SDAMPING = 8\nMETHOD = 5\nBEGIN BULK\n{PLATE}EIGR,5,LAN,,90.\n{cards}").cases
    assert case.damping == (pytest.approx(damping) if isinstance(damping, dict) else damping)
    assert case.highest == 90


def test_damping_of_materials(tmp_path):
    plate = PLATE.replace("1000.\n", "1000.,,,.03\n")
    [case] = read(tmp_path, "METHOD=5\nBEGIN BULK\n" + plate + "EIGRL,5,,90.").cases
    assert case.damping == 0.015
    assert "GE = 0.03 of all materials" in case.said[0]
    two = plate + "MAT1,8,2.+11,,.3,1000.,,,.01\n"
    [case] = read(tmp_path, "METHOD=5\nBEGIN BULK\n" + two + "EIGRL,5,,90.").cases
    assert case.damping is None
    assert "7 0.03, 8 0.01" in case.said[0]


def test_bulk_data_alone_has_its_only_sets(tmp_path):
    [case] = read(tmp_path, PLATE + "EIGRL,5,,,4\nFORCE,3,2,,10.,0.,1.,0.").cases
    assert (case.modes, case.loads) == (4, ("load_3",))
    assert read(tmp_path, PLATE).cases == ()


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("FORCE,3,99,,1.,1.", "grid 99 is not in the deck"),
        ("FORCE,3,2,44,1.,1.", "coordinate system 44 is not in the deck"),
        ("PLOAD4,3,77,1.", "element 77 is no shell and no solid"),
        ("LOAD,3,1.,1.,8", "load 8 is not in the deck"),
        ("FORCE1,3,2,5.,1,1", "its grids give no direction"),
        ("RFORCE,3,1,,1.,1.,0.,0.", "1 RFORCE"),
        ("PLOAD1,3,1,FY,FR,0.,1.,1.,1.", "element 1 is no bar and no beam"),
        (f"{STICK}PLOAD1,3,9,FW,FR,0.,1.,1.,1.", "type 'FW' with 'FR' is not one of FX"),
        (f"{STICK}PLOAD1,3,9,FY,FR,0.,1.,1.", "P2 is missing"),
        (f"{STICK}PLOAD1,3,9,FY,FR,.5,1.,.2,1.", "do not lie on the beam one after the other"),
        (f"{STICK}PLOAD1,3,9,FYE,FRPR,0.,1.,1.,1.", "of type FYE is not read; give it with LE or FR"),
        (f"{STICK}PLOAD1,3,10,FYE,FR,0.,1.,1.,1.", "element 10 has no axes across its length"),
    ],
)
def test_a_load_that_cannot_be_read_does_not_keep_the_model_out(tmp_path, card, said):
    mesh = read(tmp_path, f"LOAD = 3\nBEGIN BULK\n{PLATE}{card}")
    assert mesh.loads == {}
    assert said in mesh.cases[0].said[0]
