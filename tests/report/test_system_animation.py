"""Films of simulated systems: what the pictures show, and what is refused."""

from itertools import pairwise

import numpy as np
import pytest
from PIL import Image, ImageSequence

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.report.pictures import system_animation
from modalprep.report.pictures.system_animation import animate_system, viewpoint

needs_drawing = pytest.mark.usefixtures("drawing")


@pytest.fixture(scope="module")
def swing():
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm")
    system = mp.System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,), gravity=np.array([0, -9.81, 0]))
    return system, mp.simulate(system, t_end=1.0, output_step=0.05)


@needs_drawing
def test_the_arm_falls_in_the_film(swing, tmp_path):
    system, run = swing
    file = animate_system(system, run, tmp_path / "swing.gif", seconds=1.0, frames=5, size=(480, 360))
    with Image.open(file) as film:
        assert film.info["duration"] == 200  # ms
        pictures = [np.array(frame.convert("RGB")) for frame in ImageSequence.Iterator(film)]
    assert len(pictures) == 5
    heights = [_height(picture) for picture in pictures]
    assert all(a < b for a, b in pairwise(heights))  # rows count downwards


def _height(picture):
    """Mean row of the tip's ball; the axes in the corner are left out."""
    r, g, b = (picture[:, 80:, k].astype(int) for k in range(3))
    return np.nonzero((r > g + 40) & (g > b + 30))[0].mean()


def test_mesh_points_move_with_their_interfaces(swing):
    """The tip's mesh point is the tip, to the second order of the deflection that the picture leaves out."""
    system, run = swing
    film = system_animation.SystemScene(system, run, 5)
    tip = np.argmax(system.bodies["arm"].points[:, 0])
    for k in film.rows:
        bend = np.linalg.norm(run["arm.tip.deflection"][k])
        apart = np.linalg.norm(film.points("arm", k)[tip] - run["arm.tip.position"][k])
        assert apart <= bend**2 / 10 + 1e-12  # foreshortening is 0.6 d^2 / L


def test_a_diverging_run_is_shown_while_it_means_something():
    hub = mp.Joint(
        name="hub", type="revolute", parent="ground", child="arm", motion=mp.multibody.TimeFunction("5*t**2")
    )
    system = mp.System(bodies={"arm": uniform_beam(modes=1)}, joints=(hub,)).conventional()
    run = mp.simulate(system, t_end=5.0, output_step=0.05)
    film = system_animation.SystemScene(system, run, 10)
    assert run.status == "diverged"
    assert film.rows[-1] < len(run.time) - 1
    assert film.largest < 2 * 10.0


def test_plane_motions_are_seen_square_with_gravity_down():
    plane = np.random.default_rng(0).uniform(-1, 1, (30, 3)) * [1, 0, 1]
    towards, up = viewpoint(plane, np.array([0, 0, -9.81]))
    assert towards[1] < -0.99  # x to the right
    assert up[2] > 0.99
    towards, up = viewpoint(np.random.default_rng(0).uniform(-1, 1, (30, 3)), np.array([0, -9.81, 0]))
    assert up[1] > 0.8
    assert abs(towards @ up) < 1e-12


def test_what_cannot_be_filmed_is_refused(swing, tmp_path):
    system, run = swing
    other = system.with_(bodies={"leg": system.bodies["arm"]}, joints=(system.joints[0].with_(child="leg"),))
    with pytest.raises(mp.InputError, match=r"a \.gif or an \.mp4"):
        animate_system(system, run, tmp_path / "run.avi")
    with pytest.raises(mp.InputError, match="seconds = 0 must be positive"):
        animate_system(system, run, tmp_path / "run.gif", seconds=0.0)
    with pytest.raises(mp.InputError, match="no motion of body 'leg'"):
        animate_system(other, run, tmp_path / "run.gif")
    assert not list(tmp_path.iterdir())
