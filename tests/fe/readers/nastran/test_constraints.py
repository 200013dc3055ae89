"""Rigid elements and multi-point constraints of Nastran decks: kinematics by hand and equivalent models."""

from types import SimpleNamespace

import numpy as np
import pytest
from fe.decks import PBAR, STEEL

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.readers.nastran.constraints import is_line

# three bars from a clamped end, and a cylindrical system about the z axis through grid 6
FRAME = (
    "GRID,1,,0.,0.,0.\nGRID,2,,1.,0.,0.\nGRID,3,,1.,1.,.2\nGRID,4,,0.,1.,0.\nGRID,5,,2.,.3,.1\nGRID,6,,2.,1.,-.2\n"
    "CBAR,1,5,1,2,0.,1.,3.\nCBAR,2,5,1,4,1.,0.,3.\nCBAR,3,5,4,3,0.,1.,3.\nCBAR,4,5,5,6,1.,0.,3.\nCBAR,5,5,3,6,1.,0.,3.\n"
)
TAIL = PBAR + STEEL
ROOT = {"root": mp.Interface(node=1, kind="node")}
CD = "CORD2C,7,,1.,0.,-1.,1.,.1,1.,\n,2.,1.,0.\nCORD2R,8,,0.,0.,0.,1.,2.,3.,\n,1.,-1.,0.\n"


def turned(text):
    """Grids 3 in the cylindrical system 7, grid 5 in system 8: displacements only, the places are the same."""
    return text.replace("GRID,3,,1.,1.,.2", "GRID,3,,1.,1.,.2,7").replace("GRID,5,,2.,.3,.1", "GRID,5,,2.,.3,.1,8")


def model(mesh, **more):
    return mp.assemble(mesh, {}, ROOT, **more)


def frequencies(mesh, n=8):
    return mp.craig_bampton(model(mesh), modes=n).table.frequency[:n]


def row(grids, number):
    return int(np.flatnonzero(grids.labels == number)[0])


def random_motion(built):
    """Displacements (nodes, 6) of a random motion that satisfies every constraint of the model."""
    x = np.random.default_rng(0).standard_normal(built.C.shape[1])
    u = built.C @ x
    return np.where(built.dof >= 0, u[built.dof], 0.0)


def test_an_rbe2_holds_components_along_the_systems_of_its_grids(read):
    """The held components are zero in the displacement system, relative to the rigid motion of GN."""
    for card, held in (
        ("RBE2,9,2,13,3,5", [0, 2]),
        ("RBE2,9,2,2456,3,5", [1, 3, 4, 5]),
        ("RBE2,9,2,2346,3,5", [1, 2, 3, 5]),
    ):
        mesh = read(CD + turned(FRAME) + TAIL + card + "\n")
        built = model(mesh)
        u = random_motion(built)
        for number, axes in ((3, cylinder_axes()), (5, plane_axes())):
            k, at = row(mesh, number), row(mesh, 2)
            apart = u[k].copy()
            apart[:3] -= u[at, :3] + np.cross(u[at, 3:], mesh.points[k] - mesh.points[at])
            apart[3:] -= u[at, 3:]
            local = np.concatenate([axes @ apart[:3], axes @ apart[3:]])
            np.testing.assert_allclose(local[held], 0, atol=1e-12)
            assert abs(np.delete(local, held)).min() > 1e-3
        assert all(check.passed for check in mp.body.check_model(built))


def cylinder_axes():
    """e_r, e_theta, e_z at grid 3 of system 7, by its definition."""
    A, B, C, x = (np.array(v) for v in ([1.0, 0, -1], [1.0, 0.1, 1], [2.0, 1, 0], [1.0, 1, 0.2]))
    z = (B - A) / np.linalg.norm(B - A)
    radial = x - A - ((x - A) @ z) * z
    radial /= np.linalg.norm(radial)
    assert np.linalg.norm(np.cross(z, C - A)) > 0
    return np.array([radial, np.cross(z, radial), z])


def plane_axes():
    z = np.array([1.0, 2, 3]) / np.sqrt(14)
    y = np.cross(z, [1.0, -1, 0])
    y /= np.linalg.norm(y)
    return np.array([np.cross(y, z), y, z])


SAME = {  # each pair says the same constraint
    "rbar to rbe2": ("RBAR,9,2,3,123456\nRBAR,10,2,5,,123456\n", "RBE2,9,2,123456,3\nRBE2,10,5,123456,2\n"),
    "rbar with components": ("RBE2,8,2,123456,3\nRBAR,9,2,5,123456,,,134\n", "RBE2,8,2,123456,3\nRBE2,9,2,134,5\n"),
    "rbar from both ends": ("RBE2,8,2,123456,3\nRBAR,9,2,5,1236,45\n", "RBE2,8,2,123456,3\nRBAR,9,2,5,123456\n"),
    "rbe1 from one grid": ("RBE1,9,2,123456\n,UM,3,123456,5,13,1.-6\n", "RBE2,9,2,123456,3\nRBE2,10,2,13,5\n"),
    "rbe1 from three grids": (
        "RBE1,9,2,123,3,12,5,3\n,UM,2,456,3,3456,5,12456\n", "RBE2,9,2,123456,3,5\n",
    ),
    "rrod to mpc": (
        "RBE2,8,2,123456,3\nRROD,9,2,5,,1\n",
        "RBE2,8,2,123456,3\nMPC,1,5,1,1.,5,2,.3\n,,5,3,.1,2,1,-1.\n,,2,2,-.3,2,3,-.1\n",
    ),
    "rbe2 to mpc": (
        "RBE2,8,2,123456,3\nRBE2,9,2,1,5\n",
        "RBE2,8,2,123456,3\nMPC,1,5,1,1.,2,1,-1.\n,,2,5,-.1,2,6,.3\n",  # ux5 = ux2 + .1 ry2 - .3 rz2
    ),
    "mpc by mpcadd": (
        "RBE2,8,2,123456,3\nMPC,1,5,1,1.,2,1,-1.\n,,2,5,-.1,2,6,.3\nMPC,2,5,4,1.,2,4,-1.\nMPCADD,3,1,2\n",
        "RBE2,8,2,123456,3\nRBE2,9,2,14,5\n",
    ),
    "rbe3 by its um": (
        "RBE2,8,2,123456,3\nRBE3,9,,5,123456,1.,123,2,3,\n,4,UM,2,123,3,12,4,3\n",
        "RBE2,8,2,123456,3\nRBE3,9,,5,123456,1.,123,2,3,\n,4\n",
    ),
}  # fmt: skip


def in_systems():
    """Yield the cases: components along the systems of the grids are the same constraints in whole triples only."""
    for name, (one, other) in SAME.items():
        yield pytest.param(one, other, "basic", id=f"{name}-basic")
        if "MPC" not in one + other and ",1\n" not in one:
            yield pytest.param(one, other, "local", id=f"{name}-local")


@pytest.mark.parametrize(("one", "other", "systems"), list(in_systems()))
def test_cards_that_say_the_same(read, one, other, systems):
    found = []
    for card, name in ((one, "one.bdf"), (other, "other.bdf")):
        text = FRAME + TAIL + card if systems == "basic" else CD + turned(FRAME) + TAIL + card
        found.append(frequencies(read(text, length=0.001, mass=1e3, name=name)))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-8)


def test_an_rbe3_of_two_grids_takes_their_rotations(read):
    """Least squares by hand, reference in the middle, arms a: the twist is the mean one, a tilt counts half by each.

    With rotations weighted by a^2: ``theta = sum(r_i v_i + a^2 theta_i) / sum(r_i^2 + a^2)``.
    """
    line = "GRID,1,,0.,0.,0.\nGRID,2,,4.,0.,0.\nGRID,3,,2.,0.,0.\nCBAR,1,5,1,2,0.,1.,0.\n"
    deck = line + TAIL + "RBE3,9,,3,123456,1.,123456,1,2,\n,ALPHA,1.-6\n"
    mesh = read(deck, length=1e-3, mass=1e3)
    u = random_motion(model(mesh))
    a, b, ref = (u[row(mesh, k)] for k in (1, 2, 3))
    np.testing.assert_allclose(ref[:4], (a + b)[:4] / 2, atol=1e-14)
    arm = 2e-3
    assert ref[5] == pytest.approx((arm * (b[1] - a[1]) + arm**2 * (a[5] + b[5])) / (4 * arm**2), rel=1e-9)
    assert ref[4] == pytest.approx((-arm * (b[2] - a[2]) + arm**2 * (a[4] + b[4])) / (4 * arm**2), rel=1e-9)
    assert not [note for note in model(mesh).notes if "RBE3" in note or "rigid" in note]


def test_equations_that_define_scalar_points_constrain_nothing(read):
    """Each has a scalar point that no other equation has, the first only once the second is left out."""
    scalars = "SPOINT,50,51\nMPC,1,50,0,1.,51,0,2.\n,,3,1,1.\nMPC,1,51,0,-1.,4,2,1.\n"
    mesh = read(FRAME + TAIL + "RBE2,8,2,123456,5\n" + scalars)
    assert mesh.equations == ()
    assert "equations that only define a scalar point (MPC) are left out" in mesh.notes


def test_an_mpc_along_systems_of_its_grids(read):
    """2 u_theta of grid 3 - 0.5 rz of grid 5 (system 8) = 0, in millimetres."""
    join = "RBE2,8,2,456,5\nRBE2,10,2,123,5\n"
    mesh = read(CD + turned(FRAME) + TAIL + join + "MPC,4,3,2,2.,5,6,-.5\n", length=1e-3, mass=1e3)
    u = random_motion(model(mesh))
    free = mp.assemble(mesh, {}, ROOT).rigid_body()
    assert free.shape[1] == 6
    theta = 1e3 * u[row(mesh, 3), :3] @ cylinder_axes()[1]
    turn = u[row(mesh, 5), 3:] @ plane_axes()[2]
    root = u[row(mesh, 1)]  # relative to the rigid motion of the root, which this equation does not respect
    theta -= 1e3 * (root[:3] + np.cross(root[3:], mesh.points[row(mesh, 3)])) @ cylinder_axes()[1]
    turn -= root[3:] @ plane_axes()[2]
    assert 2 * theta == pytest.approx(0.5 * turn, abs=1e-9)
    assert any("MPC 4 (deck.bdf line" in note for note in model(mesh).notes)


def test_case_control_selects_the_set_of_mpc(read):
    join = "RBE2,8,2,123456,5,3\n"
    bulk = FRAME + TAIL + join + "MPC,1,4,1,1.,3,1,-1.\nMPC,2,4,2,1.,3,2,-1.\n"
    assert [e.coefficients[0].argmax() for e in read("CEND\nMPC = 2\nBEGIN BULK\n" + bulk).equations] == [1]
    mesh = read("CEND\n$ MPC = 2\nBEGIN BULK\n" + bulk)
    assert mesh.equations == ()
    assert "MPC sets 1, 2 are left out, because the case control selects none" in mesh.notes
    mesh = read("CEND\nSUBCASE 1\n MPC=1\nSUBCASE 2\n MPC=2\nBEGIN BULK\n" + bulk)
    assert [e.name for e in mesh.equations] == ["MPC 1 (deck.bdf line 21)"]
    assert "subcases select the MPC sets 1, 2: set 1 is used" in mesh.notes
    with pytest.raises(InputError, match="of the MPC sets 1, 2 none is selected; write MPC = 1 before BEGIN BULK"):
        read(bulk)


BAD = {
    "rbe1 without um": ("RBE1,9,2,123456,3,1\n", "RBE1 9: its UM is missing"),
    "rbe1 with five": ("RBE1,9,2,12345\n,UM,3,1\n", "it has 5 independent and 1 dependent components"),
    "rbe3 on a line": (
        "RBE3,9,,5,123456,1.,123,2,3\n",
        "its 2 grids lie on one line, so that components 123 determine",
    ),
    "rbar twice": ("RBAR,9,2,3,123456,,1,23\n", "it has 6 independent and 3 dependent"),
    "rrod without length": ("GRID,12,,1.,0.,0.\nRROD,9,2,12,1\n", "RROD 9: its ends are in one place"),
    "mpc of a scalar point": ("SPOINT,50\nMPC,1,50,0,1.,2,1,1.\nMPC,1,50,0,1.,3,1,1.\n", "grid 50 is a scalar point"),
    "mpc of component 7": ("MPC,1,3,7,1.,2,1,1.\n", "component 7 is not one of 1 to 6"),
    "mpc with zero first": ("MPC,1,3,1,0.,2,1,1.\n", "its first coefficient is missing or zero"),
}


@pytest.mark.parametrize(("card", "said"), BAD.values(), ids=list(BAD))
def test_one_sentence(read, card, said):
    with pytest.raises(InputError, match=said):
        read(FRAME + TAIL + card)


def test_grids_on_one_line():
    """Wherever the line lies; three grids of a triangle are none."""
    along = np.array([1.0, -2.0, 0.5])
    points = np.array([[3.0, 4.0, 5.0]]) + np.array([0.0, 1.0, 2.5])[:, None] * along
    bent = points + np.array([[0, 0, 0], [0, 0, 0.1], [0, 0, 0]])
    assert [is_line(SimpleNamespace(grids=SimpleNamespace(points=x)), [0, 1, 2]) for x in (points, bent)] == [
        True,
        False,
    ]


APPENDAGE = "GRID,21,,2.,1.,.5\nGRID,22,,2.,1.,1.\nGRID,23,,2.,1.,1.5\n"


@pytest.mark.parametrize(
    "links",
    [
        "RBAR,31,6,21,123456\nRBAR,32,21,22,123456\nRBE2,33,22,123456,23\n",
        "RBE2,33,22,123456,23\nRBAR,32,21,22,123456\nRBAR,31,6,21,123456\n",
        "RBE2,33,6,123456,21,22,23\n",
        "RBAR,31,21,22,123456\n",
    ],
)
def test_rigid_links_to_grids_without_elements_change_nothing(read, links):
    """Grids of a spline or for output, in a chain, in either order, or joined to each other alone."""
    plain = read(FRAME + TAIL)
    mesh = read(FRAME + TAIL + APPENDAGE + links)
    built = model(mesh)
    assert any("rigid links to nodes that no element has" in note for note in built.notes)
    np.testing.assert_allclose(frequencies(mesh), frequencies(plain), rtol=1e-9)


def test_an_appendage_may_carry_an_interface_and_a_mass(read):
    """The end of a rigid chain moves rigidly with its grid, as one rigid bar of the whole length."""
    chain = "RBAR,31,6,21,123456\nRBAR,32,21,22,123456\n"
    ends = {**ROOT, "end": mp.Interface(node=22, kind="node", boundary="free")}
    for more in ("", "CONM2,41,22,,3.\n"):
        found = [
            mp.craig_bampton(
                mp.assemble(read(FRAME + TAIL + APPENDAGE + links + more), {}, ends), modes=6, truncation=()
            ).table.frequency
            for links in (chain, "RBAR,31,6,22,123456\n")
        ]
        np.testing.assert_allclose(*found, rtol=1e-9)
