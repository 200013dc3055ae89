"""Fatigue: the example of ASTM, closed forms of sines and of narrow bands, Dirlik against counts, pyYeti's counts."""

import numpy as np
import pytest
from scipy.special import gamma, gammaincc

import modalprep as mp
from modalprep.body.stress import von_mises
from modalprep.response import SNCurve, rainflow_damage, random_damage, signed_von_mises

CURVE = SNCurve(stress=100.0, cycles=1e6, slope=5.0)


def test_counts_of_the_example_in_the_standard():
    """ASTM E1049-85, figure 6: ranges 3, 4, 6, 8, 9 counted 0.5, 1.5, 0.5, 1, 0.5."""
    stress = np.array([-2.0, 1, -3, 5, -1, 3, -4, 4, -2])
    found = rainflow_damage(np.arange(9.0), stress, CURVE)
    counted = {r: found.counts[found.ranges == r].sum() for r in found.ranges}
    assert counted == {3: 0.5, 4: 1.5, 6: 0.5, 8: 1.0, 9: 0.5}
    assert found.cycles == 4


def test_counts_of_pyyeti():
    with np.printoptions():
        counting = pytest.importorskip(
            "pyyeti.rainflow.c_rain", reason="pyYeti was installed without its compiled part"
        )
    stress = np.random.default_rng(3).normal(size=400)
    found = rainflow_damage(np.arange(400.0), stress, CURVE)
    turns = np.diff(stress)[1:] * np.diff(stress)[:-1] < 0
    theirs = counting.rainflow(stress[np.concatenate([[True], turns, [True]])])
    ours = np.array(sorted(zip(found.ranges / 2, found.means, found.counts, strict=True)))
    np.testing.assert_allclose(ours, np.array(sorted(map(tuple, theirs))), rtol=1e-12)


@pytest.mark.parametrize("amplitude", [60.0, 100.0, 180.0])
def test_damage_of_a_sine(amplitude):
    """Twenty cycles of one amplitude: ``20 / N(S)``, with a knee at 2e5 cycles."""
    curve = SNCurve(stress=100.0, cycles=1e6, slope=5.0, second_slope=9.0, knee=2e5)
    knee = 100.0 * 5 ** (1 / 5)
    N = 1e6 * (100 / amplitude) ** 5 if amplitude > knee else 2e5 * (knee / amplitude) ** 9
    time = np.linspace(0, 20, 20 * 64 + 1)
    found = rainflow_damage(time, amplitude * np.cos(2 * np.pi * time), curve)
    assert found.damage == pytest.approx(20 / N, rel=1e-12)
    assert found.life == pytest.approx(N, rel=1e-12)  # one cycle a second
    assert found.largest == pytest.approx(amplitude, rel=1e-12)


def test_mean_stress_and_endurance_limit():
    """Goodman: 40 around 150 of 300 is as 80 around zero; around -150 it is 40."""
    time = np.linspace(0, 10, 641)
    wave, curve = 40 * np.cos(2 * np.pi * time), CURVE.with_(ultimate=300.0)
    assert rainflow_damage(time, wave + 150, curve).damage == pytest.approx(10 * 0.8**5 / 1e6, rel=1e-12)
    assert rainflow_damage(time, wave - 150, curve).damage == pytest.approx(10 * 0.4**5 / 1e6, rel=1e-12)
    limited = rainflow_damage(time, wave, CURVE.with_(limit=40.0))
    assert (limited.damage, limited.life) == (0.0, np.inf)
    with pytest.raises(mp.InputError, match="reaches the tensile strength 300"):
        rainflow_damage(time, wave + 300, curve)


def narrow_band(sigma, centre=80.0, width=0.8, n=401):
    """A flat band, whose standard deviation is `sigma`."""
    f = np.linspace(centre - width / 2, centre + width / 2, n)
    return f, np.full(n, sigma**2 / width)


def test_narrow_band_is_the_closed_form_of_rayleigh():
    """``nu T (sqrt(2) sigma)^k Gamma(1 + k/2) / C``, Miles 1954; nu of a flat band is its radius of gyration."""
    f, psd = narrow_band(25.0)
    nu = np.sqrt(80.0**2 + 0.8**2 / 12)
    expected = nu * 3600 * (np.sqrt(2) * 25) ** 5 * gamma(3.5) / (1e6 * 100.0**5)
    found = random_damage(f, psd, CURVE, duration=3600.0, method="narrow_band")
    assert found.damage == pytest.approx(expected, rel=1e-5)  # the trapezoidal rule of the moments
    assert found.cycles == pytest.approx(nu * 3600, rel=1e-5)
    assert found.largest == pytest.approx(75.0, rel=1e-9)
    as_asked = random_damage(f, psd, CURVE, duration=3600.0)
    assert as_asked.method == "narrow_band"
    assert "Rayleigh" in as_asked.notes[0]


def test_narrow_band_with_two_slopes_and_a_limit():
    """Each piece is an incomplete Gamma function of ``S^2 / (2 sigma^2)``."""
    f, psd = narrow_band(25.0)
    curve = SNCurve(stress=60.0, cycles=1e6, slope=4.0, second_slope=7.0, limit=20.0)
    nu = np.sqrt(80.0**2 + 0.8**2 / 12)

    def above(S, k):
        return (np.sqrt(2) * 25) ** k * gamma(1 + k / 2) * gammaincc(1 + k / 2, S**2 / (2 * 25**2)) / (1e6 * 60.0**k)

    expected = nu * (above(60, 4) + above(20, 7) - above(60, 7))
    found = random_damage(f, psd, curve, duration=1.0, method="narrow_band")
    assert found.damage == pytest.approx(expected, rel=1e-5)


def test_dirlik_is_near_the_counts_of_a_long_history():
    """Two bands: a history of 4000 s with random phases; Dirlik's formula fits such counts to some per cent."""
    f = np.arange(0, 40.0, 0.05)
    psd = np.where((f > 2) & (f < 4), 60.0, 0.0) + np.where((f > 9) & (f < 12), 25.0, 0.0)
    curve = SNCurve(stress=50.0, cycles=1e5, slope=4.0)
    rng, n, rate = np.random.default_rng(4), 2**17, 100.0
    lines = np.fft.rfftfreq(n, 1 / rate)
    size = np.sqrt(np.interp(lines, f, psd) * n * rate / 2)
    stress = np.fft.irfft(size * np.exp(2j * np.pi * rng.uniform(size=len(lines))))
    counted = rainflow_damage(np.arange(n) / rate, stress, curve)
    found = random_damage(f, psd, curve, duration=counted.duration)
    assert found.method == "dirlik"
    assert found.damage == pytest.approx(counted.damage, rel=0.1)
    wide = random_damage(f, psd, curve, duration=counted.duration, method="narrow_band")
    assert wide.damage > 1.1 * counted.damage  # on the safe side


def test_dirlik_is_that_of_flife():
    """Its closed form for one slope; ours integrates the same density with any curve."""
    from FLife import Dirlik, SpectralData

    f = np.linspace(5, 200, 500)
    psd = 1 / (1 + (f / 60) ** 4)
    theirs = Dirlik(SpectralData(input={"PSD": psd, "f": f})).get_life(C=1e6 * 100.0**5, k=5)
    assert random_damage(f, psd, CURVE, duration=1.0).life == pytest.approx(theirs, rel=1e-8)


def test_sign_of_von_mises_stress():
    stress = np.random.default_rng(5).normal(size=(50, 6))
    found = signed_von_mises(stress)
    np.testing.assert_allclose(abs(found), von_mises(dict(zip("xx yy zz xy yz xz".split(), stress.T, strict=True))))
    np.testing.assert_allclose(signed_von_mises(-stress), -found)
    assert signed_von_mises(np.array([[5.0, 5, 5.1, 0, 0, 0]]))[0] > 0


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: SNCurve(stress=1.0, cycles=1.0, slope=0.0), "slope of an S-N curve must be a positive number"),
        (lambda: SNCurve(stress=1.0, cycles=1.0, slope=3.0, limit=-1.0), "endurance limit is zero or more"),
        (lambda: rainflow_damage(np.zeros(1), np.zeros(1), CURVE), "two finite values"),
        (lambda: random_damage(np.ones(2), np.ones(2), CURVE, duration=1.0), "ascending frequencies"),
        (lambda: random_damage(np.arange(2.0), -np.ones(2), CURVE, duration=1.0), "not negative"),
        (lambda: random_damage(np.arange(2.0), np.ones(2), CURVE, duration=1.0, method="dirlick"), "'dirlik'"),
    ],
)
def test_refused(act, words):
    with pytest.raises(mp.InputError, match=words):
        act()


def test_no_stress_no_damage():
    assert random_damage(np.arange(3.0), np.zeros(3), CURVE, duration=1.0).life == np.inf
    counted = rainflow_damage(np.arange(3.0), np.zeros(3), CURVE)
    assert (counted.damage, counted.largest) == (0, 0)


def test_what_lies_on_the_limits_is_accepted():
    """Two frequencies, the first of them zero, a duration of zero; a history of two values, which is half a cycle."""
    assert random_damage(np.array([0.0, 1.0]), np.ones(2), CURVE, duration=1.0).damage > 0
    assert random_damage(np.array([0.0, 1.0]), np.ones(2), CURVE, duration=0.0).damage == 0
    half = rainflow_damage(np.arange(2.0), np.array([0.0, 60.0]), CURVE)
    assert half.damage == pytest.approx(rainflow_damage(np.arange(3.0), np.array([0.0, 30.0, 60.0]), CURVE).damage)
    assert half.cycles == 0.5


@pytest.mark.parametrize(
    ("f", "psd", "duration"),
    [
        ([1.0, 2.0], [1.0, np.inf], 1.0),
        ([1.0, 2.0], [1.0, -1e-9], 1.0),
        ([1.0, 2.0], [1.0, 1.0], -1e-9),
        ([1.0, 2.0], [1.0, 1.0], np.nan),
        ([-1e-9, 2.0], [1.0, 1.0], 1.0),
        ([1.0, 1.0], [1.0, 1.0], 1.0),
        ([1.0], [1.0], 1.0),
        ([1.0, 2.0], [1.0, 1.0, 1.0], 1.0),
    ],
)
def test_what_lies_outside_is_refused(f, psd, duration):
    with pytest.raises(mp.InputError):
        random_damage(np.array(f), np.array(psd), CURVE, duration=duration)
