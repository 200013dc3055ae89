"""From a CAD part, a mesh or a deck to a first pipeline file that runs, and to a pendulum."""

import re
import tomllib
from pathlib import Path

import meshio
import numpy as np
import pytest
from fe.cad_parts import VOLUME, draw, plate
from fe.generated import needs_gmsh
from scipy.special import ellipk
from shared_data import DATA
from size import some

import modalprep as mp
from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.examples import uniform_beam
from modalprep.formats.export import export_body
from modalprep.pipeline.building.model import assemble_pipeline, read_pipeline_mesh
from modalprep.pipeline.init.survey import survey
from modalprep.pipeline.init.write import init_pipeline
from modalprep.pipeline.schema.load import load
from modalprep.report.pictures.system_animation import animate_system

needs_data = pytest.mark.skipif(not DATA.is_dir(), reason=f"the decks are not in {DATA} (set MODALPREP_DATA)")


@pytest.fixture(scope="module")
def parts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cad")
    draw(folder, plate, "plate")
    return folder


def model_of(file):
    """Return the model of a pipeline file, as its run assembles it."""
    source = load(file)
    return assemble_pipeline(source.pipeline, read_pipeline_mesh(source))


@needs_gmsh
@pytest.mark.parametrize("suffix", [".step", ".iges", ".brep"])
def test_openings_of_a_part(parts, tmp_path, suffix):
    """Nodes of second-order elements lie on the CAD surfaces."""
    found, (file, _) = init_pipeline(parts / f"plate{suffix}", tmp_path / "plate.toml")
    small, large = found.openings
    for one, x, radius in ((small, 15, 4), (large, 65, 6)):
        assert one.hole
        assert one.cylinder.radius == pytest.approx(1e-3 * radius, rel=1e-6)
        np.testing.assert_allclose(one.centre, [1e-3 * x, 0.02, 0.004], atol=1e-6 * 0.08)
        np.testing.assert_allclose(one.cylinder.axis, [0, 0, 1], atol=1e-6)
    table = tomllib.loads(file.read_text())
    assert table["interfaces"]["hole_1"]["cylinder"] == {"point": [15, 20, 4], "axis": [0, 0, 1], "radius": 4}
    assert list(table["interfaces"]) == ["hole_1", "hole_2"]
    assert "ASSUMPTION: the file says no material" in file.read_text()
    model = model_of(file)
    assert [frame.name for frame in model.interfaces] == ["hole_1", "hole_2"]
    assert model.rigid.m == pytest.approx(7850 * VOLUME * 1e-9, rel=1e-5)
    wall = 2 * np.pi * np.array([4, 6]) * 8  # each frame holds the nodes of its own wall
    assert len(model.interfaces[0].nodes) > wall[0] / (found.read.size / 2) ** 2


@needs_gmsh
@pytest.mark.usefixtures("rough_edges")
@pytest.mark.parametrize("suffix", some([".iges", ".brep", ".step"], 1))  # .ci/newcomer makes a film of a STEP file
def test_a_moving_pendulum_in_three_commands(parts, tmp_path, monkeypatch, capsys, suffix):
    """The period of a large swing, by the complete elliptic integral, from the mass properties of the modal file."""
    (tmp_path / f"plate{suffix}").write_bytes((parts / f"plate{suffix}").read_bytes())
    monkeypatch.chdir(tmp_path)
    assert main(["init", f"plate{suffix}", "--material", "aluminium", "--size", "8"]) == 0
    plain = suffix != ".step"  # one film will do, and one set of pictures
    monkeypatch.setitem(animate_system.__kwdefaults__, "frames", 6)  # of 60
    assert main(["run", "plate.toml", *["--no-pictures"] * plain]) == 0
    if plain:
        swinging = Path("plate-pendulum.toml")
        swinging.write_text(swinging.read_text().replace('film = "gif"', 'film = "none"'))
    assert main(["simulate", "plate-pendulum.toml"]) == 0
    printed = capsys.readouterr().out
    assert "hole of radius 6 at [65, 20, 4]" in printed
    body = mp.read_body(tmp_path / "output" / "plate" / "plate.h5")
    assert body.m == pytest.approx(2700 * VOLUME * 1e-9, rel=1e-4)
    run = mp.read_result(tmp_path / "output" / "plate-pendulum" / "plate-pendulum-run.h5")
    film = tmp_path / "output" / "plate-pendulum" / "plate-pendulum.gif"
    assert film.exists() == (suffix == ".step" and "pictures not drawn" not in printed)
    # the output step is a hundredth of the period: cubic interpolation of the crossings errs by 1e-6 of it
    assert period(run.time, run["hinge.angle"] + resting(body)) == pytest.approx(swing(body), rel=1e-5)


def resting(body):
    """Return the angle from gravity, along x, to the centre of mass."""
    return np.arctan2(body.s0[1], body.s0[0])


def swing(body):
    """Return the period of a rigid body that starts 30 degrees from the direction of x."""
    inertia = np.trace(body.E0) - body.E0[2, 2]
    omega = np.sqrt(9.81 * np.linalg.norm(body.s0[:2]) / inertia)
    return 4 / omega * ellipk(np.sin((np.radians(30) + resting(body)) / 2) ** 2)


def period(time, angle):
    """Return the mean time between crossings of zero from below."""
    from scipy.interpolate import CubicSpline

    spline = CubicSpline(time, angle)
    crossings = [t for t in spline.roots(extrapolate=False) if spline(t, 1) > 0]
    assert len(crossings) >= 2
    return (crossings[-1] - crossings[0]) / (len(crossings) - 1)


MESHES = {  # interfaces of the meshes beside the pipelines; the first is the root
    "bracket": ["bolt_a", "bolt_b"],
    "block": ["root", "tip"],
    "beam": ["root", "tip"],
    "plate": ["root", "tip"],
    "panel": ["root", "tip"],
    "loaded-plate": ["root", "free_corner"],
    "satellite": ["launcher", "rim", "tank_ring", "wheel_ring_a", "wheel_ring_b"],
}


@pytest.mark.parametrize("name", MESHES)
def test_meshes_of_gmsh(project, tmp_path, name):
    found, files = init_pipeline(project / "meshes" / f"{name}.msh", tmp_path / "part.toml")
    assert [one.name for one in found.active] == MESHES[name]
    assert [frame.name for frame in model_of(files[0]).interfaces] == MESHES[name]
    load(files[1])
    assert found.read.length_unit == ("mm" if name == "bracket" else "m")


@needs_gmsh
@pytest.mark.parametrize("suffix", [".unv", ".med", ".vtu", ".msh"])
def test_other_formats(project, tmp_path, suffix):
    """The bracket without its groups: one group, and the holes found by their shape."""
    raw = meshio.read(project / "meshes" / "bracket.msh")
    bare = meshio.Mesh(raw.points, [block for block in raw.cells if block.type == "tetra10"])
    meshio.write(tmp_path / "a.msh", bare, file_format="gmsh")
    if suffix == ".unv":
        convert(tmp_path / "a.msh", tmp_path / "a.unv")
    else:
        meshio.write(tmp_path / f"a{suffix}", bare, **({"file_format": "gmsh"} if suffix == ".msh" else {}))
    found, files = init_pipeline(tmp_path / f"a{suffix}", tmp_path / "a.toml")
    assert [one.name for one in found.active] == ["hole_1", "hole_2"]
    assert model_of(files[0]).rigid.m == pytest.approx(7850 * 2.780854e-5, rel=1e-6)  # of test_meshes: 2.7809e-5 m^3


def convert(source, target):
    import gmsh

    gmsh.initialize(readConfigFiles=False, interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.open(str(source))
        gmsh.write(str(target))
    finally:
        gmsh.finalize()


DECKS = {  # length and mass units of the decks, and what carries each body
    "nastran_cb/inboard.dat": ("mm", "kg", ["node_3", "node_11", "node_19", "node_27"]),
    "isat/ISat_Launch_Sm_4pt.dat": ("in", "slinch", ["support"]),
    "abaqus/blockC3D10.inp": ("m", "kg", ["plane_5", "plane_6"]),
    "calculix/beamf.inp": ("mm", "t", ["support"]),
    "ansys/HexBeam.cdb": ("m", "kg", ["NCOMP2", "NODE_SELECTION"]),
    "ansys/sector.cdb": ("m", "kg", ["REFINE"]),
}


@needs_data
@pytest.mark.parametrize("name", DECKS)
def test_decks(tmp_path, name):
    length, mass, interfaces = DECKS[name]
    found, files = init_pipeline(DATA / name, tmp_path / "deck.toml")
    assert (found.read.length_unit, found.read.mass_unit) == (length, mass)
    model = model_of(files[0])
    assert [frame.name for frame in model.interfaces] == interfaces
    assert len(files) == 2
    load(files[1])


@needs_data
def test_a_deck_with_its_supports_runs(tmp_path, monkeypatch):
    """CalculiX' own first frequency of this cantilever, 13096.03 Hz (ISCPC/CalculiX-ccx-test, beamf.dat.ref)."""
    monkeypatch.chdir(tmp_path)
    assert main(["init", str(DATA / "calculix" / "beamf.inp"), "--json"]) == 0
    assert main(["run", "beamf.toml", "--no-report", "--no-pictures"]) == 0
    body = mp.read_body(tmp_path / "output" / "beamf" / "beamf.h5")
    assert body.frequency[0] == pytest.approx(13096.03, rel=5e-3)  # C3D20R, which is softer than full integration


@needs_gmsh
def test_the_tutorial_shows_what_is_written(project, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "meshes").mkdir()
    (tmp_path / "meshes" / "bracket.step").write_bytes((project / "meshes" / "bracket.step").read_bytes())
    assert main(["init", "meshes/bracket.step", "--material", "aluminium"]) == 0
    page = (project / "docs" / "tutorials" / "own-part.md").read_text()
    shown = re.search(r"```toml\n(.*?)```", page, re.DOTALL)[1]
    written = re.sub(r"\b\d+ nodes", "N nodes", (tmp_path / "bracket.toml").read_text())  # of another gmsh
    for paragraph in shown.strip().split("\n\n"):
        assert re.sub(r"\b\d+ nodes", "N nodes", paragraph) in written
    assert (tmp_path / "bracket-pendulum.toml").exists()


def test_nothing_to_hold(tmp_path, capsys):
    """A ball of one cell has no interface that could be guessed: the file and the output say so, and the file runs."""
    points = np.array([[0, 0, 0], [1, 0, 0], [0.2, 1, 0.1], [0.1, 0.3, 0.9]])
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("tetra", [[0, 1, 2, 3]])]))
    assert main(["init", str(tmp_path / "a.vtu"), "-o", str(tmp_path / "a.toml")]) == 0
    printed = capsys.readouterr().out
    assert "no interface was found" in printed
    assert "no interface was found" in (tmp_path / "a.toml").read_text()


@pytest.mark.parametrize("name", ["beam.msh", "beam.fem"])
def test_a_folder_is_no_file(project, tmp_path, capsys, name):
    export_body(uniform_beam(modes=1), "mbdyn", tmp_path / "beam.fem")
    (tmp_path / "beam.msh").write_bytes((project / "meshes" / "beam.msh").read_bytes())
    assert main(["init", str(tmp_path / name), "-o", str(tmp_path)]) == 2
    assert capsys.readouterr().err == f"modalprep: cannot write {tmp_path}: Is a directory; name a file in it\n"


def test_files_are_not_replaced(project, tmp_path, capsys):
    command = ["init", str(project / "meshes" / "beam.msh"), "-o", str(tmp_path / "beam.toml")]
    assert main(command) == 0
    assert main(command) == 2
    assert "is there already; give another name by -o, or --force" in capsys.readouterr().err
    (tmp_path / "beam.toml").unlink()
    assert main(command) == 2  # the pendulum is there still
    assert "beam-pendulum.toml is there already" in capsys.readouterr().err
    assert main([*command, "--force"]) == 0


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (["--material", "stel"], "did you mean 'steel'?"),
        (["--material", "1,2"], "is neither a known name nor E,nu,rho"),
        (["--material", "1e9,0.7,1000"], "nu below 0.5"),
        (["--size", "1"], "--size is for CAD files"),
        (["--length-unit", "parsec"], "unknown length_unit 'parsec'"),
    ],
)
def test_what_cannot_be(project, tmp_path, capsys, given, said):
    file = project / "meshes" / "beam.msh"
    assert main(["init", str(file), "-o", str(tmp_path / "a.toml"), *given]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_a_reduced_body_swings_as_a_pendulum(tmp_path, capsys, monkeypatch):
    """A rod hinged at its end, ``2 pi sqrt(2 L / (3 g))``: from a file of MBDyn to its motion in three commands."""
    monkeypatch.chdir(tmp_path)
    export_body(uniform_beam(modes=2), "mbdyn", tmp_path / "rod.fem")
    assert main(["init", "rod.fem"]) == 0
    assert "next: modalprep run rod.toml, modalprep simulate rod-pendulum.toml" in capsys.readouterr().out
    assert main(["run", "rod.toml", "--no-pictures"]) == 0
    assert main(["simulate", "rod-pendulum.toml", "--set", 'output.film="none"']) == 0
    run = mp.read_result(tmp_path / "output" / "rod-pendulum" / "rod-pendulum-run.h5")
    swing = 4 * np.sqrt(2 * 10 / (3 * 9.81)) * ellipk(np.sin(np.radians(15)) ** 2)
    angle = run["hinge.angle"]
    falls = np.flatnonzero((angle[:-1] > 0) & (angle[1:] <= 0))
    at = run.time[falls] + np.diff(run.time)[falls] * angle[falls] / (angle[falls] - angle[falls + 1])
    assert np.diff(at)[0] == pytest.approx(swing, rel=2e-3)  # it bends a little: 5e-4 measured


def test_reduced_bodies_say_what_is_unknown(tmp_path, capsys):
    free = mp.body.in_mean_axes(uniform_beam(modes=8))
    export_body(free, "sid", tmp_path / "free.sid_fem")
    assert main(["init", str(tmp_path / "free.sid_fem"), "-o", str(tmp_path / "free.toml")]) == 0
    assert "choose a root in" in capsys.readouterr().out
    assert sorted(path.suffix for path in tmp_path.iterdir()) == [".sid_fem", ".toml"]
    assert main(["init", str(tmp_path / "free.sid_fem"), "-o", str(tmp_path / "free.toml")]) == 2
    assert "is there already" in capsys.readouterr().err
    assert main(["init", str(tmp_path / "free.sid_fem"), "--size", "2"]) == 2
    assert "--size is of meshes" in capsys.readouterr().err
    (tmp_path / "a.asm").write_text("SEBULK")
    assert main(["init", str(tmp_path / "a.asm")]) == 2
    assert "the matrices are in its .op4 file" in capsys.readouterr().err


def test_given_units_are_taken(project, tmp_path):
    found = survey(project / "meshes" / "bracket.msh", "cm")
    assert found.mesh.scale == 0.01
    with pytest.raises(InputError, match="does not exist"):
        init_pipeline(tmp_path / "no.msh")


def test_nodes_off_a_cylinder_are_found_by_a_tolerance(project, tmp_path):
    """Coordinates of four digits: a hundredth of a millimetre, where node sets see a ten-thousandth."""
    raw = meshio.read(project / "meshes" / "bracket.msh")
    bare = meshio.Mesh(raw.points.round(2), [block for block in raw.cells if block.type == "tetra10"])
    meshio.write(tmp_path / "a.vtu", bare)
    found, files = init_pipeline(tmp_path / "a.vtu", tmp_path / "a.toml")
    table = tomllib.loads(files[0].read_text())["interfaces"]["hole_1"]["cylinder"]
    assert 0 < table["tolerance"] < 0.02
    assert set(found.openings[0].nodes) <= set(model_of(files[0]).interfaces[0].nodes)
