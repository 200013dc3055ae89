"""Random response against Lyapunov's equation, independent inputs, cross spectra and closed forms."""

import numpy as np
import pytest
from response.beams import ELEMENTS, cantilever
from scipy.linalg import solve_continuous_lyapunov

import modalprep as mp
from modalprep.body.recovery import Recovery
from modalprep.response import Spectrum, modal_equations, random_response

ZETA = 0.02


@pytest.fixture(scope="module")
def body():
    return cantilever(6)[1]


def covariance(equations, S, filtered=None):
    """Covariance of (q, q') under white noise of one-sided densities S (k,), or a filter (A, b, C) of it."""
    n = len(equations.K)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(equations.K), -np.diag(equations.D)]])
    B = np.vstack([np.zeros_like(equations.B), equations.B])
    if filtered:
        Af, bf, Cf = filtered
        A = np.block([[A, B @ Cf], [np.zeros((len(Af), 2 * n)), Af]])
        B = np.vstack([np.zeros((2 * n, 1)), bf])
    # a one-sided density S per Hz has the intensity S / 2
    return solve_continuous_lyapunov(A, -B @ np.diag(S) @ B.T / 2)


def test_rms_under_white_noise_is_lyapunovs(body):
    """Of displacements and bending moments; what is below 1e-5 and above 1e4 of the lowest mode is missing."""
    body = body.with_(recovery={k: x.with_(qdd=None, loads=None) for k, x in body.recovery.items() if k == "beam"})
    S = {"base.y": 2.0, "base.z": 0.5, "tip.rz": 3.0}
    found = random_response(body, S, band=(6e-6, 6e3), damping=ZETA)
    P = covariance(modal_equations(body, tuple(S), ZETA), list(S.values()))[: body.n, : body.n]
    block = body.recovery["beam"]
    for name, row in (("tip.displacement.y", body.phi[1][1]), ("beam.1.start.Mz", block.q[0, 5])):
        # the density below the band: 2 zeta f / f_1 = 1e-6
        assert found.peak(name).figures["rms"] == pytest.approx(np.sqrt(row @ P @ row), rel=2e-6)


def test_rms_under_filtered_noise_is_lyapunovs(body):
    """Through a second-order filter at 2 Hz; its spectrum as a table of straight lines in logarithmic axes."""
    w, z = 4 * np.pi, 0.1
    filtered = np.array([[0, 1], [-(w**2), -2 * z * w]]), np.array([[0], [1.0]]), np.array([[w**2, 0]])
    equations = modal_equations(body, ["base.y"], ZETA)
    P = covariance(equations, [1.0], filtered)[: body.n, : body.n]
    f = np.geomspace(1e-4, 1e3, 12001)
    s = f / 2
    found = random_response(
        body, {"base.y": Spectrum(frequency=f, value=1 / ((1 - s**2) ** 2 + (2 * z * s) ** 2))}, damping=ZETA,
        channels=["tip.displacement"],
    )  # fmt: skip
    row = body.phi[1][1]
    # lines between 12000 points: the square of a step of 1.3e-3 over that of the filter's half-width 0.1
    assert found.peak("tip.displacement.y").figures["rms"] == pytest.approx(np.sqrt(row @ P @ row), rel=5e-5)


def test_one_lightly_damped_mode_is_miles_formula():
    """Miles (1954): a_rms = sqrt(pi f Q S / 2); apparent frequency f; the error is of order zeta and of the band."""
    _, body = cantilever(1)
    zeta, S = 1e-4, 3.0
    f = float(body.frequency[0])
    found = random_response(body, {"base.y": S}, band=(f / 50, 50 * f), damping=zeta).peak("tip.displacement.y").figures
    gain = abs(body.S[1, 0] * body.phi[1][1, 0]) / body.K[0]
    assert found["rms"] == pytest.approx(gain * np.sqrt(np.pi * f * S / (4 * zeta)), rel=2e-4)
    assert found["apparent_hz"] == pytest.approx(f, rel=5e-3)  # 4 zeta / pi of the band above the mode, times 50
    assert found["three_sigma"] == pytest.approx(3 * found["rms"], rel=1e-15)


def test_inputs_that_are_one_signal_add_before_the_square(body):
    """Fully correlated = the sum of the transfers; coherence 0.25 with 60 degrees: by the cross spectra themselves."""
    S = {"base.y": 2.0, "tip.y": 0.5}
    options = {"band": (0.1, 5.0), "damping": ZETA, "channels": ["tip.acceleration.y"]}
    alone = [mp.response.harmonic_response(body, {name: 1.0}, [0.5, 0.7], damping=ZETA, refine=False) for name in S]
    H = np.stack([x["tip.acceleration.y"] for x in alone], axis=1)
    r = 0.5 * np.exp(1j * np.pi / 3)
    for given, R in (("none", np.eye(2)), ("full", np.ones((2, 2))), *[(np.array([[1, r], [r.conj(), 1]]),) * 2]):
        found = random_response(body, S, correlation=given, **options)
        root = np.sqrt([2.0, 0.5])
        expected = np.einsum("fi,ij,fj->f", H * root, R, (H * root).conj()).real
        # between points of the refined axis a straight line
        values = [np.interp(f, found.axis, found["tip.acceleration.y"]) for f in (0.5, 0.7)]
        assert values == pytest.approx(expected, rel=0.02)
        q = modal_equations(body, tuple(S), ZETA).solve(
            found.axis, np.diag(root)[None] * np.ones((len(found.axis), 1, 1))
        )
        Y = -((2 * np.pi * found.axis[:, None]) ** 2) * np.einsum("n,fnk->fk", body.phi[1][1], q) + [root[0], 0]
        exact = np.einsum("fi,ij,fj->f", Y, R, Y.conj()).real
        assert found["tip.acceleration.y"] == pytest.approx(exact, rel=1e-9)


def test_von_mises_is_segalmans(body):
    """E[s^T A s] from the covariance of the stress, which is that of the modes."""
    rows = np.random.default_rng(1).standard_normal((2, 3, body.n))
    names = {"places": ("a", "b"), "components": ("xx", "yy", "xy"), "units": ("Pa",) * 3}
    skin = Recovery(kind="stress", q=rows, allowable=7.0, **names)
    found = random_response(body.with_(recovery={"skin": skin}), {"base.y": 1.0}, band=(6e-6, 6e3), damping=ZETA)
    P = covariance(modal_equations(body, ["base.y"], ZETA), [1.0])[: body.n, : body.n]
    A = np.array([[1, -0.5, 0], [-0.5, 1, 0], [0, 0, 3.0]])
    peak = found.peak("skin.b.von_mises")
    assert peak.figures["rms"] == pytest.approx(np.sqrt(np.trace(A @ rows[1] @ P @ rows[1].T)), rel=2e-6)
    assert peak.margin == pytest.approx(7.0 / (3 * peak.figures["rms"]) - 1, rel=1e-12)
    assert np.isnan(found.peak("skin.b.xx").margin)
    assert any("not Gaussian" in note for note in found.notes)


def test_slopes_of_a_test_specification():
    """+3 dB/oct doubles a density in an octave less 0.24 %: 10^0.3."""
    table = Spectrum.with_slopes([20, 80, 500, 2000], ["3 dB/oct", 0.1, 0.1, "-6 dB/oct"])
    assert table.value == pytest.approx([0.1 * 10**-0.6, 0.1, 0.1, 0.1 * 10**-1.2], rel=1e-12)
    assert table.values_at(np.array([40.0, 1000.0, 10.0])) == pytest.approx(
        [0.1 * 10**-0.3, 0.1 * 10**-0.6, 0], rel=1e-12
    )
    jump = Spectrum(frequency=np.array([1.0, 2.0, 2.0, 3.0]), value=np.array([1.0, 1.0, 4.0, 4.0]))
    assert jump.values_at(np.array([1.5, 2.0, 2.5, 3.0])).tolist() == [1, 4, 4, 4]


def test_many_channels_have_peaks_only(body, monkeypatch):
    monkeypatch.setattr("modalprep.response.channels.MOST", 10)
    monkeypatch.setattr("modalprep.response.channels.AT_ONCE", 1000)
    found = random_response(body, {"base.y": 1.0}, band=(0.1, 5.0), damping=ZETA)
    name = f"beam.{ELEMENTS}.end.Vy"
    assert name not in found.names
    assert found.peak(name).figures["rms"] > 0
    assert any("beam has 72 channels" in note for note in found.notes)


@pytest.mark.parametrize(
    ("inputs", "options", "words"),
    [
        ({"base.x": 1.0}, {}, "needs a band"),
        ({"base.y": 1.0}, {"band": (0.1, 5.0), "damping": 0.0}, "has no damping"),
        ({"base.y": 1.0}, {"band": (5.0, 1.0)}, "must begin above 0"),
        ({"base.x": 1.0, "base.y": 1.0}, {"band": (1.0, 2.0), "correlation": np.full((2, 2), 2)}, "must be Hermitian"),
        (
            {"base.x": 1.0, "base.y": 1.0, "base.z": 1.0},
            {"band": (1.0, 2.0), "correlation": np.array([[1, 0.9, -0.9], [0.9, 1, 0.9], [-0.9, 0.9, 1]])},
            "contradict each other",
        ),
    ],
)
def test_bad_input_is_one_message(body, inputs, options, words):
    with pytest.raises(mp.InputError, match=words):
        random_response(body, inputs, **{"damping": ZETA} | options)
