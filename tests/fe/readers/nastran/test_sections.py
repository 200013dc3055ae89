"""Sections of Nastran's bars by their dimensions, against hand calculation and contour integrals."""

import math

import numpy as np
import pytest
from fe.decks import BAR, GRIDS, STEEL

from modalprep.errors import InputError
from modalprep.fe.readers.nastran.sections import Section
from modalprep.fe.readers.nastran.shapes import SHAPES, two_cells


@pytest.mark.parametrize(
    ("kind", "dims", "expected"),
    [
        ("ROD", (2.0,), (4 * math.pi, 4 * math.pi, 4 * math.pi, 0, 8 * math.pi)),
        ("TUBE", (2.0, 1.0), (3 * math.pi, 15 * math.pi / 4, 15 * math.pi / 4, 0, 15 * math.pi / 2)),
        ("TUBE2", (2.0, 1.0), (3 * math.pi, 15 * math.pi / 4, 15 * math.pi / 4, 0, 15 * math.pi / 2)),
        ("BAR", (3.0, 3.0), (9, 27 / 4, 27 / 4, 0, 0.1408 * 81)),  # torsion of a square: 0.1406 a^4
        # outer 40 x 60, walls 3 above and below, 2 at the sides
        ("BOX", (40.0, 60.0, 3.0, 2.0), (456, (40 * 60**3 - 36 * 54**3) / 12, (60 * 40**3 - 54 * 36**3) / 12, 0, None)),
        # height 100, flanges 50 x 10, web 6
        (
            "I",
            (100.0, 50.0, 50.0, 6.0, 10.0, 10.0),
            (1480, (50 * 100**3 - 44 * 80**3) / 12, (20 * 50**3 + 80 * 6**3) / 12, 0, None),
        ),
        (
            "I1",
            (44.0, 6.0, 80.0, 100.0),
            (1480, (50 * 100**3 - 44 * 80**3) / 12, (20 * 50**3 + 80 * 6**3) / 12, 0, None),
        ),
        # the same pieces lying: legs 10 x 50 upright at both sides, web 80 x 6
        ("H", (80.0, 20.0, 50.0, 6.0), (1480, (20 * 50**3 + 80 * 6**3) / 12, (50 * 100**3 - 44 * 80**3) / 12, 0, None)),
        ("CHAN", (50.0, 100.0, 6.0, 10.0), (1480, (50 * 100**3 - 44 * 80**3) / 12, None, 0, None)),
        # flange 60 x 10 over a stem 10 x 60: centroid 52.5 from below by hand
        (
            "T",
            (60.0, 70.0, 10.0, 10.0),
            (
                1200,
                60 * 10**3 / 12 + 600 * 17.5**2 + 10 * 60**3 / 12 + 600 * 17.5**2,
                (10 * 60**3 + 60 * 10**3) / 12,
                0,
                None,
            ),
        ),
        # equal angle 100 x 10: I12 = -1.05e6 about, J = sum b t^3 / 3 on mid-lines
        ("L", (100.0, 100.0, 10.0, 10.0), (1900, 1.8002e6, 1.8002e6, -1.0658e6, 190 * 1000 / 3)),
    ],
)
def test_sections_by_their_dimensions(kind, dims, expected):
    count, law = SHAPES[kind]
    assert count == len(dims)
    for found, value in zip(law(*dims)[:5], expected, strict=True):
        assert value is None or found == pytest.approx(value, rel=2e-3 if kind in ("BAR", "L") else 1e-12, abs=1e-9)


def test_closed_and_open_torsion():
    """Bredt for the box; a slit makes it an open section, so its J is far above that of the I."""
    J = SHAPES["BOX"][1](40.0, 60.0, 3.0, 2.0)[4]
    assert pytest.approx(4 * (38 * 57) ** 2 / (2 * 38 / 3 + 2 * 57 / 2)) == J
    assert SHAPES["I"][1](100.0, 50.0, 50.0, 6.0, 10.0, 10.0)[4] == pytest.approx((2 * 50 * 10**3 + 90 * 6**3) / 3)
    assert Section(A=1, I1=2.0, I2=2.0, I12=1.0, J=1).turned == pytest.approx((3, 1, math.pi / 4))


def contour(*loops):
    """Area and moments (about z, about y, product) at the centroid of polygons (y, z); clockwise ones are holes."""
    sums = np.zeros(6)
    for loop in loops:
        (y0, z0), (y1, z1) = np.array(loop, dtype=float).T, np.roll(np.array(loop, dtype=float), -1, axis=0).T
        cross = y0 * z1 - y1 * z0
        terms = [cross / 2, (y0 + y1) * cross / 6, (z0 + z1) * cross / 6, (y0**2 + y0 * y1 + y1**2) * cross / 12,
                 (z0**2 + z0 * z1 + z1**2) * cross / 12,
                 (y0 * z1 + 2 * y0 * z0 + 2 * y1 * z1 + y1 * z0) * cross / 24]  # fmt: skip
        sums += np.array([np.sum(term) for term in terms])
    A, Sy, Sz, yy, zz, yz = sums * np.sign(sums[0])
    return A, yy - Sy**2 / A, zz - Sz**2 / A, yz - Sy * Sz / A


# Contours from the figures of the PBARL card, corner by corner: height along y, width along z.
CONTOURS = [
    ("BOX1", (8, 12, 1, 2, 0.5, 1.5), [[(0, 0), (0, 8), (12, 8), (12, 0)], [(2, 1.5), (11, 1.5), (11, 7.5), (2, 7.5)]]),
    ("CHAN1", (5, 1, 8, 10), [[(0, 0), (0, 6), (1, 6), (1, 1), (9, 1), (9, 6), (10, 6), (10, 0)]]),
    ("CHAN2", (1, 2, 7, 10), [[(0, 0), (0, 10), (7, 10), (7, 9), (2, 9), (2, 1), (7, 1), (7, 0)]]),
    (
        "CROSS",
        (6, 2, 10, 3),
        [[(-5, -1), (-1.5, -1), (-1.5, -4), (1.5, -4), (1.5, -1), (5, -1), (5, 1), (1.5, 1), (1.5, 4), (-1.5, 4),
          (-1.5, 1), (-5, 1)]],
    ),
    ("HEXA", (2, 9, 6), [[(-3, -2.5), (-3, 2.5), (0, 4.5), (3, 2.5), (3, -2.5), (0, -4.5)]]),
    (
        "HAT",
        (6, 1, 8, 3),
        [[(0, -7), (0, -3), (5, -3), (5, 3), (0, 3), (0, 7), (1, 7), (1, 4), (6, 4), (6, -4), (1, -4), (1, -7)]],
    ),
    (
        "HAT1",
        (14, 7, 8, 1, 2),
        [[(0, -7), (0, 7), (3, 7), (3, 4), (7, 4), (7, -4), (3, -4), (3, -7)], [(2, -3), (6, -3), (6, 3), (2, 3)]],
    ),
    ("T1", (10, 7, 1, 2), [[(-5, 7), (-5, 8), (5, 8), (5, 7), (1, 7), (1, 0), (-1, 0), (-1, 7)]]),
    ("T2", (8, 10, 1, 2), [[(0, -4), (0, 4), (1, 4), (1, 1), (10, 1), (10, -1), (1, -1), (1, -4)]]),
    (
        "DBOX",  # z to the right: left cell 3 wide with walls 1 (left), 0.5 (above), 1.5 (below), middle wall 2
        (14, 9, 5, 1, 2, 3, 0.5, 1.5, 1, 2),
        [[(0, 0), (0, 14), (9, 14), (9, 0)], [(1.5, 1), (8.5, 1), (8.5, 4), (1.5, 4)],
         [(2, 6), (8, 6), (8, 11), (2, 11)]],
    ),
    (
        "GBOX",
        (12, 9, 1, 2, 1.5, 4),
        [[(0, -6), (0, 6), (2, 6), (2, 3.5), (8, 3.5), (8, 6), (9, 6), (9, -6), (8, -6), (8, -3.5), (2, -3.5), (2, -6)],
         [(2, -2), (8, -2), (8, 2), (2, 2)]],
    ),
    (
        "FCROSS",
        (12, 14, 2, 3, 6, 1, 8, 1.5),
        [[(-6, -3), (-6, 3), (-5, 3), (-5, 1), (-1.5, 1), (-1.5, 5.5), (-4, 5.5), (-4, 7), (4, 7), (4, 5.5), (1.5, 5.5),
          (1.5, 1), (5, 1), (5, 3), (6, 3), (6, -3), (5, -3), (5, -1), (1.5, -1), (1.5, -5.5), (4, -5.5), (4, -7),
          (-4, -7), (-4, -5.5), (-1.5, -5.5), (-1.5, -1), (-5, -1), (-5, -3)]],
    ),
    ("Z", (4, 2, 8, 10), [[(-5, -1), (-5, 5), (-4, 5), (-4, 1), (5, 1), (5, -5), (4, -5), (4, -1)]]),
]  # fmt: skip


@pytest.mark.parametrize(("kind", "dims", "loops"), CONTOURS)
def test_area_and_moments_are_those_of_the_contour(kind, dims, loops):
    count, law = SHAPES[kind]
    assert count == len(dims)
    np.testing.assert_allclose(law(*dims)[:4], contour(*loops), rtol=1e-12, atol=1e-9)


def dbox(middle, left=7.0):
    """Torsion constant of a box 14 x 9 with walls of 0.5 and a middle wall."""
    return SHAPES["DBOX"][1](14, 9, left, 0.5, middle, 0.5, 0.5, 0.5, 0.5, 0.5)[4]


def test_two_cells_twist_by_bredt_and_batho():
    """Equal cells do not use their middle wall; without it any two are one cell, with a stiff one each is a cell."""
    a, h, t = 13.5, 8.5, 0.5  # along the middles of the walls
    one = 4 * (a * h) ** 2 / (2 * (a + h) / t)
    for middle in (0.1, 0.5, 2.0):
        assert dbox(middle) == pytest.approx(one, rel=1e-12)
    assert dbox(1e-9, left=4.0) == pytest.approx(one, rel=1e-6)
    first, second = 4.0 - 0.25, 14 - 4.0 - 0.25
    apart = sum(4 * (w * h) ** 2 / ((2 * w + h) / t) for w in (first, second))
    assert two_cells((first, second), (h, h), ((t, t, t), (t, t, t)), 1e9) == pytest.approx(apart, rel=1e-6)
    q = np.linalg.solve([[(2 * first + h) / t + h / 0.7, -h / 0.7], [-h / 0.7, (2 * second + h) / t + h / 0.7]],
                        [2 * first * h, 2 * second * h])  # flows for G theta' = 1  # fmt: skip
    assert dbox(0.7, left=4.0) == pytest.approx(2 * first * h * q[0] + 2 * second * h * q[1], rel=1e-12)


@pytest.mark.parametrize("kind", SHAPES)
def test_every_shape_has_positive_stiffness(kind, read):
    """Dimensions that fit every figure; the shear factors are below one."""
    sizes = {
        "9.,4.,5.,1.,1.,1.": "I",
        "9.,8.,1.,1.,1.,1.": "BOX1",
        "5.,9.,1.,1.": "CHAN T T2",
        "9.,8.,1.,1.": "BOX L",
        "9.,5.,1.,1.": "T1",
        "5.,1.,8.,3.": "HAT",
        "14.,7.,8.,1.,2.": "HAT1",
        "4.,1.,7.,9.": "I1 CHAN1 Z",
        "1.,1.,7.,9.": "CHAN2",
        "4.,1.,7.,1.": "CROSS",
        "4.,2.,7.,1.": "H",
        "2.,9.,6.": "HEXA",
        "9.,8.,4.,1.,1.,1.,1.,1.,1.,1.": "DBOX",
        "9.,8.,1.,1.,1.,2.": "GBOX",
        "9.,8.,1.,1.,4.,1.,4.,1.": "FCROSS",
        "2.": "ROD",
        "2.,1.": "TUBE TUBE2",
        "3.,4.": "BAR",
    }
    dims = {name: text for text, names in sizes.items() for name in names.split()}
    mesh = read(GRIDS + BAR + f"PBARL,5,7,,{kind},,,,,+\n+,{dims[kind]},.7\n" + STEEL)
    beam = mesh.properties["pbarl_5"]
    assert min(beam.A, beam.Iy, beam.Iz, beam.J, beam.nsm) > 0
    assert beam.nsm == 0.7
    assert kind in ("L", "Z") or (0 < beam.ky < 1 and 0 < beam.kz < 1 and beam.theory == "timoshenko")
    assert any(f"PBARL {kind}: torsion constant" in note for note in mesh.notes) == (kind != "ROD")


@pytest.mark.parametrize(
    ("kind", "dims"),
    [
        ("DBOX", "9.,8.,1.,1.,1.,1.,1.,1.,1.,1."),  # the middle wall lies in the left one
        ("DBOX", "9.,8.,4.,1.,0.,1.,1.,1.,1.,1."),
        ("GBOX", "9.,8.,1.,1.,1.,8."),
        ("FCROSS", "9.,8.,4.,1.,4.,5.,4.,1."),
    ],
)
def test_dimensions_that_do_not_fit_are_refused(kind, dims, read):
    with pytest.raises(InputError, match=f"make no {kind}"):
        read(GRIDS + BAR + f"PBARL,5,7,,{kind},,,,,+\n+,{dims}\n" + STEEL)


def test_shear_factors_of_the_shapes():
    """Round 0.9 (NX Nastran's frequencies, test_mass_distribution.py), rectangle 5/6, web over area."""
    assert SHAPES["ROD"][1](2.0)[5:] == (0.9, 0.9)
    assert SHAPES["BAR"][1](2.0, 3.0)[5:] == pytest.approx((5 / 6, 5 / 6))
    assert SHAPES["I"][1](100.0, 50.0, 50.0, 6.0, 10.0, 10.0)[5:] == pytest.approx((480 / 1480, 5 / 6 * 1000 / 1480))
    assert SHAPES["BOX"][1](40.0, 60.0, 3.0, 2.0)[5:] == pytest.approx((4 * 54 / 456, 6 * 36 / 456))


WALLS = {  # area, areas that carry the shear forces (5/6 of solid and outstanding walls), sum b t^3 / 3 or Bredt
    "BOX1": (
        (8, 12, 1.25, 2, 0.5, 1.5),
        43.5,
        8.75 * 2,
        6 * 3.25,
        4 * (7 * 10.375) ** 2 / (7 * (1 / 1.25 + 1 / 2) + 10.375 * (1 / 0.5 + 1 / 1.5)),
    ),
    "I1": ((44, 6, 80, 100), 1480, 80 * 6, 5 / 6 * 1000, (2 * 50 * 10**3 + 90 * 6**3) / 3),
    "T": ((60, 70, 10, 8), 1080, 480, 5 / 6 * 600, (60 * 10**3 + 65 * 8**3) / 3),
    "T1": ((10, 7, 1.5, 2), 29, 5 / 6 * 15, 14, (10 * 1.5**3 + 7.75 * 2**3) / 3),
    "T2": ((8, 10, 1.5, 2), 29, 17, 5 / 6 * 12, (8 * 1.5**3 + 9.25 * 2**3) / 3),
    "L": ((50, 100, 8, 5), 860, 5 / 6 * 500, 5 / 6 * 400, (47.5 * 8**3 + 96 * 5**3) / 3),
    "CHAN": ((50, 100, 6, 10), 1480, 480, 5 / 6 * 1000, (2 * 47 * 10**3 + 90 * 6**3) / 3),
    "CHAN1": ((5, 1.2, 7, 10), 27, 8.4, 5 / 6 * 18.6, (2 * 5.6 * 1.5**3 + 8.5 * 1.2**3) / 3),
    "CHAN2": ((1.5, 2, 7, 10), 35, 5 / 6 * 21, 14, (2 * 6 * 1.5**3 + 8.5 * 2**3) / 3),
    "Z": ((4, 2, 7, 10), 32, 14, 5 / 6 * 18, (2 * 6 * 1.5**3 + 8.5 * 2**3) / 3),
    "CROSS": ((6, 2, 10, 3), 38, 5 / 6 * 20, 5 / 6 * 24, (10 * 2**3 + 6 * 3**3) / 3),
    "H": ((80, 20, 50, 6), 1480, 5 / 6 * 1000, 480, (2 * 50 * 10**3 + 90 * 6**3) / 3),
    "HAT": ((6, 1.5, 8, 3), 34.5, 9, 5 / 6 * 25.5, 23 * 1.5**3 / 3),
    "HAT1": ((14, 7, 8, 0.5, 2), 39.5, 4, 5 / 6 * 35.5, 4 * (7.5 * 5.75) ** 2 / (7.5 * (2 + 0.5) + 2 * 5.75 / 0.5)),
}


@pytest.mark.parametrize("kind", WALLS)
def test_shear_areas_and_torsion_of_walls(kind):
    dims, area, *expected = WALLS[kind]
    shape = SHAPES[kind][1](*dims)
    assert pytest.approx(area) == shape.A
    assert [shape.k1 * area, shape.k2 * area, shape.J] == pytest.approx(expected)


def test_walls_that_do_not_fit_are_refused(read):
    with pytest.raises(InputError, match="PBARL 5: the dimensions 4, 4, 3, 3 make no BOX; correct them"):
        read(GRIDS + BAR + "PBARL,5,7,,BOX,,,,,+\n+,4.,4.,3.,3.\n" + STEEL)


LAMINATE = "GRID,1\nGRID,2,,1.\nGRID,3,,1.,1.\nGRID,4,,0.,1.\nCQUAD4,1,9,1,2,3,4\n"
LAMINATE += "MAT8,8,1.+11,2.+10,.25,5.+9,4.+9,3.+9,1600.\nMAT1,7,2.+11,,.3,8000.\n"


@pytest.mark.parametrize("symmetric", ["", "SYM"])
def test_global_plies_are_plies(read, symmetric):
    """PCOMPG names its plies by numbers, one in each line; PCOMP has two in each."""
    own = read(f"{LAMINATE}PCOMPG,9,-.01,2.,,,,,{symmetric}\n,1,8,.01,30.\n,5,7,.02,,YES\n,6,8,.005,-45.\n")
    same = read(f"{LAMINATE}PCOMP,9,-.01,2.,,,,,{symmetric}\n,8,.01,30.,,7,.02,,YES\n,8,.005,-45.\n")
    first, second = own.properties["pcompg_9"], same.properties["pcomp_9"]
    assert first.plies == second.plies
    assert [round(math.degrees(ply.angle)) for ply in first.plies][:3] == [30, 0, -45]
    assert first.plies[0].material.G13 == 4e9
    assert (first.offset, first.nsm) == (second.offset, 2.0)
    assert first.offset == pytest.approx(-0.01 + 0.035 * (2 if symmetric else 1) / 2)


@pytest.mark.parametrize(("field", "said"), [("", False), ("TWO", True), ("3", True), ("0", False)])
def test_bricks_that_ask_for_no_incompatible_modes(read, field, said):
    corners = "GRID,1\nGRID,2,,1.\nGRID,3,,1.,1.\nGRID,4,,0.,1.\nGRID,5,,0.,0.,1.\nGRID,6,,1.,0.,1.\n"
    deck = corners + "GRID,7,,1.,1.,1.\nGRID,8,,0.,1.,1.\nCHEXA,1,9,1,2,3,4,5,6,+\n+,7,8\nMAT1,7,2.+11,,.3,8000.\n"
    notes = " ".join(read(f"{deck}PSOLID,9,7,,{field}\n").notes)
    assert ("PSOLID 9: CHEXA with 8 grids have incompatible modes here" in notes) is said
