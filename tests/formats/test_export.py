"""Every format by its name: from Python, from the command line, from a pipeline; and the page about the formats."""

import json
import re
from importlib import import_module

import h5py
import numpy as np
import pytest
from bad.good import BEAM

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats.export import EXPORTS, export_body
from modalprep.formats.mbdyn import VERSIONS
from modalprep.formats.modalfile import SHAPES
from modalprep.formats.sid import DIALECTS
from modalprep.pipeline.exporting import SYSTEM_EXPORTS
from modalprep.pipeline.schema.pipeline import Pipeline

FIRST = {  # how a file of each format begins, or what its beginning holds
    "sid": b":No. nodes, No. modes:",
    "mbdyn": b"** RECORD GROUP 1",
    "exudyn": b"PK\x03\x04",
    "op4": b"KAAX",
    "nastran": b"KAAX",
    "dmig": b"DMIG",
    "coupling": b'"participation"',
    "extptfm": b"!Flex 5 Format",
    "simscape": b"MATLAB 5.0 MAT-file",
    "modelica": b"record beam",
    "uff": b"    -1\n",
    "vtu": b"<VTKFile",
}


@pytest.fixture(scope="module")
def body():
    return uniform_beam(modes=3)


@pytest.fixture
def file(body, tmp_path):
    return mp.write_body(body, tmp_path / "beam.h5")


def test_every_format_is_tested():
    assert set(FIRST) == set(EXPORTS)


@pytest.mark.parametrize("name", EXPORTS)
def test_every_name_writes_its_format(name, body, tmp_path):
    target = tmp_path / f"beam{EXPORTS[name].suffix}"
    assert export_body(body, name, target) == target
    assert FIRST[name] in target.read_bytes()[:2000]
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("name", EXPORTS)
def test_command_writes_what_the_function_writes(name, body, file, tmp_path, capsys):
    assert main(["export", str(file), "--to", name, "--json"]) == 0
    default = tmp_path / f"beam{EXPORTS[name].suffix}"
    softens = "geometric stiffness has no place in this format: a fast turning body softens instead of stiffening"
    linear = "all that is not linear has no place in this format: of the geometric stiffness and of P and H, which "
    linear += "large rotations need, a reader can rebuild a part"
    root = "it describes small motions of the root, without geometric stiffness and without other interfaces"
    notes = {"coupling": [root], "extptfm": [root], "exudyn": [softens]}
    notes |= {key: [linear] for key in ("op4", "nastran", "dmig", "simscape")}
    notes = notes.get(name, [])
    assert json.loads(capsys.readouterr().out) == {"files": [str(default)], "notes": notes}
    direct = export_body(body, name, tmp_path / "direct" / default.name)
    chosen = tmp_path / "new" / "folder" / default.name
    assert main(["export", str(file), "--to", name, "-o", str(chosen)]) == 0
    assert f"wrote {chosen}" in capsys.readouterr().out
    assert default.read_bytes() == chosen.read_bytes() == direct.read_bytes()


@pytest.mark.parametrize(("name", "option", "values"), [("sid", "dialect", DIALECTS), ("mbdyn", "version", VERSIONS)])
def test_variants(name, option, values, body, file, tmp_path):
    assert EXPORTS[name].option == option
    written = set()
    for value in values:
        target = tmp_path / value
        assert main(["export", str(file), "--to", name, f"--{option}", value, "-o", str(target)]) == 0
        assert target.read_bytes() == export_body(body, name, tmp_path / value, **{option: value}).read_bytes()
        written.add(target.read_bytes())
    assert len(written) == len(values)


KNOWN = ", ".join(EXPORTS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--to", "adams"], f"format 'adams' does not exist; known are {KNOWN}"),
        (["--to", "sids"], f"format 'sids' does not exist; did you mean 'sid'? known are {KNOWN}"),
        (["--to", "sid", "--dialect", "x"], "SID dialect 'x' does not exist; known are fembs, pysid, embs, fembeam"),
        (["--to", "mbdyn", "--version", "x"], "MBDyn version 'x' does not exist; known are full, classic"),
        (["--to", "vtu", "--dialect", "x"], "format 'vtu' has no dialect; leave --dialect out, it is for sid"),
        (["--to", "sid", "--version", "x"], "format 'sid' has no version; leave --version out, it is for mbdyn"),
    ],
)
def test_wrong_options_get_a_message(options, message, file, tmp_path, capsys):
    assert main(["export", str(file), *options]) == 2
    assert capsys.readouterr().err == f"modalprep: {message}\n"
    assert list(tmp_path.iterdir()) == [file]


def test_missing_file_and_unknown_keyword(body, tmp_path, capsys):
    assert main(["export", str(tmp_path / "no.h5"), "--to", "sid"]) == 2
    assert "no.h5 does not exist" in capsys.readouterr().err
    with pytest.raises(mp.InputError, match="format 'sid' has no colour; leave --colour out, it is for no format"):
        export_body(body, "sid", tmp_path / "a", colour="red")


def test_writers_are_loaded_when_needed():
    """The registry names modules: asking for one format needs the libraries of no other."""
    for export in EXPORTS.values():
        module, function = export.writer.split(".")
        assert callable(getattr(import_module(f"modalprep.formats.{module}"), function))


def test_pipeline_exports(project, tmp_path, capsys):
    text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh"))
    text = text.replace("modes = 3", "modes = 3\ntruncation_vectors = []")
    (tmp_path / "job.toml").write_text(text + 'export = ["sid", "mbdyn"]\n')
    assert main(["run", str(tmp_path / "job.toml"), "--json", "--no-report"]) == 0
    folder = tmp_path / "output" / "job"
    body = mp.read_body(folder / "job.h5")
    files = json.loads(capsys.readouterr().out)["files"]
    for name in ("sid", "mbdyn"):
        target = folder / f"job{EXPORTS[name].suffix}"
        assert str(target) in files
        assert target.read_bytes() == export_body(body, name, tmp_path / target.name).read_bytes()


def test_pipeline_refuses_an_unknown_format(project, tmp_path, capsys):
    text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh"))
    (tmp_path / "job.toml").write_text(text + 'export = ["sid", "adams"]\n')
    assert main(["run", str(tmp_path / "job.toml")]) == 2
    error = capsys.readouterr().err
    assert "[output.export.1]" in error
    for name in EXPORTS:
        assert f"'{name}'" in error
    assert not (tmp_path / "output").exists()


def test_schema_lists_the_formats():
    export = Pipeline.model_json_schema()["$defs"]["OutputTable"]["properties"]["export"]
    assert export["items"]["enum"] == list(EXPORTS)


@pytest.fixture(scope="module")
def page(project):
    return (project / "docs" / "reference" / "formats.md").read_text()


def test_page_reads_the_modal_file_with_h5py(page, body, tmp_path, monkeypatch, capsys):
    (block,) = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    assert len(block.splitlines()) <= 10
    mp.write_body(body, tmp_path / "beam.h5")
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "formats.md", "exec"), scope := {})
    assert capsys.readouterr().out == f"beam {body.frequency}\n"
    stiffening = scope["stiffening"]  # of a cantilever spinning about z: both bending planes get stiffer
    assert np.array_equal(stiffening, -body.Kg_W[0, 0] - body.Kg_W[1, 1])
    assert np.linalg.eigvalsh(stiffening).min() > 1.0


def test_page_names_every_dataset(page, file):
    """The table has every dataset of a file and no other, and its shapes are those that are written."""
    table = page.split("## Exchange formats")[0]
    rows = dict(re.findall(r"^\| `([\w/<>]+)` \| ([^|]*?) \|", table, re.MULTILINE))
    with h5py.File(file) as h5:
        written = {name + "/<type>" * isinstance(item, h5py.Group) for name, item in h5.items()}
    assert written <= set(rows)
    texts, parts = {"mode_names", "notes"}, {"energy/<type>", "volume/<type>", "stress/<point>", "recovery/<name>"}
    optional = {"T", "truncation", "stations", "coupled_damping"}  # not in every file
    assert set(rows) - written <= optional | texts | parts
    for name, shape in SHAPES.items():
        wanted = ", ".join(str(x) for x in shape("n", "k")) or "-"
        assert rows[name] == wanted, name


def test_page_names_every_format_and_variant(page):
    assert set(re.findall(r"^\| `--to (\w+)` \|", page, re.MULTILINE)) == {
        *EXPORTS,
        "fmu",
        *SYSTEM_EXPORTS,
    }
    for variant in (*DIALECTS, *VERSIONS):
        assert f"`{variant}`" in page


@pytest.mark.parametrize("to", ["sid", "mbdyn", "exudyn"])
def test_half_full_bodies_are_refused(to, tmp_path):
    """Programs take the modal mass as 1; at another fill level it is not."""
    half = mp.body.with_density_factor(uniform_beam(modes=2), 0.5)
    with pytest.raises(mp.InputError, match="modal mass is not 1"):
        export_body(half, to, tmp_path / "half.npz")
    assert not list(tmp_path.iterdir())


def test_synthesis_of_a_half_full_body():
    """Half the mass everywhere: frequencies times sqrt(2)."""
    full = uniform_beam(modes=3)
    half = mp.reduction.synthesise({"a": mp.body.with_density_factor(full, 0.5)}, ground=["a.root"])
    np.testing.assert_allclose(half.frequency, np.sqrt(2) * full.frequency, rtol=1e-12)
