"""[synthesis] of a pipeline file: a cut beam is the uncut one; projected bodies, damping, bad input."""

import json
import re
import shutil
import tomllib

import matplotlib.image
import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import beam_mesh, spinup_section
from modalprep.pipeline.schema.pipeline import Pipeline
from modalprep.reduction.damping import system_damping
from modalprep.reduction.recoveries.shares import Share
from modalprep.reduction.selection import VALUES, select
from modalprep.reduction.synthesis import synthesise
from modalprep.report.synthesis import draw_modes

FRAME = """
[bodies.a]
file = "beam.h5"
[bodies.b]
file = "beam.h5"
[welds.knee]
between = ["a.tip", "b.root"]
[welds.wall]
between = ["ground", "a.root"]
[synthesis]
modes = 6
[output]
pictures = "none"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A modal file of a beam of 10 m with both ends fixed."""
    ends = {n: mp.Interface(group=n, kind="node") for n in ("root", "tip")}
    model = mp.assemble(beam_mesh(20), {"beam": spinup_section()}, ends)
    place = tmp_path_factory.mktemp("synthesis")
    mp.write_body(mp.flexible_body(model, mp.craig_bampton(model, modes=8), name="beam"), place / "beam.h5")
    return place


@pytest.fixture
def run(folder, capsys):
    def runner(text, name="job"):
        (folder / f"{name}.toml").write_text(text)
        code = main(["run", str(folder / f"{name}.toml"), "--json"])
        captured = capsys.readouterr()
        return code, json.loads(captured.out) if code == 0 else captured.err

    return runner


@pytest.fixture(scope="module")
def shipped(project, tmp_path_factory):
    """What the two shipped pipelines write."""
    place = tmp_path_factory.mktemp("shipped")
    for name in ("half-beam", "two-beams"):
        shutil.copy(project / "pipelines" / f"{name}.toml", place)
        text = (place / f"{name}.toml").read_text()
        (place / f"{name}.toml").write_text(
            text.replace("../meshes", str(project / "meshes")).replace("pictures = 4", "pictures = 0")
        )
    assert main(["run", str(place / "two-beams.toml")]) == 0
    return place / "output" / "two-beams"


def test_two_beams_are_the_uncut_beam(shipped):
    """20 m, 80 elements, clamped: the components' 12 modes leave 1e-6; of the closed form, shear and rotation 1e-4."""
    found = json.loads((shipped / "two-beams-synthesis.json").read_text())
    uncut = mp.assemble(
        beam_mesh(80, 20.0), {"beam": spinup_section()}, {"root": mp.Interface(group="root", kind="node")}
    )
    exact = mp.craig_bampton(uncut, modes=10, truncation=()).frequency
    np.testing.assert_allclose(found["frequency_Hz"], exact, rtol=1e-6)
    assert np.all(np.array(found["frequency_Hz"]) > exact * (1 - 1e-9))
    closed = 1.875104**2 / (2 * np.pi * 20.0**2) * np.sqrt(1.4e4 / 1.2)
    assert found["frequency_Hz"][0] == pytest.approx(closed, rel=1e-3)


@pytest.mark.usefixtures("drawing")
def test_pictures_of_the_system_modes(shipped, tmp_path):
    """Two beams in line, drawn as one body: the picture is not empty."""
    inner, outer = (mp.read_body(shipped / f"two-beams-{name}.h5") for name in ("inner", "outer"))
    modes = synthesise({"a": inner, "b": outer}, [("a.tip", "b.root")], ground=["a.root"], modes=4)
    (drawn,) = draw_modes(modes, "pair", tmp_path, 1)
    pixels = matplotlib.image.imread(drawn)[..., :3]
    assert len(np.unique(pixels.reshape(-1, 3), axis=0)) > 100


def test_strain_energy_adds_up_to_one(shipped):
    """In the first mode the moment grows as (1 - x)^2 and the outer half bears 5 %: int of (1 - x)^4 would be 1/32."""
    share = json.loads((shipped / "two-beams-synthesis.json").read_text())["strain_energy"]
    np.testing.assert_allclose(np.array(share["inner"]) + share["outer"], 1.0, rtol=1e-9)
    assert 1 / 32 < share["outer"][0] < 1 / 8


def test_table_and_notes(shipped, capsys, charts):
    assert main(["run", str(shipped.parent.parent / "two-beams.toml")]) == 0
    printed = capsys.readouterr().out
    assert "10 modes of 2 bodies." in printed
    assert "0.15111" in printed
    assert "outer: 15 of 25 coordinates are kept" in printed
    assert (shipped / "two-beams-strain-energy.png").stat().st_size > 5000


def test_projected_body_gives_the_same_system(shipped):
    """The outer beam in the coordinates that ten system modes need: the same ten modes."""
    inner, outer = (mp.read_body(shipped / f"two-beams-{name}.h5") for name in ("inner", "outer"))
    assert outer.n < inner.n
    again = synthesise({"a": inner, "b": outer}, [("a.tip", "b.root")], ground=["a.root"], modes=10)
    found = json.loads((shipped / "two-beams-synthesis.json").read_text())
    np.testing.assert_allclose(again.frequency, found["frequency_Hz"], rtol=1e-9)
    assert [check.name for check in mp.check_body(outer) if not check.passed] == []


def test_component_damping_is_in_the_files(folder, run):
    code, found = run(FRAME.replace("modes = 6", "modes = 6\ndamping = 0.02"), "damped")
    assert code == 0
    bodies = {name: mp.read_body(folder / "output" / "damped" / f"damped-{name}.h5") for name in "ab"}
    modes = synthesise(bodies, [("a.tip", "b.root")], ground=["a.root"], modes=6)
    ratio = np.diag(system_damping(modes)) / (4 * np.pi * modes.frequency)
    np.testing.assert_allclose(found["system"]["damping_ratio"]["achieved"], ratio, rtol=1e-9)
    np.testing.assert_allclose(ratio, 0.02, rtol=0.3)  # one damping per coordinate has to serve all modes
    stiff = FRAME.replace("modes = 6", "modes = 6\ndamping = { beta = 1e-3 }")
    _, found = run(stiff, "rayleigh")
    wanted = 1e-3 * np.pi * modes.frequency
    np.testing.assert_allclose(found["system"]["damping_ratio"]["target"], wanted, rtol=1e-12)


def test_hinge_and_placement(run):
    """A hinge at the wall frees one motion; a free system has six; a body turned by 90 degrees still meets its weld."""
    hinged = FRAME.replace('"a.root"]', '"a.root"]\nfree = ["rz"]')
    assert run(hinged)[1]["system"]["rigid"] == 1
    loose = FRAME.replace('[welds.wall]\nbetween = ["ground", "a.root"]\n', "")
    assert run(loose)[1]["system"]["rigid"] == 6
    knee = FRAME + '[synthesis.placement.b]\nposition = [10, 0, 0]\nrotation = { axis = [0, 0, 1], angle = "90 deg" }\n'
    knee += "[synthesis.placement.a]\n"
    found = run(knee)[1]["system"]
    np.testing.assert_allclose(found["rotation"]["b"], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert found["frequency_Hz"][0] != pytest.approx(run(FRAME)[1]["system"]["frequency_Hz"][0], rel=1e-2)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"b.root"', '"b.rot"'), ["'b.rot'", "did you mean 'root'"]),
        (('"b.root"', '"c.root"'), ["body 'c' does not exist"]),
        (('"b.root"', '"a.tip"'), ["[welds.knee]", "with itself"]),
        (("modes = 6", "modes = 0"), ["[synthesis.modes]"]),
        (("modes = 6", 'project = "c"'), ["[synthesis] project", "'c'", "known are a, b"]),
        (
            ("modes = 6", "[synthesis.placement.a]\nrotation = { axis = [0, 0, 0], angle = 1 }"),
            ["placement.a", "no direction"],
        ),
        (("modes = 6", "[synthesis.placement.b]\nposition = [0, 0, 1]\n[synthesis.placement.a]"), ["m apart"]),
        (("[synthesis]\nmodes = 6", "[simulation]\nt_end = 1"), ["[welds]", "[synthesis]"]),
        (('file = "beam.h5"', 'file = "no.h5"'), ["no.h5"]),
        (('between = ["ground", "a.root"]', 'between = ["ground", "a.root"]\nfree = ["spin"]'), ["[welds.wall.free"]),
    ],
)
def test_bad_synthesis_is_refused(run, change, words):
    assert change[0] in FRAME
    code, error = run(FRAME.replace(*change), "bad")
    assert code == 2
    assert "Traceback" not in error
    for word in words:
        assert word in error


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "[mesh], [simulation], [analysis] or [synthesis]"),
        ('[bodies.a]\nfile = "beam.h5"\n', "'bodies' has no effect without 'simulation' or 'analysis' or 'synthesis'"),
    ],
)
def test_nothing_to_do_is_said(run, text, words):
    code, error = run(text)
    assert code == 2
    assert words in error


def test_pages_show_what_is_shipped(project):
    """The block of loads is valid, the block of synthesis is the shipped file's."""
    docs = project / "docs"
    pages = (docs / "reference" / "choosing-modes.md", docs / "how-to" / "synthesis.md")
    found = [[tomllib.loads(x) for x in re.findall(r"```toml\n(.*?)```", p.read_text(), re.DOTALL)] for p in pages]
    (recovery, loads), (synthesis,) = found
    assert "loads" in loads
    Pipeline.model_validate({"mesh": {"file": "a.msh"}, **recovery})
    Pipeline.model_validate({"mesh": {"file": "a.msh"}, **loads})
    shipped = tomllib.loads((project / "pipelines" / "two-beams.toml").read_text())
    assert synthesis == {key: shipped[key] for key in synthesis}


def test_page_has_every_selection_variable(project):
    text = (project / "docs" / "reference" / "choosing-modes.md").read_text()
    rows = dict(re.findall(r"^\| `(\w+)` \| [^|]+ \| `([^`|]+)` \|$", text, re.MULTILINE))
    assert set(VALUES) <= set(rows)
    six = [np.ones(2)] * 3
    shares = {"struts": [Share(0.5, "struts", "7", "base.x")] * 2}
    for word in VALUES:
        select(rows[word], np.ones(2), np.ones((2, 6)), *six, shares)
        assert word in rows[word]
