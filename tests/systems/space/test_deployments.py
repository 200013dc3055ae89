"""Beams and tethers that come out of a body or go in: the continuum's tip by Galerkin's method, identities."""

import numpy as np
import pytest
from analytic import cantilever_roots
from beam_series import POINTS, WEIGHTS, mode_shapes, unit_loads
from scipy.integrate import solve_ivp
from systems.shipped import run_shipped

import modalprep as mp
from modalprep.cli import main

TIMES = np.array([1.0, 2.0, 4.0, 6.0, 8.0, 10.0])
MASS, EI = 1.2, 1.4e4  # kg/m, N m^2


def continuum(length, spin=0.0, deflection=0.0, modes=3):
    """Tip (len(TIMES),) of a beam of changing length in the frame of its exit, by Galerkin's method.

    ``D^2 w - W^2 w + 2 W L' + (EI w'')'' / m - (N w')' = 0`` with ``D = d/dt + L' d/dx``, for what is out moves at L',
    and ``N = L'' (x - L) + W^2 (L^2 - x^2) / 2``. Clamped-free modes of x / L; the shape at the start is that of a
    force at the tip, over the length at every time. `length` returns L, L' and L''.
    """
    phi, slope, curvature = mode_shapes(modes)
    g = 1 - POINTS
    A, B, C = ((WEIGHTS * one) @ two.T for one, two in ((phi * g, slope), (phi * g**2, curvature), (slope * g, slope)))
    turning = unit_loads(modes)["centrifugal"] - np.eye(modes)
    bending, area = np.diag(cantilever_roots(modes) ** 4) * EI / MASS, phi @ WEIGHTS

    def rates(t, y):
        q, v = np.split(y, 2)
        L, speed, acceleration = length(t)
        s = speed / L
        K = (acceleration / L - 2 * s**2) * A + s**2 * B + bending / L**4 - acceleration / L * C
        K = K + spin**2 * turning
        return np.concatenate([v, -2 * s * (A @ v) - K @ q - 2 * spin * speed * area])

    start = np.append(deflection * (phi @ (WEIGHTS * (3 * POINTS**2 - POINTS**3) / 2)), np.zeros(modes))
    q = solve_ivp(rates, (0, TIMES[-1]), start, "DOP853", TIMES, rtol=1e-7, atol=1e-10).y[:modes]
    return mode_shapes(modes, np.array([1.0]))[0][:, 0] @ q


def at(run, values, times=TIMES):
    """Values at output times."""
    return values[[np.argmin(np.abs(run.time - t)) for t in times]]


def test_deploying_beam(tmp_path):
    """40 rods reach the continuum to 4e-3 m of an amplitude of 0.13 m; inserting rods costs no energy."""
    run = run_shipped("deploying-beam", tmp_path).runs["with geometric stiffness"]
    expected = continuum(lambda t: (5 + t / 2, 0.5, 0.0), deflection=0.1)
    np.testing.assert_allclose(at(run, run["boom1.tip.position.y"]), expected, atol=4e-3)
    assert run["boom.rods"][0] == 20
    assert run["boom.rods"][-1] == 40
    np.testing.assert_allclose(run.events["boom.insert"], np.arange(0.5, 10, 0.5), rtol=1e-12)
    assert np.abs(run["energy.events"]).max() < 1e-12
    assert run.stats["energy_error"] < 1e-6  # rtol 1e-6


def test_beam_that_goes_in():
    """Order one: a rod that reaches the exit takes its rotation with it, which the continuum sheds bit by bit."""
    worst, expected = [], continuum(lambda t: (10 - t / 2, -0.5, 0.0), deflection=0.1)[:5]
    for segments in (16, 32):
        boom = mp.multibody.Deployment(
            name="boom", parent="ground", length=10.0, segments=segments, mass_per_length=1.2, EI=1.4e4,
            deployed_length="10 - t/2", deflection=0.1,
        )  # fmt: skip
        system = mp.multibody.DeployingSystem(bodies={}, joints=(), deployments=(boom,))
        run = mp.multibody.simulate_deployment(system, t_end=8.0, output_step=0.1, rtol=1e-6, method="explicit")
        found = at(run, run["boom1.tip.position.y"], TIMES[:5])
        worst.append(np.sqrt(np.mean((found - expected) ** 2)))
    assert worst[1] < 1e-3  # of an amplitude of 0.1 m
    assert np.log2(worst[0] / worst[1]) == pytest.approx(1.0, abs=0.2)


def test_retracting_beam(tmp_path):
    """The tip in the hub's frame, to 1.2e-3 m; it leads, as a beam that comes out would lag."""
    run = run_shipped("retracting-beam", tmp_path).runs["with geometric stiffness"]
    turn = np.pi / 5
    expected = continuum(
        lambda t: (
            10 - t / 2 + 5 * np.sin(turn * t) / (2 * np.pi),
            -(1 - np.cos(turn * t)) / 2,
            -turn / 2 * np.sin(turn * t),
        ),
        spin=1.0,
    )
    seen = run.relative_to("hub")["boom1.tip.position.y"]
    np.testing.assert_allclose(at(run, seen), expected, atol=1.2e-3)
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
    """`modalprep simulate` writes what is asked for."""
    file = tmp_path / "boom.toml"
    file.write_text(BOOM.format(key='deployed_length = "0.6 + t"', more='output = ["boom.rods", "boom1.tip.position"]'))
    assert main(["simulate", str(file), "--output", str(tmp_path)]) == 0
    assert mp.formats.read_csv(tmp_path / "boom" / "boom-run.csv")["boom.rods"][-1] == 4
