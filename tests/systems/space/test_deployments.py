"""Beams and tethers that come out of a body or go in: the continuum's tip (own Galerkin solution), identities."""

import numpy as np
import pytest
from systems.shipped import run_shipped

import modalprep as mp
from modalprep.cli import main

TIMES = np.array([1.0, 2.0, 4.0, 6.0, 8.0, 10.0])
OUT = [0.03247, 0.10427, 0.09550, 0.11375, -0.00580, 0.11691]
IN = [-0.05986, -0.05265, 0.08847, 0.03298, 0.06823, 0.05881]
TURNING = [0.015435, 0.067445, 0.098555, 0.036549, 0.003415, 0.000204]


def at(run, values, times=TIMES):
    """Values at output times."""
    return values[[np.argmin(np.abs(run.time - t)) for t in times]]


def test_deploying_beam(tmp_path):
    """Case A: 40 rods reach the continuum to 4e-3 m of an amplitude of 0.13 m; inserting rods costs no energy."""
    run = run_shipped("deploying-beam", tmp_path).runs["with geometric stiffness"]
    np.testing.assert_allclose(at(run, run["boom1.tip.position.y"]), OUT, atol=4e-3)
    assert run["boom.rods"][0] == 20
    assert run["boom.rods"][-1] == 40
    np.testing.assert_allclose(run.events["boom.insert"], np.arange(0.5, 10, 0.5), rtol=1e-12)
    assert np.abs(run["energy.events"]).max() < 1e-12
    assert run.stats["energy_error"] < 1e-6  # rtol 1e-6


def test_beam_that_goes_in():
    """Case B, order two: 20 rods are out by the square of what 10 are."""
    worst = []
    for segments in (10, 20):
        boom = mp.multibody.Deployment(
            name="boom", parent="ground", length=10.0, segments=segments, mass_per_length=1.2, EI=1.4e4,
            deployed_length="10 - t/2", deflection=0.1,
        )  # fmt: skip
        system = mp.multibody.DeployingSystem(bodies={}, joints=(), deployments=(boom,))
        run = mp.multibody.simulate_deployment(system, t_end=10.0, output_step=0.1, rtol=1e-6, method="explicit")
        worst.append(np.sqrt(np.mean((at(run, run["boom1.tip.position.y"]) - IN) ** 2)))
    assert worst[1] < 4e-3
    assert 3.0 < worst[0] / worst[1]


def test_retracting_beam(tmp_path):
    """Case D: the tip in the hub's frame, to 1.2e-3 m; it leads, as a beam that comes out would lag."""
    run = run_shipped("retracting-beam", tmp_path).runs["with geometric stiffness"]
    seen = run.relative_to("hub")["boom1.tip.position.y"]
    np.testing.assert_allclose(at(run, seen), TURNING, atol=1.2e-3)
    assert seen.max() > 0.1
    assert run["boom.rods"][[0, -1]].tolist() == [20, 10]


def test_deploying_tether(tmp_path):
    """Momentum of the free spacecraft stays, also where the reel jams; the spin falls as the inertia grows."""
    run = run_shipped("deploying-tether", tmp_path).runs["with geometric stiffness"]
    H = run["momentum.angular"]
    assert np.abs(H - H[0]).max() < 1e-9 * np.abs(H).max()
    assert np.abs(run["momentum.linear"] - run["momentum.linear"][0]).max() < 1e-9
    assert len(run.events["tether.stop"]) == 1
    length, jammed = run["tether.length"], run.time >= 100.0
    assert np.ptp(length[jammed]) < 1e-12
    assert run["energy.events"][-1] < 0
    assert run["tether.tension"][1:].min() > 0  # it stays taut
    assert run["orbit.angular_velocity.z"][jammed].max() < 0.5 * run["orbit.angular_velocity.z"][0]


BOOM = """
[deployments.boom]
length = 2.0
segments = 4
mass_per_length = 1.0
EI = 100.0
{key}
[simulation]
t_end = 1.0
{more}
"""


@pytest.mark.parametrize(
    ("key", "more", "words"),
    [
        ('deployed_length = "1 + 2*t"', "", "between 0 and length"),
        ("", "", "deployment 'boom': give either a 'deployed_length'"),
        ('deployed_length = "1"', "compare_conventional = true", "no conventional theory"),
        ('deployed_length = "1"', "[analysis]", "[analysis] cannot be combined with [deployments]"),
        ('deployed_length = "1"\nparent = "bus.exit"', "", "'bus'"),
        ('deployed_length = "sin("', "", "not an expression"),
    ],
)
def test_bad_tables(tmp_path, capsys, key, more, words):
    """One message, exit code 2."""
    file = tmp_path / "boom.toml"
    file.write_text(BOOM.format(key=key, more=more))
    assert main(["simulate", str(file), "--output", str(tmp_path)]) == 2
    assert words in " ".join(capsys.readouterr().err.split())


def test_command_line(tmp_path):
    """`modalprep simulate` writes what is asked for; a film is refused."""
    file = tmp_path / "boom.toml"
    file.write_text(BOOM.format(key='deployed_length = "0.6 + t"', more='output = ["boom.rods", "boom1.tip.position"]'))
    assert main(["simulate", str(file), "--output", str(tmp_path)]) == 0
    assert mp.formats.read_csv(tmp_path / "boom" / "boom-run.csv")["boom.rods"][-1] == 4
    assert main(["simulate", str(file), "--animate", str(tmp_path / "film.gif")]) == 2
