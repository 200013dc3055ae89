"""The command line: quick help, every command, exit codes."""

import json
import os
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from bad.good import BEAM, HINGE

import modalprep as mp
from modalprep.cli import main
from modalprep.cli.commands import _command, app
from modalprep.examples import uniform_beam
from modalprep.report.pictures.animation import animate_mode

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


COMMANDS = {command.name or command.callback.__name__: command.callback for command in app.registered_commands}


@pytest.mark.parametrize("command", sorted(COMMANDS))
def test_every_command_explains_itself(command, capsys):
    """The help has every word of the docstring and of the options' texts, brackets such as [grid] included."""
    assert main([command, "--help"]) == 0
    printed = " ".join(capsys.readouterr().out.split())
    assert "Usage" in printed
    function = COMMANDS[command]
    hints = get_type_hints(function, include_extras=True)
    texts = [function.__doc__, *(get_args(hint)[1].help for name, hint in hints.items() if name != "return")]
    for word in " ".join(texts).split():
        assert word in printed


def test_list_of_commands_cuts_no_sentence(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    assert main(["--help"]) == 0
    printed = capsys.readouterr().out
    assert "[grid]" in printed
    assert "[analysis]" in printed
    assert "..." not in printed.replace("[ARGS]...", "")


def test_run_as_json(job, capsys):
    assert main(["run", str(job), "--json"]) == 0
    outcome = json.loads(capsys.readouterr().out)
    assert outcome["mass_kg"] == pytest.approx(12.0)
    assert len(outcome["frequency_Hz"]) > 0
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
    assert body.with_name("beam-modes.html").read_text().rstrip().endswith("</html>")


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
    for option in ("", "--reference", "--no-geometric-stiffness"):
        target = tmp_path / f"run{option}.h5"
        assert main(["simulate", str(job), "-o", str(target), *filter(None, [option])]) == 0
        ends[option] = mp.read_result(target)["hinge.angle"][-1]
    assert ends["--reference"] == pytest.approx(ends[""], rel=1e-8)
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


def test_schema_leaves_out_the_names_that_users_choose(capsys):
    """[joints.hinge] is a joint of this name; a name like that of a type or a key is taken for a slip."""
    assert main(["schema", "joints.hinge"]) == 0
    assert "A joint of the tree." in capsys.readouterr().out
    assert main(["schema", "joints.hinge.axis"]) == 0
    assert "hinge axis in the parent's frame" in capsys.readouterr().out
    assert main(["schema", "joints.revolut"]) == 2
    assert "did you mean 'revolute'" in capsys.readouterr().err


def test_the_shell_completes_commands_and_options():
    """As the lines of ``--show-completion`` ask in bash: the words, and the number of the one to complete."""
    for line, answer in (("modalprep ru", "run"), ("modalprep run --no-p", "--no-pictures")):
        asked = {"_MODALPREP_COMPLETE": "complete_bash", "COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
        code = "from modalprep.cli.commands import app; app(prog_name='modalprep')"
        done = subprocess.run(
            [sys.executable, "-c", code], env=os.environ | asked, capture_output=True, text=True, timeout=60
        )
        assert done.stdout.split() == [answer], done.stderr


def test_schema_describes_every_table(capsys):
    assert main(["schema", "--json"]) == 0
    schema = json.loads(capsys.readouterr().out)
    assert {"mesh", "materials", "properties", "interfaces", "reduction", "simulation"} <= set(schema["properties"])
    assert "description" in schema["$defs"]["ReductionTable"]["properties"]["keep"]


@pytest.mark.parametrize("arguments", [["run"], ["run", "a.toml", "--fast"], ["fly"]])
def test_wrong_usage(arguments, capsys):
    assert main(arguments) == 2
    error = capsys.readouterr().err.strip()
    assert error.startswith("modalprep: ")
    assert len(error.splitlines()) == 1


@pytest.mark.usefixtures("drawing", "rough_edges")
def test_render(body, tmp_path, monkeypatch):
    monkeypatch.setitem(animate_mode.__kwdefaults__, "frames", 3)  # of 24
    for name, options in (("m.png", []), ("m.gif", ["--animate"]), ("mesh.png", ["--mode", "0"])):
        assert main(["render", str(body), "-o", str(tmp_path / name), *options]) == 0
        assert (tmp_path / name).stat().st_size > 1000


def test_help_loads_no_heavy_library():
    """SciPy, numba, VTK and the mesh libraries take seconds to import, each."""
    heavy = {"numpy", "scipy", "numba", "vtkmodules", "pyvista", "skfem", "gmsh", "meshio", "h5py", "matplotlib"}
    code = "import sys\nfrom modalprep.cli import entry\ntry: entry()\nfinally: print(*sys.modules)"
    done = subprocess.run([sys.executable, "-c", code, "--help"], check=True, capture_output=True, text=True)
    assert "modalprep.cli" in done.stdout.split()
    assert not heavy & set(done.stdout.split())


COUNTED = """
import atexit, gc, importlib.metadata, os
asked, left = [], sum(stage["collections"] for stage in gc.get_stats())
importlib.metadata.entry_points = lambda **given: asked.append(given) or ()
class Kept:
    def __del__(self, write=os.write):
        write(1, b"taken apart")
kept = Kept()
from modalprep.cli import entry
try:
    entry()
finally:
    print("searches", len(asked), "collections", sum(stage["collections"] for stage in gc.get_stats()) - left)
    atexit.register(print, "closed")
"""


@pytest.mark.parametrize(("words", "code"), [(["schema"], 0), (["simulate", "missing.toml"], 2)])
def test_an_entry_does_nothing_but_the_command(words, code):
    """No search for plugins, no garbage collection in a short run, no modules taken apart at its end.

    What libraries have registered for the end of the process is done.
    """
    done = subprocess.run([sys.executable, "-c", COUNTED, *words], capture_output=True, text=True)
    assert done.returncode == code, done.stderr
    assert done.stdout.splitlines()[-2:] == ["searches 0 collections 0", "closed"]


def test_a_command_makes_its_own_options_only():
    """Those of all commands take longer to make than many a command to run."""
    everything = set(_command("").commands)
    assert {"run", "simulate", "import"} < everything
    assert set(_command("simulate").commands) == {"simulate"}
    assert set(_command("import").commands) == {"import"}
    assert set(_command("simulat").commands) == everything  # which the message looks through


def keys_unknown_to(schema, table, definitions, where=""):
    """Yield the keys of a TOML table that a JSON schema does not describe."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].removeprefix("#/$defs/")]
    choices = schema.get("anyOf", []) + schema.get("oneOf", [])
    if choices:
        found = [list(keys_unknown_to(choice, table, definitions, where)) for choice in choices]
        yield from min(found, key=len)
    elif isinstance(table, dict):
        for key, value in table.items():
            inner = schema.get("properties", {}).get(key, schema.get("additionalProperties"))
            if not inner:
                yield f"{where}.{key}"
            elif inner is not True:  # true: any value, such as a key of a joint that a chain's first one changes
                yield from keys_unknown_to(inner, value, definitions, f"{where}.{key}")
    elif isinstance(table, list) and table and isinstance(table[0], dict):
        for row in table:
            if "items" in schema:
                yield from keys_unknown_to(schema["items"], row, definitions, where)
            else:
                yield where


def test_schema_describes_the_shipped_pipelines(project, capsys):
    assert main(["schema", "--json"]) == 0
    schema = json.loads(capsys.readouterr().out)
    pipelines = sorted((project / "pipelines").glob("*.toml"))
    assert pipelines
    for file in pipelines:
        data = tomllib.loads(file.read_text())
        assert list(keys_unknown_to(schema, data, schema["$defs"])) == [], file.name
    assert list(keys_unknown_to(schema, {"mesh": {"file": "a.msh", "fyle": 1}}, schema["$defs"])) == [".mesh.fyle"]


def test_geometric_stiffness_is_felt(tmp_path, project):
    """A beam let go at 3 rad/s, near its first bending frequency of 3.8 rad/s, is stiffened by its spin."""
    text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh"))
    text = text.replace("modes = 3\n", "modes = 1\ntruncation_vectors = []\n")
    hinge = HINGE.replace('"job.root"', '"job.root"\nstart = { rate = 3.0 }').replace("0.01", "0.2\nrtol = 1e-7")
    (tmp_path / "job.toml").write_text(text + hinge)
    ends = {}
    for option in ("", "--reference", "--no-geometric-stiffness"):
        target = tmp_path / f"run{option}.h5"
        assert main(["simulate", str(tmp_path / "job.toml"), "-o", str(target), *filter(None, [option])]) == 0
        ends[option] = mp.read_result(target)["job.modal"][-1]
    size = abs(ends[""]).max()
    assert abs(ends["--reference"] - ends[""]).max() < 1e-6 * size  # two integrations of relative tolerance 1e-7
    assert abs(ends["--no-geometric-stiffness"] - ends[""]).max() > 0.1 * size  # (rate / frequency)^2 is 0.6


def test_modes_writes_the_page_beside_the_file(job, body, tmp_path, capsys):
    assert main(["modes", str(job), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert {row["kind"] for row in answer["modes"]} >= {"fixed-interface"}
    assert Path(answer["page"]).read_text().rstrip().endswith("</html>")
    assert main(["modes", str(body), "--output", str(tmp_path / "elsewhere"), "--json"]) == 0
    assert Path(json.loads(capsys.readouterr().out)["page"]) == tmp_path / "elsewhere" / "beam-modes.html"


def test_modes_leaves_the_full_report_as_it_is(job, capsys):
    """The page of `run` has responses, margins and runs, which that of `modes` has not; they had one name."""
    assert main(["run", str(job), "--no-pictures", "--json"]) == 0
    files = [Path(file) for file in json.loads(capsys.readouterr().out)["files"]]
    full = next(file for file in files if file.name == "job.html")
    before = full.read_bytes()
    for file in (job, full.with_suffix(".h5")):
        assert main(["modes", str(file), "--json"]) == 0
        assert Path(json.loads(capsys.readouterr().out)["page"]) == full.with_name("job-modes.html")
    assert full.read_bytes() == before


@pytest.mark.parametrize(
    "arguments",
    [
        [],
        ["simulate", "a.toml", "--dence"],
        ["render", "a.h5", "--mode", "one"],
        ["check", "a.h5", "b.h5"],
        ["run", "a.toml", "--output"],
    ],
)
def test_more_wrong_usage(arguments, capsys):
    code = main(arguments)
    captured = capsys.readouterr()
    if not arguments:  # the command alone shows its help
        assert "Usage" in captured.out + captured.err
        return
    assert code == 2
    assert captured.err.startswith("modalprep: ")
    assert captured.err.count("\n") == 1


@pytest.mark.parametrize("mode", ["-1", "3"])
def test_render_of_a_mode_that_is_not_there(body, tmp_path, capsys, mode):
    assert main(["render", str(body), "-o", str(tmp_path / "m.png"), "--mode", mode]) == 2
    error = capsys.readouterr().err
    assert "modes are 1 to 2" in error
    assert error.count("\n") == 1
    assert not (tmp_path / "m.png").exists()


def test_render_into_an_unknown_format(body, tmp_path, capsys):
    for options in ([], ["--animate"]):
        assert main(["render", str(body), "-o", str(tmp_path / "m.xyz"), *options]) == 2
        error = capsys.readouterr().err
        assert "m.xyz" in error
        assert error.count("\n") == 1


def test_the_program_alone_prints_its_help(capsys):
    assert main([]) == 0
    assert "Commands:" in capsys.readouterr().out


def test_set_replaces_values_of_the_file(job, tmp_path, capsys):
    out = tmp_path / "other"
    material = next(iter(tomllib.loads(job.read_text())["materials"]))
    dense = f"materials.{material}.rho='3100 kg/m^3'"
    given = ["--output", str(out), "--set", dense, "--set", "output.pictures=none", "--quiet"]
    assert main(["run", str(job), *given]) == 0
    assert capsys.readouterr().out == ""
    assert mp.read_body(out / "job" / "job.h5").m == pytest.approx(12.4)  # 12 kg at the file's 3000 kg/m^3
    assert not (job.parent / "output").exists()
    written = tomllib.loads((out / "job" / "job.toml").read_text())
    assert written["materials"][material]["rho"] == "3100 kg/m^3"
    assert (out / "job" / "job.toml").read_text().splitlines()[1] == f"# --set {dense}"


@pytest.mark.parametrize(
    ("setting", "said"),
    [
        ("modes", "--set 'modes' is not KEY=VALUE, such as reduction.modes=20"),
        ("reduction..modes=2", "--set 'reduction..modes=2' is not KEY=VALUE"),
        ("reduction.modes.first=2", "--set: 'reduction.modes.first' passes through 'modes', which is not a table"),
        ("reduction.mode=2", "unknown key 'mode'"),
    ],
)
def test_settings_that_cannot_be(job, setting, said, capsys):
    assert main(["run", str(job), "--set", setting]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1


def test_no_pictures(job, capsys):
    assert main(["run", str(job), "--no-pictures", "--set", "output.pictures=2"]) == 0
    assert not list((job.parent / "output" / "job").glob("*-mode-*.png"))
    assert (job.parent / "output" / "job" / "job.html").is_file()


def test_open_shows_the_page_of_the_report(job, monkeypatch, capsys):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    monkeypatch.setenv("DISPLAY", ":0")
    assert main(["run", str(job), "--no-pictures", "--open"]) == 0
    assert opened == [(job.parent / "output" / "job" / "job.html").as_uri()]


def test_open_is_refused_before_the_work(job, capsys):
    """A file that has neither a body nor a run makes no page."""
    assert main(["run", str(job), "--no-report", "--no-pictures"]) == 0
    system = job.with_name("system.toml")
    body = job.parent / "output" / "job" / "job.h5"
    start = job.read_text().index("[joints")
    text = f'[bodies.job]\nfile = "{body}"\n' + job.read_text()[start:]
    system.write_text(text[: text.index("[simulation]")] + "[analysis]\n")
    capsys.readouterr()
    assert main(["run", str(system), "--open"]) == 2
    assert "makes no report page" in capsys.readouterr().err
    assert not (job.parent / "output" / "system").exists()


def test_schema_describes_a_table_in_words(capsys):
    assert main(["schema", "materials.isotropic"]) == 0
    rows = [line.split() for line in capsys.readouterr().out.splitlines()]
    assert ["rho", "number", "or", "text", "required", "density,", "kg/m^3"] in rows
    assert main(["schema"]) == 0
    assert "isotropic, orthotropic" in capsys.readouterr().out
    assert main(["schema", "joints.revolut"]) == 2
    assert "did you mean 'revolute'?" in capsys.readouterr().err
