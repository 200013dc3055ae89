"""Records that draw themselves."""

import matplotlib
import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, uniform_beam
from modalprep.multibody.results.result import Result

matplotlib.use("agg")


@pytest.fixture(scope="module")
def arm():
    return uniform_beam(modes=2)


@pytest.fixture(scope="module")
def pendulum(arm):
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.5)
    return mp.System(bodies={"arm": arm}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))


@pytest.fixture
def scenes(monkeypatch, drawing):
    """Let pyvista draw off screen, and return the pictures of what is shown."""
    import pyvista

    shown = []

    def show(plotter):
        shown.append(np.array(plotter.screenshot(return_img=True)))
        plotter.close()

    monkeypatch.setattr(pyvista, "OFF_SCREEN", True)
    monkeypatch.setattr(pyvista.Plotter, "show", show)
    return shown


def test_every_record_shows_a_scene(scenes, arm, pendulum):
    for record in (beam_mesh(4), cantilever_model(elements=4), arm, pendulum):
        record.plot()
    arm.plot(mode=1, colour="energy")
    assert len(scenes) == 5
    assert all(picture.std() > 5 for picture in scenes)  # a white picture has 0


def test_a_system_is_shown_at_the_time_that_is_asked_for(scenes, pendulum):
    run = mp.simulate(pendulum, t_end=0.4, output_step=0.1)
    pendulum.plot()
    pendulum.plot(run, time=0.0)
    pendulum.plot(run)
    first, same, last = (picture.astype(int) for picture in scenes)
    assert np.array_equal(first, same)
    assert np.abs(last - first).max() > 100
    with pytest.raises(mp.InputError, match=r"time = 3 s lies outside the run, from 0 to 0\.4 s"):
        pendulum.plot(run, time=3.0)
    assert pendulum.animate(run, frames=3, size=(240, 180)).data[8:12] == b"WEBP"


def test_a_mode_becomes_a_film_that_a_notebook_plays(drawing, arm, tmp_path):
    film = arm.animate(1, kind="gif", frames=2)
    assert film._repr_html_().startswith('<img src="data:image/gif;base64,R0lGOD')
    assert film.save(tmp_path / "mode.gif").read_bytes() == film.data
    with pytest.raises(mp.InputError, match=r"this film is a \.gif"):
        film.save(tmp_path / "mode.mp4")
    with pytest.raises(mp.InputError, match=r"animate: kind 'mp4' does not exist"):
        arm.animate(1, kind="mp4")


def test_without_a_display_the_message_names_the_functions_that_write_files(monkeypatch, arm):
    import pyvista

    monkeypatch.setattr(pyvista, "OFF_SCREEN", False)
    monkeypatch.setattr("sys.modules", {k: v for k, v in __import__("sys").modules.items() if k != "ipykernel"})
    monkeypatch.setattr("sys.platform", "linux")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(mp.RenderError, match="no display for a window; write a file by modalprep.report.render_mode"):
        arm.plot()


def test_charts_have_the_values_of_the_records(arm):
    run = Result(time=np.arange(3.0), channels={"a.position": np.eye(3)}, status="done", message="")
    axes = run.plot("a.position", ylabel="m")
    assert np.array_equal([line.get_ydata() for line in axes.lines], np.eye(3))
    assert run.plot("a.position.x", axes=axes) is axes
    with pytest.raises(mp.InputError, match="no channel 'a.positon'; did you mean 'a.position'"):
        run.plot("a.positon")
    share = arm.modes.fraction[arm.modes.kept]
    assert sum(bar.get_width() for bar in arm.modes.plot().patches) == pytest.approx(100 * np.nansum(share))


def test_tables_become_labelled_arrays(arm):
    run = Result(time=np.arange(3.0), channels={"a.position": np.eye(3), "b": np.ones(3)}, status="done", message="ok")
    data = run.to_xarray()
    assert float(data["a.position"].sel(time=1.0, axis="y")) == 1.0
    assert (data["b"].dims, data.attrs["message"]) == (("time",), "ok")
    frame = arm.modes.to_dataframe()
    assert list(frame.index) == list(range(1, len(arm.modes.kind) + 1))
    assert frame["fraction.y"].to_numpy() == pytest.approx(arm.modes.fraction[:, 1], nan_ok=True)
