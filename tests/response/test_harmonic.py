"""Harmonic response against the full finite-element model, solved directly at each frequency."""

import numpy as np
import pytest
from response.beams import BETA, ELEMENTS, LENGTH, cantilever, direct

import modalprep as mp
from modalprep.examples import cantilever_model, uniform_beam
from modalprep.reduction.basis import held_mass
from modalprep.reduction.damping import Rayleigh
from modalprep.reduction.table import DIRECTIONS
from modalprep.response import Spectrum, harmonic_response, modal_equations
from modalprep.response.harmonic import largest_mises

F = np.array([0.05, 0.6, 0.604, 1.21, 3.78, 20.0])  # Hz, resonances among them
BASE = {"base.x": 1.0, "base.y": 2.0, "base.z": 3.0, "base.rx": 0.3, "base.ry": 0.2, "base.rz": 0.1}
TIP = {"tip.x": 5.0, "tip.y": -4.0, "tip.z": 3.0, "tip.rx": 2.0, "tip.ry": 1.0, "tip.rz": -1.0}
AXES = "xyz"


@pytest.fixture(scope="module")
def complete():
    """The beam with all its 36 modes."""
    return cantilever(6 * ELEMENTS)


def columns(found, *names):
    return np.stack([found[name] for name in names], axis=1)


@pytest.mark.parametrize("inputs", [BASE, TIP, BASE | TIP], ids=["base", "tip", "both"])
def test_with_all_modes_it_is_the_direct_solution(complete, inputs):
    """Motion, reaction and section forces of the full model; 1e-8 of each vector is round-off of its stiffness."""
    model, body = complete
    found = harmonic_response(body, inputs, F, damping=Rayleigh(alpha=0.0, beta=BETA), refine=False)
    base, tip = ([inputs.get(f"{end}.{d}", 0.0) for d in DIRECTIONS] for end in ("base", "tip"))
    for k, f in enumerate(F):
        u, reaction = direct(model, f, base, tip)
        a = -((2 * np.pi * f) ** 2) * u
        expected = {
            "base.force": reaction[:3],
            "base.moment": reaction[3:],
            "tip.acceleration": a[model.dof[ELEMENTS, :3]],
            "tip.angular_acceleration": a[model.dof[ELEMENTS, 3:]],
            f"middle.{ELEMENTS // 2 + 1}": a[model.dof[ELEMENTS // 2, :3]],
        }
        for name, vector in expected.items():
            values = columns(found, *(f"{name}.{x}" for x in AXES))[k]
            assert values == pytest.approx(vector, rel=1e-8, abs=1e-8 * np.abs(vector).max())
        elastic = (model.K @ u + model.M @ a)[model.dof[0]]
        wall = columns(found, *(f"wall.root.{x}" for x in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")))[k]
        assert wall == pytest.approx(elastic, rel=1e-7, abs=1e-7 * np.abs(elastic).max())
        start = [found[f"beam.1.start.{x}"][k] for x in ("N", "Vy", "Vz", "T", "My", "Mz")]
        assert start == pytest.approx(-elastic, rel=1e-7, abs=1e-7 * np.abs(elastic).max())
    assert not any("mode displacement" in note for note in found.notes)


def test_modes_that_their_masses_couple_move_the_same_body():
    """Modes mixed until all have the stiffness one, of a body so soft that the first turns at 0.4 rad/s."""
    body = uniform_beam(modes=3)
    body = body.with_(K=body.K / 100, D=0 * body.K, frequency=body.frequency / 10)
    T = np.linalg.qr(np.random.default_rng(1).standard_normal((body.n, body.n)))[0] / np.sqrt(body.K)[:, None]
    shapes = {name: getattr(body, name) @ T for name in ("S", "H", "phi", "psi", "shape")}
    mixed = body.with_(K=np.ones(body.n), D=np.zeros(body.n), modal_mass=T.T @ T, **shapes)
    one, two = (
        harmonic_response(each, {"base.z": 1.0, "tip.y": 2.0}, F, damping=Rayleigh(alpha=0.02, beta=0.01), refine=False)
        for each in (body, mixed)
    )
    for name in ("tip.acceleration.y", "tip.acceleration.z", "base.force.z"):
        assert two[name] == pytest.approx(one[name], rel=1e-8)


def test_few_modes_have_the_error_that_mode_acceleration_leaves(complete):
    """Below half the highest kept mode, forces are within (f / f_dropped)^4 of all modes; this is some 1e-3."""
    _, body = cantilever(10)
    f = np.array([0.2, 0.8, 1.5])
    errors = []
    for method in (body, body.with_(recovery={k: x.with_(qdd=None, loads=None) for k, x in body.recovery.items()})):
        exact = harmonic_response(complete[1], {"base.y": 1.0}, f, damping=0.01, refine=False)
        found = harmonic_response(method, {"base.y": 1.0}, f, damping=0.01, refine=False)
        name = "beam.1.start.Mz"
        errors.append(float(np.abs(found[name] / exact[name] - 1).max()))
    assert errors[0] < 1e-3
    assert errors[1] > 10 * errors[0]


def test_a_slow_base_moves_the_body_as_if_it_were_rigid(complete):
    """At f << f_1: force m a, moment about the root of the inertia; relative error (f / f_1)^2."""
    body = complete[1]
    found = harmonic_response(body, {"base.y": 2.0}, [0.604e-4, 0.7e-4], damping=0.01, refine=False)
    assert found["base.force.y"][0] == pytest.approx(body.m * 2.0, rel=1e-7)
    assert found["base.moment.z"][0] == pytest.approx(body.s0[0] * 2.0, rel=1e-7)
    turning = harmonic_response(body, {"base.rz": 2.0}, [0.604e-4], damping=0.01)
    J = np.trace(body.E0) - body.E0[2, 2]
    assert turning["base.moment.z"][0] == pytest.approx(J * 2.0, rel=1e-7)
    assert turning["tip.acceleration.y"][0] == pytest.approx(2.0 * LENGTH, rel=1e-7)


def test_a_full_damping_matrix_couples_the_modes(complete):
    """The same beam with a dashpot at its tip, directly: C = c at one degree of freedom."""
    model, body = complete
    c, f = 0.7, 0.61
    matrix = c * np.outer(body.phi[1][1], body.phi[1][1])
    found = harmonic_response(body, {"tip.y": 1.0}, [f], damping=matrix)
    assert any("damping couples" in note for note in found.notes)
    w, n = 2 * np.pi * f, model.dof[ELEMENTS, 1]
    i = np.setdiff1d(np.arange(model.n_dof), model.dof[0])
    Z = (model.K - w**2 * model.M).toarray().astype(complex)
    Z[n, n] += 1j * w * c
    u = np.linalg.solve(Z[np.ix_(i, i)], (i == n).astype(float))[i == n]
    assert found["tip.displacement.y"] == pytest.approx(u, rel=1e-8)  # round-off of the stiffness
    f, ratio = modal_equations(body, ["tip.y"], matrix).resonances
    assert f[0] == pytest.approx(0.604, abs=2e-3)
    # of the lowest mode alone: c phi^2 / (2 w); the others change it by the ratio of c to their impedance
    assert ratio[0] == pytest.approx(matrix[0, 0] / (2 * np.sqrt(body.K[0])), rel=0.05)


def test_modes_with_another_mass_are_made_orthonormal_first(complete):
    """A body at half its density, in the modes of the full one, against the beam of half the density."""
    half = mp.body.with_density_factor(complete[1], 0.5).with_(recovery={})
    light = cantilever(6 * ELEMENTS, wanted={}, rho=1500.0)[1]
    options = {"damping": Rayleigh(alpha=0.1, beta=BETA), "refine": False}
    exact, found = (harmonic_response(x, {"base.y": 1.0, "tip.z": 1.0}, F, **options) for x in (light, half))
    for name in ("base.force.y", "base.moment.y", "tip.acceleration.y", "tip.displacement.z"):
        assert found[name] == pytest.approx(exact[name], rel=1e-8)  # round-off of the stiffness
    damped = harmonic_response(half.with_(D=BETA * half.K), {"base.y": 1.0}, F, refine=False)
    exact = harmonic_response(light, {"base.y": 1.0}, F, damping=Rayleigh(alpha=0.0, beta=BETA), refine=False)
    assert damped["base.force.y"] == pytest.approx(exact["base.force.y"], rel=1e-8)


def test_the_axis_is_refined_where_the_response_is_sharp(complete):
    """The peak of a single resonance: 1 / (2 zeta) of the base, to zeta^2."""
    zeta = 1e-4
    _, body = cantilever(1)
    found = harmonic_response(body, {"base.y": 1.0}, [0.1, 10.0], damping=zeta)
    row = found.peak("tip.displacement.y").figures
    expected = abs(body.S[1, 0] * body.phi[1][1, 0]) / (2 * zeta * body.K[0])
    assert row["peak"] == pytest.approx(expected, rel=1e-6)
    assert row["at_hz"] == pytest.approx(body.frequency[0], rel=1e-6)
    assert abs(row["phase_deg"]) == pytest.approx(90, abs=0.1)


def test_largest_von_mises_in_a_cycle_is_that_of_its_times():
    s = np.random.default_rng(0).standard_normal((3, 2)) @ [1, 1j]
    A = np.array([[1, -0.5, 0], [-0.5, 1, 0], [0, 0, 3.0]])
    t = np.exp(1j * np.linspace(0, 2 * np.pi, 20001))
    x = (s[:, None] * t).real
    assert largest_mises(s, A) == pytest.approx(np.sqrt(np.einsum("it,ij,jt->t", x, A, x).max()), rel=1e-7)


def test_what_is_left_out_is_said(complete):
    _, body = cantilever(2)
    table = Spectrum(frequency=np.array([1.0, 2.0]), value=np.ones(2))
    notes = " ".join(harmonic_response(body, {"base.y": table}, [0.5, 9.0]).notes)
    for words in (
        "highest kept mode has",
        "of the effective mass for base.y",
        "zero outside its table",
        "have no bound",
    ):
        assert words in notes


@pytest.mark.parametrize(
    ("inputs", "options", "words"),
    [
        ({}, {}, "needs an input"),
        ({"top.x": 1.0}, {}, "no input 'top.x'"),
        ({"root.x": 1.0}, {}, "no input 'root.x'"),
        ({"base.x": np.nan}, {}, "no numbers"),
        ({"base.x": 1.0}, {"frequency": [2.0, 1.0]}, "ascend"),
        ({"base.x": 1.0}, {"channels": ["tip.velocity"]}, "no channel 'tip.velocity'"),
        ({"base.x": 1.0}, {"damping": np.eye(3)}, "shape (3, 3)"),
    ],
)
def test_bad_input_is_one_message(complete, inputs, options, words):
    with pytest.raises(mp.InputError) as error:
        harmonic_response(complete[1], inputs, options.pop("frequency", [1.0]), **options)
    assert words in str(error.value)


def test_the_frame_must_move_with_the_root(complete):
    body = mp.body.in_mean_axes(complete[1])
    with pytest.raises(mp.InputError, match="frame on the root"):
        harmonic_response(body, {"base.x": 1.0}, [1.0])


def test_the_worst_peaks_are_those_of_the_chosen_channels_and_of_what_has_a_margin(complete):
    _, body = complete
    limited = {name: block.with_(allowable=1.0) if name == "wall" else block for name, block in body.recovery.items()}
    found = harmonic_response(body.with_(recovery=limited), {"base.z": 1.0}, [1.0], channels=["tip.acceleration"])
    named = {peak.channel.rsplit(".", 1)[0] for peak in found.worst()}
    assert named == {"tip.acceleration", "wall.root"}
    assert len(found.peaks) > len(found.worst())  # all remain in the files


def test_mass_that_sits_on_the_held_root_is_not_missing():
    """All modes of two elements have 85 % of the mass across; the rest is at the root, and moves with it exactly."""
    model = cantilever_model(elements=2)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=12, truncation=()), name="beam")
    known = body.with_(modes=body.modes.with_(held_mass=held_mass(model)))
    said = [" ".join(harmonic_response(one, {"base.y": 1.0}, [0.5, 0.7]).notes) for one in (body, known)]
    assert ["of the effective mass for base.y" in notes for notes in said] == [True, False]
    few = mp.flexible_body(model, mp.craig_bampton(model, modes=1, truncation=()), name="beam")
    few = few.with_(modes=few.modes.with_(held_mass=held_mass(model)))
    share = 100 * held_mass(model)[1] / body.m
    notes = " ".join(harmonic_response(few, {"base.y": 1.0}, [0.5, 0.6]).notes)
    assert f"of the effective mass for base.y and the held root {share:.1f} %" in notes
