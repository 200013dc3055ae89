"""``start`` of ``[simulation]``: words, files of runs and states, and what is refused."""

import numpy as np
import pytest

from modalprep.cli import main
from modalprep.formats.resultfile import read_result, write_result

PENDULUM = """
[bodies.bob]
mass = 2.0
centre = [0.5, 0, 0]
inertia = [0.1, 0.1, 0.1]
interfaces = { root = [0, 0, 0] }
[joints.hinge]
type = "revolute"
child = "bob.root"
stiffness = 20.0
start = { angle = 0.2 }
[environment]
gravity = [0, -9.81, 0]
[simulation]
"""


@pytest.fixture
def simulate(tmp_path, capsys):
    def simulate(keys, name="job"):
        (tmp_path / f"{name}.toml").write_text(PENDULUM + keys)
        code = main(["simulate", str(tmp_path / f"{name}.toml"), "--no-report"])
        run = None if code else read_result(tmp_path / f"output/{name}/{name}-run.h5")
        return code, run, capsys.readouterr().err

    return simulate


def test_a_pendulum_on_a_spring_rests_in_equilibrium(simulate):
    _, run, _ = simulate('t_end = 1.0\nstart = "equilibrium"')
    angle = run["hinge.angle"]
    assert np.ptp(angle) < 1e-9
    assert 20 * angle[0] == pytest.approx(-2 * 9.81 * 0.5 * np.cos(angle[0]), rel=1e-9)


def test_a_run_goes_on_from_its_file(simulate):
    _, first, _ = simulate("t_end = 0.5", "first")
    _, whole, _ = simulate("t_end = 1.0", "whole")
    _, last, _ = simulate('t_end = 1.0\nstart = "output/first/first-run.h5"', "last")
    _, middle, _ = simulate('t_end = 1.0\nstart = "output/first/first-run.h5"\nstart_time = "300 ms"', "middle")
    assert last.time[0] == first.time[-1] == 0.5
    assert last["hinge.angle"] == pytest.approx(whole["hinge.angle"][50:], abs=1e-5)  # rtol
    assert middle["hinge.angle"] == pytest.approx(whole["hinge.angle"][30:], abs=1e-5)


@pytest.mark.parametrize(
    ("keys", "says"),
    [
        (
            't_end = 1.0\nstart = "equilibruim"',
            "neither 'rest', 'quasi_static', 'equilibrium', 'steady' nor 'periodic'",
        ),
        ('t_end = 1.0\nstart = "missing.h5"', "missing.h5 does not exist"),
        ("t_end = 1.0\nstart_time = 0.5", "start_time is the time of a run"),
        ('t_end = 1.0\nstart = { "bob.modal" = [1.0] }', "has 0 modal coordinates"),
        ('t_end = 1.0\nstart = "equilibrium"\nvariables = "momentum"', "'start'"),
    ],
)
def test_a_wrong_start_has_one_sentence(simulate, keys, says):
    code, _, error = simulate(keys)
    assert code == 2
    assert says in error
    assert error.count("\n") == 1


def test_a_time_without_output_is_refused(simulate):
    simulate("t_end = 0.5", "first")
    code, _, error = simulate('t_end = 1.0\nstart = "output/first/first-run.h5"\nstart_time = 0.3333', "last")
    assert code == 2
    assert "no output at t = 0.3333 s" in error


def test_an_interrupted_run_goes_on(simulate, tmp_path, monkeypatch):
    """One that is killed at its second checkpoint, and then called again."""
    keys = 't_end = 0.5\nmethod = "explicit"\nmax_step = 2e-5\ncheckpoint = "1e-6 ms"'
    _, whole, _ = simulate(keys, "whole")
    count = []

    def write(*args, **options):
        if len(count) == 2:
            raise KeyboardInterrupt
        count.append(0)
        return write_result(*args, **options)

    with monkeypatch.context() as broken:
        broken.setattr("modalprep.pipeline.systems.checkpoints.write_result", write)
        assert simulate(keys)[0] == 130  # as of a shell
    kept = tmp_path / "output/job/job-checkpoint.h5"
    assert 0 < read_result(kept).time[-1] < 0.5
    _, run, _ = simulate(keys)
    assert not kept.exists()
    assert np.array_equal(run["hinge.angle"], whole["hinge.angle"])
    assert run.stats["steps"] == whole.stats["steps"]


def test_a_checkpoint_of_another_run_is_not_used(simulate, tmp_path):
    keys = 't_end = 0.1\ncheckpoint = "1 min"'
    _, run, _ = simulate(keys)
    write_result(run, tmp_path / "output/job/job-checkpoint.h5", identity="of another")
    _, again, _ = simulate(keys)
    assert np.array_equal(run["hinge.angle"], again["hinge.angle"])
