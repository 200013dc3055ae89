"""Coupling matrices: a hub in hybrid coordinates against the multibody solver, and files."""

import json

import numpy as np
import pytest
from compare import assert_close
from scipy.integrate import solve_ivp
from scipy.io import loadmat
from scipy.linalg import eigh

import modalprep as mp
from modalprep.body import coupling_matrices, in_mean_axes
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.formats import write_coupling

HUB_MASS, INERTIA = 50.0, np.diag([8.0, 10.0, 12.0])
MOUNTED = np.array([0.3, 0.1, -0.2])  # the beam's root from the centre of mass of the hub
TORQUE = np.array([1e-3, -2e-3, 3e-3])


@pytest.fixture(scope="module")
def beam():
    body = uniform_beam(modes=4, truncation=("interfaces",))
    return body.with_(D=0.01 * np.sqrt(body.K))


@pytest.fixture(scope="module")
def matrices(beam):
    """Mass, stiffness and damping of hub and beam about the hub's centre of mass: six rows of the hub, then modes."""
    found = coupling_matrices(beam, -MOUNTED)
    hub = np.diag([HUB_MASS] * 3 + [*np.diag(INERTIA)])
    M = np.block([[hub + found.mass, found.participation], [found.participation.T, np.eye(beam.n)]])
    omega = 2 * np.pi * found.frequency
    return M, np.diag([0.0] * 6 + [*(omega**2)]), np.diag([0.0] * 6 + [*(2 * found.damping * omega)])


def satellite(beam, **options):
    hub = mp.rigid_body(
        "hub", mass=HUB_MASS, centre=[0.0] * 3, inertia=INERTIA, interfaces={"root": [0.0] * 3, "panel": MOUNTED}
    )
    free = mp.Joint(name="free", type="free", parent="ground", child="hub")
    weld = mp.Joint(name="weld", type="weld", parent="hub.panel", child="beam")
    return mp.System(bodies={"hub": hub, "beam": beam}, joints=(free, weld), **options)


def test_frequencies_are_those_of_the_system(beam, matrices):
    M, K, _ = matrices
    expected = np.sqrt(eigh(K, M, eigvals_only=True)[6:]) / (2 * np.pi)
    found = mp.system_modes(satellite(beam.with_(D=0 * beam.D))).frequency
    assert_close(found[found > 1e-3], expected, 1e-9)


def test_motion_under_a_torque(beam, matrices):
    """Linear against nonlinear equations: they differ by a share of the turned angle (5.9e-4; half of it for half)."""
    M, K, D = matrices
    n = len(M)
    push = np.linalg.solve(M, np.concatenate([np.zeros(3), TORQUE, np.zeros(beam.n)]))
    inverse = np.linalg.inv(M)
    rates = lambda t, x: np.concatenate([x[n:], push - inverse @ (K @ x[:n] + D @ x[n:])])  # noqa: E731
    times = np.linspace(0, 5.0, 51)
    linear = solve_ivp(rates, (0, 5.0), np.zeros(2 * n), t_eval=times, rtol=1e-10, atol=1e-14).y
    load = mp.PointForce(name="torque", at="hub.root", torque=TORQUE)
    run = mp.simulate(satellite(beam, loads=(load,)), 5.0, output_step=0.1, rtol=1e-9)
    q = run.channels["beam.modal"].T
    angle = np.abs(linear[3:6]).max()  # 1.4e-3
    assert_close(q, linear[6:n], 0.6 * angle, scale=np.abs(linear[6:n]).max())


def test_about_the_root_it_is_the_body_itself(beam):
    found = coupling_matrices(beam)
    assert_close(found.participation[:3], beam.S, 1e-15)
    assert_close(found.mass[:3, :3], beam.m * np.eye(3), 1e-15)
    rest = np.linalg.eigvalsh(found.residual_mass)
    assert rest.min() > -1e-12 * found.mass.max()


def test_files(beam, tmp_path):
    file = mp.write_body(beam, tmp_path / "beam.h5")
    assert main(["export", str(file), "--to", "coupling", "--point=0,0,0.5"]) == 0
    assert main(["export", str(file), "--to", "coupling", "--point=0,0,0.5", "-o", str(tmp_path / "b.mat")]) == 0
    expected = coupling_matrices(beam, (0, 0, 0.5))
    plain, matlab = json.loads((tmp_path / "beam.json").read_text()), loadmat(tmp_path / "b.mat")
    for name in ("mass", "participation", "residual_mass"):
        assert_close(plain[name], getattr(expected, name), 1e-15)
        assert_close(matlab[name], getattr(expected, name), 1e-15)
    assert plain["body"] == "beam"
    assert_close(matlab["frequency"][:, 0], beam.frequency, 1e-15)


@pytest.mark.parametrize(
    ("point", "file", "said"),
    [
        ("1,2", "b.json", "give three numbers x, y, z in m"),
        ("a,b,c", "b.json", "give x,y,z in m, such as"),
        ("0,0,nan", "b.json", "give three numbers x, y, z in m"),
        ("0,0,0", "b.txt", "of coupling matrices ends in .json or .mat"),
    ],
)
def test_bad_input_is_one_sentence(beam, point, file, said, tmp_path):
    with pytest.raises(mp.InputError, match=said):
        write_coupling(beam, tmp_path / file, point)
    assert not list(tmp_path.iterdir())


def test_a_free_body_has_no_hub(beam):
    with pytest.raises(mp.InputError, match="has the modes of a free body, which no hub holds"):
        coupling_matrices(in_mean_axes(beam))
