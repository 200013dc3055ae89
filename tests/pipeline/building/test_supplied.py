"""Bodies that are reduced already, in pipeline files: [body], files of suppliers in [bodies], and welds."""

import json

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats import export_body, import_body

pytestmark = pytest.mark.usefixtures("rough_edges")  # pictures are not looked at here

SUPPLIED = """
[body]
file = "arm.op4"
damping = 0.01

[joints.hinge]
type = "revolute"
child = "job.root"

[environment]
gravity = [0, 0, -9.81]

[simulation]
t_end = 0.01
output_step = 0.005
output = ["hinge.angle", "job.interface_2.position"]

[output]
pictures = 1
export = ["mbdyn"]
"""


@pytest.fixture
def job(tmp_path):
    export_body(uniform_beam(modes=3), "op4", tmp_path / "arm.op4")
    (tmp_path / "job.toml").write_text(SUPPLIED)
    return tmp_path / "job.toml"


def test_supplied_body_goes_the_whole_way(job, capsys):
    """Imported, checked, damped, exported, drawn, simulated."""
    assert main(["run", str(job)]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "the file does not hold stress stiffness" in printed
    output = job.parent / "output" / "job"
    body = mp.read_body(output / "job.h5")
    assert body.name == "job"
    np.testing.assert_allclose(body.D, 2 * 0.01 * np.sqrt(body.K), rtol=1e-12)
    names = {path.name for path in output.iterdir()}
    assert {"job.html", "job.fem", "job-effective-mass.png", "job-mode-01.png"} <= names
    assert import_body(output / "job.fem").interface_name == ("root", "interface_2")
    assert main(["check", str(job)]) == 0


def test_supplied_body_is_built_again_when_its_file_changes(job, capsys):
    assert main(["modes", str(job)]) == 0
    export_body(uniform_beam(modes=2), "op4", job.parent / "arm.op4")
    assert main(["simulate", str(job)]) == 0
    assert mp.read_body(job.parent / "output" / "job" / "job.h5").n == 2
    capsys.readouterr()


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("job.root", "job.tip", "tip"),
        ('file = "arm.op4"', 'file = "leg.op4"', "leg.op4 does not exist"),
        ('file = "arm.op4"', 'file = "arm.op4"\nroot = "tip"', "no interface 'tip'"),
        ('file = "arm.op4"', 'file = "arm.op4"\nlength_unit = "mm"', "mass_unit"),
        ("[body]", "[reduction]\nmodes = 3\n[body]", "[reduction] cannot be combined with [body]"),
        ("[body]", '[mesh]\nfile = "a.msh"\n[body]', "[mesh] cannot be combined with [body]"),
        ("job.interface_2", "job.interface_9", "interface_9"),
    ],
)
def test_wrong_tables_are_one_sentence(old, new, said, job, capsys):
    job.write_text(SUPPLIED.replace(old, new))
    assert main(["run", str(job)]) == 2
    printed = capsys.readouterr().err
    assert said in printed
    assert printed.count("\n") == 1
    assert not list((job.parent / "output").rglob("*.h5"))


def test_other_commands_need_a_mesh(job, capsys):
    assert main(["quality", str(job)]) == 2
    assert "reduced already" in capsys.readouterr().err
    assert main(["check", str(job), "--energy"]) == 2
    assert "no mesh" in capsys.readouterr().err


def test_systems_name_the_file_of_a_supplier(tmp_path, capsys):
    """The same pendulum by [bodies] with the file, with a modal file in its place, and with [body]."""
    export_body(uniform_beam(modes=3), "sid", tmp_path / "arm.sid")
    main(["import", str(tmp_path / "arm.sid"), "-o", str(tmp_path / "arm.h5")])
    runs = []
    for name, table in {
        "one": '[bodies.arm]\nfile = "arm.sid"\nroot = "tip"',
        "two": '[bodies.arm]\nfile = "arm.h5"\nroot = "tip"',
        "three": 'name = "arm"\n[body]\nfile = "arm.h5"\nroot = "tip"',
    }.items():
        text = SUPPLIED[SUPPLIED.index("[joints") : SUPPLIED.index("[output]")].replace("job.interface_2", "arm.root")
        (tmp_path / f"{name}.toml").write_text(f"{table}\n{text.replace('job.root', 'arm.tip')}")
        assert main(["simulate", str(tmp_path / f"{name}.toml")]) == 0, capsys.readouterr().err
        runs.append(mp.read_result(tmp_path / "output" / name / f"{name}-run.h5").channels["arm.root.position"])
    np.testing.assert_allclose(runs[1], runs[0], rtol=1e-12)
    np.testing.assert_allclose(runs[2], runs[0], rtol=1e-12)


@pytest.mark.parametrize("file", ["arm.sid", "arm.h5"])
def test_one_file_may_be_two_bodies_with_other_roots(file, tmp_path, capsys):
    """Two arms of 10 m from one file hang from their root and from their tip: both reach 10 m to the other side."""
    export_body(uniform_beam(modes=2), "sid", tmp_path / "arm.sid")
    main(["import", str(tmp_path / "arm.sid"), "-o", str(tmp_path / "arm.h5")])
    text = ""
    for name, end in (("one", "root"), ("two", "tip")):
        text += f'[bodies.{name}]\nfile = "{file}"\nroot = "{end}"\n'
        text += f'[joints.{name}]\ntype = "revolute"\nchild = "{name}.{end}"\n'
    text += '[simulation]\nt_end = 0.01\noutput_step = 0.01\noutput = ["one.tip.position", "two.root.position"]\n'
    (tmp_path / "pair.toml").write_text(text)
    assert main(["simulate", str(tmp_path / "pair.toml")]) == 0, capsys.readouterr().err
    run = mp.read_result(tmp_path / "output" / "pair" / "pair-run.h5").channels
    np.testing.assert_allclose(run["one.tip.position"][0], [10, 0, 0], atol=1e-9)
    np.testing.assert_allclose(run["two.root.position"][0], [-10, 0, 0], atol=1e-9)


def test_units_of_a_modal_file_are_refused(tmp_path, capsys):
    mp.write_body(uniform_beam(modes=2), tmp_path / "arm.h5")
    (tmp_path / "job.toml").write_text('[body]\nfile = "arm.h5"\nlength_unit = "mm"\nmass_unit = "t"\n')
    assert main(["modes", str(tmp_path / "job.toml")]) == 2
    assert "in SI units" in capsys.readouterr().err


def test_supplied_bodies_are_welded(tmp_path, capsys):
    """Two halves of a cantilever from their OUTPUT4 files: the frequencies of the whole of 20 m, from the files."""
    for name in ("one", "two"):
        export_body(uniform_beam(modes=8, truncation=("interfaces",)), "op4", tmp_path / f"{name}.op4")
    text = """
[bodies.one]
file = "one.op4"
[bodies.two]
file = "two.op4"
[welds.middle]
between = ["one.interface_2", "two.root"]
[welds.wall]
between = ["ground", "one.root"]
[synthesis]
modes = 2
"""
    (tmp_path / "pair.toml").write_text(text)
    assert main(["run", str(tmp_path / "pair.toml"), "--no-report"]) == 0, capsys.readouterr().err
    found = json.loads((tmp_path / "output" / "pair" / "pair-synthesis.json").read_text())["frequency_Hz"]
    body = uniform_beam(modes=8, truncation=("interfaces",))
    direct = mp.reduction.synthesise({"a": body, "b": body}, [("a.tip", "b.root")], ground=["a.root"], modes=2)
    np.testing.assert_allclose(found, direct.frequency, rtol=1e-9)


def test_import_of_other_units(tmp_path, capsys):
    """A beam of 10 mm and 12 t, as the numbers of one of 10 m and 12 kg say."""
    export_body(uniform_beam(modes=2), "sid", tmp_path / "arm.sid")
    assert main(["import", str(tmp_path / "arm.sid"), "--length-unit", "mm", "--mass-unit", "t"]) == 0
    assert "taken as mm, t and s" in " ".join(capsys.readouterr().out.split())
    body = mp.read_body(tmp_path / "arm.h5")
    assert (body.m, round(body.interface_position[1, 0], 9)) == (12e3, 0.01)
    np.testing.assert_allclose(body.frequency, uniform_beam(modes=2).frequency, rtol=1e-9)
    assert main(["import", str(tmp_path / "arm.sid"), "--length-unit", "mm"]) == 2
    assert main(["import", str(tmp_path / "arm.sid"), "--length-unit", "furlong"]) == 2
    assert main(["import", str(tmp_path / "arm.sid"), "--interface", "tip"]) == 2
