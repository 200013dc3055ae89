"""Bearings by coefficients: a seal that drives the whirl, journal bearings, tables."""

import numpy as np
import pytest
from discs import MASS, X, held
from shafts import LENGTH, SPIN, floating
from size import FULL

import modalprep as mp
from modalprep.multibody.rotors.bearings import BearingCoefficients, read_bearing, short_journal_bearing
from modalprep.multibody.rotors.whirl import whirl_modes

# a shaft as in tests/shafts.py on two journal bearings of 525 N at 4000 rpm: the slowest eigenvalues by ROSS 2.3.0, 1/s
JOURNALS = {"load": 525.0, "length": 0.03, "diameter": 0.1, "clearance": 1e-4, "viscosity": 0.1}
WHIP = [-0.42766178037 + 107.4966580426j, 1.4765007846 + 113.6312182448j, -44.617471588 + 212.0915788804j]


def test_a_seal_drives_the_forward_whirl():
    """``m s^2 + c s + k - i q = 0`` of a forward circle grows where the coupling q is above ``c sqrt(k / m)``."""
    k, c = 1e6, 200.0
    limit = c * np.sqrt(k / MASS)
    for q in ((1 - 1e-4) * limit, (1 + 1e-4) * limit):
        K = np.array([[[0.0, q], [-q, 0.0]]])
        seal = BearingCoefficients(speed=np.array([100.0]), stiffness=K, damping=c * np.eye(2)[None])
        rotor = held([1e5, k, k, 0, 0, 0])
        rotor = rotor.with_(loads=(*rotor.loads, seal.load("seal", "disc.hub", 100.0)))
        found = whirl_modes(rotor, "flight", 100.0, axis=X)
        growing = found.eigenvalue.real > 1e-6
        assert np.any(growing) == (q > limit)
        assert {found.kind[n] for n in np.flatnonzero(growing)} <= {"forward"}


@pytest.mark.skipif(not FULL, reason="tens of seconds: a control law is differentiated along a turn of the shaft")
def test_shaft_in_journal_bearings():
    """Oil whip: the second mode grows at 4000 rpm. Control laws are differentiated by differences, to 1e-11."""
    bearing = short_journal_bearing([SPIN], **JOURNALS)
    places = {"root": 0.0, "tip": LENGTH}
    loads = tuple(bearing.load(end, f"shaft.{end}", SPIN, position=(x, 0, 0)) for end, x in places.items())
    found = whirl_modes(floating().with_(loads=loads), "flight", SPIN, axis=X, modes=3)
    assert found.eigenvalue == pytest.approx(WHIP, rel=1e-7)


def test_published_coefficients():
    """Friswell and others, example 5.5.1: 1500 rpm, four digits."""
    K, C = short_journal_bearing([50 * np.pi], **JOURNALS).at(50 * np.pi)
    assert np.array([[12.81, 16.39], [-25.06, 8.815]]) * 1e6 == pytest.approx(K, rel=5e-4)
    assert np.array([[232.9, -81.92], [-81.92, 294.9]]) * 1e3 == pytest.approx(C, rel=5e-4)


def test_a_table_in_rpm(tmp_path):
    file = tmp_path / "seal.csv"
    file.write_text("rpm,kxx,kxy,kyx,kyy,cxx,cyy\n1000,1,2,-2,1,5,6\n3000,3,4,-4,3,5,6\n")
    K, C = read_bearing(file).at(2000 * np.pi / 30)
    assert K == pytest.approx(np.array([[2, 3], [-3, 2]]))
    assert C == pytest.approx(np.diag([5, 6]))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("rpm,kxx,kyy,cxx\n1,1,1,1\n", "has no column 'cyy'"),
        ("kxx,kyy,cxx,cyy\n1,1,1,1\n", "has no column 'speed'"),
        ("rpm,kxx,kyy,cxx,cyy,mass\n1,1,1,1,1,1\n", "column 'mass' is none of"),
        ("rpm,kxx,kyy,cxx,cyy\n1,1,1,1,stiff\n", "every row needs 5 numbers"),
        ("rpm,kxx,kyy,cxx,cyy\n2,1,1,1,1\n1,1,1,1,1\n", "must ascend"),
        ("", "has no column 'kxx'"),
    ],
)
def test_damaged_tables(tmp_path, text, says):
    file = tmp_path / "seal.csv"
    file.write_text(text)
    with pytest.raises(mp.InputError, match=says):
        read_bearing(file)


def test_a_bearing_is_not_extrapolated():
    bearing = short_journal_bearing([100.0, 200.0], **JOURNALS)
    with pytest.raises(mp.InputError, match="from 100 to 200 rad/s, not at 250"):
        bearing.load("b", "disc.hub", 250.0)
    with pytest.raises(mp.InputError, match="are not two of x, y and z"):
        bearing.load("b", "disc.hub", 150.0, axes="yy")
    with pytest.raises(mp.InputError, match="positive viscosity"):
        short_journal_bearing([100.0], **JOURNALS | {"viscosity": 0.0})
