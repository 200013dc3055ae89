"""[run_sensitivities] of a pipeline file: its files and page, and what is refused before any work."""

import h5py
import numpy as np
import pytest

from modalprep.cli import main

OSCILLATOR = """
[bodies.block]
mass = 4.0
centre = [0, 0, 0]
inertia = [1, 1, 1]
interfaces = { root = [0, 0, 0] }
[joints.slide]
type = "prismatic"
child = "block.root"
start = { displacement = 0.5 }
stiffness = 100.0
[simulation]
t_end = 0.4
output_step = 0.1
[run_sensitivities]
parameters = ["slide.stiffness", "slide.displacement", "block.mass"]
"""
K, M, X = 100.0, 4.0, 0.5
W = np.sqrt(K / M)


@pytest.fixture
def simulate(tmp_path, capsys):
    def simulate(keys, *options):
        (tmp_path / "job.toml").write_text(OSCILLATOR + keys)
        code = main(["simulate", str(tmp_path / "job.toml"), *options])
        return code, tmp_path / "output/job", capsys.readouterr()

    return simulate


def test_derivatives_of_an_oscillator_are_written(simulate):
    """x = X cos wt: dx/dk = -X t sin(wt) w / (2 k), dx/dX = cos wt, dx/dm = X t sin(wt) w / (2 m); tolerance 1e-8."""
    code, folder, said = simulate('channels = ["slide.displacement"]\nobjective = { last = "slide.speed" }')
    assert code == 0
    with h5py.File(folder / "job-sensitivities.h5") as file:
        t = file["time"][()]
        found = file["derivatives/slide.displacement"][()]
        of_speed = file["objective/derivatives"][()]
        assert file["objective"].attrs["of"] == "last of slide.speed"
    swing = X * t * np.sin(W * t) * W / 2
    expected = np.array([-swing / K, np.cos(W * t), swing / M])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-7 * np.abs(expected).max())
    end = -X * (np.sin(W * 0.4) + W * 0.4 * np.cos(W * 0.4)) * W / 2  # of the speed by ln k
    np.testing.assert_allclose(of_speed[[0, 2]], [end / K, -end / M], rtol=1e-7)
    table = np.genfromtxt(folder / "job-sensitivities.csv", delimiter=",", skip_header=1)
    np.testing.assert_allclose(table[:, 2], found[0], rtol=0, atol=1e-9)
    assert "Derivatives of the run" in said.out
    page = (folder / "job-run.html").read_text()
    assert "change of slide.displacement" in page
    assert "The last of slide.speed is" in page


@pytest.mark.parametrize(
    ("keys", "sentence"),
    [
        ("", "name 'channels', or an 'objective', or both"),
        ('channels = ["slide.angle"]', "channel 'slide.angle': "),
        ('channels = ["energy.work"]', "'energy.work' depends on the whole run before"),
        ('objective = { last = "slide.speed", integral = "slide.speed" }', "give one of them"),
        ('channels = ["block.root.position"]', "has 3 numbers; name one, such as block.root.position.x"),
    ],
)
def test_what_is_refused(simulate, keys, sentence):
    code, folder, said = simulate(keys, "--no-report")
    assert code == 2
    assert sentence in " ".join(said.err.split())
    assert not folder.exists()
