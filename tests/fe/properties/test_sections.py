"""Standard sections against tables and integrals."""

import numpy as np
import pytest

import modalprep as mp

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)


def test_rectangle_torsion_of_timoshenko():
    """Timoshenko and Goodier, table 9: J = k1 (2a)^3 2b with k1 = 0.1406, 0.196, 0.229, 0.281, 0.312."""
    for ratio, k1 in ((1, 0.1406), (1.5, 0.196), (2, 0.229), (4, 0.281), (10, 0.312)):
        beam = mp.fe.beam_section("rectangle", STEEL, width=0.02, height=0.02 * ratio)
        assert beam.J == pytest.approx(k1 * 0.02**4 * ratio, rel=3e-3)  # the table has three or four digits
        assert beam.J == mp.fe.beam_section("rectangle", STEEL, width=0.02 * ratio, height=0.02).J


@pytest.mark.parametrize(
    ("shape", "sizes", "inside"),
    [
        ("rectangle", {"width": 0.04, "height": 0.1}, lambda y, z: (abs(y) < 0.02) & (abs(z) < 0.05)),
        ("rod", {"diameter": 0.08}, lambda y, z: y**2 + z**2 < 0.04**2),
        ("tube", {"diameter": 0.1, "thickness": 0.01}, lambda y, z: (np.hypot(y, z) < 0.05) & (np.hypot(y, z) > 0.04)),
        (
            "box",
            {"width": 0.06, "height": 0.1, "thickness": 0.01},
            lambda y, z: (abs(y) < 0.03) & (abs(z) < 0.05) & ~((abs(y) < 0.02) & (abs(z) < 0.04)),
        ),
        (
            "i",
            {"width": 0.06, "height": 0.1, "flange": 0.01, "web": 0.006},
            lambda y, z: (abs(y) < 0.03) & (abs(z) < 0.05) & ((abs(z) > 0.04) | (abs(y) < 0.003)),
        ),
    ],
)
def test_area_and_moments_are_integrals_over_the_section(shape, sizes, inside):
    """Midpoint rule on a grid of 1500 x 1500 cells; e2 = y carries the width, e3 = z the height."""
    edge = (np.arange(1500) + 0.5) / 1500 * 0.12 - 0.06
    y, z = np.meshgrid(edge, edge, indexing="ij")
    where, cell = inside(y, z), (0.12 / 1500) ** 2
    beam = mp.fe.beam_section(shape, STEEL, **sizes)
    found = np.array([beam.A, beam.Iy, beam.Iz])
    exact = cell * np.array([where.sum(), (z**2 * where).sum(), (y**2 * where).sum()])
    np.testing.assert_allclose(found, exact, rtol=4e-3)  # cells on the edge: 1 / 750 of the walls' thickness


def test_tube_torsion_and_shear_are_exact():
    """Polar moment; Cowper's factor 2 (1 + nu) / (4 + 3 nu) of the thin tube, 6 (1 + nu) / (7 + 6 nu) of the rod."""
    thin = mp.fe.beam_section("tube", STEEL, diameter=0.1, thickness=1e-5)
    assert thin.J == pytest.approx(2 * np.pi * 0.05**3 * 1e-5, rel=1e-3)
    assert thin.ky == pytest.approx(2.6 / 4.9, rel=1e-3)
    assert mp.fe.beam_section("rod", STEEL, diameter=0.1).kz == pytest.approx(7.8 / 8.8)


def test_thin_box_torsion_is_bredt():
    box = mp.fe.beam_section("box", STEEL, width=0.06, height=0.1, thickness=0.001)
    a, b = 0.059, 0.099
    assert box.J == pytest.approx(4 * (a * b) ** 2 * 0.001 / (2 * (a + b)), rel=1e-12)


@pytest.mark.parametrize(
    ("shape", "sizes", "words"),
    [
        ("oval", {}, "unknown section shape 'oval'"),
        ("tube", {"diameter": 0.1}, "needs diameter, thickness; got diameter"),
        ("tube", {"diameter": 0.1, "thickness": 0.06}, "walls of 0.06 m overlap"),
        ("box", {"width": 0.1, "height": -0.1, "thickness": 0.01}, "height = -0.1 m must be positive"),
        ("i", {"width": 0.01, "height": 0.1, "flange": 0.01, "web": 0.02}, "thinner than the width"),
    ],
)
def test_impossible_sections(shape, sizes, words):
    with pytest.raises(mp.InputError, match=words):
        mp.fe.beam_section(shape, STEEL, **sizes)


@pytest.mark.parametrize(
    ("shape", "material", "words"),
    [
        (STEEL, "rectangle", "the shape must be of type str, not Material"),
        ("rod", "steel", "of type Material, not str"),
    ],
)
def test_arguments_in_another_order_are_refused(shape, material, words):
    with pytest.raises(mp.InputError, match=words):
        mp.fe.beam_section(shape, material, diameter=0.1)
