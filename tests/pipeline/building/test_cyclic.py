"""[cyclic] of a pipeline file, through the command line."""

import csv
import re

import numpy as np
import pytest
from calculix import deck
from rings import bricks

import modalprep as mp
from modalprep.cli import main
from modalprep.pipeline.building.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.schema.load import load
from modalprep.reduction import cyclic_modes

pytestmark = pytest.mark.usefixtures("rough_edges")  # pictures are not looked at here


def write_sector(folder, symmetry=False):
    """The dished disc of bricks, in m, with its sets; `symmetry` as a deck of CalculiX states it."""
    mesh, _, cyclic = bricks()
    rim = np.flatnonzero(np.hypot(*mesh.points[:, :2].T) > 0.199)
    tip = rim[np.abs(np.arctan2(mesh.points[rim, 1], mesh.points[rim, 0]) + np.pi / 6) < 0.4]
    lines = [deck(mesh.points, mesh.nodes("hub"), C3D20R=mesh.cells["hexahedron20"])]
    for name, nodes in (("hub", mesh.nodes("hub")), ("tip", tip), ("a", mesh.nodes("low")), ("b", mesh.nodes("high"))):
        lines += [f"*NSET, NSET={name}", *(f"{node + 1}," for node in nodes)]
    if symmetry:
        lines += ["*SURFACE, NAME=SA, TYPE=NODE", "a", "*SURFACE, NAME=SB, TYPE=NODE", "b"]
        lines += ["*TIE, CYCLIC SYMMETRY, NAME=T", "SB, SA", f"*CYCLIC SYMMETRY MODEL, N={cyclic.sectors}, TIE=T"]
        lines += ["0, 0, 0, 0, 0, 1"]
    (folder / "sector.inp").write_text("\n".join(lines) + "\n")


@pytest.fixture(scope="module")
def page(project):
    text = (project / "docs" / "how-to" / "cyclic.md").read_text()
    return {kind: re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL) for kind in ("toml", "python")}


def table(file):
    rows = csv.DictReader(file.read_text().splitlines())
    return [{key: float(value) for key, value in row.items()} for row in rows]


def test_the_page_runs(page, tmp_path, capsys):
    """Its table is that of the sector, its body that of the ring."""
    write_sector(tmp_path)
    (tmp_path / "job.toml").write_text(page["toml"][0] + "\n[output]\npictures = 0\n")
    assert main(["run", str(tmp_path / "job.toml")]) == 0
    printed = capsys.readouterr().out
    assert "Modes of 6 sectors by nodal diameter, Hz, at 314.2 rad/s" in printed
    rows = table(tmp_path / "output/job/job-nodal-diameters.csv")
    mesh = mp.read_mesh(tmp_path / "sector.inp")
    model = mp.assemble(mesh, {}, {"hub": mp.Interface(group="hub", kind="rbe2")})
    expected = cyclic_modes(
        model, mesh, bricks()[2].with_(low="", high=""), modes=4, speed=100 * np.pi, nodal_diameters=range(3)
    )
    for key in ("nodal_diameter", "frequency", "backward", "forward"):
        np.testing.assert_allclose([row[key] for row in rows], getattr(expected, key), rtol=1e-9)
    body = mp.read_body(tmp_path / "output/job/job.h5")
    assert body.m == pytest.approx(6 * model.rigid.m, rel=1e-12)
    assert body.interface_name == ("hub", "tip")
    at_rest = cyclic_modes(model, mesh, bricks()[2].with_(low="", high=""), modes=4)
    frequency = np.sort(np.repeat(at_rest.frequency, at_rest.multiplicity))[:6]
    np.testing.assert_allclose(body.modes.frequency[:6], frequency, rtol=1e-9)
    shown = (tmp_path / "output/job/job.html").read_text()
    assert 'id="nodal-diameters"' in shown
    assert "forward wave (Hz)" in shown


def test_a_deck_brings_its_symmetry(tmp_path, capsys):
    """In mm here; what the file states comes before it. The interface of one sector is not in the table."""
    write_sector(tmp_path, symmetry=True)
    held = '[interfaces.hub]\ngroup = "hub"\n[interfaces.tip]\ngroup = "tip_2"\n[output]\npictures = 0\n'
    (tmp_path / "job.toml").write_text('[mesh]\nfile = "sector.inp"\n[cyclic]\nmodes = 1\n' + held)
    assert main(["run", str(tmp_path / "job.toml"), "--no-report"]) == 0
    assert "are free in the nodal diameters: tip" in " ".join(capsys.readouterr().out.split())
    found = table(tmp_path / "output/job/job-nodal-diameters.csv")
    assert [row["nodal_diameter"] for row in found] == [0, 1, 2, 3]
    other = "[cyclic]\nmodes = 1\nnodal_diameters = [2]\npoint = [0, 0, '1 cm']\ntolerance = '1 mm'\n"
    (tmp_path / "other.toml").write_text('[mesh]\nfile = "sector.inp"\n' + other + held)
    assert main(["run", str(tmp_path / "other.toml"), "--no-report"]) == 0
    same = table(tmp_path / "output/other/other-nodal-diameters.csv")
    assert same[0]["frequency"] == pytest.approx(found[2]["frequency"], rel=1e-9)


def test_init_writes_the_table_of_a_deck(tmp_path, capsys):
    """Its file runs as it is: the model is that of the ring."""
    write_sector(tmp_path, symmetry=True)
    assert main(["init", str(tmp_path / "sector.inp"), "-o", str(tmp_path / "job.toml")]) == 0
    source = load(tmp_path / "job.toml")
    assert source.pipeline.cyclic is not None
    ring = read_pipeline_mesh(source)
    sector = mp.assemble(mp.read_mesh(tmp_path / "sector.inp"), {}, {"hub": mp.Interface(group="hub")})
    assert assemble_pipeline(source.pipeline, ring).rigid.m == pytest.approx(6 * sector.rigid.m, rel=1e-12)


BAD = {
    "[cyclic]\nsectors = 7\n": "no node of the mesh onto another",
    "[cyclic]\n": "the mesh file has no number of sectors; give sectors",
    "[cyclic]\nsectors = 6\nlow = 'a'\n": "name low and high",
    "[cyclic]\nsectors = 1\n": "greater than or equal to 2",
    "[cyclic]\nsectors = 6\nnodal_diameters = [9]\n": "6 sectors have 0 to 3",
    "[cyclic]\nsectors = 6\n[reduction]\nroot = 'tip'\n": "the root 'tip' is not in every sector",
}


@pytest.mark.parametrize("text", BAD)
def test_what_cannot_be_is_refused(text, tmp_path, capsys):
    write_sector(tmp_path)
    held = '[interfaces.hub]\ngroup = "hub"\n[interfaces.tip]\ngroup = "tip_2"\n[output]\npictures = 0\n'
    (tmp_path / "job.toml").write_text('[mesh]\nfile = "sector.inp"\n' + held + text)
    assert main(["run", str(tmp_path / "job.toml"), "--no-report"]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert BAD[text] in said
    assert "job.toml" in said


def test_the_python_of_the_page_runs(page):
    scope = {}
    exec(compile(page["python"][0], "cyclic.md", "exec"), scope)
    assert len(scope["found"].frequency) == 15
    assert scope["found"].plot().get_xlabel() == "nodal diameter"
    assert scope["body"].frequency[0] == pytest.approx(48.814, rel=1e-4)
