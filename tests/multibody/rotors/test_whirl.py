"""Whirl of a rotor at one speed, against closed forms, published digits and a direct integration over a turn."""

import numpy as np
import pytest
from discs import ACROSS, MASS, POLAR, X, disc, held, shaft_of_two_stiffnesses, tilting
from scipy.integrate import solve_ivp

import modalprep as mp
from modalprep.multibody.rotors.whirl import whirl_modes


@pytest.mark.parametrize("speed", [50.0, 400.0])
def test_gyroscopic_tilting(speed):
    """``A w^2 -+ P speed w - k = 0`` of a symmetric disc: backward and forward precession."""
    k = 2000.0
    found = whirl_modes(tilting(k, k), "spin", speed)
    half = POLAR * speed / (2 * ACROSS)
    expected = np.sqrt(half**2 + k / ACROSS) + half * np.array([-1.0, 1.0])
    assert found.eigenvalue.imag == pytest.approx(expected, rel=1e-6)  # the rings have 1e-8 of the inertia
    assert found.kind == ("backward", "forward")
    assert found.whirl == pytest.approx([-1.0, 1.0], abs=1e-6)


def test_supports_that_differ():
    """``(k1 - A w^2) (k2 - A w^2) = (P speed w)^2``: elliptic precession, the axes of the supports stand still."""
    k1, k2, speed = 2000.0, 1200.0, 120.0
    found = whirl_modes(tilting(k1, k2), "spin", speed)
    squares = np.roots([ACROSS**2, -ACROSS * (k1 + k2) - (POLAR * speed) ** 2, k1 * k2])
    assert found.eigenvalue.imag == pytest.approx(np.sort(np.sqrt(squares)), rel=1e-6)
    assert found.kind == ("backward", "forward")
    assert np.all(np.abs(found.whirl) < 0.999)


def test_supports_that_differ_under_a_free_rotor():
    """The same in coordinates that turn: the equations are periodic there, the modes have two harmonics each."""
    ky, kz, speed = 1e6, 0.6e6, 150.0
    found = whirl_modes(held([1e5, ky, kz, 0, 0, 0]), "flight", speed, axis=X)
    moving = found.eigenvalue.imag[np.abs(found.eigenvalue.imag - POLAR / ACROSS * speed) > 1.0]
    assert moving == pytest.approx(np.sqrt(np.array([1e5, kz, ky]) / MASS), rel=1e-8)
    assert [found.kind[k] for k in np.flatnonzero(np.isin(found.eigenvalue.imag, moving))] == [
        "axial or torsional",
        "planar",
        "planar",
    ]


def test_free_disc_wobbles():
    """A symmetric disc without springs against tilting precesses at ``P / A`` times its speed, seen from the ground."""
    speed = 150.0
    found = whirl_modes(held([1e5, 1e6, 1e6, 0, 0, 0]), "flight", speed, axis=X)
    wobble = found.eigenvalue.imag[np.argmin(np.abs(found.eigenvalue.imag - 200.0))]
    assert wobble == pytest.approx(POLAR / ACROSS * speed, rel=1e-8)


def of_the_plane(found):
    """Return the modes that move the mass across."""
    moves = np.linalg.norm(found.motion["mass.c"][1:3], axis=0) > 1e-3
    return found.eigenvalue[moves]


@pytest.mark.parametrize("speed", [60.0, 100.0, 140.0])
def test_unsymmetric_shaft(speed):
    """``(s^2 + k1/m - W^2) (s^2 + k2/m - W^2) + 4 W^2 s^2 = 0`` in turning axes: growth between two critical speeds."""
    k1, k2 = 8e4, 1.2e5
    found = whirl_modes(shaft_of_two_stiffnesses(k1, k2), "spin", speed)
    a, b = k1 / MASS - speed**2, k2 / MASS - speed**2
    squares = np.roots([1.0, a + b + 4 * speed**2, a * b]).astype(complex)
    s = np.concatenate([np.sqrt(squares), -np.sqrt(squares)])
    growth = of_the_plane(found).real.max()
    assert growth == pytest.approx(s.real.max(), rel=1e-7, abs=1e-6)
    assert (growth > 1.0) == (np.sqrt(k1 / MASS) < speed < np.sqrt(k2 / MASS))


def test_internal_damping_has_a_limit():
    """Damping that turns with the shaft drives the forward whirl above ``w (1 + outer / inner)``."""
    k, inner, outer = 1e5, 20.0, 30.0
    limit = np.sqrt(k / MASS) * (1 + outer / inner)
    for factor, sign in ((1 - 1e-6, -1), (1 + 1e-6, 1)):
        found = whirl_modes(shaft_of_two_stiffnesses(k, k, inner, outer), "spin", factor * limit)
        assert np.sign(of_the_plane(found).real.max()) == sign


def test_rotor_and_supports_unsymmetric():
    """Multipliers of a turn by direct integration of the two equations in inertial axes."""
    k1, k2, ky, kz, speed, outer = 8e4, 1.2e5, 5e4, 2e4, 80.0, 40.0
    found = whirl_modes(shaft_of_two_stiffnesses(k1, k2, outer=outer, supports=(ky, kz)), "spin", speed)

    def rate(t, z):
        c, s = np.cos(speed * t), np.sin(speed * t)
        R = np.array([[c, -s], [s, c]])
        K = R @ np.diag([k1, k2]) @ R.T + np.diag([ky, kz])
        x, v = z.reshape(2, 2, 4)
        return np.concatenate([v, -(K @ x + outer * v) / MASS]).ravel()

    turn = solve_ivp(rate, (0, 2 * np.pi / speed), np.eye(4).ravel(), rtol=1e-11, atol=1e-13).y[:, -1].reshape(4, 4)
    multipliers = np.linalg.eigvals(turn)
    own = np.exp(of_the_plane(found) * 2 * np.pi / speed)
    both = np.concatenate([own, own.conj()])
    assert len(both) == 4
    assert np.sort_complex(both) == pytest.approx(np.sort_complex(multipliers), rel=1e-6)


def test_what_is_left_out_is_said():
    found = whirl_modes(held([1e5, 1e6, 1e6, 0, 0, 0]).with_(gravity=(0, 0, -9.81)), "flight", 100.0, axis=X)
    assert any("weight is left out" in note for note in found.notes)
    body = mp.rigid_body("disc", mass=MASS, centre=(0, 1e-3, 0), inertia=np.eye(3), interfaces={"hub": np.zeros(3)})
    found = whirl_modes(held([1e5, 1e6, 1e6, 0, 0, 0], body=body), "flight", 100.0, axis=X)
    assert any("does not turn steadily" in note for note in found.notes)


@pytest.mark.parametrize(
    ("joint", "axis", "says"),
    [
        ("flite", X, "did you mean 'flight'"),
        ("flight", None, "give the rotor's axis"),
    ],
)
def test_refusals(joint, axis, says):
    with pytest.raises(mp.InputError, match=says):
        whirl_modes(held([1e5, 1e6, 1e6, 0, 0, 0]), joint, 100.0, axis=axis)


def test_a_slide_does_not_spin():
    slide = mp.Joint(name="slide", type="prismatic", parent="ground", child="disc")
    with pytest.raises(mp.InputError, match="prismatic; a rotor spins in one of revolute"):
        whirl_modes(mp.System(bodies={"disc": disc()}, joints=(slide,)), "slide", 1.0)


def test_rotor_in_a_casing():
    """``w^2 = k / (casing + disc)``; the axis is that of the hinge, wherever it points."""
    turned = np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]])
    casing = mp.rigid_body("casing", mass=5.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"seat": np.zeros(3)})
    spring = mp.multibody.HingeElement(stiffness=1e4 * (5.0 + MASS))
    rail = {"parent": "ground", "axis": turned @ (0, 1, 0), "rotation": turned}
    slide = mp.Joint(name="slide", type="prismatic", child="casing", elements=spring, **rail)
    spin = mp.Joint(name="spin", type="revolute", parent="casing.seat", child="disc", axis=X)
    found = whirl_modes(mp.System(bodies={"casing": casing, "disc": disc()}, joints=(slide, spin)), "spin", 120.0)
    assert found.eigenvalue.imag == pytest.approx([100.0], rel=1e-9)
    assert found.kind == ("planar",)
