"""A material without density has no mass: closed forms of structures whose mass stands elsewhere."""

import math

import pytest
from fe.ansys_decks import deck as ansys_deck

import modalprep as mp
from modalprep.linalg.modes import lowest_modes

# A cantilever along x of 8 beams of E I = 6e4 N m^2 with 5 kg at its tip; f = sqrt(3 E I / (m L^3)) / 2 pi of a
# massless beam.
COUNT, LENGTH, TIP, EI = 8, 2.0, 5.0, 6e4
TIP_FREQUENCY = math.sqrt(3 * EI / (TIP * LENGTH**3)) / (2 * math.pi)


def nastran(folder):
    grids = [f"GRID,{k + 1},,{LENGTH * k / COUNT}" for k in range(COUNT + 1)]
    bars = [f"CBAR,{k + 1},5,{k + 1},{k + 2},0.,1.,0." for k in range(COUNT)]
    cards = [*grids, *bars, "PBAR,5,7,.01,3.-7,3.-7,6.-7", "MAT1,7,2.+11,,.3", f"CONM2,99,{COUNT + 1},,{TIP}"]
    (folder / "tip.bdf").write_text("\n".join([*cards, "ENDDATA\n"]))
    return folder / "tip.bdf"


def abaqus(folder):
    nodes = [f"{k + 1}, {LENGTH * k / COUNT}" for k in range(COUNT + 1)]
    lines = [f"{k + 1}, {k + 1}, {k + 2}" for k in range(COUNT)]
    text = ["*NODE", *nodes, "*ELEMENT, TYPE=B33, ELSET=b", *lines, f"*ELEMENT, TYPE=MASS, ELSET=m\n99, {COUNT + 1}"]
    text += [f"*MASS, ELSET=m\n{TIP}", "*MATERIAL, NAME=s\n*ELASTIC\n2e11, .3"]
    text += ["*BEAM GENERAL SECTION, ELSET=b, SECTION=GENERAL\n.01, 3e-7, 0., 3e-7, 6e-7\n0., 0., 1.\n2e11, 8e10\n"]
    (folder / "tip.inp").write_text("\n".join(text))
    return folder / "tip.inp"


def ansys(folder):
    nodes = [f"N,{k + 1},{LENGTH * k / COUNT}" for k in range(COUNT + 1)]
    lines = [f"E,{k + 1},{k + 2}" for k in range(COUNT)]
    text = [
        "ET,1,4",
        "ET,2,21",
        "KEYOPT,2,3,2",
        "MP,EX,1,2e11",
        "MP,PRXY,1,.3",
        "R,1,.01,3e-7,3e-7,.1,.1",
        f"R,2,{TIP}",
    ]
    text += [*nodes, "TYPE,1", "REAL,1", *lines, "TYPE,2", "REAL,2", f"E,{COUNT + 1}"]
    return ansys_deck(folder, text)


@pytest.mark.parametrize("write", [nastran, abaqus, ansys])
def test_a_massless_beam_carries_a_mass_at_its_tip(write, tmp_path):
    """The mass is that of the tip alone, and the frequency that of a spring of 3 E I / L^3 under it."""
    mesh = mp.read_mesh(write(tmp_path))
    assert any("no density" in note or "no DENSITY" in note for note in mesh.notes)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=1, kind="node")})
    assert model.rigid.m == pytest.approx(TIP, rel=1e-12)
    found = mp.craig_bampton(model, modes=2).table.frequency
    assert found[0] == pytest.approx(TIP_FREQUENCY, rel=1e-6 if write is not ansys else 5e-3)  # BEAM4 has shear


def test_a_stick_weighs_its_nsm(tmp_path):
    """E = 1 and A = E A, as condensed models have them: 5 kg/m over 2 m are 10 kg."""
    text = "GRID,1\nGRID,2,,2.\nCBAR,1,1,1,2,0.,1.,0.\nPBAR,1,1,7.+9,1.+6,1.+6,1.+6,5.\nMAT1,1,1.,.4\nENDDATA\n"
    (tmp_path / "stick.bdf").write_text(text)
    model = mp.assemble(mp.read_mesh(tmp_path / "stick.bdf"), {}, {"root": mp.Interface(node=1, kind="node")})
    assert model.rigid.m == pytest.approx(10.0, rel=1e-12)


def test_a_free_body_with_massless_parts_has_the_motions_of_its_masses(tmp_path):
    """Two masses on a massless beam, free: five rigid motions, and f = sqrt(2 E A / (L m)) / 2 pi along the beam."""
    path = nastran(tmp_path)
    path.write_text(path.read_text().replace("ENDDATA", f"CONM2,98,1,,{TIP}\nENDDATA"))
    model = mp.assemble(mp.read_mesh(path), {}, {"root": mp.Interface(node=5, kind="node")})
    axial = 2 * 2e11 * 0.01 / LENGTH / TIP
    found = lowest_modes(model.K, model.M, 6, shift=-1e-3 * axial).w2
    assert len(found) == 6
    assert found / axial == pytest.approx([0, 0, 0, 0, 0, 1], abs=1e-9)


def test_a_model_without_any_mass_is_refused(tmp_path):
    path = nastran(tmp_path)
    path.write_text(path.read_text().replace("CONM2", "$"))
    model = mp.assemble(mp.read_mesh(path), {}, {"root": mp.Interface(node=1, kind="node")})
    with pytest.raises(mp.InputError, match="the model has no mass"):
        mp.craig_bampton(model, modes=2)


def test_a_density_below_zero_is_refused():
    with pytest.raises(mp.InputError, match="rho = -1 must be zero or positive"):
        mp.Material(E=1.0, nu=0.0, rho=-1.0)


def test_a_massless_strut_that_turns_freely_at_an_interface(tmp_path):
    """A beam of 7800 kg/m^3, and a strut without density from a hinge (PA = 5) at its end to an interface.

    The strut turns without strain: one motion of frequency zero, as far as it has mass.
    """
    cards = ["GRID,1", "GRID,2,,1.", "GRID,3,,1.,,1.", "CBAR,1,5,1,2,0.,1.,0.", "CBAR,2,6,2,3,0.,1.,0.", ",5"]
    cards += [
        "PBAR,5,7,.01,3.-7,3.-7,6.-7",
        "PBAR,6,8,.01,3.-7,3.-7,6.-7",
        "MAT1,7,2.+11,,.3,7800.",
        "MAT1,8,2.+11,,.3",
    ]
    (tmp_path / "strut.bdf").write_text("\n".join([*cards, "ENDDATA\n"]))
    ends = {"root": mp.Interface(node=1, kind="node"), "tip": mp.Interface(node=3, kind="node")}
    model = mp.assemble(mp.read_mesh(tmp_path / "strut.bdf"), {}, ends)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=2), name="strut")
    assert body.m == pytest.approx(78.0, rel=1e-11)
    assert (body.frequency == 0).sum() == 1
    assert [check.name for check in mp.check_body(body) if not check.passed] == []
