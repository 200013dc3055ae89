"""``[inverse_kinematics]``: start values by targets, printed, and what cannot be met."""

import numpy as np
import pytest

from modalprep.cli import main
from modalprep.formats.resultfile import read_result

SLIDER_CRANK = """
[bodies.crank]
mass = 1.0
centre = [0.5, 0, 0]
inertia = [0.1, 0.1, 0.1]
interfaces = { root = [0, 0, 0], tip = [1, 0, 0] }
[bodies.rod]
mass = 1.0
centre = [1.5, 0, 0]
inertia = [0.1, 0.1, 0.1]
interfaces = { root = [0, 0, 0], tip = [3, 0, 0] }
[joints.a]
type = "revolute"
child = "crank.root"
start = { angle = "57 deg" }
[joints.b]
type = "revolute"
parent = "crank.tip"
child = "rod.root"
start = { angle = -1.3 }
[closures.slot]
type = "point_on_line"
a = "ground"
b = "rod.tip"
axis = [1, 0, 0]
[simulation]
t_end = 0.1
[inverse_kinematics]
"""


@pytest.fixture
def simulate(tmp_path, capsys):
    def simulate(keys):
        (tmp_path / "job.toml").write_text(SLIDER_CRANK + keys)
        code = main(["simulate", str(tmp_path / "job.toml"), "--no-report"])
        run = None if code else read_result(tmp_path / "output/job/job-run.h5")
        return code, run, capsys.readouterr()

    return simulate


@pytest.mark.parametrize("position", ['{ x = "3200 mm" }', "[3.2, 0, 0]"])
def test_a_run_starts_where_its_target_is(simulate, position):
    """The law of cosines."""
    keys = f'targets."rod.tip" = {{ position = {position}, velocity = {{ x = -0.7 }}, weight = 2.0 }}'
    _, run, said = simulate(keys)
    assert run["a.angle"][0] == pytest.approx(np.arccos((1 + 3.2**2 - 9) / 6.4), abs=1e-10)
    assert run["rod.tip.velocity"][0] == pytest.approx([-0.7, 0, 0], abs=1e-9)
    assert "a      1.21323" in said.out
    assert "rod.tip.position is met to" in said.out


def test_given_joints_leave_nothing_open(simulate):
    _, run, said = simulate('given = ["a"]')
    assert run["a.angle"][0] == pytest.approx(np.radians(57))
    assert "open:" not in said.out
    assert "open: 1 motions of a, b" in simulate("weights = { a = 2.0 }")[2].out


@pytest.mark.parametrize(
    ("keys", "code", "says"),
    [
        ('targets."rod.tip" = { position = { x = 5.2 } }', 1, "stays 1.2 m away"),
        ('targets."rod.tip" = { position = [1.0, 2.0] }', 2, "position"),
        ('targets."rod.end" = { position = [1.0, 2.0, 0.0] }', 2, "'rod.end' names no interface"),
        ('targets."rod.tip" = { weight = 2.0 }', 2, "at least one of"),
        ('given = ["c"]', 2, "'c' does not exist"),
        ('given = ["a"]\nfree = ["b"]', 2, "exclude each other"),
    ],
)
def test_what_cannot_be_met_has_one_sentence(simulate, keys, code, says):
    found, _, said = simulate(keys)
    assert found == code
    assert says in said.err
    assert said.err.count("\n") == 1


def test_the_nearest_place_is_taken_where_it_is_meant(simulate):
    _, run, said = simulate('nearest = true\ntargets."rod.tip" = { position = { x = 5.0 } }')
    assert run["rod.tip.position"][0, 0] == pytest.approx(4.0, abs=1e-6)
    assert "rod.tip.position is met to 1.0e+00" in said.out
