"""What a deck says of its analysis becomes the first pipeline file."""

import re
import tomllib

import numpy as np
import pytest
from scipy.linalg import eigvalsh

from modalprep.cli import main
from modalprep.pipeline.building.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.init.write import init_pipeline
from modalprep.pipeline.schema.load import load
from modalprep.reduction.clamped import clamp

GRIDS = "".join(f"GRID,{k},,{0.5 * (k - 1)}\n" for k in range(1, 6))
BARS = GRIDS + "".join(f"CBAR,{k},5,{k},{k + 1},0.,1.,0.\n" for k in range(1, 5))
BARS += "PBAR,5,7,.01,3.-6,2.-6,4.-6\nMAT1,7,2.+11,,.3,8000.\n"
SETS = "SPC1,1,123456,1\nSPC1,2,123456,5\nFORCE,3,4,,10.,0.,1.,0.\nFORCE,4,3,,10.,0.,0.,1.\nGRAV,6,,9.81,0.,0.,-1.\n"
SETS += "LOAD,8,1.,1.,4,1.,6\nEIGRL,5,2.,200.,3\nEIGRL,6,,900.\nTABDMP1,9,CRIT\n,10.,.02,ENDT\n"
CONTROL = (
    "SOL 103\nCEND\nSUBCASE 1\nSPC = 1\nLOAD = 3\nMETHOD = 5\nSDAMPING = 9\n"
    "SUBCASE 2\nSPC = 2\nLOAD = 8\nMETHOD = 6\nSUBCASE 3\nSPC = 1\nDLOAD = 7\nBEGIN BULK\n"
)


def written(folder, text, name="part.bdf", **options):
    """The survey, the table and the text of the pipeline file of a deck."""
    (folder / name).write_text(text)
    found, files = init_pipeline(folder / name, folder / "part.toml", force=True, length_unit="m", **options)
    text = files[0].read_text()
    return found, tomllib.loads(text), text


def below(folder, frequency):
    """How many modes of the clamped model lie below a frequency, all computed."""
    source = load(folder / "part.toml")
    clamped = clamp(assemble_pipeline(source.pipeline, read_pipeline_mesh(source)))
    w2 = eigvalsh(clamped.K_ii.toarray(), clamped.M_ii.toarray())
    return np.count_nonzero(w2 < (2 * np.pi * frequency) ** 2)


def test_all_subcases(tmp_path):
    """The loads of all, else the first of each; what differs is said."""
    found, table, text = written(tmp_path, CONTROL + BARS + SETS)
    assert table["supports"] == {"spc_1": {"set": "spc_1"}}
    assert table["loads"] == {"load_3": {"set": "load_3"}, "load_8": {"set": "load_8"}}
    assert table["reduction"]["modes"] == 3
    assert table["reduction"]["damping"] == [[10, 0.02]]
    assert table["reduction"]["truncation_vectors"] == ["interfaces", "inertia", "load_3", "load_8"]
    assert "# Gravity of the deck is [0, 0, -9.81] m/s^2" in text
    assert "# up_to = 200  # Hz" in text
    assert "# Modes above 2 Hz are asked for" in text
    assert '# set = "load_4"' in text
    notes = " ".join(found.notes)
    assert "the cases differ in supports: those of subcase 1 are taken, --subcase chooses another" in notes
    assert "subcase 3: DLOAD = 7, which is not used" in notes
    assert all(f"# note: {note}" in text for note in found.notes)


def test_one_subcase(tmp_path):
    """A band without a count gets the modes of the clamped beam up to 1.5 times its end."""
    _, table, text = written(tmp_path, CONTROL + BARS + SETS, subcase=2)
    assert table["supports"] == {"spc_2": {"set": "spc_2"}}
    assert table["loads"] == {"load_8": {"set": "load_8"}}
    assert table["reduction"]["modes"] == below(tmp_path, 1.5 * 900)
    assert "# up_to = 900  # Hz" in text
    assert table["reduction"]["damping"] == 0.01
    assert "ASSUMPTION: of critical" in text
    assert "# Gravity of subcase 2 is" in text


def test_all_modes_are_not_asked_for(tmp_path):
    """A deck that asks for all by a large number gets those of its band."""
    _, table, text = written(
        tmp_path, "METHOD = 5\nBEGIN BULK\n" + GRIDS + BARS[len(GRIDS) :] + "EIGRL,5,,300.,99999\n"
    )
    assert table["reduction"]["modes"] == below(tmp_path, 1.5 * 300)
    assert "those up to 1.5 times the 300 Hz of the case control" in text


def test_a_load_on_the_interfaces_alone_is_none(tmp_path):
    """The constraint modes have its response; the pipeline file would be refused with it."""
    found, table, _ = written(tmp_path, "LOAD = 3\nSPC = 2\nBEGIN BULK\n" + BARS + SETS + "ASET1,123456,4")
    assert "loads" not in table
    assert "truncation_vectors" not in table["reduction"]
    assert "load 'load_3' acts on fixed interfaces only" in " ".join(found.notes)


def test_the_file_runs_and_keeps_the_static_response(tmp_path, monkeypatch, capsys):
    """The truncation vector of a force on a beam between two clamps has the Rayleigh quotient of its static shape."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "part.bdf").write_text(CONTROL + BARS + SETS)
    assert main(["init", "part.bdf", "--subcase", "1", "--length-unit", "m"]) == 0
    vectors = ["--set", "reduction.modes=0", "--set", 'reduction.truncation_vectors=["load_3"]']
    assert main(["run", "part.toml", "--no-pictures", *vectors]) == 0
    printed = re.search(r"truncation +(\S+)", capsys.readouterr().out)
    assert printed is not None
    assert float(printed[1]) == pytest.approx(rayleigh(a=1.5, b=0.5), rel=1e-4)  # printed digits


def rayleigh(a, b):
    """Frequency of the shape of a clamped beam under a force at a from one and b from the other end, Hz."""
    EI, A, inertia, rho = 2e11 * 3e-6, 0.01, 3e-6, 8000.0
    energy = mass = 0.0
    for near, far in ((a, b), (b, a)):  # both sides of the force, each from its clamp
        x = np.linspace(0, near, 20001)
        shape = (
            far**2 * np.polynomial.Polynomial([0, 0, 3 * near * (a + b), -(3 * near + far)]) / (6 * EI * (a + b) ** 3)
        )
        energy += np.trapezoid(EI * shape.deriv(2)(x) ** 2, x)
        mass += np.trapezoid(rho * (A * shape(x) ** 2 + inertia * shape.deriv()(x) ** 2), x)
    return np.sqrt(energy / mass) / (2 * np.pi)


@pytest.mark.parametrize(
    ("name", "text", "interfaces"),
    [
        ("part.bdf", BARS + SETS + "ASET1,123456,2,3,4,5\nSPC1,1,1,1", ["node_2", "node_3", "node_4", "node_5"]),
        ("part.bdf", BARS + SETS + "BSET,2,123456,4,123456\nCSET1,123456,5", ["node_2", "node_4", "node_5"]),
    ],
)
def test_nodes_that_the_deck_keeps_are_interfaces(tmp_path, name, text, interfaces):
    _, table, _ = written(tmp_path, "SPC = 1\nBEGIN BULK\n" + text, name)
    assert list(table["interfaces"]) == ["support", *interfaces]


def test_a_substructure_keeps_its_nodes(tmp_path):
    """Ten retained nodes are ten interfaces, where others are six at most."""
    nodes = "".join(f"{k}, {k}., 0., 0.\n" for k in range(1, 13))
    beams = "".join(f"{k}, {k}, {k + 1}\n" for k in range(1, 12))
    deck = f"*NODE\n{nodes}*ELEMENT, TYPE=B31, ELSET=b\n{beams}*MATERIAL, NAME=m\n*ELASTIC\n2e11, .3\n*DENSITY\n7800.\n"
    deck += "*BEAM SECTION, ELSET=b, MATERIAL=m, SECTION=RECT\n.02, .05\n0, 1, 0\n*STEP\n*SUBSTRUCTURE GENERATE\n"
    deck += "*RETAINED NODAL DOFS\n" + "".join(f"{k}, 1, 6\n" for k in range(2, 12)) + "*END STEP\n"
    _, table, _ = written(tmp_path, deck, "part.inp")
    assert list(table["interfaces"]) == [f"node_{k}" for k in range(2, 12)]


def test_a_subcase_must_be_there(tmp_path, capsys):
    (tmp_path / "part.bdf").write_text(CONTROL + BARS + SETS)
    assert main(["init", str(tmp_path / "part.bdf"), "--subcase", "9", "-o", str(tmp_path / "a.toml")]) == 2
    assert "has no subcase or step 9 that says anything; it has 1, 2, 3" in capsys.readouterr().err
