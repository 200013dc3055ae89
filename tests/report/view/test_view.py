"""The pages of `modalprep view` in a real browser: a mode is picked, a run is scrubbed, and the picture changes."""

import base64

import numpy as np
import pytest
from report.browser import needs_browser, run_page, run_viewer
from report.test_browser import VIEW

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import beam_mesh, uniform_beam
from modalprep.report import view_body, view_mesh, view_run
from modalprep.report.scene.style import FilmStyle
from modalprep.report.scene.system import SystemScene
from modalprep.report.viewer.run import run_data
from modalprep.report.viewer.still import FULL

LOOK = VIEW.split("if (out.state")[0]
FITS = """
out.wide = document.documentElement.scrollWidth - document.documentElement.clientWidth;
out.cut = [...document.querySelectorAll("label, button, p, h1")].filter(e => e.scrollWidth > e.clientWidth + 1
  && e.clientWidth > 0).map(e => e.textContent.slice(0, 40));
out.unnamed = [...document.querySelectorAll("input, select, button")]
  .filter(e => !(e.labels?.length || e.textContent)).length;
"""


@pytest.fixture(scope="module")
def swing():
    """A hinged beam of two modes that falls beside a rigid disc, by a run that is made up."""
    arm, disc = uniform_beam(modes=2, elements=6), rigid()
    joints = [mp.Joint(name=name, type="revolute", parent="ground", child=name) for name in ("arm", "disc")]
    system = mp.System(bodies={"arm": arm, "disc": disc}, joints=tuple(joints))
    time = np.linspace(0, 2, 41)
    turns = {"arm": 0.4 * time, "disc": 3 * time}
    channels = {"arm.modal": np.stack([0.3 * np.sin(3 * time), 0.1 * np.cos(4 * time)], axis=1)}
    for name, angle in turns.items():
        turn = np.stack([np.cos(angle / 2), 0 * angle, 0 * angle, np.sin(angle / 2)], axis=1)
        place = np.array([0.0, 2.0, 0]) * (name == "disc")
        channels |= {f"{name}.origin": np.tile(place, (len(time), 1)), f"{name}.orientation": turn}
        for i, at in zip(system.bodies[name].interface_name, system.bodies[name].interface_position, strict=True):
            spun = np.stack([np.cos(angle) * at[0], np.sin(angle) * at[0], 0 * angle], axis=1)
            channels[f"{name}.{i}.position"] = place + spun
            channels[f"{name}.{i}.deflection"] = np.zeros((len(time), 3))
    return system, mp.Result(time=time, channels=channels, status="done", message="reached t = 2 s", notes=("a note",))


def rigid():
    places = {"hub": np.zeros(3), "rim": np.array([0.5, 0, 0])}
    return mp.rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces=places)


def seen(page, folder, probe):
    """What a probe of the page found."""
    ready = "await wait(100); out.ink = look().ink;"
    out = run_viewer(page, folder, LOOK + f"if (out.state === 'drawn') {{ {ready} {probe} }}")
    if out["state"] == "no-webgl":
        pytest.skip("this chromium has no WebGL 2")
    assert out["faults"] == []
    return out


@needs_browser
def test_a_body_shows_the_mode_that_is_picked(tmp_path):
    page = view_body(uniform_beam(modes=3), tmp_path / "beam.html")
    probe = """const first = look(); set("mode", 1, "change"); out.other = look().sum !== first.sum;
      set("mode", 0, "change"); out.same = look().sum === first.sum; set("amplitude", 0, "input");
      out.still = look().sum !== first.sum; set("amplitude", 100, "input"); out.seen = first;
      canvas.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowLeft" })); out.turned = look().sum !== first.sum;
      document.querySelector("a[href='#mode-3']").click(); await wait(50); out.shown = part("mode").value;"""
    out = seen(page, tmp_path, probe)
    assert (out["other"], out["same"], out["still"], out["turned"], out["shown"]) == (True, True, True, True, "2")
    assert out["seen"]["yellow"] > 50


@needs_browser
def test_a_run_is_scrubbed_played_and_followed(swing, tmp_path):
    """The slider changes the picture and the time beside it; playing moves the slider; the sizes are on the bar."""
    page = view_run(*swing, tmp_path / "run.html")
    probe = """const first = look(), at = k => (set("time", k, "input"), look());
      out.bar = box.querySelector(".bar em").textContent; out.notes = document.querySelector(".note").textContent;
      const later = at(20); out.clock = part("clock").textContent; out.moved = later.sum !== first.sum;
      set("factor", 5, "input"); out.larger = look().sum !== later.sum; set("factor", 1, "input");
      out.same = at(0).sum === first.sum;
      set("follow", 1, "change"); set("follow", -1, "change"); out.back = look().sum === first.sum;
      part("names").click();
      out.names = [...box.querySelectorAll(".stage span")].filter(s => !s.hidden).map(s => s.textContent);
      part("play").click(); clock = performance.now(); for (let k = 0; k < 8; k++) nextFrame();
      out.played = Number(part("time").value); part("play").click(); out.seen = first;"""
    out = seen(page, tmp_path, probe)
    assert (out["clock"], out["notes"]) == ("t = 1 s", "a note")
    assert [out[what] for what in ("moved", "larger", "same", "back")] == [True] * 4
    assert out["bar"].startswith("deflection, ")
    assert set(out["names"]) == {"arm.root", "arm.tip", "disc.hub", "disc.rim"}
    assert out["played"] > 0
    assert out["seen"]["ink"] > 1000


@needs_browser
@pytest.mark.parametrize("width", [1400, 400])
@pytest.mark.parametrize("dark", [False, True])
def test_pages_fit_the_screen_and_name_their_controls(swing, tmp_path, width, dark):
    flags = (f"--window-size={width},900", *(("--blink-settings=preferredColorScheme=0",) if dark else ()))
    out = run_page(view_run(*swing, tmp_path / "run.html"), tmp_path, FITS, flags=flags)
    assert out == {"wide": 0, "cut": [], "unnamed": 0, "faults": []}


@needs_browser
def test_a_notebook_shows_a_body_that_is_drawn_in_its_frame(tmp_path):
    """A notebook is executed; what its cell shows, in a page of its own, is alive in a browser."""
    pytest.importorskip("ipykernel")
    nbclient, nbformat = pytest.importorskip("nbclient"), pytest.importorskip("nbformat")
    code = "from modalprep.examples import uniform_beam\nuniform_beam(modes=2).view()"
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(code)])
    nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
    shown = next(out for out in notebook.cells[0].outputs if "data" in out)["data"]["text/html"]  # besides warnings
    page = tmp_path / "notebook.html"
    page.write_text(f"<!doctype html><html><head></head><body>{shown}</body></html>")
    probe = """await wait(300); const inside = document.querySelector("iframe").contentDocument;
      out.state = inside.getElementById("viewer").dataset.state; const mode = inside.querySelector("[name=mode]");
      out.modes = mode?.options.length;"""
    out = run_page(page, tmp_path, probe)
    if out["state"] == "no-webgl":
        pytest.skip("this chromium has no WebGL 2")
    assert out == {"state": "drawn", "modes": 2, "faults": []}


def test_records_give_their_pages(swing, tmp_path):
    system, run = swing
    model = mp.examples.cantilever_model(elements=4)
    pages = {
        'name="time"': system.view(run), "arm.tip": system.view(), "Hz": system.bodies["arm"].view(),
        "4 line": beam_mesh(4).view(), "root": model.view(),
    }  # fmt: skip
    assert all(word in page.html for word, page in pages.items())
    page = pages["root"]
    assert page.save(tmp_path / "model.html").read_text() == page.html
    with pytest.raises(mp.InputError, match=r"the page is an \.html file"):
        page.save(tmp_path / "model.png")


@needs_browser
def test_a_mesh_is_turned(tmp_path):
    probe = """const first = look();
      canvas.dispatchEvent(new PointerEvent("pointermove", { buttons: 1, movementX: 80, movementY: 90 }));
      out.turned = look().sum !== first.sum; out.modes = part("mode");"""
    out = seen(view_mesh(beam_mesh(4), tmp_path / "mesh.html"), tmp_path, probe)
    assert (out["turned"], out["modes"]) == (True, None)


def test_frames_have_the_places_of_the_run(swing):
    """Rest, deflection and pose of the viewer give the places that films draw, to 1e-4 of the size (16 bits)."""
    system, result = swing
    scene, film = run_data(system, result), SystemScene(*swing, 41, FilmStyle())
    poses = decoded(scene["run"]["poses"], "<f4").reshape(41, 2, 7)
    arm = scene["run"]["parts"][0]
    rest, bend = decoded(arm["rest"], "<f4").reshape(-1, 3), decoded(arm["bend"], "<i2").reshape(41, -1, 3)
    for k in (0, 17, 40):
        w, z = poses[k, 0, 3], poses[k, 0, 6]  # about z
        R = np.array([[w * w - z * z, -2 * w * z, 0], [2 * w * z, w * w - z * z, 0], [0, 0, 1]])
        drawn = (rest + arm["full"] / FULL * bend[k]) @ R.T
        exact = film.points("arm", k)
        size = np.ptp(exact, axis=0).max() / np.ptp(drawn, axis=0).max()
        np.testing.assert_allclose(drawn - drawn[0], (exact - exact[0]) / size, atol=1e-4)


def decoded(text, kind):
    return np.frombuffer(base64.b64decode(text), dtype=kind)


def test_the_command_finds_out_what_a_file_is(project, tmp_path, capsys, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open", lambda address: opened.append(address) or True)
    monkeypatch.setenv("DISPLAY", ":0")
    body = mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")
    page = tmp_path / "page.html"
    assert main(["view", str(body), "-o", str(page)]) == 0
    assert opened == [page.as_uri()]
    assert main(["view", str(project / "meshes" / "beam.msh"), "-o", str(page), "--no-open"]) == 0
    assert len(opened) == 1
    monkeypatch.delenv("DISPLAY")
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    assert main(["view", str(body)]) == 0
    assert "no browser was found to open" in capsys.readouterr().out
    assert len(opened) == 1


def test_a_run_is_shown_by_its_pipeline_file(swing, tmp_path, capsys):
    """The file is found above the outputs; elsewhere it is named, and a run of another system is refused."""
    system, result = swing
    for name, body in system.bodies.items():
        mp.write_body(body, tmp_path / f"{name}.h5")
    tables = "".join(
        f'[bodies.{n}]\nfile = "{n}.h5"\n[joints.{n}]\ntype = "revolute"\nchild = "{n}"\n' for n in system.bodies
    )
    (tmp_path / "job.toml").write_text(tables + "[simulation]\nt_end = 2.0\n")
    run = mp.write_result(result, tmp_path / "output" / "job" / "job-run.h5")
    page = tmp_path / "run.html"
    assert main(["view", str(run), "-o", str(page), "--no-open"]) == 0
    assert "arm.tip" in page.read_text()
    (tmp_path / "away").mkdir()
    moved = run.rename(tmp_path / "away" / "other-run.h5")
    capsys.readouterr()
    assert main(["view", str(moved), "-o", str(page), "--no-open"]) == 2
    assert "other.toml is not beside the outputs; name it with --pipeline" in capsys.readouterr().err
    assert main(["view", str(moved), "-o", str(page), "--no-open", "--pipeline", str(tmp_path / "job.toml")]) == 0


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["beam.toml"], "is a pipeline file"),
        (["beam.h5", "-o", "page.png"], "the page is an .html file"),
        (["beam.h5", "--length-unit", "mm"], "--length-unit is of a mesh"),
        (["beam.h5", "--pipeline", "a.toml"], "--pipeline is of a run"),
        (["no.h5"], "no.h5"),
    ],
)
def test_what_cannot_be_shown_is_refused(options, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    mp.write_body(uniform_beam(modes=2), tmp_path / "beam.h5")
    (tmp_path / "beam.toml").write_text("")
    assert main(["view", *options, "--no-open"]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert len(error.splitlines()) == 1
