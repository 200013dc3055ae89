"""What a run records: rates of what is recorded beside, laws of momentum, springs, files."""

import numpy as np
import pytest
from multibody.single_bodies import DOWN, rigid

import modalprep as mp
from modalprep.body.line import swing
from modalprep.examples import uniform_beam
from modalprep.formats.resultfile import read_csv

WEIGHT = 12.0


@pytest.fixture(scope="module")
def double():
    """Two beams: the upper hinge driven, the lower with a spring."""
    spring = mp.multibody.HingeElement(stiffness=400.0, damping=3.0)
    joints = (
        mp.Joint(
            name="hip",
            type="revolute",
            parent="ground",
            child="upper",
            motion=mp.multibody.TimeFunction("0.3*sin(t)**2"),
        ),
        mp.Joint(name="knee", type="revolute", parent="upper.tip", child="lower", elements=spring),
    )
    beam = uniform_beam(modes=1)
    system = mp.System(bodies={"upper": beam, "lower": beam}, joints=joints, gravity=DOWN)
    return mp.simulate(system, t_end=1.0, output_step=1e-3, rtol=1e-9, method="explicit")


def test_accelerations_are_the_rates_of_velocities(double):
    h = 1e-3
    v, a = double["lower.tip.velocity"], double["lower.tip.acceleration"]
    slope = (8 * (v[3:-1] - v[1:-3]) - (v[4:] - v[:-4])) / (12 * h)
    np.testing.assert_allclose(slope, a[2:-2], atol=1e-5 * np.abs(a).max())  # h^4 and interpolation between steps


def test_force_at_the_wall_is_the_rate_of_momentum_less_the_weight(double):
    h, p, force = 1e-3, double["momentum.linear"], double["hip.force"][2:-2]
    slope = (8 * (p[3:-1] - p[1:-3]) - (p[4:] - p[:-4])) / (12 * h)
    np.testing.assert_allclose(force + 2 * WEIGHT * DOWN, slope, atol=1e-5 * np.abs(force).max())
    np.testing.assert_allclose(double["hip.torque.z"], double["hip.drive"], rtol=1e-9)


def test_wrench_of_a_joint_is_in_the_axes_of_the_parents_interface():
    """A weight on an arm welded upright: its force and its lever, seen from the turned arm."""
    turn = np.array([[0, -1.0, 0], [1, 0, 0], [0, 0, 1]])  # the arm's x points up
    joints = (
        mp.Joint(name="wall", type="weld", parent="ground", child="arm", rotation=turn),
        mp.Joint(name="grip", type="weld", parent="arm.end", child="load"),
    )
    bodies = {"arm": rigid(1.0, end=(1, 0, 0)), "load": rigid(3.0, (0, -0.2, 0.4))}
    run = mp.simulate(mp.System(bodies=bodies, joints=joints, gravity=10 * DOWN), 0.1)
    np.testing.assert_allclose(run["grip.force"][0], [30, 0, 0], atol=1e-12)
    np.testing.assert_allclose(run["grip.torque"][0], [0, 12, 6], atol=1e-12)  # r x the force
    np.testing.assert_allclose(run["wall.force"][0], [0, 40, 0], atol=1e-12)


def test_modal_channel_is_the_deflection(double):
    """``h phi q``, h of the strain of the line from root to tip (theory 4.6)."""
    body, q = uniform_beam(modes=1), double["upper.modal"][:, 0]
    strain = -0.5 * body.Kg_F[1, 0, 0, 0] * q**2 / 10.0
    wanted = body.phi[1, 1, 0] * q * [swing(tau)[0] for tau in strain]
    np.testing.assert_allclose(double["upper.tip.deflection.y"], wanted, atol=1e-9)


def test_hinge_torque_is_its_springs(double):
    spring = -400 * double["knee.angle"] - 3 * double["knee.rate"]
    np.testing.assert_allclose(double["knee.drive"], spring, atol=1e-9 * np.abs(spring).max())
    np.testing.assert_allclose(double["knee.torque.z"], spring, atol=1e-7 * np.abs(double["hip.torque"]).max())


def test_power_is_the_rate_of_work(double):
    h, work = 1e-3, double["energy.work"]
    slope = (8 * (work[3:-1] - work[1:-3]) - (work[4:] - work[:-4])) / (12 * h)
    np.testing.assert_allclose(slope, double["power.input"][2:-2], atol=1e-5 * np.abs(slope).max())
    assert np.abs(double["energy.error"]).max() < 1e-6 * np.abs(double["energy.kinetic"]).max()


def test_channels_survive_files(double, tmp_path):
    back = mp.read_result(mp.write_result(double, tmp_path / "run.h5"))
    assert back.channels.keys() == double.channels.keys()
    for name, values in double.channels.items():
        np.testing.assert_array_equal(back[name], values)
    table = read_csv(mp.formats.write_csv(double, tmp_path / "run.csv"))
    assert table.channels.keys() == double.channels.keys()
    for name, values in double.channels.items():
        np.testing.assert_allclose(table[name], values, rtol=1e-9, atol=1e-300)  # ten digits


def test_data_frame_has_every_component(double):
    pytest.importorskip("pandas")
    frame = double.to_dataframe(["knee.force", "knee.angle"])
    assert list(frame.columns) == ["knee.force.x", "knee.force.y", "knee.force.z", "knee.angle"]
    np.testing.assert_array_equal(frame["knee.angle"], double["knee.angle"])
    assert frame.index.name == "time"


def test_data_frame_without_pandas_says_what_to_install(double, monkeypatch):
    monkeypatch.setattr("modalprep.extras.find_spec", lambda name: None)
    with pytest.raises(mp.InputError, match=r"pip install 'modalprep\[dataframe\]'"):
        double.to_dataframe()


def test_a_channel_with_a_wrong_letter_is_suggested():
    channels = {"hinge.angle": np.zeros(1), "z": np.zeros(1)}
    run = mp.Result(time=np.zeros(1), channels=channels, status="done", message="")
    with pytest.raises(mp.InputError, match=r"'hinge.angel'; did you mean 'hinge.angle'\? it has hinge.angle, z"):
        run["hinge.angel"]
