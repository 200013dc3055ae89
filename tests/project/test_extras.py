"""What an installation without extras does: it says what is missing and who brings it, and goes on where it can."""

import re
import shutil
import sys
import tomllib

import numpy as np
import pytest
from bad.good import BEAM, HINGE

import modalprep as mp
from modalprep import extras
from modalprep.cli import main
from modalprep.examples import cantilever_model, uniform_beam
from modalprep.linalg import onemkl
from modalprep.pipeline.building import compute
from modalprep.report.pictures import render

LEAN = ("pyvista", "vtkmodules", "gmsh", "pypardiso", "pyyeti", "imageio_ffmpeg", "pandas", "xarray", "distributed",
        "pyarrow", "control")  # fmt: skip
SPECTRUM = '[srs.shock]\nchannels = ["hinge.angle"]\nlowest = "5 Hz"\nhighest = "100 Hz"\n'


@pytest.fixture
def lean(monkeypatch):
    """A process in which no library of an extra can be imported, and which has forgotten what it found before."""
    for module in LEAN:
        monkeypatch.setitem(sys.modules, module, None)
    for found in (render.drawing_problem, onemkl.library):
        found.cache_clear()
    yield
    for found in (render.drawing_problem, onemkl.library):
        found.cache_clear()


@pytest.fixture
def folder(tmp_path, project, monkeypatch):
    """Inputs of every command that needs an extra."""
    shutil.copy(project / "meshes" / "bracket.step", tmp_path / "part.step")
    mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")
    text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh")) + HINGE
    (tmp_path / "job.toml").write_text(text)
    (tmp_path / "shock.toml").write_text(text.replace("job.root", "shock.root") + SPECTRUM)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.usefixtures("lean")
@pytest.mark.parametrize(
    ("command", "extra"),
    [
        ("render beam.h5", "pictures"),
        ("render beam.h5 --sheet", "pictures"),
        ("render beam.h5 --animate", "pictures"),
        ("render beam.h5 --mode 0", "pictures"),
        ("film job.toml", "pictures"),
        ("simulate job.toml --animate a.gif", "pictures"),
        ("mesh plate -o plate.msh", "mesh"),
        ("init part.step --material aluminium", "mesh"),
        ("run shock.toml", "shock"),
        ("simulate shock.toml", "shock"),
    ],
)
def test_a_command_that_needs_an_extra_names_it(folder, command, extra, capsys):
    before = sorted(folder.rglob("*.*"))
    assert main(command.split()) == 2
    said = capsys.readouterr()
    assert re.fullmatch(rf"modalprep: .+ needs \S+: pip install 'modalprep\[{extra}\]'\n", said.err), said.err
    assert sorted(folder.rglob("*.*")) == before


def test_a_run_goes_on_without_pictures_and_says_so(folder, request, capsys):
    """Modes and motion of the other factorisation agree to the accuracy of the eigensolver and of the integration."""
    assert main(["run", "job.toml", "--output", "all", "-q"]) == 0
    request.getfixturevalue("lean")
    request.getfixturevalue("monkeypatch").setattr(compute, "LARGE", 1)
    capsys.readouterr()
    assert (
        main(["run", "job.toml", "--output", "lean", "--set", "output.pictures=kept", "--set", "output.film=gif"]) == 0
    )
    said = " ".join(capsys.readouterr().out.split())
    assert said.count("pictures not drawn: a picture or film needs pyvista: pip install 'modalprep[pictures]'") == 2
    assert re.search(r"note: SuperLU factorised \d+ unknowns; PARDISO, quicker, needs pypardiso: pip install", said)
    lean, full = folder / "lean" / "job", folder / "all" / "job"
    assert "needs pyvista" in (lean / "job.html").read_text()
    assert {file.name for file in full.iterdir()} <= {file.name for file in lean.iterdir()}
    bodies = [mp.read_body(at / "job.h5").frequency for at in (lean, full)]
    np.testing.assert_allclose(*bodies, rtol=1e-8)
    ends = [mp.read_result(at / "job-run.h5")["hinge.angle"] for at in (lean, full)]
    np.testing.assert_allclose(*ends, rtol=1e-6, atol=1e-9)


def test_every_extra_is_declared(project):
    """Each library is a requirement of the extra that the sentences name, and `all` has what `make demo` needs."""
    declared = tomllib.loads((project / "pyproject.toml").read_text())["project"]
    optional = declared["optional-dependencies"]
    for module, extra in extras.EXTRA.items():
        assert any(name.replace("-", "_").startswith(module) for name in optional[extra]), module
        assert not any(name.replace("-", "_").startswith(module) for name in declared["dependencies"])
    assert optional["all"] == ["modalprep[pictures,mesh,fast,shock]"]


def test_gmsh_without_a_wheel_sends_to_another_machine(lean, monkeypatch):
    """`pip install` would fail there: the advice is another."""
    monkeypatch.setattr(sys, "platform", "linux")
    monkeypatch.setattr(extras.platform, "machine", lambda: "aarch64")
    with pytest.raises(mp.NotInstalledError, match="gmsh, which has no wheel for linux aarch64: make the mesh"):
        mp.make_mesh("beam", "a.msh")


def test_pardiso_by_name_is_refused_without_it(lean):
    """It is no mechanism that cannot be factorised, as a matrix without PARDISO would seem to be."""
    with pytest.raises(mp.NotInstalledError, match=r"PARDISO is not installed here: pip install 'modalprep\[fast\]'"):
        mp.craig_bampton(cantilever_model(30), modes=2, solver="in_memory")
