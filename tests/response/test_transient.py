"""Histories and sweeps against closed forms, a direct integration, pyYeti and the harmonic response."""

import numpy as np
import pytest
from response.beams import cantilever
from scipy.integrate import solve_ivp

import modalprep as mp
from modalprep.response import History, harmonic_response, modal_equations, sweep_response, transient_response
from modalprep.response.inputs import Sweep
from modalprep.response.integrate import Integrator
from modalprep.response.modal import ModalEquations
from modalprep.response.validity import highest_mode

ZETA = 0.02


@pytest.fixture(scope="module")
def body():
    return cantilever(6)[1]


def one_mode(w, zeta):
    names = {"inputs": ("base.x",), "units": ("m/s^2",)}
    arrays = {"K": np.array([w**2]), "D": np.array([2 * zeta * w]), "B": np.ones((1, 1))}
    return ModalEquations(**names, **arrays, drives=np.zeros((18, 1)), basis=np.eye(1))


def step_and_ramp(w, zeta, t, rise):
    """Under a force that rises to 1 in `rise`: of q'' + 2 zeta w q' + w^2 q = f (Craig and Kurdila, section 5.2)."""

    def ramp(s):
        s = np.maximum(s, 0)
        wd = w * np.sqrt(1 - zeta**2)
        decay = np.exp(-zeta * w * s)
        a, b = 2 * zeta / w, (2 * zeta**2 - 1) / wd
        return (s - a + decay * (a * np.cos(wd * s) + b * np.sin(wd * s))) / w**2

    return (ramp(t) - ramp(t - rise)) / rise


@pytest.mark.parametrize("zeta", [0.0, 0.02, 0.9])
@pytest.mark.parametrize("step", [0.5, 0.01], ids=["coarse", "fine"])
def test_a_ramp_has_its_closed_form_at_any_step(zeta, step):
    """Round-off only: the steps are a third of a period and a hundredth."""
    w = 4.0
    t = step * np.arange(20 if step > 0.1 else 1001)
    q, qd, qdd = Integrator(one_mode(w, zeta)).run(step, np.minimum(t / 2.0, 1.0)[:, None])
    assert q[:, 0] == pytest.approx(step_and_ramp(w, zeta, t, 2.0), abs=1e-13)
    assert qdd + 2 * zeta * w * qd + w**2 * q == pytest.approx(np.minimum(t / 2.0, 1.0)[:, None], abs=1e-13)


@pytest.mark.parametrize("zeta", [1.0, 3.0])
def test_critical_and_heavy_damping_are_integrated_too(zeta):
    t = np.linspace(0, 3, 31)
    q, _, _ = Integrator(one_mode(4.0, zeta)).run(0.1, np.minimum(t, 1.0)[:, None])
    found = solve_ivp(
        lambda s, y: [y[1], min(s, 1.0) - 8 * zeta * y[1] - 16 * y[0]], (0, 3), [0, 0], t_eval=t, rtol=1e-11,
        atol=1e-13, max_step=0.1,
    )  # fmt: skip
    assert q[:, 0] == pytest.approx(found.y[0], abs=1e-9)  # of the peer


def test_without_stiffness_it_is_the_motion_of_a_mass():
    """A constant force: t^2 / 2, exact in two steps or in many."""
    e = one_mode(0.0, 0.0)
    assert Integrator(e).run(1.5, np.ones((3, 1)))[0][:, 0] == pytest.approx([0, 1.125, 4.5], rel=1e-14)


def test_calls_continue_where_the_last_one_ended(body):
    e = modal_equations(body, ["base.y"], ZETA)
    u = np.random.default_rng(0).standard_normal((21, 1))
    whole = Integrator(e).run(0.05, u)[0]
    parts = Integrator(e)
    assert parts.run(0.05, u[:11])[0] == pytest.approx(whole[:11], abs=1e-15)
    assert parts.run(0.05, u[10:])[0] == pytest.approx(whole[10:], abs=1e-14)


@pytest.mark.parametrize("kind", ["uncoupled", "coupled"])
def test_histories_are_those_of_pyyeti(body, kind):
    """SolveUnc and SolveExp2 of pyYeti hold the same straight lines; round-off of some thousand steps."""
    ode = pytest.importorskip("pyyeti.ode")
    damping = ZETA if kind == "uncoupled" else np.diag(2 * ZETA * np.sqrt(body.K)) + 0.3 * np.ones((body.n, body.n))
    e = modal_equations(body, ["base.y", "tip.rz"], damping)
    h, random = 0.02, np.random.default_rng(1)
    u = random.standard_normal((400, 2))
    u[0] = 0
    solver = ode.SolveUnc if kind == "uncoupled" else ode.SolveExp2
    peer = solver(np.ones(body.n), e.D, e.K, h, order=1).tsolve(e.B @ u.T)
    t = h * np.arange(400)
    inputs = {"base.y": History(time=t, value=u[:, 0]), "tip.rz": History(time=t, value=u[:, 1])}
    found = transient_response(body, inputs, step=h, damping=damping)
    expected = body.phi[1][1] @ peer.d
    assert found["tip.displacement.y"] == pytest.approx(expected, abs=1e-11 * np.abs(expected).max())
    expected = u[:, 0] + body.phi[1][1] @ peer.a
    assert found["tip.acceleration.y"] == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_extremes_and_what_the_samples_miss_are_said(body):
    push = History(time=np.array([0.1, 0.35, 0.5]), value=np.array([1.0, -2.0, 1.0]))
    found = transient_response(body, {"tip.y": push}, step=0.1, duration=3.0, damping=ZETA)
    notes = " ".join(found.notes)
    for words in (
        "corners of the input tip.y",
        "drops to zero after",
        "zero before its table",
        f"highest kept mode has {10 / highest_mode(body):.3g} samples",
    ):
        assert words in notes
    history, figures = found["base.force.y"], found.peak("base.force.y").figures
    assert (figures["highest"], figures["lowest"]) == (history.max(), history.min())
    assert found.axis[np.argmin(history)] == figures["lowest_at_s"]
    assert found.peak("base.force.y").largest == np.abs(history).max()
    fine = transient_response(body, {"tip.y": push}, damping=ZETA)
    assert not any("corners" in note for note in fine.notes)


@pytest.mark.parametrize(("rate", "seconds"), [((2.0, "oct/min"), 60.0), ((0.5, "Hz/s"), 60.0)])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_the_phase_of_a_sweep_is_the_integral_of_its_frequency(rate, seconds, direction):
    """From 10 to 40 Hz: two octaves, or 30 Hz; differences of 1e-3 s are exact to its square."""
    clock, h = Sweep(10.0, 40.0, rate, direction), 1e-3
    t = np.linspace(0, seconds, 7)
    assert clock.duration == pytest.approx(seconds, rel=1e-12)
    assert (clock.phase(t + h) - clock.phase(t - h)) / (4 * np.pi * h) == pytest.approx(clock.frequency(t), rel=1e-8)
    assert clock.frequency(t)[[0, -1]] == pytest.approx([40, 10] if direction == "down" else [10, 40], rel=1e-12)
    assert clock.time(clock.frequency(t)) == pytest.approx(t, abs=1e-9)


@pytest.mark.parametrize("rate", [(20.0, "oct/min"), (0.05, "Hz/s")], ids=["octaves", "linear"])
@pytest.mark.parametrize("direction", ["up", "down"])
def test_a_sweep_is_its_direct_integration(rate, direction):
    """One mode through its resonance by an adaptive method at 1e-9; the samples miss 5e-4 of the sine."""
    body = cantilever(1, wanted={})[1]
    found = sweep_response(body, {"base.y": 2.0}, 0.4, 0.9, rate, direction=direction, damping=ZETA)
    clock, w, b = Sweep(0.4, 0.9, rate, direction), np.sqrt(body.K[0]), -body.S[1, 0]

    def motion(t, x):
        return [x[1], b * 2.0 * np.sin(clock.phase(t)) - 2 * ZETA * w * x[1] - w**2 * x[0]]

    t = np.linspace(0, clock.duration, 40001)
    peer = solve_ivp(motion, (0, clock.duration), [0, 0], t_eval=t, rtol=1e-9, atol=1e-12, method="DOP853").y[0]
    expected = np.abs(peer * body.phi[1][1, 0])
    figures = found.peak("tip.displacement.y").figures
    assert figures["peak"] == pytest.approx(expected.max(), rel=1e-3)
    assert figures["at_s"] == pytest.approx(t[np.argmax(expected)], abs=0.02)
    assert figures["peak"] < figures["steady"]


def test_a_slow_sweep_is_the_steady_state(body):
    """A sweep misses about its speed over the square of the half-width: 7e-5 / (0.05 0.6)^2 = 0.08."""
    options = {"damping": 0.05, "channels": ["tip", "beam.1.start"]}
    found = sweep_response(body, {"base.y": 1.0}, 0.4, 0.9, (0.01, "oct/min"), **options)
    exact = harmonic_response(body, {"base.y": 1.0}, found.axis, refine=False, **options)
    k = found.names.index("beam.1.start.Mz")
    assert found.steady[:, k] == pytest.approx(np.abs(exact["beam.1.start.Mz"]), rel=1e-12)
    assert found.values[2:-1, k] == pytest.approx(found.steady[2:-1, k], rel=0.08)
    assert any("miss the sine by 0.049 %" in note for note in found.notes)


@pytest.mark.parametrize(
    ("band", "rate", "words"),
    [
        ((2.0, 1.0), (2.0, "oct/min"), "is none"),
        ((1.0, 2.0), (0.0, "oct/min"), "is none"),
        ((1.0, 2.0), (1.0, "oct/s"), "not known"),
        ((1.0, 2e6), (1.0, "oct/min"), "too many"),
    ],
)
def test_bad_sweeps_are_one_message(body, band, rate, words):
    with pytest.raises(mp.InputError, match=words):
        sweep_response(body, {"base.y": 1.0}, *band, rate, damping=ZETA)


def test_bad_histories_are_one_message(body):
    with pytest.raises(mp.InputError, match="must ascend"):
        History(time=np.array([0.0, 0.0]), value=np.zeros(2))
    table = History(time=np.array([0.0, 1.0]), value=np.ones(2))
    with pytest.raises(mp.InputError, match="give a longer step"):
        transient_response(body, {"base.y": table}, step=1e-9)
    with pytest.raises(mp.InputError, match="has no samples"):
        transient_response(body, {"base.y": table}, step=2.0)


def test_a_sweep_leaves_out_recoveries_of_many_channels(body, monkeypatch):
    monkeypatch.setattr("modalprep.response.channels.MOST", 10)
    found = sweep_response(body, {"base.y": 1.0}, 0.5, 0.7, (20.0, "oct/min"), damping=ZETA)
    assert "wall.root.Fy" in found.names
    assert not any(peak.block == "beam" for peak in found.peaks)
    assert "beam has too many channels for a sweep, which leaves it out" in found.notes
