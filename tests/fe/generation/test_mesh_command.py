"""Files of generated meshes, what generators refuse, and their command line."""

import json
import runpy
import subprocess
import sys

import numpy as np
import pytest
from fe.generated import HOLED, STRUCTURE, area, every, needs_gmsh

from modalprep.cli import main
from modalprep.errors import InputError
from modalprep.fe.generation.generate import GENERATORS, make_mesh
from modalprep.fe.readers import gmsh_session
from modalprep.fe.readers.read import read_mesh

# --- files ----------------------------------------------------------------------------------------------------------


@needs_gmsh
@every([(name, {}) for name in GENERATORS] + [("plate", HOLED)])
def test_same_input_same_bytes(tmp_path, case):
    """Also after other meshes were made in this process."""
    first = make_mesh(case[0], tmp_path / "a.msh", **case[1])
    make_mesh("box", tmp_path / "other.msh", size=0.1)
    again = make_mesh(case[0], tmp_path / "b.msh", **case[1])
    assert first.sha256 == again.sha256


@needs_gmsh
def test_same_bytes_in_another_process(tmp_path):
    here = make_mesh("l-bracket", tmp_path / "here.msh")
    code = f"import modalprep as mp; mp.make_mesh('l-bracket', {str(tmp_path / 'there.msh')!r})"
    subprocess.run([sys.executable, "-c", code], check=True)
    assert read_mesh(tmp_path / "there.msh").sha256 == here.sha256


@needs_gmsh
def test_text_and_numbers_mean_the_same(tmp_path):
    a = make_mesh("box", tmp_path / "a.msh", size=0.1, order=1, element="tetrahedron")
    b = make_mesh("box", tmp_path / "b.msh", size="1e-1", order="1", element="tetrahedron")
    assert a.sha256 == b.sha256


@needs_gmsh
def test_gmsh_is_closed_after_success_and_failure(tmp_path):
    import gmsh

    make_mesh("beam", tmp_path / "a.msh")
    assert not gmsh.isInitialized()
    with pytest.raises(InputError, match="does not fit into a plate"):
        make_mesh("plate", tmp_path / "b.msh", hole=0.5)
    assert not gmsh.isInitialized()
    assert [file.name for file in tmp_path.iterdir()] == ["a.msh"]


@needs_gmsh
def test_a_model_open_in_gmsh_is_left_alone(tmp_path):
    import gmsh

    gmsh.initialize(interruptible=False)
    try:
        gmsh.model.add("mine")
        with pytest.raises(InputError, match=r"gmsh is open in this program.*gmsh.finalize"):
            make_mesh("beam", tmp_path / "a.msh")
        assert gmsh.isInitialized()
        assert gmsh.model.getCurrent() == "mine"
    finally:
        gmsh.finalize()


@needs_gmsh
def test_what_gmsh_refuses_is_one_message(tmp_path, monkeypatch):
    import gmsh

    def fail(dimension):
        raise Exception("no luck today")

    monkeypatch.setattr(gmsh.model.mesh, "generate", fail)
    with pytest.raises(InputError, match="gmsh cannot mesh this beam: no luck today; choose other parameters"):
        make_mesh("beam", tmp_path / "a.msh")
    assert not gmsh.isInitialized()


@needs_gmsh
def test_generate_does_not_touch_its_parameters(tmp_path):
    params = {"length": "2", "elements": 3.0}
    make_mesh("beam", tmp_path / "a.msh", **params)
    assert params == {"length": "2", "elements": 3.0}


# --- bad input ------------------------------------------------------------------------------------------------------

SENTENCES = [
    ("plat", {}, r"unknown shape 'plat'; did you mean 'plate'\? known are beam, plate"),
    ("plate", {"lenght": 2}, r"shape plate has no parameter 'lenght'; did you mean 'length'\? it has length, width"),
    ("plate", {"length": "wide"}, "length = wide is not a number; give one in m"),
    ("plate", {"length": ""}, "length =  is not a number"),
    ("plate", {"length": None}, "length = None is not a number"),
    ("plate", {"length": True}, "length = True is not a number"),
    ("plate", {"length": "nan"}, "length = nan is not a finite number"),
    ("plate", {"length": float("inf")}, "length = inf is not a finite number"),
    ("plate", {"length": 0}, "length = 0 must be positive$"),
    ("plate", {"length": -2}, "length = -2 must be positive$"),
    ("plate", {"hole": -1}, "hole = -1 must be positive or zero$"),
    ("plate", {"length": 1e9}, "length = 1e.09 m is outside 1e-05 to 1e.06; give metres"),
    ("plate", {"length": 1e-9}, "length = 1e-09 m is outside"),
    ("plate", {"length": 1e5, "width": 1e-4}, "width = 0.0001 m is lost beside length = 100000 m"),
    ("plate", {"element": "quads"}, r"element = quads is unknown; did you mean 'quad'\? known are quad, triangle"),
    ("box", {"order": 3}, "order = 3 is unknown; known are 1, 2"),
    ("beam", {"elements": 2.5}, "elements = 2.5 is not a whole number"),
    ("beam", {"elements": 0}, "elements = 0 must be positive"),
]
NEED_GMSH = [
    ("plate", {"hole": 0.46}, "hole = 0.46 m does not fit into a plate of 1 m by 0.5 m; make it smaller than 0.45 m"),
    ("plate", {"size": 1e-5}, "the mesh would have about 5e.09 elements, more than 500000; give a larger size"),
    ("plate", {"size": 1e-5, "hole": 0.1}, "about 5e.09 elements"),
    ("tube", {"size": 1e-5}, "elements, more than 500000; give a larger size"),
    ("blade", {"size": 1e-5}, "elements, more than 500000"),
    ("box", {"size": 1e-5}, "elements, more than 500000"),
    ("box", {"size": 1e-5, "element": "hexahedron"}, "elements, more than 500000"),
    ("l-bracket", {"size": 1e-5}, "elements, more than 500000"),
    ("beam", {"elements": "1e300"}, "elements, more than 500000; choose fewer elements"),
    ("truss-tower", {"bays": 10**9}, "choose fewer bays or elements"),
    ("stiffened-panel", {"stiffeners": 10**7}, "choose fewer stiffeners"),
    ("boom", {"angle": 360}, "angle = 360 deg leaves no slit; make it at most 355, or take shape tube"),
    ("blade", {"twist": -400}, "twist = -400 deg is more than one turn"),
    ("l-bracket", {"hole": 0.037}, "hole = 0.037 m does not fit beside the fillet; make it smaller than 0.036 m"),
    ("l-bracket", {"fillet": 0.06}, "does not fit beside the fillet; make length and height larger"),
]


def refused(folder, name, params, message):
    with pytest.raises(InputError, match=message) as caught:
        make_mesh(name, folder / "a.msh", **params)
    assert "\n" not in str(caught.value)
    assert not list(folder.iterdir())


@pytest.mark.parametrize(("name", "params", "message"), SENTENCES)
def test_bad_parameters(tmp_path, name, params, message):
    refused(tmp_path, name, params, message)


@needs_gmsh
@pytest.mark.parametrize(("name", "params", "message"), NEED_GMSH)
def test_impossible_shapes(tmp_path, name, params, message):
    refused(tmp_path, name, params, message)


@pytest.mark.parametrize("suffix", [".bdf", ".inp", ".vtk", ""])
def test_other_formats_lose_groups(tmp_path, suffix):
    with pytest.raises(InputError, match="generated meshes are .msh files, which keep all groups"):
        make_mesh("beam", tmp_path / f"a{suffix}")


@needs_gmsh
def test_a_path_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot write"):
        make_mesh("beam", tmp_path / "file" / "a.msh")
    (tmp_path / "a.msh").mkdir()
    with pytest.raises(InputError, match="cannot write"):
        make_mesh("beam", tmp_path / "a.msh")


@pytest.mark.parametrize("error", [ImportError("no module"), OSError("libGLU.so.1: cannot open shared object file")])
def test_gmsh_without_its_libraries(tmp_path, monkeypatch, capsys, error):
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "gmsh.py").write_text(f"raise {error!r}")
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    monkeypatch.syspath_prepend(tmp_path / "broken")
    assert main(["mesh", "beam", "-o", str(tmp_path / "a.msh")]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"modalprep: gmsh cannot be imported: {error} (as root: apt-get install libgl1 ")
    assert said.count("\n") == 1
    assert [file.name for file in tmp_path.iterdir()] == ["broken"]


def test_advice_names_the_libraries_that_make_demo_installs(project):
    known = runpy.run_path(str(project / ".ci" / "system-libraries"))["GMSH"]
    assert gmsh_session.ADVICE.split("apt-get install ")[1].split() == list(known)


# --- command line ---------------------------------------------------------------------------------------------------


@needs_gmsh
def test_command(tmp_path, capsys):
    file = tmp_path / "sub" / "out.msh"
    assert main(["mesh", "plate", "--param", "length=2", "-p", "width=0.5", "-p", "size = 0.1", "-o", str(file)]) == 0
    said = capsys.readouterr().out
    assert "out.msh" in said
    assert "126 points: 4 vertex, 50 line, 100 quad" in said
    assert "plate: 100 quad" in said
    assert "root: 5 line" in said
    assert area(read_mesh(file), "plate") == pytest.approx(1.0, rel=1e-12)


@needs_gmsh
def test_command_as_json_in_the_current_folder(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", "truss_tower", "-p", "bays=2", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["file"] == "truss-tower.msh"
    assert answer["groups"]["legs"] == {"line": 8}
    assert read_mesh("truss-tower.msh").groups.keys() == answer["groups"].keys()


@needs_gmsh
def test_dashes_in_parameter_names(tmp_path):
    assert main(["mesh", "blade", "-p", "root-chord=0.5", "-o", str(tmp_path / "a.msh")]) == 0
    assert np.ptp(read_mesh(tmp_path / "a.msh").points[:, 1]) == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "no shape given"),
        (["plat"], "did you mean 'plate'?"),
        (["plate", "-p", "length"], "--param 'length' is not NAME=VALUE, such as length=2"),
        (["plate", "-p", "=2"], "is not NAME=VALUE"),
        (["plate", "-p", "length=1", "-p", "length=2"], "--param length is given twice, as 1 and 2; keep one"),
        (["plate", "-p", "lenght=1"], "did you mean 'length'?"),
        (["plate", "-o", "a.bdf"], "generated meshes are .msh files"),
    ],
)
def test_wrong_command_lines(tmp_path, monkeypatch, capsys, arguments, message):
    monkeypatch.chdir(tmp_path)
    assert main(["mesh", *arguments]) == 2
    said = capsys.readouterr().err
    assert message in said
    assert said.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_list_shows_everything(capsys):
    assert main(["mesh", "--list"]) == 0
    said = capsys.readouterr().out
    for generator in GENERATORS.values():
        assert generator.name in said
        assert all(name in said for name in (*generator.groups, *generator.parameters))
    assert "0.5 m " in said
    assert "300.0 deg" in said
    assert main(["mesh", "--list", "--json"]) == 0
    shapes = json.loads(capsys.readouterr().out)
    assert set(shapes) == set(GENERATORS) == set(STRUCTURE)
    assert shapes["tube"]["parameters"][1]["default"] == 0.1


def test_every_parameter_says_what_it_is():
    for generator in GENERATORS.values():
        assert generator.meaning
        for parameter in generator.parameters.values():
            assert parameter.meaning, f"{generator.name} {parameter.name}"
            assert parameter.read(parameter.default) == parameter.default
            assert parameter.unit in ("m", "deg", "")
