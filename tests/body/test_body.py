"""The modal body against closed forms of the uniform cantilever, and its own checks."""

import numpy as np
import pytest
from analytic import ROTATING_FLAP, cantilever_frequency, cantilever_roots
from beam_series import blade, effective_masses, unit_loads
from compare import assert_close

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section, uniform_beam
from modalprep.multibody.analysis.spin import spin_modes

EI, RHO_A, L = 1.4e4, 1.2, 10.0
TIME = np.sqrt(RHO_A * L**4 / EI)


@pytest.fixture(scope="module")
def planar():
    """Six modes in the x-y plane only: out of it the beam is much stiffer."""
    return beam_body(80, 6, Iy=2e-3, J=2e-3)


def beam_body(elements, modes, tip="free", **section):
    model = mp.assemble(
        beam_mesh(elements),
        {"beam": spinup_section(theory="euler-bernoulli", **section)},
        {
            "root": mp.Interface(group="root", kind="node"),
            "tip": mp.Interface(group="tip", kind="node", boundary=tip),
        },
    )
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=()), name="beam")


def with_signs(matrix, body):
    """The tables hold for mode shapes whose tip moves by 2 (-1)^(i+1)."""
    sign = np.sign(body.phi[1, 1, :3]) * [1, -1, 1]
    return matrix[:3, :3] * sign * sign[:, None]


def test_cantilever_frequencies(planar):
    exact = cantilever_frequency(4, EI, RHO_A, L) / (2 * np.pi)
    np.testing.assert_allclose(
        planar.frequency[:4], exact, rtol=2e-3
    )  # rotary inertia lowers mode k by (k pi r/L)^2 / 2


@pytest.mark.parametrize(
    ("name", "pick", "scale"),
    [
        ("centrifugal", lambda b: -b.Kg_W[0, 0], 1.0),
        ("acceleration", lambda b: -b.Kg_A[0], L),
        ("tip force", lambda b: b.Kg_F[1, 0], RHO_A * L**2),
    ],
)
def test_unit_load_matrices(planar, name, pick, scale):
    found, expected = with_signs(pick(planar) * scale, planar), unit_loads(3)[name]
    # cubic elements, axial force constant per element: order h^2, 6e-4 of the diagonal at 80 elements
    size = np.sqrt(np.outer(expected.diagonal(), expected.diagonal()))
    assert_close(found / size, expected / size, 1e-3, scale=1.0)


def test_modal_integrals(planar):
    sign = np.sign(planar.phi[1, 1, :3]) * [1, -1, 1]
    moved, turned = planar.S[1, :3] * sign / np.sqrt(RHO_A * L), planar.H[1, 0, :3] * sign / np.sqrt(RHO_A * L) / L
    np.testing.assert_allclose(moved, np.sqrt(effective_masses(3)[0]), rtol=1e-4)
    np.testing.assert_allclose(turned, 2 / cantilever_roots(3) ** 2, rtol=5e-4)  # rotary inertia, as above


def test_loads_across_the_beam_do_not_stiffen_it(planar):
    others = [
        planar.Kg_A[1],
        planar.Kg_A[2],
        planar.Kg_W[1, 1] + planar.P[0, 0],  # fibres beside the axis: their rotary inertia swings out
        planar.Kg_W[2, 2],
        planar.Kg_W[1, 0],
        planar.Kg_W[2, 0],
    ]
    assert max(np.abs(k[:3, :3]).max() for k in others) < 1e-9 * np.abs(planar.Kg_W[0, 0]).max()


# First flap frequency with a tip mass rho A L, spin 0 .. 12: Bir, NREL/CP-500-47953 (2010), table 5, as the tests of
# pyBModes print it (test_rotating_blade_with_tip_mass.py)
BIR = (1.557, 1.902, 2.670, 3.582, 4.543, 5.522, 6.509, 7.501, 8.495, 9.490, 10.49, 11.48, 12.48)


def test_series_give_the_published_frequencies_of_blades():
    """The Ritz series against which bodies and systems are held, to the digits printed."""
    for gamma, printed in ROTATING_FLAP.items():
        np.testing.assert_allclose(blade(gamma)[:3], printed, rtol=2e-5)
    found = [blade(gamma, tip_mass=1.0)[0] for gamma in range(13)]
    np.testing.assert_allclose(found, BIR, rtol=4e-4)


@pytest.mark.parametrize("gamma", sorted(ROTATING_FLAP))
@pytest.mark.parametrize("flap", [True, False])
def test_rotating_cantilever_from_the_modal_file(gamma, flap, tmp_path):
    body = beam_body(40, 16, Iy=2e-7) if flap else uniform_beam(modes=8, truncation=("inertia",))
    body = mp.read_body(mp.write_body(body, tmp_path / "beam.h5"))
    spin = gamma / TIME * np.array([0.0, 0.0, 1.0])
    if flap:  # spin about z, bending towards z, with lag modes beside: pick by the pair lag^2 = flap^2 - gamma^2
        found = np.sort(spin_modes(body, spin).frequency) * 2 * np.pi * TIME
        expected = np.array(ROTATING_FLAP[gamma])
        nearest = np.array([found[np.argmin(np.abs(found - e))] for e in expected])
    else:
        found = spin_modes(body, spin).frequency * 2 * np.pi * TIME
        expected = np.sqrt(np.array(ROTATING_FLAP[gamma]) ** 2 - gamma**2)
        nearest = np.array([found[np.argmin(np.abs(found - e))] for e in expected])
    np.testing.assert_allclose(nearest, expected, rtol=3e-3)  # shear flexibility and 40 elements; required: 1e-2


def test_conventional_theory_softens_instead(planar):
    spin = 6 / TIME * np.array([0.0, 0.0, 1.0])
    assert spin_modes(planar.conventional(), spin).frequency[0] == 0.0  # lambda^2 = 3.516^2 - 36 < 0: unstable


@pytest.mark.parametrize("alpha", [-20, -5, 4, 7])
def test_axial_base_acceleration(planar, alpha):
    """A base that accelerates along the beam compresses it."""
    a = np.array([alpha * EI / (RHO_A * L**3), 0.0, 0.0])
    found = spin_modes(planar, np.zeros(3), a).frequency[0] * 2 * np.pi * TIME
    assert found == pytest.approx(
        blade(acceleration=alpha)[0], rel=5e-3
    )  # near buckling (7.837) the square root magnifies 1e-3


def test_body_does_not_depend_on_where_the_mesh_lies():
    shift = np.array([3.0, -2.0, 5.0])
    mesh = beam_mesh(10)
    ends = {"root": mp.Interface(group="root", kind="node")}
    bodies = []
    for moved in (mesh, mesh.with_(points=mesh.points + shift)):
        model = mp.assemble(moved, {"beam": spinup_section()}, ends)
        bodies.append(mp.flexible_body(model, mp.craig_bampton(model, modes=4), name="b"))
    for name in ("m", "s0", "E0", "S", "H", "P", "Kg_A", "Kg_W"):
        a, b = (np.asarray(getattr(x, name)) for x in bodies)
        np.testing.assert_allclose(a, b, atol=1e-8 * max(np.abs(a).max(), 1e-12))


def test_checks_pass_and_catch_a_wrong_mass(bracket_body, bracket_model):
    assert [c.name for c in mp.check_body(bracket_body) + mp.body.check_model(bracket_model) if not c.passed] == []
    wrong = {
        "mass and inertia": bracket_body.with_(m=bracket_body.m * 1.001),
        "modal mass": bracket_body.with_(P=bracket_body.P * 1.01),
        "modal stiffness": bracket_body.with_(K=-bracket_body.K),
        "geometric stiffness": bracket_body.with_(
            Kg_A=bracket_body.Kg_A + np.triu(np.ones(bracket_body.P.shape[2:]), 1)
        ),
        "mass matrix": bracket_body.with_(S=100 * bracket_body.S),
    }
    for name, body in wrong.items():
        assert name in [c.name for c in mp.check_body(body) if not c.passed]


def test_negative_damping_is_refused():
    ends = {"root": mp.Interface(group="root", kind="node")}
    model = mp.assemble(beam_mesh(4), {"beam": spinup_section()}, ends)
    reduction = mp.craig_bampton(model, modes=2)
    with pytest.raises(mp.InputError, match="damping = -0.1"):
        mp.flexible_body(model, reduction, name="b", damping=-0.1)
