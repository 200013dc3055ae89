"""Records that draw themselves."""

import matplotlib
import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, uniform_beam
from modalprep.multibody.results.result import Result

matplotlib.use("agg")


@pytest.fixture(autouse=True)
def figures():
    """Close the figures of each test: pyplot warns of more than twenty."""
    yield
    from matplotlib import pyplot

    pyplot.close("all")


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


def test_ensembles_show_their_percentiles():
    values = np.arange(12.0).reshape(3, 4)
    cases = {"cases": {"a": np.ones(3)}, "time": np.arange(4.0), "channels": {"x": values}, "status": ("done",) * 3}
    some = mp.ensemble.Ensemble(**cases, message=("",) * 3, end=np.full(3, 3.0), energy_error=np.zeros(3))
    axes = some.plot("x")
    np.testing.assert_array_equal(axes.lines[0].get_ydata(), values[1])
    with pytest.raises(mp.InputError, match="no channel 'y'"):
        some.plot("y")


def test_responses_have_axes_for_each_unit(arm):
    found = mp.response.harmonic_response(arm, {"base.y": 1.0}, np.geomspace(0.1, 10, 30), damping=0.02)
    force, tip = found.plot("base.force.y", "tip.acceleration")
    np.testing.assert_array_equal(force.lines[0].get_ydata(), np.abs(found["base.force.y"]))
    assert [line.get_label() for line in tip.lines] == [f"tip.acceleration.{axis}" for axis in "xyz"]
    assert found.plot()[0].get_ylabel() == "base.force.y"  # a curve alone
    assert found.plot("tip.acceleration.x")[0].lines[0].get_ydata().max() < 1e-9  # nothing drives it
    with pytest.raises(mp.InputError, match=r"no curve 'tip.accelerat'"):
        found.plot("tip.accelerat")


def test_spectra_of_a_channel():
    time = np.arange(2000) / 1000
    history = np.stack([np.sin(60 * time), np.cos(90 * time), time], axis=1) * np.exp(-3 * time)[:, None]
    shock = mp.response.shock_spectrum(time, history, np.geomspace(5, 50, 8))
    axes = shock.plot(label="tip", unit="m/s²")
    assert [line.get_label() for line in axes.lines] == ["tip.x", "tip.y", "tip.z"]
    np.testing.assert_allclose(axes.lines[1].get_ydata(), shock.maximax[:, 1] / 9.80665, rtol=1e-12)  # in g
    power = mp.response.power_spectrum(time, history[:, 0])
    line = power.plot(label="tip", unit="N").lines[0]
    np.testing.assert_array_equal(line.get_ydata(), power.density[1:])  # a logarithmic axis has no 0 Hz


def test_diagrams_of_linear_equations():
    """An oscillator of 1 Hz with 1 % of damping, force to displacement: peak 1 / (2 zeta w^2), -90 degrees there."""
    w, zeta = 2 * np.pi, 0.01
    plant = mp.multibody.LinearSystem(
        A=np.array([[0, 1.0], [-(w**2), -2 * zeta * w]]), B=np.array([[0], [1.0]]), C=np.eye(2), D=np.zeros((2, 1)),
        states=("x", "v"), inputs=("f",), outputs=("x", "v"),
    )  # fmt: skip
    amplitude, phase = plant.plot(output="x")
    frequency, size = amplitude.lines[0].get_data()
    assert size.max() == pytest.approx(1 / (2 * zeta * w**2), rel=zeta**2)
    assert phase.lines[0].get_ydata()[size.argmax()] == pytest.approx(-90, abs=1)
    assert frequency[size.argmax()] == pytest.approx(1, rel=zeta**2)
    assert len(plant.plot()[0].lines) == 2
    circle = plant.plot("nyquist", output="v")[0].lines[0]
    centre = np.hypot(circle.get_xdata() - 1 / (4 * zeta * w), circle.get_ydata())
    np.testing.assert_allclose(centre, 1 / (4 * zeta * w), rtol=1e-9)  # mobility is a circle
    locus = plant.plot("root_locus", output="v", gain=np.linspace(0, 1, 5))[0]
    np.testing.assert_allclose(locus.lines[0].get_xdata(), -zeta * w - np.linspace(0, 0.5, 5), rtol=1e-9)
    with pytest.raises(mp.InputError, match="name one of each"):
        plant.plot("root_locus")
    with pytest.raises(mp.InputError, match="no output 'y'"):
        plant.plot(output="y")


def test_axes_have_units():
    run = Result(time=np.arange(3.0), channels={"a.angle": np.ones(3), "b.angle": np.ones(3), "c.tension": np.ones(3)},
                 status="done", message="")  # fmt: skip
    assert run.plot("a.angle", "b.angle").get_ylabel() == "a.angle, b.angle (rad)"
    assert run.plot("a.angle", "c.tension").get_ylabel() == "a.angle (rad), c.tension (N)"
