"""Pairs of modes side by side: what moves how, the page, and the animation."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from report.browser import FRAMES, needs_browser, run_page

import modalprep as mp
from modalprep.cli import main
from modalprep.correlation import body_modes, choose_sensors, correlate, synthetic_test
from modalprep.examples import uniform_beam
from modalprep.formats.uff import write_uff
from modalprep.report.correlation.drawn import draw_pairs
from modalprep.report.correlation.page import write_pairs_page
from modalprep.report.pictures.animation import animate_mode


@pytest.fixture(scope="module")
def beam():
    return uniform_beam(modes=4)


@pytest.fixture(scope="module")
def compared(beam):
    """A test of some components with signs and sizes of its own, and the beam's modes."""
    modes = body_modes(beam)
    test = synthetic_test(modes.select(np.array([1, 0, 3])), choose_sensors(modes, 20), noise=0.01)
    test = test.with_(shape=test.shape * [-7.0, 0.2, 3.0], lines=np.array([[0, 1]]))
    return correlate(test, modes), modes


def test_both_models_of_a_pair_move_alike(beam, compared):
    """The expanded test is the analysis but for the noise: the same sign and size, a shift apart."""
    found, modes = compared
    drawn = draw_pairs(found, modes, beam.cells)
    p = len(modes.points)
    left, right = drawn.shape[:p], drawn.shape[p : 2 * p]
    assert np.abs(right - left).max() < 0.05 * np.abs(left).max()
    shift = drawn.points[p : 2 * p] - drawn.points[:p]
    np.testing.assert_allclose(shift, np.tile(shift[0], (p, 1)), atol=1e-12)
    np.testing.assert_array_equal(left, modes.shape[:, :, found.pairs[:, 1]])
    assert drawn.cells["line"][-1].tolist() == [2 * p, 2 * p + 1]  # the trace line, between sensors


def test_models_do_not_overlap(beam, compared):
    """Seen from any side, the two stand apart by more than both move: a tenth of the size of the whole each."""
    found, modes = compared
    drawn = draw_pairs(found, modes, beam.cells)
    p, size = len(modes.points), np.linalg.norm(np.ptp(drawn.points, axis=0))
    apart = np.linalg.norm(drawn.points[p] - drawn.points[0])
    assert apart > 0.25 * size


def test_sensors_move_as_measured_and_elsewhere_as_the_model(beam, compared):
    found, modes = compared
    drawn = draw_pairs(found, modes, beam.cells)
    measured = found.test.measured
    dots = drawn.phi[2 : 2 + len(measured)]
    model = modes.shape[found.node][:, :, found.pairs[:, 1]]
    np.testing.assert_array_equal(dots[~measured], model[~measured])
    assert 0 < np.abs(dots[measured] - model[measured]).max() < 0.05 * np.abs(model).max()


def test_a_test_that_cannot_be_expanded_is_drawn_by_its_sensors(beam):
    modes = body_modes(beam)
    few = np.zeros(modes.measured.shape, dtype=bool)
    few[[20, 40], 1] = True
    found = correlate(synthetic_test(modes, few), modes, smallest_mac=0.0)
    drawn = draw_pairs(replace(found, pairs=np.array([[0, 0], [1, 1], [2, 2]])), modes, beam.cells)
    assert "cannot be expanded" in drawn.notes[0]
    assert len(drawn.points) == len(modes.points) + 2


def test_page_without_pairs(compared, tmp_path):
    found, _ = compared
    none = replace(found, pairs=np.zeros((0, 2), dtype=int))
    text = write_pairs_page(none, None, tmp_path / "none.html").read_text()
    assert "No modes were paired" in text
    assert 'id="viewer"' not in text


@pytest.fixture(scope="module")
def page(beam, tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    body, test = mp.write_body(beam, folder / "beam.h5"), write_uff(beam, folder / "test.uff")
    assert main(["compare", str(body), str(test), "-o", str(folder / "mac.png"), "--json"]) == 0
    return folder / "mac.html"


def test_page_is_one_file(page):
    text = page.read_text()
    assert not re.findall(r'(?:src|href)="(?!data:|#)', text)
    scene = json.loads(re.search(r'id="scene">(.*?)</script>', text, re.DOTALL)[1])
    assert len(scene["modes"]) == 4
    assert scene["interfaces"][:2] == ["analysis", "test"]
    assert text.count("data-show=") == 4


@needs_browser
def test_a_pair_that_is_picked_moves(page, tmp_path):
    """In the browser: pictures of two pairs, at rest and moving, differ; nothing fails."""
    probe = """
      const canvas = document.querySelector("canvas"), pictures = [];
      const take = () => pictures.push(canvas.toDataURL());
      await wait(200); take();
      document.querySelectorAll("[data-show]")[2].click(); await wait(200); take();
      out.chosen = document.querySelector("[name=mode]").value;
      document.querySelector("[name=play]").click(); nextFrame(); nextFrame(); take();
      out.different = new Set(pictures).size; out.state = document.getElementById("viewer").dataset.state;
      out.wide = document.documentElement.scrollWidth <= window.innerWidth;
    """
    found = run_page(page, tmp_path, probe, before=FRAMES)
    assert found == {"chosen": "2", "different": 3, "state": "drawn", "wide": True, "faults": []}


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--pair", "2"], "--pair is the pair of an animation"),
        (["--animate", "a.avi"], "cannot write a.avi: an animation is a"),
        (["--animate", "FOLDER/a.gif", "--pair", "9"], "--pair 9: there are 4 pairs"),
    ],
)
def test_wrong_animations_are_refused(page, tmp_path, capsys, arguments, said):
    files = [str(page.parent / name) for name in ("beam.h5", "test.uff")]
    given = [text.replace("FOLDER", str(tmp_path)) for text in arguments]
    assert main(["compare", *files, "-o", str(tmp_path / "mac.png"), *given]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.usefixtures("drawing")
def test_animation_of_a_pair(beam, compared, tmp_path):
    from PIL import Image

    found, modes = compared
    drawn = draw_pairs(found, modes, beam.cells)
    film = animate_mode(drawn, 2, tmp_path / "pair.gif", frames=3, size=(160, 120), title=drawn.titles[1])
    with Image.open(film) as image:
        assert image.n_frames == 3
    assert drawn.titles[1].startswith("pair 2: test 2 (")
