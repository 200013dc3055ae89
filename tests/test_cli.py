"""The command line: quick help, every command, exit codes."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from test_bad_input import BEAM, HINGE

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.report.render import drawing_problem

HEAVY = {
    "numpy",
    "scipy",
    "numba",
    "gmsh",
    "pyvista",
    "vtkmodules",
    "matplotlib",
    "skfem",
    "meshio",
    "h5py",
    "pydantic",
}


@pytest.fixture
def job(tmp_path, project):
    text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh"))
    (tmp_path / "job.toml").write_text(text + HINGE + "[environment]\ngravity = [0, -9.81, 0]\n")
    return tmp_path / "job.toml"


@pytest.fixture
def body(tmp_path):
    return mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")


def test_help_imports_nothing_heavy():
    code = (
        "import sys; from modalprep.cli import main; code = main(['--help']);"
        f"print('HEAVY', sorted({HEAVY!r} & set(sys.modules))); sys.exit(code)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "HEAVY []" in done.stdout
    assert "simulate" in done.stdout


def test_version(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out.strip() == f"modalprep {mp.__version__}"


@pytest.mark.parametrize("command", ["run", "modes", "render", "simulate", "check", "schema"])
def test_every_command_explains_itself(command, capsys):
    assert main([command, "--help"]) == 0
    assert "Usage" in capsys.readouterr().out


def test_run_as_json(job, capsys):
    assert main(["run", str(job), "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert outcome["mass"] == pytest.approx(12.0)
    assert len(outcome["frequency"]) > 0
    assert all(check["passed"] for check in outcome["checks"])
    names = {Path(file).name for file in outcome["files"]}
    assert {"job.h5", "job.html", "job-run.h5", "job-run.csv"} <= names
    assert all(Path(file).is_file() for file in outcome["files"])


def test_modes_of_a_pipeline_and_of_a_file(job, body, capsys):
    assert main(["modes", str(job)]) == 0
    assert "Mode selection" in capsys.readouterr().out
    assert main(["modes", str(body), "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["modes"]
    assert [row["kind"] for row in rows] == ["fixed-interface"] * 2
    assert body.with_suffix(".html").read_text().rstrip().endswith("</html>")


def test_check(body, tmp_path, capsys):
    assert main(["check", str(body)]) == 0
    good = mp.read_body(body)
    wrong = mp.write_body(good.with_(P=1.1 * good.P), tmp_path / "wrong.h5")
    assert main(["check", str(wrong)]) == 1
    assert "FAILED modal mass" in capsys.readouterr().out
    assert main(["check", str(wrong), "--json"]) == 1
    report = {c["name"]: c["passed"] for c in json.loads(capsys.readouterr().out)["checks"]}
    assert report["modal mass"] is False
    assert report["mass tensor"] is True


def test_simulate_variants(job, tmp_path, capsys):
    ends = {}
    for option in ("", "--dense", "--no-geometric-stiffness"):
        target = tmp_path / f"run{option}.h5"
        assert main(["simulate", str(job), "-o", str(target), *filter(None, [option])]) == 0
        ends[option] = mp.read_result(target)["hinge.angle"][-1]
    assert ends["--dense"] == pytest.approx(ends[""], rel=1e-8)
    assert ends["--no-geometric-stiffness"] != ends[""]
    assert (tmp_path / "run.csv").read_text().startswith("time,")


def test_body_is_reused_until_its_inputs_change(job, capsys):
    main(["simulate", str(job)])
    file = job.parent / "output" / "job" / "job.h5"
    first = file.stat().st_mtime_ns
    main(["simulate", str(job)])
    assert file.stat().st_mtime_ns == first
    job.write_text(job.read_text().replace("rho = 3000.0", "rho = 3100.0"))
    main(["simulate", str(job)])
    assert file.stat().st_mtime_ns != first
    assert mp.read_body(file).m == pytest.approx(12.4)


def test_schema_describes_every_table(capsys):
    assert main(["schema"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert {"mesh", "materials", "properties", "interfaces", "reduction", "simulation"} <= set(schema["properties"])
    assert "description" in schema["$defs"]["ReductionTable"]["properties"]["keep"]


@pytest.mark.parametrize("arguments", [["run"], ["run", "a.toml", "--fast"], ["fly"]])
def test_wrong_usage(arguments, capsys):
    assert main(arguments) == 2
    error = capsys.readouterr().err.strip()
    assert error.startswith("modalprep: ")
    assert len(error.splitlines()) == 1


@pytest.mark.skipif(drawing_problem() is not None, reason=f"cannot draw: {drawing_problem()}")
def test_render(body, tmp_path):
    for name, options in (("m.png", []), ("m.gif", ["--animate"]), ("mesh.png", ["--mode", "0"])):
        assert main(["render", str(body), "-o", str(tmp_path / name), *options]) == 0
        assert (tmp_path / name).stat().st_size > 1000
