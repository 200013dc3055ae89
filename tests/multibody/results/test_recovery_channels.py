"""Recovered forces of bodies in motion: closed forms, the solver's own forces and accelerations, envelopes."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.body.recovery import Recovery
from modalprep.examples import beam_mesh
from modalprep.multibody.results.envelopes import AT_ONCE, envelopes

Recover = mp.fe.Recover
LENGTH, G = 2.0, 9.81
STIFF = mp.Material(E=2e15, nu=0.3, rho=7800.0)
SECTION = mp.fe.beam_section("rectangle", STIFF, width=0.03, height=0.02)
LINE_MASS = STIFF.rho * SECTION.A
WANTED = {
    "beam": Recover(kind="section_force", stations=3, allowable=1e5),
    "base": Recover(kind="reaction"),
    "tip": Recover(kind="acceleration", group="tip"),
    "modes": Recover(kind="section_force", method="displacement"),
}


def beam(modes=3, truncation=(), wanted=None, section=SECTION, damping=0.0):
    mesh = beam_mesh(8, LENGTH)
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(mesh, {"beam": section}, ends)
    recovery = mp.fe.model_recovery(model, mesh, WANTED if wanted is None else wanted)
    reduction = mp.craig_bampton(model, modes=modes, truncation=truncation)
    return mp.flexible_body(model, reduction, name="beam", damping=damping, recovery=recovery)


def hinge(**given):
    return mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", **given)


def forces(run, component, ends=("1.start", "4.50%", "8.end")):
    return np.stack([run[f"arm.recovery.beam.{end}.{component}"] for end in ends], axis=1)


PLACES = np.array([0.0, 3.5 * LENGTH / 8, LENGTH])


def test_axial_force_of_a_spinning_arm():
    """N(x) = rho A w^2 (L^2 - x^2) / 2, with two bending modes and nothing axial in the basis."""
    w = 30.0
    system = mp.System(bodies={"arm": beam(modes=2)}, joints=(hinge(motion=f"{w}*t"),))
    run = mp.simulate(system, t_end=0.05)
    expected = LINE_MASS * w**2 * (LENGTH**2 - PLACES**2) / 2
    assert forces(run, "N")[-1] == pytest.approx(expected, abs=1e-8 * expected[0])  # of the integrated motion
    assert np.abs(run["arm.recovery.modes.1.start.N"]).max() < 1e-6 * expected[0]


def test_forces_in_a_swinging_rod():
    """N = rho A (L - x) (g cos + th'^2 (L + x) / 2), V = -rho A ((L - x) g sin + th'' (L^2 - x^2) / 2).

    Statics with d'Alembert's forces of a rigid compound pendulum; the moment is the integral of V beyond x, such as
    breaks a falling chimney.
    """
    system = mp.System(
        bodies={"arm": beam(damping=0.05)},
        joints=(hinge(rotation=(np.array([0.0, 0, 1]), -np.pi / 2), angle=0.8),),
        gravity=np.array([0, -G, 0]),
    )
    run = mp.simulate(system, t_end=0.4, rtol=1e-12, method="explicit")  # stable steps: what they ring is below 1e-5
    run = run.with_(channels={name: values[20:] for name, values in run.channels.items()})  # the start has died out
    angle, rate, alpha = (run[f"hinge.{x}"][:, None] for x in ("angle", "rate", "acceleration"))
    left = LENGTH - PLACES
    N = LINE_MASS * left * (G * np.cos(angle) + rate**2 * (LENGTH + PLACES) / 2)
    V = -LINE_MASS * (left * G * np.sin(angle) + alpha * (LENGTH**2 - PLACES**2) / 2)
    M = -LINE_MASS * (left**2 / 2 * G * np.sin(angle) + alpha * left**2 * (2 * LENGTH + PLACES) / 6)
    scale = LINE_MASS * LENGTH * G
    # the sections' own rotation, (h / L)^2 / 4 = 6e-5 of the moment; the damper's force, 2 zeta rate / w = 1e-4
    assert forces(run, "N") == pytest.approx(N, abs=1e-4 * scale)
    assert forces(run, "Vy") == pytest.approx(V, abs=1e-4 * scale)
    assert forces(run, "Mz") == pytest.approx(M, abs=1e-4 * scale * LENGTH)


def test_an_arm_carries_what_its_child_needs():
    """A mass on the tip: the last section force is the joint's, the root reaction that of the hinge."""
    load = mp.rigid_body(
        "load", mass=5.0, centre=np.array([0.1, 0.2, 0.0]), inertia=0.1 * np.eye(3), interfaces={"root": np.zeros(3)}
    )
    joints = (
        hinge(motion="sin(3*t)"),
        mp.Joint(name="weld", type="weld", parent="arm.tip", child="load"),
    )
    system = mp.System(bodies={"arm": beam(modes=2), "load": load}, joints=joints, gravity=np.array([0, 0, -G]))
    run = mp.simulate(system, t_end=1.0, rtol=1e-8)
    end = np.stack([run[f"arm.recovery.beam.8.end.{c}"] for c in ("N", "Vy", "Vz", "T", "My", "Mz")], axis=1)
    joint = np.hstack([run["weld.force"], run["weld.torque"]])  # on the child, at its root, in axes of the tip
    assert end == pytest.approx(-joint, abs=1e-6 * np.abs(joint).max())  # deflections of the tip are 1e-7
    base = np.stack([run[f"arm.recovery.base.root.{c}"] for c in ("Fx", "Fy", "Fz", "Mx", "My", "Mz")], axis=1)
    turn = Rotation.from_quat(run["arm.orientation"], scalar_first=True)
    both = np.hstack([turn.apply(np.array(run[f"hinge.{x}"]), inverse=True) for x in ("force", "torque")])
    # Coriolis forces of the vibration, 2 w q' at 1e-3 m/s, are none of the linear recovery
    assert base == pytest.approx(both, abs=5e-5 * np.abs(both).max())


@pytest.mark.parametrize("axes", ["inertial", "body"])
def test_loads_of_forces_springs_and_closures_reach_the_section_at_the_tip(axes):
    """A force, a spring to the ground and a rod to the ground pull at the tip: their sum is the last section force."""
    system = mp.System(
        bodies={"arm": beam(modes=2)},
        joints=(hinge(angle=0.3),),
        loads=(
            mp.PointForce(name="push", at="arm.tip", force=("5*sin(9*t)", 3.0, -2.0), torque=(1.0, 0, 0), axes=axes),
            mp.multibody.AxialSpring(
                name="stay", between=("arm.tip", "ground"), position=np.array([1.0, 4, 2]), stiffness=10.0,
                free_length=1.0,
            ),
        ),
        gravity=np.array([0, -G, 0]),
    )  # fmt: skip
    run = mp.simulate(system, t_end=0.3, rtol=1e-8)
    end = np.stack([run[f"arm.recovery.beam.8.end.{c}"] for c in ("N", "Vy", "Vz")], axis=1)
    turn = Rotation.from_quat(run["arm.orientation"], scalar_first=True)
    push = np.stack([5 * np.sin(9 * run.time), 3 + 0 * run.time, -2 + 0 * run.time], axis=1)
    push = push if axes == "body" else turn.apply(push, inverse=True)
    away = np.array([1.0, 4, 2]) - run["arm.tip.position"]
    stay = run["stay.tension"][:, None] * away / np.linalg.norm(away, axis=1, keepdims=True)
    expected = push + turn.apply(stay, inverse=True)
    assert end == pytest.approx(expected, abs=1e-6 * np.abs(expected).max())  # deflections of the tip are 1e-7


def test_accelerometers_agree_with_the_solver():
    """Acceleration of the tip node less gravity, in body axes, of a soft beam without geometric stiffness."""
    soft = mp.fe.beam_section("rectangle", mp.Material(E=2e9, nu=0.3, rho=7800.0), width=0.03, height=0.02)
    g = np.array([0, -G, 0])
    system = mp.System(
        bodies={"arm": beam(modes=4, section=soft).conventional()}, joints=(hinge(motion="sin(8*t)"),), gravity=g
    )
    run = mp.simulate(system, t_end=0.5)
    found = np.stack([run[f"arm.recovery.tip.9.{c}"] for c in "xyz"], axis=1)
    turn = Rotation.from_quat(run["arm.orientation"], scalar_first=True)
    expected = turn.apply(run["arm.tip.acceleration"] - g, inverse=True)
    assert found == pytest.approx(expected, abs=1e-10 * np.abs(expected).max())  # round-off


def _same(row: dict, other: dict, round_off: float) -> bool:
    sizes = {
        "highest": pytest.approx(row["highest"], abs=round_off),
        "lowest": pytest.approx(row["lowest"], abs=round_off),
    }
    return other | {"margin": 0} == row | sizes | {"margin": 0}


def test_envelopes_are_the_extremes_of_the_histories(monkeypatch):
    system = mp.System(bodies={"arm": beam()}, joints=(hinge(motion="sin(7*t)"),), gravity=np.array([0, -G, 0]))
    run = mp.simulate(system, t_end=1.0)
    whole = envelopes(run, system.bodies)
    assert [each.name for each in whole] == list(WANTED)
    monkeypatch.setattr("modalprep.multibody.results.envelopes.AT_ONCE", 2000)
    assert AT_ONCE > 2000
    for each, pieces in zip(whole, envelopes(run, system.bodies), strict=True):
        for row, again in zip(each.rows(), pieces.rows(), strict=True):
            # of the largest of its kind: pieces are multiplied otherwise
            round_off = 1e-12 * np.abs(each.largest).max()
            assert row == again or _same(row, again, round_off)
            history = run[f"arm.recovery.{each.name}.{row['place']}.{row['component']}"]
            assert (row["highest"], row["lowest"]) == pytest.approx((history.max(), history.min()), rel=1e-12)
            assert history[run.time == row["at_s"]] == pytest.approx(row["highest"], rel=1e-12)
    (force,) = (each for each in whole if each.name == "beam")
    assert force.margin == pytest.approx(1e5 / force.largest - 1)
    assert force.worst()[0]["place"] == force.places[int(np.argmax(force.largest[:, 0]))]


def test_margin_of_stress_is_that_of_von_mises():
    body = beam(wanted={})
    q = np.zeros((1, 3, body.n))
    q[0, :, 0] = 1.0, 2.0, 3.0
    skin = Recovery(kind="stress", places=("a",), components=("xx", "yy", "xy"), units=("Pa",) * 3, q=q, allowable=10.0)
    channels = {"arm.modal": np.array([[1.0, 0, 0], [-2.0, 0, 0]])}
    result = mp.Result(time=np.array([0.0, 1.0]), channels=channels, status="done", message="")
    (found,) = envelopes(result, {"arm": body.with_(recovery={"skin": skin})})
    mises = 2 * np.sqrt(1 - 2 + 4 + 27)
    assert found.components[-1] == "von_mises"
    assert found.margin[0] == pytest.approx([np.nan] * 3 + [10 / mises - 1], nan_ok=True)
    assert found.highest_time[0, -1] == 1.0


def test_large_recoveries_have_no_channels():
    body = beam(wanted={})
    many = Recovery(
        kind="force", places=tuple(map(str, range(1001))), components=("N",), units=("N",),
        q=np.ones((1001, 1, body.n)),
    )  # fmt: skip
    system = mp.System(bodies={"arm": body.with_(recovery={"many": many})}, joints=(hinge(),))
    run = mp.simulate(system, t_end=0.02)
    assert not [name for name in run if ".recovery." in name]
    assert len(envelopes(run, system.bodies)[0].places) == 1001


def test_mean_axes_recover_the_same_forces():
    """A beam in free flight that a force shakes at its tip: in the frame of its root and in its mean axes."""
    soft = mp.fe.beam_section("rectangle", mp.Material(E=2e11, nu=0.3, rho=7800.0), width=0.03, height=0.02)
    own = beam(modes=6, section=soft, truncation=("interfaces",))
    histories = []
    for body in (own, mp.body.in_mean_axes(own)):
        place = np.zeros(3) if body is own else own.s0 / own.m
        free = mp.Joint(name="flight", type="free", parent="ground", child="arm", position=place)
        push = mp.PointForce(name="push", at="arm.tip", force=("0.2*sin(40*t)", "0.05*sin(60*t)", 0.0))
        system = mp.System(bodies={"arm": body}, joints=(free,), loads=(push,))
        run = mp.simulate(system, t_end=0.05, method="explicit", step=4e-6)
        histories.append([forces(run, c) for c in ("N", "Vy", "Mz")])
        histories[-1].append(np.stack([run[f"arm.recovery.tip.9.{c}"] for c in "xy"], axis=1))
    for root, mean in zip(*histories, strict=True):
        # the axes of the elements turn with the frame: N times 2e-5
        assert mean == pytest.approx(root, abs=3e-4 * np.abs(root).max())
