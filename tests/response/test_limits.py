"""Force limits and notches: by hand, by pyYeti, and the identity that a notched response is at its limit."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.response import force_limit, notch, quasi_static_limit

F = np.geomspace(5, 500, 2001)


def apparent_mass(f, m, rest, natural, z):
    """Force per base acceleration of a rigid mass and an oscillator on one base."""
    r = f / natural
    return rest + m * (1 + 2j * z * r) / (1 - r**2 + 2j * z * r)


@pytest.mark.parametrize("density", [False, True])
def test_notched_response_is_at_its_limit(density):
    power = 2 if density else 1
    given = np.where(F < 100, 4.0, 1.0)
    H = {"base": apparent_mass(F, 80, 20, 60, 0.02), "bracket": apparent_mass(F, 1, 0, 220, 0.01)}
    limits = {"base": force_limit(F, given, mass=100, factor=1.5, break_frequency=70, density=density), "bracket": 9.0}
    found = notch(F, given, H, limits, density=density, max_depth=np.inf)
    at = found.notched < given
    assert 0 < at.sum() < len(F)
    ratios = np.array([found.responses[n] / found.limits[n] for n in limits])
    assert np.abs(ratios.max(axis=0)[at] - 1).max() < 1e-14  # a product of a quotient
    assert ratios.max() <= 1 + 1e-14
    np.testing.assert_array_equal(found.notched[~at], given[~at])
    assert [n.reason for n in found.notches] == ["base", "bracket"]
    first = found.notches[0]
    assert first.frequency == pytest.approx(60, rel=5e-3)  # of the resonance, between the points of the axis
    peak = np.abs(apparent_mass(first.frequency, 80, 20, 60, 0.02))
    assert first.depth == pytest.approx(20 * np.log10(peak / 150), rel=1e-12)
    assert found.depth.max() == pytest.approx(max(n.depth for n in found.notches))
    assert first.start < first.frequency < first.end
    expected = np.abs(H["base"]) ** power * found.notched
    np.testing.assert_allclose(found.responses["base"], expected, rtol=1e-12)


@pytest.mark.parametrize("density", [False, True])
def test_no_notch_is_deeper_than_allowed(density):
    """A response of 100 times its limit: 40 dB, of which 14 are cut by default; 26 dB are left, by the definition."""
    f, one = np.array([10.0, 20.0, 30.0]), np.ones(3)
    H, limits = {"a": np.array([1.0, 1000.0, 1.0]), "b": np.array([1.0, 1.0, 30.0])}, {"a": 10.0, "b": 10.0}
    if density:
        limits = {name: x**2 for name, x in limits.items()}
    found = notch(f, one, H, limits, density=density)
    assert found.depth == pytest.approx([0, 14, 20 * np.log10(3)], abs=1e-12)
    assert [n.limited for n in found.notches] == [True, False]
    assert found.exceeded == {"a": (pytest.approx(26.0), 20.0)}
    deeper = notch(f, one, H, limits, density=density, max_depth={"a": 40.0, "b": 6.0})
    assert deeper.depth == pytest.approx([0, 40, 6])
    assert list(deeper.exceeded) == ["b"]
    with pytest.raises(mp.InputError, match="give a positive one"):
        notch(f, one, H, limits, density=density, max_depth=0.0)


def test_no_limit_no_notch():
    found = notch(F, np.ones(F.shape), {"base": F}, {"base": np.inf}, density=True)
    assert found.notches == ()
    np.testing.assert_array_equal(found.notched, found.given)
    assert notch(F, np.zeros(F.shape), {"base": F}, {"base": 1.0}, density=True).depth.max() == 0


def test_force_limit_by_hand():
    """20 kg, C = 1.2, break at 50 Hz: 24 N up to it, 6 N at 200 Hz; the density is the square."""
    f = np.array([10.0, 50.0, 200.0])
    values = {"mass": 20.0, "factor": 1.2, "break_frequency": 50.0}
    np.testing.assert_allclose(force_limit(f, np.ones(3), density=False, **values), [24, 24, 6], rtol=1e-14)
    np.testing.assert_allclose(force_limit(f, 0.5 * np.ones(3), density=True, **values), [288, 288, 18], rtol=1e-14)
    flat = force_limit(f, np.ones(3), density=False, rolloff=0.0, **values)
    np.testing.assert_allclose(flat, 24, rtol=1e-14)


def test_force_limit_of_pyyeti():
    with np.printoptions():
        from pyyeti import frclim
    found = force_limit(F, np.ones(F.shape), mass=1.0, factor=1.4, break_frequency=40.0, rolloff=1.5, density=False)
    np.testing.assert_allclose(found, [frclim.sefl(1.4, f, 40.0, 1.5) for f in F], rtol=1e-12)


def test_quasi_static_limit_of_a_random_force():
    """Cut at its level the force has three standard deviations of the design force."""
    force = np.abs(apparent_mass(F, 80, 20, 60, 0.02)) ** 2
    level = quasi_static_limit(F, force, mass=100.0, acceleration=20.0, density=True)
    found = notch(F, np.ones(F.shape), {"base": np.sqrt(force)}, {"base": level}, density=True, max_depth=np.inf)
    assert 3 * np.sqrt(np.trapezoid(found.responses["base"], F)) == pytest.approx(2000, rel=1e-12)
    assert np.all(quasi_static_limit(F, force, mass=1e4, acceleration=50.0, density=True) == np.inf)
    assert quasi_static_limit(F, force, mass=100.0, acceleration=20.0, density=False)[0] == 2000


@pytest.mark.parametrize(
    ("act", "words"),
    [
        (lambda: notch(F, F, {"base": F}, {"bas": 1.0}, density=True), "'bas' has no transfer; there are base"),
        (lambda: notch(F, F, {"base": F[:3]}, {"base": 1.0}, density=True), "as many values"),
        (lambda: notch(F, F, {"base": F}, {"base": 0.0}, density=True), "allows no input"),
        (lambda: force_limit(F, F, mass=-1, factor=1, break_frequency=9, density=True), "mass of a force limit"),
        (
            lambda: force_limit(F, F, mass=1, factor=1, break_frequency=9, rolloff=-1, density=True),
            "rolloff of a force limit",
        ),
        (lambda: quasi_static_limit(F, F, mass=1, acceleration=0, density=True), "positive mass and acceleration"),
    ],
)
def test_refused(act, words):
    with pytest.raises(mp.InputError, match=words):
        act()
