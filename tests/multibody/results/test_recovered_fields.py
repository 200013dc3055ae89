"""Recovered quantities over the mesh: cells and nodes, the series for ParaView, the colour of films."""

from xml.etree import ElementTree

import meshio
import numpy as np
import pytest
from body.test_recovered_stress import STEEL, T, strip
from PIL import Image, ImageSequence
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.cli import main
from modalprep.multibody.results.fields import cell_fields, node_field
from modalprep.report.pictures.system_animation import animate_system
from modalprep.report.scene.recovered_colour import RecoveredColour
from modalprep.report.scene.style import FilmStyle

Recover = mp.fe.Recover
G = 9.81


@pytest.fixture(scope="module")
def swing():
    """A strip of shells that is clamped and falls, with a beam along its middle."""
    mesh = strip()
    middle = np.flatnonzero(np.abs(mesh.points[:, 1]) < 1e-9)
    lines = np.stack([middle[:-1], middle[1:]], axis=1)
    mesh = mp.fe.Mesh(
        points=mesh.points,
        cells={**mesh.cells, "line": lines},
        groups={**mesh.groups, "rib": {"line": np.arange(len(lines))}},
    )
    sections = {
        "strip": mp.Shell(material=STEEL, thickness=T),
        "rib": mp.Beam(material=STEEL, A=1e-5, Iy=1e-11, Iz=1e-11, J=2e-11),
    }
    model = mp.assemble(mesh, sections, {"root": mp.Interface(group="clamp")})
    wanted = {
        "skin": Recover(kind="stress", group="strip", allowable=1e6),
        "rib": Recover(kind="section_force", group="rib"),
        "end": Recover(kind="acceleration", group="end"),
        "base": Recover(kind="reaction"),
    }
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=4), name="strip", recovery=recovery)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="wing", motion="0.5*sin(4*t)")
    system = mp.System(bodies={"wing": body}, joints=(hinge,), gravity=np.array([0, 0, -G]))
    return system, mp.simulate(system, t_end=0.4, output_step=0.05)


def motion_at(system, run, k):
    motion = mp.multibody.body_motion(system.bodies["wing"], "wing", run.channels)
    return type(motion)(*(x[k : k + 1] for x in motion))


def test_fields_are_the_channels_cell_by_cell(swing):
    system, run = swing
    body = system.bodies["wing"]
    for name, kind, parts in (("skin", "quad", ("top", "bottom")), ("rib", "line", ("start", "end"))):
        block = body.recovery[name]
        fields = cell_fields(body, block, block.full_values(motion_at(system, run, 5))[0])
        for part in parts:
            for component in block.full_components:
                field = fields[f"{part}.{component}"]
                own = [run[f"wing.recovery.{name}.{k + 1}.{part}.{component}"][5] for k in range(len(field[kind]))]
                assert field[kind] == pytest.approx(own, rel=1e-12)
                (other,) = set(field) - {kind}
                assert np.all(np.isnan(field[other]))


def test_cells_of_places_have_their_positions(swing):
    """The middle of the nodes of a place's cell is its position; the second end of a beam is half an element on."""
    body = swing[0].bodies["wing"]
    centres = np.concatenate([body.points[body.cells[kind]].mean(axis=1) for kind in sorted(body.cells)])
    skin, rib = body.recovery["skin"], body.recovery["rib"]
    assert skin.position == pytest.approx(centres[skin.cell], abs=1e-12)
    assert (rib.position[::2] + rib.position[1::2]) / 2 == pytest.approx(centres[rib.cell[::2]], abs=1e-12)


def test_nodes_have_the_mean_of_the_largest_around_them(swing):
    system, run = swing
    body, block = system.bodies["wing"], system.bodies["wing"].recovery["skin"]
    values = block.full_values(motion_at(system, run, 3))[0]
    found = node_field(body, block, values, "xx")
    faces = values[:, 0].reshape(-1, 2)
    largest = np.take_along_axis(faces, np.argmax(np.abs(faces), axis=1)[:, None], 1)[:, 0]
    for node in range(len(body.points)):
        around = np.any(body.cells["quad"] == node, axis=1)
        assert found[node] == pytest.approx(largest[around].mean(), rel=1e-12)
    at_end = node_field(body, body.recovery["end"], np.arange(9.0).reshape(3, 3), "y")
    assert at_end[body.recovery["end"].node].tolist() == [1.0, 4.0, 7.0]
    assert np.isnan(at_end).sum() == len(at_end) - 3


def test_series_for_paraview(swing, tmp_path):
    system, run = swing
    body = system.bodies["wing"]
    file = mp.formats.write_vtu_series(body, run, tmp_path / "wing.pvd", name="wing", every=4)
    text = file.read_text()
    assert text.count("<DataSet") == 3
    assert 'timestep="0.2" file="wing_0001.vtu"' in text
    found = meshio.read(tmp_path / "wing_0001.vtu")
    turn = Rotation.from_quat(run["wing.orientation"][4], scalar_first=True)
    shift = body.shape @ run["wing.modal"][4]
    assert found.point_data["displacement"] == pytest.approx(shift, abs=1e-15)
    assert found.points == pytest.approx(turn.apply(body.points + shift) + run["wing.origin"][4], abs=1e-12)
    kinds = [block.type for block in found.cells]
    quads = found.cell_data["skin.top.von_mises"][kinds.index("quad")]
    assert quads == pytest.approx([run[f"wing.recovery.skin.{k + 1}.top.von_mises"][4] for k in range(16)], rel=1e-12)
    rib = found.cell_data["rib.start.N"]
    assert np.all(np.isnan(rib[kinds.index("quad")]))
    assert rib[kinds.index("line")][2] == pytest.approx(run["wing.recovery.rib.3.start.N"][4], rel=1e-12)
    assert np.isfinite(found.point_data["end.z"]).sum() == 3


def test_names_of_a_series_are_escaped(swing, tmp_path):
    """XML: a name with its signs comes back, in the file of a time and in the collection."""
    system, run = swing
    body, name = system.bodies["wing"], 'a "b" <c> & d'
    body = body.with_(recovery={name: body.recovery["skin"]})
    file = mp.formats.write_vtu_series(body, run, tmp_path / "a & <b>.pvd", name="wing", every=8)
    assert ElementTree.parse(file).find(".//DataSet").get("file") == "a & <b>_0000.vtu"
    assert f"{name}.top.von_mises" in meshio.read(tmp_path / "a & <b>_0000.vtu").cell_data


def test_what_cannot_be_written_is_refused(swing, tmp_path):
    system, run = swing
    body = system.bodies["wing"]
    with pytest.raises(mp.InputError, match="collected by a .pvd file"):
        mp.formats.write_vtu_series(body, run, tmp_path / "wing.vtu", name="wing")
    with pytest.raises(mp.InputError, match="no motion of a flexible body 'strip'"):
        mp.formats.write_vtu_series(body, run, tmp_path / "wing.pvd")
    with pytest.raises(mp.InputError, match="every = 0"):
        mp.formats.write_vtu_series(body, run, tmp_path / "wing.pvd", name="wing", every=0)
    with pytest.raises(mp.InputError, match=r"did you mean 'skin.von_mises'"):
        animate_system(system, run, tmp_path / "film.gif", style=FilmStyle(colour="skin.von_mies"))
    with pytest.raises(mp.InputError, match="no body recovers it over its mesh"):
        RecoveredColour(system.bodies, run, "base.Fx")  # of an interface


@pytest.mark.usefixtures("drawing")
def test_film_is_coloured_by_the_stress(swing, tmp_path):
    """The clamp is bright where the stress is high at the last picture, the free end dark."""
    system, run = swing
    film = tmp_path / "film.gif"
    animate_system(system, run, film, style=FilmStyle(colour="skin.von_mises"), frames=3, seconds=1.0, size=(480, 360))
    plain = tmp_path / "plain.gif"
    animate_system(system, run, plain, frames=3, seconds=1.0, size=(480, 360))
    with Image.open(film) as a, Image.open(plain) as b:
        pictures = [[np.array(f.convert("RGB")) for f in ImageSequence.Iterator(x)] for x in (a, b)]
    assert np.abs(pictures[0][-1].astype(int) - pictures[1][-1]).max() > 100
    yellow = [np.all(np.abs(p.astype(int) - [253, 231, 37]) < 60, axis=2)[:300].sum() for p in pictures[0]]
    assert max(yellow) > 0


def test_the_command_writes_both(project, tmp_path):
    from pipeline.building.test_recovery import TABLES
    from pipeline.building.test_stress import TOML

    text = TOML.replace("[simulation]\n", TABLES).format(mesh=project / "meshes" / "beam.msh", t_end=1.0)
    (tmp_path / "job.toml").write_text(text)
    assert main(["simulate", str(tmp_path / "job.toml"), "--vtu", str(tmp_path / "series" / "job.pvd")]) == 0
    assert (tmp_path / "series" / "job_0002.vtu").exists()


@pytest.mark.parametrize(
    ("options", "words"),
    [(["--vtu", "a.vtu"], "collected by a .pvd file"), (["--colour", "skin.xx"], "add --animate with a file")],
)
def test_wrong_options_are_refused_before_the_run(tmp_path, capsys, options, words):
    assert main(["simulate", str(tmp_path / "missing.toml"), *options]) == 2
    assert words in " ".join(capsys.readouterr().err.split())
