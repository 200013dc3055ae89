"""Shock response spectra: closed forms of a half sine and of a step, pyYeti on the same history, Miles' equation."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.response import shock_spectrum, vibration_spectrum


def half_sine_peaks(natural, T, n=20_001):
    """Largest and smallest undamped response to a half sine of one: closed form during the pulse and after it.

    C. M. Harris, A. G. Piersol, Harris' Shock and Vibration Handbook, chapter 8.
    """
    w, wf = 2 * np.pi * natural, np.pi / T
    t = np.linspace(0, T, n)[:, None]
    within = (np.sin(wf * t) - wf / w * np.sin(w * t)) / (1 - (wf / w) ** 2)
    after = 2 * wf / w * np.cos(w * T / 2) / (1 - (wf / w) ** 2)
    return np.maximum(within.max(axis=0), abs(after)), np.minimum(within.min(axis=0), -abs(after))


def test_half_sine():
    """Straight lines between 500 samples of the pulse are low by ``(pi / 500)^2 / 8``; peaks lie within 1/50 cycle."""
    T, natural = 0.01, np.array([5.0, 20.0, 60.0, 140.0, 260.0])
    time = np.arange(3001) * T / 500
    pulse = np.where(time < T, np.sin(np.pi * time / T), 0.0)
    found = shock_spectrum(time, pulse, natural, Q=1e7)
    high, low = half_sine_peaks(natural, T)
    np.testing.assert_allclose(found.positive, high, rtol=2.1e-3)
    np.testing.assert_allclose(found.negative, low, rtol=2.1e-3)
    np.testing.assert_array_equal(found.maximax, np.maximum(found.positive, -found.negative))
    assert found.notes == ()


@pytest.mark.parametrize("Q", [5.0, 25.0])
def test_step_overshoots_by_its_closed_form(Q):
    """Relative displacement after a step a of the base: ``-a/w^2 (1 + exp(-pi z / sqrt(1 - z^2)))`` at the extreme.

    The step takes one sample, so that the overshoot is low by ``(pi f dt)^2 / 6`` at most.
    """
    time, natural, z = np.arange(4001) * 1e-4, np.array([5.0, 40.0]), 1 / (2 * Q)
    found = shock_spectrum(time, np.full(time.shape, 3.0), natural, Q=Q, kind="relative_displacement")
    expected = 3.0 / (2 * np.pi * natural) ** 2 * (1 + np.exp(-np.pi * z / np.sqrt(1 - z**2)))
    np.testing.assert_allclose(-found.negative, expected, rtol=1e-4)
    assert "sudden start" in found.notes[1]
    assert "ends at 100 %" in found.notes[0]


@pytest.mark.parametrize(("kind", "theirs"), [("absolute_acceleration", "absacce"), ("pseudo_velocity", "pvelo")])
def test_same_as_pyyeti(kind, theirs):
    """Its own spectra of a history that needs no finer steps; one column or several."""
    srs = mp.response.shock.pyyeti_srs()
    rng = np.random.default_rng(1)
    time, natural = np.arange(2000) / 5000, np.geomspace(5, 100, 12)
    signal = np.cumsum(rng.normal(size=(2000, 2)), axis=0) * np.hanning(2000)[:, None]
    found = shock_spectrum(time, signal, natural, Q=10, kind=kind)
    for peak, ours in (("abs", found.maximax), ("poss", found.positive), ("negs", found.negative)):
        expected = srs.srs(signal, 5000, natural, 10, stype=theirs, peak=peak, rolloff=None, time="total")
        np.testing.assert_allclose(ours, expected, rtol=1e-12)
    alone = shock_spectrum(time, signal[:, 1], natural, Q=10, kind=kind)
    np.testing.assert_array_equal(alone.maximax, found.maximax[:, 1])


def test_straight_lines_between_samples():
    """A history with few samples is the one with all points of its straight lines: pyYeti's own resampling is not."""
    rng = np.random.default_rng(2)
    coarse = np.concatenate([[0.0], rng.normal(size=30), [0.0]])
    time, fine = np.arange(32) * 0.01, np.arange(31 * 5 + 1) * 0.002
    natural = np.array([3.0, 10.0])
    expected = shock_spectrum(fine, np.interp(fine, time, coarse), natural)
    np.testing.assert_allclose(shock_spectrum(time, coarse, natural).maximax, expected.maximax, rtol=1e-10)


def test_importing_pyyeti_does_not_change_how_arrays_print():
    mp.response.shock.pyyeti_srs()
    assert np.get_printoptions()["legacy"] is False


def test_gravity_on_an_accelerometer_is_no_shock():
    time = np.arange(1000) * 1e-3
    found = shock_spectrum(time, np.full(1000, 9.81), np.array([10.0, 50.0]), start="steady")
    np.testing.assert_allclose(found.positive, 9.81, rtol=1e-9)
    assert len(found.notes) == 1  # on its end


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"frequency": np.array([10.0, 600.0])}, "know nothing beyond 500 Hz"),
        ({"frequency": np.array([10.0, 5.0])}, "must be positive and ascend"),
        ({"Q": 0.5}, "vibrate above 0.5 only"),
        ({"kind": "absolute_accel"}, "did you mean 'absolute_acceleration'"),
        ({"time": np.geomspace(1, 2, 1000)}, "not equally spaced"),
        ({"acceleration": np.full(1000, np.nan)}, "not finite"),
        ({"acceleration": np.zeros(3)}, "one value each"),
    ],
)
def test_refused(changed, words):
    given = {"time": np.arange(1000) * 1e-3, "acceleration": np.zeros(1000), "frequency": np.array([10.0])} | changed
    with pytest.raises(mp.InputError, match=words):
        shock_spectrum(given.pop("time"), given.pop("acceleration"), given.pop("frequency"), **given)


def test_few_samples_are_said():
    time = np.arange(1000) * 1e-3
    assert "5 samples in a cycle of 200 Hz" in shock_spectrum(time, np.sin(20 * time), np.array([200.0])).notes[0]


def test_vibration_spectrum_of_white_noise_is_miles():
    """Closed form for a flat spectrum: ``pi/2 f Q S (1 + 1/Q^2)``; pyYeti sums 60 points per half-power width."""
    f = np.geomspace(0.5, 1e5, 40_000)
    rms, miles = vibration_spectrum(f, np.full(f.shape, 0.04), np.array([50.0, 200.0]), Q=10)
    expected = np.sqrt(np.pi / 2 * np.array([50.0, 200.0]) * 10 * 0.04)
    np.testing.assert_allclose(miles, expected, rtol=1e-12)
    np.testing.assert_allclose(rms, expected * np.sqrt(1 + 1 / 10**2), rtol=2e-3)  # the tails are cut at 0.5 and 1e5 Hz
