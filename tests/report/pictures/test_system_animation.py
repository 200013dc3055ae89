"""Films of simulated systems: what the pictures show, and what is refused."""

from itertools import pairwise

import numpy as np
import pytest
from PIL import Image, ImageSequence

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.multibody.model.loads import AxialSpring
from modalprep.report.pictures.system_animation import animate_system, render_motion
from modalprep.report.scene.camera import viewpoint
from modalprep.report.scene.style import FilmStyle, lines_between
from modalprep.report.scene.system import SystemScene
from modalprep.report.tables import prefixed

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
    film = SystemScene(system, run, 5, FilmStyle())
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
    film = SystemScene(system, run, 10, FilmStyle())
    assert run.status == "diverged"
    assert film.rows[-1] < len(run.time) - 1
    assert film.largest < 2 * 10.0 * film.factor


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
    with pytest.raises(mp.InputError, match=r"a \.gif, a \.webp or an \.mp4"):
        animate_system(system, run, tmp_path / "run.avi")
    with pytest.raises(mp.InputError, match="seconds = 0 must be positive"):
        animate_system(system, run, tmp_path / "run.gif", seconds=0.0)
    with pytest.raises(mp.InputError, match="no motion of body 'leg'"):
        animate_system(other, run, tmp_path / "run.gif")
    for style, words in (
        ({"follow": "leg"}, "follow = 'leg' is no body"),
        ({"boxes": ["leg"]}, "boxes: 'leg' is no body"),
        ({"boxes": ["arm"]}, "body 'arm' is flexible and has no box"),
        ({"trails": ["arm.tap"]}, "trail 'arm.tap' is no interface of a body; did you mean 'arm.tip'"),
    ):
        with pytest.raises(mp.InputError, match=words):
            animate_system(system, run, tmp_path / "run.gif", style=FilmStyle(**style))
    with pytest.raises(mp.InputError, match="exaggeration = -1 must be a positive number"):
        FilmStyle(exaggeration=-1.0)
    with pytest.raises(mp.InputError, match="positions = 0"):
        render_motion(system, run, tmp_path / "run.png", positions=0)
    assert not list(tmp_path.iterdir())


def test_exaggeration_scales_deflections_about_the_rigid_motion(swing):
    system, run = swing
    plain, more = (SystemScene(system, run, 5, FilmStyle(exaggeration=x)) for x in (1.0, 3.0))
    rigid, k = SystemScene(system, run, 5, FilmStyle(exaggeration=1e-12)), plain.rows[2]
    for places in ("points", "interfaces"):
        at = [getattr(scene, places)("arm", k) for scene in (rigid, plain, more)]
        assert at[2] - at[0] == pytest.approx(3 * (at[1] - at[0]), rel=1e-9, abs=1e-12)  # round-off of 10 m
    assert np.abs(at[1] - at[0]).max() > 1e-3


def test_joints_stay_together_in_exaggerated_motion():
    """The root of the second beam is the tip of the first, whatever the factor."""
    beam = uniform_beam(modes=2)
    joints = (
        mp.Joint(name="wall", type="weld", parent="ground", child="first"),
        mp.Joint(name="hinge", type="revolute", parent="first.tip", child="second", axis=np.array([0, 0, 1.0])),
    )
    system = mp.System(bodies={"first": beam, "second": beam}, joints=joints, gravity=np.array([0, -9.81, 0]))
    run = mp.simulate(system, t_end=0.1, output_step=0.05)
    scene = SystemScene(system, run, 3, FilmStyle(exaggeration=20.0))
    for k in scene.rows:
        places = [scene.interfaces(name, k) for name in ("first", "second")]
        assert places[1][0] == pytest.approx(places[0][1], rel=1e-12, abs=1e-12)
    assert np.abs(places[0][1] - run["first.tip.position"][k]).max() > 1e-3


@needs_drawing
def test_a_followed_body_stays_in_the_picture(tmp_path):
    """A free body that flies along x for ten lengths: followed it stays where it is."""
    fly = mp.Joint(name="fly", type="free", parent="ground", child="arm", velocity=np.array([100.0, 0, 0]))
    system = mp.System(bodies={"arm": uniform_beam(modes=1)}, joints=(fly,))
    run = mp.simulate(system, t_end=1.0, output_step=0.5)
    size = {"frames": 3, "size": (320, 240)}
    places = {}
    for follow in ("", "arm"):
        file = animate_system(system, run, tmp_path / f"fly{follow}.gif", style=FilmStyle(follow=follow), **size)
        with Image.open(file) as film:
            places[follow] = [_column(np.array(f.convert("RGB"))) for f in ImageSequence.Iterator(film)]
    assert np.ptp(places["arm"]) < 2  # pixels
    assert np.ptp(places[""]) > 100


def _column(picture):
    r, g, b = (picture[:180, :, k].astype(int) for k in range(3))
    return np.nonzero((r > g + 40) & (g > b + 30))[1].mean()


def test_units_take_the_prefix_that_makes_numbers_readable():
    for unit, largest, found in (
        ("Pa", 3.1e7, (1e-6, "MPa")), ("m", 4e-5, (1e6, "um")), ("N m", 999.0, (1.0, "N m")),
        ("m", 1e-3, (1e3, "mm")), ("N", 1e3, (1e-3, "kN")), ("kg", 1e6, (1.0, "kg")), ("m", 1e-15, (1e9, "nm")),
    ):  # fmt: skip
        factor, name = prefixed(unit, largest)
        assert (pytest.approx(factor, rel=1e-12), name) == found


BOOM = """
[deployments.boom]
length = 2.0
segments = 4
mass_per_length = 1.0
EI = 100.0
deployed_length = "0.6 + t"

[simulation]
t_end = 1.0
"""


@needs_drawing
def test_the_command_draws_a_finished_run(tmp_path, capsys):
    (tmp_path / "boom.toml").write_text(BOOM)
    file, out = str(tmp_path / "boom.toml"), ["--output", str(tmp_path)]
    assert main(["film", file, *out]) == 2
    assert "boom-run.h5 does not exist" in capsys.readouterr().err
    assert main(["simulate", file, *out, "--quiet"]) == 0
    few = ["--set", "film.frames=3", "--set", "film.size=[320, 240]"]
    film, picture = tmp_path / "film.webp", tmp_path / "picture.png"
    assert main(["film", file, *out, *few, "-o", str(film)]) == 0
    assert main(["film", file, *out, *few, "-o", str(picture), "--positions", "2"]) == 0
    with Image.open(film) as moving:
        balls = [_orange(np.array(f.convert("RGB"))) for f in ImageSequence.Iterator(moving)]
    assert len(balls) == 3
    assert balls[-1] > 1.2 * balls[0]  # more rods of the boom are out
    with Image.open(picture) as still:
        assert still.size == (320, 240)
    strip = ["--strip", "--positions", "2"]
    assert main(["film", file, *out, *few, "-o", str(picture), *strip]) == 0
    with Image.open(picture) as still:
        assert still.size == (2 * 320 + 2, 240)  # with a line of two pixels
    assert main(["film", file, *out, *few, "-o", str(film), *strip]) == 2
    assert "--strip draws a picture" in capsys.readouterr().err


def _orange(picture):
    r, g, b = (picture[:180, :, k].astype(int) for k in range(3))
    return ((r > g + 40) & (g > b + 30)).sum()


def test_springs_and_slides_are_lines_between_their_ends():
    """The ends are those of the run: of the slide its place on the ground and its body, of the spring both bodies."""
    inertia, root = np.eye(3), {"root": np.zeros(3)}
    block = rigid_body("block", mass=1.0, centre=np.zeros(3), inertia=inertia, interfaces=root)
    joints = (
        mp.Joint(name="slide", type="prismatic", parent="ground", child="a", position=np.array([0, 0, 1.0])),
        mp.Joint(name="hinge", type="revolute", parent="ground", child="b.root"),
    )
    spring = AxialSpring(name="strap", between=("a.root", "b.root"), stiffness=1.0)
    system = mp.System(bodies={"a": block, "b": block}, joints=joints, loads=(spring,))
    places = {"a.root.position": np.arange(6.0).reshape(2, 3), "b.root.position": np.ones((2, 3))}
    found = dict(lines_between(system, mp.Result(time=np.arange(2.0), channels=places, status="done", message="")))
    assert list(found) == ["slide", "strap"]
    np.testing.assert_array_equal(found["slide"][0], [[0, 0, 1]] * 2)
    for name, end in (("slide", 1), ("strap", 0)):
        np.testing.assert_array_equal(found[name][end], places["a.root.position"])
    np.testing.assert_array_equal(found["strap"][1], places["b.root.position"])
