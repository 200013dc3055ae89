"""Charts: what the frame holds, what is written beside a curve that leaves it."""

import numpy as np
import pytest
from PIL import Image

import modalprep as mp
from modalprep.report.charts import mass_chart, plots
from modalprep.report.charts.mass_chart import effective_mass_plot

TIME = np.linspace(0, 20, 401)
STEADY = -0.574 * np.exp(-(((TIME - 6.76) / 3) ** 2))
RUNAWAY = np.where(TIME < 12, -0.5 * np.exp(np.minimum(TIME - 5, 12)), np.nan)[:240]


def result(y, status="done", time=TIME):
    return mp.Result(time=time[: len(y)], channels={"tip.y": np.asarray(y)}, status=status, message="")


@pytest.fixture
def drawn(monkeypatch):
    """Return the axes of the figures saved."""
    saved = []
    save = plots.save_figure
    for home in (plots, mass_chart):
        monkeypatch.setattr(
            home, "save_figure", lambda figure, path: saved.append(figure.axes[0]) or save(figure, path)
        )
    return saved


def notes(axes):
    return [child.get_text() for child in axes.texts]


def test_diverging_run_leaves_the_frame_with_a_note(drawn, tmp_path):
    runs = {"with": result(STEADY), "without": result(RUNAWAY, "diverged")}
    plots.history_plot(runs, ["tip.y"], tmp_path / "h.png")
    (axes,) = drawn
    low, high = axes.get_ylim()
    assert -1.0 < low < -0.574 < 0 < high < 0.2
    assert axes.get_xlim() == (0, 20)
    (note,) = notes(axes)
    leaves = TIME[np.flatnonzero(low > RUNAWAY)[0]]
    assert note.startswith(f"without diverges:\nleaves the frame at t = {leaves:.1f} s,\nreaches -")


def test_diverging_run_of_several_curves_has_one_note(drawn, tmp_path):
    run = mp.Result(time=TIME[:200], channels={"tip": np.outer(RUNAWAY[:200], [1, 2])}, status="diverged", message="")
    calm = run.with_(channels={"tip": np.outer(STEADY[:200], [1, 2])}, status="done")
    plots.history_plot({"with": calm, "without": run}, ["tip"], tmp_path / "h.png")
    (note,) = notes(drawn[0])
    assert note.startswith("without diverges")


def test_runs_that_stay_have_no_note(drawn, tmp_path):
    plots.history_plot({"a": result(STEADY), "b": result(2 * STEADY)}, ["tip.y"], tmp_path / "h.png")
    assert notes(drawn[0]) == []
    assert drawn[0].get_ylim()[0] < -2 * 0.57


def test_all_diverged_and_not_finite_is_still_a_picture(drawn, tmp_path):
    y = np.exp(TIME)
    y[-3:] = [np.inf, np.nan, np.nan]
    plots.history_plot({"only": result(y, "diverged")}, ["tip.y"], tmp_path / "h.png")
    assert drawn[0].get_ylim()[1] < np.exp(11)
    assert "diverges" in notes(drawn[0])[0]


def test_reference_and_given_limits(drawn, tmp_path):
    reference = [{"label": "known", "t": [1.0], "y": [3.0]}]
    plots.history_plot({"a": result(STEADY)}, ["tip.y"], tmp_path / "h.png", reference=reference)
    assert drawn[0].get_ylim()[1] > 3.0
    plots.history_plot({"a": result(STEADY)}, ["tip.y"], tmp_path / "h.png", ylim=(-2, 5), title="t", ylabel="m")
    assert drawn[1].get_ylim() == (-2, 5)
    assert drawn[1].get_ylabel() == "m"


def test_channel_of_several_columns_is_several_curves(drawn, tmp_path):
    run = mp.Result(time=TIME, channels={"tip": np.outer(STEADY, [1, 2, 3])}, status="done", message="")
    plots.history_plot({"a": run, "b": run}, ["tip"], tmp_path / "h.png")
    labels = drawn[0].get_legend_handles_labels()[1]
    assert labels == ["tip.x, a", "tip.y, a", "tip.z, a", "tip.x, b", "tip.y, b", "tip.z, b"]


def test_round_off_is_drawn_as_a_constant(drawn, tmp_path):
    plots.history_plot({"a": result(1 + 1e-15 * np.sin(TIME))}, ["tip.y"], tmp_path / "h.png")
    low, high = drawn[0].get_ylim()
    assert high - low > 0.05


def test_bad_requests_are_one_message(tmp_path):
    with pytest.raises(mp.InputError, match="no channel 'tip.w'"):
        plots.history_plot({"a": result(STEADY)}, ["tip.w"], tmp_path / "h.png")
    with pytest.raises(mp.InputError, match="at least one run"):
        plots.history_plot({}, ["tip.y"], tmp_path / "h.png")
    assert list(tmp_path.iterdir()) == []


def test_bars_add_up_to_the_kept_mass(block, drawn, tmp_path):
    file = effective_mass_plot(block.modes, tmp_path / "m.png")
    width = sum(bar.get_width() for bar in drawn[0].patches if abs(bar.get_y() + bar.get_height() / 2 - 1) < 0.1)
    kept = block.modes.kept
    np.testing.assert_allclose(width, 100 * np.nansum(block.modes.fraction[kept, 1]), rtol=1e-12)
    with Image.open(file) as image:
        assert image.size[0] >= 1600


def test_key_of_the_bars_names_rows_and_frequencies(cantilever, drawn, tmp_path):
    """Every vector of 4 % or more is in the key with its frequency, all others together in one grey piece."""
    effective_mass_plot(cantilever.modes, tmp_path / "m.png")
    share = 100 * np.nan_to_num(cantilever.modes.fraction).max(axis=1) * cantilever.modes.kept
    key = [text.get_text() for text in drawn[0].get_legend().get_texts()]
    named = [text for text in key if text.startswith("row ")]
    assert [int(text.split()[1].rstrip(":")) - 1 for text in named] == list(np.flatnonzero(share >= 4))
    assert all(text.endswith("Hz") for text in named)
    assert len(key) - len(named) == bool(((share > 0) & (share < 4)).any())


def test_body_without_inertia_in_a_direction_is_reported(cantilever, drawn, tmp_path):
    total = np.where(np.arange(6) == 3, 0, cantilever.modes.total)
    effective_mass_plot(cantilever.modes.with_(total=total), tmp_path / "m.png")
    assert "no inertia" in notes(drawn[0])


def test_failed_write_leaves_nothing(monkeypatch, cantilever, tmp_path):
    def half(image, file, **_):
        file.write_bytes(b"half a picture")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Image.Image, "save", half)
    with pytest.raises(mp.InputError, match="No space left"):
        effective_mass_plot(cantilever.modes, tmp_path / "m.png")
    assert list(tmp_path.iterdir()) == []


def test_error_plot_takes_the_axes_its_curves_need(tmp_path, monkeypatch):
    scales = []
    monkeypatch.setattr(plots, "save_figure", lambda figure, path: scales.extend([figure.axes[0].get_xscale(),
                                                                           figure.axes[0].get_yscale()]))  # fmt: skip
    plots.error_plot({"a": ([1, 2, 3], [1e-8, 1e-3, np.nan]), "b": ([1, 3], [1e-5, 1e-2])}, tmp_path / "e.png")
    plots.error_plot({"a": ([1, 1000], [-1, 1])}, tmp_path / "e.png")
    assert scales == ["linear", "log", "log", "linear"]


@pytest.mark.parametrize(("curves", "words"), [
    ({}, "there is no error curve"),
    ({"a": ([], [])}, "'a' needs as many x as y"),
    ({"a": ([1], [1]), "b": ([1, 2], [1])}, "'b' needs as many x as y"),
])  # fmt: skip
def test_error_curves_that_are_none_are_refused(curves, words, tmp_path):
    with pytest.raises(mp.InputError, match=words):
        plots.error_plot(curves, tmp_path / "e.png")
    assert list(tmp_path.iterdir()) == []
