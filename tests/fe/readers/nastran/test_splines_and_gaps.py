"""RSPLINE by the cubics of a beam, and CGAP as the springs of an open or a closed gap."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.errors import InputError

LINE = "GRID,1\nGRID,2,,1.\nGRID,3,,3.\nGRID,4,,4.\n"
BEAMS = "CBAR,1,5,1,2,0.,1.,0.\nCBAR,2,5,2,3,0.,1.,0.\nCBAR,3,5,3,4,0.,1.,0.\n"
BEAMS += "PBAR,5,7,.01,3.-6,2.-6,4.-6\nMAT1,7,2.+11,,.3,8000.\n"


@pytest.fixture
def read(tmp_path):
    def reader(text, *units, **more):
        (tmp_path / "deck.bdf").write_text(text)
        return mp.read_mesh(tmp_path / "deck.bdf", *units, **more)

    return reader


def followed(mesh, node, component, motion):
    """The displacement of a component that the equations give for the motion (n, 6) of the independent nodes."""
    held = np.zeros(6)
    held[component] = 1.0
    for equation in mesh.equations:
        if equation.nodes[0] == node and np.allclose(equation.coefficients[0], held):
            return -np.sum(equation.coefficients[1:] * motion[equation.nodes[1:]])
    raise AssertionError(f"no equation drives component {component} of node {node}")


@pytest.mark.parametrize("unit", ["m", "mm"])
def test_a_straight_spline_is_a_cubic(read, unit):
    """Lateral displacement and slope between two ends by Hermite's polynomials, the others linear."""
    mesh = read(LINE + BEAMS + "RSPLINE,9,,1,2,123456,3,123456,4\n", unit, "kg")
    L = np.ptp(mesh.points[:, 0])
    ends = np.random.default_rng(3).normal(size=(2, 6))
    motion = np.zeros((4, 6))
    motion[[0, 3]] = ends
    for node, s in ((1, 0.25), (2, 0.75)):
        hermite = np.array([1 - 3 * s**2 + 2 * s**3, L * s * (1 - s) ** 2, 3 * s**2 - 2 * s**3, -L * s**2 * (1 - s)])
        slope = np.array([-6 * s * (1 - s), L * (1 - s) * (1 - 3 * s), 6 * s * (1 - s), -L * s * (2 - 3 * s)]) / L
        y = np.array([ends[0, 1], ends[0, 5], ends[1, 1], ends[1, 5]])
        z = np.array([ends[0, 2], -ends[0, 4], ends[1, 2], -ends[1, 4]])
        linear = (1 - s) * ends[0] + s * ends[1]
        exact = [linear[0], hermite @ y, hermite @ z, linear[3], -slope @ z, slope @ y]
        found = [followed(mesh, node, c, motion) for c in range(6)]
        np.testing.assert_allclose(found, exact, rtol=1e-9)


def test_rotations_that_are_not_named_bend_the_spline(read):
    """Components 123 of a grid depend, its rotations are free: the line clamped there passes through its slope."""
    mesh = read(
        "GRID,1\nGRID,2,,1.\nGRID,3,,2.\n" + BEAMS.replace("CBAR,3,5,3,4,0.,1.,0.\n", "") + "RSPLINE,9,,1,2,123,3\n"
    )
    motion = np.zeros((3, 6))
    motion[2, 1] = 1.0  # the end moves by 1, no rotation anywhere: two clamped halves in a row
    assert followed(mesh, 1, 1, motion) == pytest.approx(0.5)
    motion = np.zeros((3, 6))
    motion[1, 5] = 1.0  # of two equal halves, the slope in the middle moves it by nothing
    assert followed(mesh, 1, 1, motion) == pytest.approx(0.0, abs=1e-12)


def test_rigid_motions_of_a_crooked_spline(read):
    """Through grids off one line, in a cylindrical system: what is rigid at the ends is rigid between."""
    grids = "CORD2C,6,,0.,0.,0.,0.,0.,1.\n,1.,0.,0.\nGRID,1\nGRID,2,,1.,.3,.1,6\nGRID,3,,2.,-.2,.4,6\nGRID,4,,3.,.1\n"
    mesh = read(grids + BEAMS + "RSPLINE,9,.2,1,2,123456,3,123456,4\n")
    rng = np.random.default_rng(1)
    shift, turn = rng.normal(size=(2, 3))
    motion = np.hstack([shift + np.cross(turn, mesh.points), np.tile(turn, (4, 1))])
    for equation in mesh.equations:
        assert np.sum(equation.coefficients * motion[equation.nodes]) == pytest.approx(0.0, abs=1e-12)
    assert len(mesh.equations) == 12


@pytest.mark.parametrize(
    ("card", "said"),
    [
        ("RSPLINE,9,,1,2,123456", "its last grid must be independent"),
        ("RSPLINE,9,,1,2,,3", "one between it and the first depend"),
        ("RSPLINE,9,,1,1,123,3", "lie in one place"),
        ("RSPLINE,9,,1,2,789,3", "are not made of the digits 1 to 6"),
    ],
)
def test_splines_that_cannot_be(read, card, said):
    with pytest.raises(InputError, match=said):
        read(LINE + BEAMS + card)


GAP = "GRID,5,,4.5\nCGAP,8,3,4,5,0.,1.,0.\nPGAP,3,.01,,2.+6,3.,4.+5\nCONM2,6,5,,2.\n"


@pytest.mark.parametrize(
    ("gaps", "property_card", "translation"),
    [
        ("closed", "PGAP,3,.01,,2.+6,3.,4.+5", (2e6, 4e5, 4e5)),
        ("closed", "PGAP,3,.01,,2.+6,3.,,.1", (2e6, 2e5, 2e5)),  # KT is MU1 KA where it is blank
        ("open", "PGAP,3,.01,,2.+6,3.,4.+5", (3, 0, 0)),
    ],
)
def test_gaps(read, gaps, property_card, translation):
    """The spring of a gap along x, in N/m also from mm."""
    text = LINE + BEAMS + GAP.replace("PGAP,3,.01,,2.+6,3.,4.+5", property_card)
    mesh = read(text, gaps=gaps)
    assert mesh.properties["pgap_3"].translation == pytest.approx(translation)
    assert mesh.cells["line"][mesh.groups["pgap_3"]["line"]].tolist() == [[3, 4]]
    np.testing.assert_allclose(mesh.data["frame"]["line"][mesh.groups["pgap_3"]["line"][0]][0], [1, 0, 0])
    assert f"gaps (CGAP) are {gaps}, as asked" in mesh.notes


def test_an_open_gap_without_stiffness_is_nothing(read):
    assert "pgap_3" not in read(LINE + BEAMS + GAP.replace("3.,4.+5", ""), gaps="open").properties


def test_gaps_are_asked_for(read, project):
    with pytest.raises(InputError, match=r"CGAP 8: a gap is open or closed: write gaps = 'closed' or gaps = 'open'"):
        read(LINE + BEAMS + GAP)
    assert "pgap_3" not in read(LINE + BEAMS + GAP, ignore=["CGAP"]).properties
    with pytest.raises(InputError, match="'gaps' is for CGAP in decks of Nastran"):
        mp.read_mesh(project / "meshes" / "beam.msh", gaps="open")
    with pytest.raises(InputError, match="gaps of a deck: 'shut'"):
        read(LINE + BEAMS + GAP, gaps="shut")
