"""Where runs start: in equilibrium, in a steady motion, at a state that is given or where another run ended."""

from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.examples import beam_mesh
from modalprep.formats import read_state, write_state
from modalprep.formats.resultfile import read_result, write_result
from modalprep.multibody import Closure, Equilibrium, SystemState, TimeFunction, state_at
from modalprep.multibody.starts import started

LENGTH, WIDTH, HEIGHT = 1.0, 0.02, 0.01
E, DENSITY = 2.1e11, 7850.0
LINE = DENSITY * WIDTH * HEIGHT  # kg/m
EI = E * WIDTH**3 * HEIGHT / 12  # of bending in the plane of the gravity
SHEAR = 5 / 6 * E / 2.6 * WIDTH * HEIGHT  # shear stiffness, N
SAG = LINE * 9.81 * (LENGTH**4 / (8 * EI) + LENGTH**2 / (2 * SHEAR))  # of a Timoshenko beam
SPIN = 50.0  # rad/s
GRAVITY = np.array([0, -9.81, 0])
METHODS = ("auto", "explicit", "rosenbrock", "generalised_alpha")
STILL = 1e-6  # of the deflection: vibrations of a run that starts in equilibrium


@pytest.fixture(scope="module")
def arm():
    return beam(Iy=WIDTH * HEIGHT**3 / 12, Iz=WIDTH**3 * HEIGHT / 12, J=0.229 * WIDTH * HEIGHT**3)


def beam(**second):
    section = mp.Beam(material=mp.Material(E=E, nu=0.3, rho=DENSITY), A=WIDTH * HEIGHT, **second)
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(beam_mesh(10, LENGTH), {"beam": section}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=6), name="arm")


def hanging(arm):
    weld = mp.Joint(name="wall", type="weld", parent="ground", child="arm.root")
    return mp.System(bodies={"arm": arm}, joints=(weld,), gravity=GRAVITY)


def spinning(arm, **hinge):
    joint = mp.Joint(name="hub", type="revolute", parent="ground", child="arm.root", **hinge)
    return mp.System(bodies={"arm": arm}, joints=(joint,))


def rigid(name, ends, mass=1.0):
    places = {end: np.array(place, dtype=float) for end, place in ends.items()}
    return rigid_body(name, mass=mass, centre=np.zeros(3), inertia=np.eye(3) * mass, interfaces=places)


def vibration(run, channel="arm.modal"):
    """Return the largest change of a channel over its largest value."""
    values = run[channel]
    return np.ptp(values, axis=0).max() / np.abs(values).max()


def test_a_run_from_rest_swings_to_twice_the_sag(arm):
    run = mp.simulate(hanging(arm), t_end=0.1, output_step=5e-4)
    tip = run["arm.tip.position.y"]
    assert "start = 'quasi_static' (what is released), 'equilibrium', 'steady' or 'periodic'" in run.notes[0]
    assert tip.min() == pytest.approx(-2 * SAG, rel=0.03)  # higher modes add two per cent


@pytest.mark.parametrize("method", METHODS)
def test_a_run_from_equilibrium_rests_at_the_sag(arm, method):
    run = mp.simulate(hanging(arm), t_end=0.1, start="equilibrium", method=method)
    assert run["arm.tip.position.y"] == pytest.approx(-SAG, rel=1e-5)  # the arc of the tip: (sag/L)^2
    assert vibration(run) < STILL
    assert run.stats["energy_error"] < 1e-9
    assert not run.notes


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("hinge", [{"motion": TimeFunction(f"{SPIN}*t")}, {"rate": SPIN}], ids=["driven", "free"])
def test_a_steady_spin_does_not_ring(arm, hinge, method):
    run = mp.simulate(spinning(arm, **hinge), t_end=0.05, output_step=1e-3, start="steady", method=method)
    force = np.linalg.norm(run["hub.force"], axis=1)
    assert force == pytest.approx(LINE * SPIN**2 * LENGTH**2 / 2, rel=1e-4)  # by stretching 4e-5 more
    assert vibration(run) < STILL


def test_a_free_satellite_spins_steadily(arm):
    hub = rigid("hub", {"root": (0, 0, 0), "side": (0.5, 0, 0)}, mass=20.0)
    joints = (
        mp.Joint(name="flight", type="free", parent="ground", child="hub.root", angular_velocity=(0, 0, 5.0)),
        mp.Joint(name="wing", type="weld", parent="hub.side", child="arm.root"),
    )
    system = mp.System(bodies={"hub": hub, "arm": arm}, joints=joints)
    steady = mp.simulate(system, t_end=2.0, start="steady")
    assert vibration(steady) < STILL
    assert vibration(mp.simulate(system, t_end=2.0)) > 0.9  # from rest it rings about that
    assert steady["flight.angular_velocity"][-1] == pytest.approx([0, 0, 5.0], abs=1e-8)


def test_a_pendulum_that_is_released_does_not_ring(arm):
    """It falls with the acceleration ``3 g / 2 l`` of a rigid rod, whose modes follow the angle smoothly."""
    system = spinning(arm, angle=0.5).with_(gravity=GRAVITY)
    rest, smooth = (
        mp.simulate(system, t_end=0.1, output_step=1e-3, start=start, method="explicit", rtol=1e-9)
        for start in ("rest", "quasi_static")
    )
    assert smooth["hub.acceleration"][0] == pytest.approx(-1.5 * 9.81 / LENGTH * np.cos(0.5), rel=1e-3)
    largest = np.argmax(np.abs(smooth["arm.modal"]).max(axis=0))
    ringing = [np.abs(np.diff(run["arm.modal"][:, largest], 2)).max() for run in (rest, smooth)]
    assert ringing[1] < 0.02 * ringing[0]
    assert smooth["arm.modal"][0, largest] == pytest.approx(rest["arm.modal"][:, largest].mean(), rel=0.1)


ORBIT = mp.multibody.Orbit(rate=1.1e-3)


def satellite(arm):
    """A hub with four booms across the vertical, which gravity gradient bends by 1e-10."""
    places = {
        f"side{k}": 0.2 * axis for k, axis in enumerate(np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]))
    }
    turns = [Rotation.from_euler("z", 45 + 90 * k, degrees=True).as_matrix() for k in range(4)]
    booms = [
        mp.Joint(name=f"weld{k}", type="weld", parent=f"hub.side{k}", child=f"boom{k}.root", rotation=turn)
        for k, turn in enumerate(turns)
    ]
    flight = mp.Joint(name="flight", type="free", parent="ground", child="hub.root")
    bodies = {"hub": rigid("hub", {"root": (0, 0, 0), **places}, mass=20.0), **{f"boom{k}": arm for k in range(4)}}
    return mp.System(bodies=bodies, joints=(flight, *booms), orbit=ORBIT)


def test_a_satellite_in_orbit_does_not_ring(arm):
    run = mp.simulate(satellite(arm), t_end=200.0, start="steady")
    assert np.abs(run["boom0.modal"]).max() > 1e-11
    assert vibration(run, "boom0.modal") < STILL


TETHER = 10.0, 50.0, 100.0  # stiffness, mass and length


def tethered():
    """Masses on elastic tethers above and below a hub."""
    k, m, L = TETHER
    bodies = {name: rigid(name, {"root": (0, 0, 0)}, mass=m) for name in ("up", "down")}
    hub = {"root": (0, 0, 0), "up": (L, 0, 0), "down": (-L, 0, 0)}
    tethers = [
        mp.Joint(
            name=name,
            type="prismatic",
            parent=f"hub.{name}",
            child=f"{name}.root",
            axis=(side, 0, 0),
            elements=mp.multibody.HingeElement(stiffness=k),
        )
        for name, side in (("up", 1), ("down", -1))
    ]
    flight = mp.Joint(name="flight", type="free", parent="ground", child="hub.root")
    return mp.System(bodies={"hub": rigid("hub", hub, mass=500.0), **bodies}, joints=(flight, *tethers), orbit=ORBIT)


def test_a_tether_in_orbit_does_not_ring():
    """``k x = 3 n^2 m (L + x)``."""
    k, m, L = TETHER
    run = mp.simulate(tethered(), t_end=2000.0, output_step=50.0, start="steady")
    pull = 3 * ORBIT.rate**2 * m
    assert run["up.displacement"] == pytest.approx(pull * L / (k - pull), rel=STILL)


def test_what_rests_beside_a_spin_finds_its_place():
    """A lumped mass on a spring, on a turntable: ``k x = m w^2 (r + x)``."""
    table, mass = rigid("table", {"root": (0, 0, 0), "rail": (1.0, 0, 0)}), rigid("mass", {"root": (0, 0, 0)}, mass=2.0)
    joints = (
        mp.Joint(name="spin", type="revolute", parent="ground", child="table.root", rate=3.0),
        mp.Joint(
            name="slide",
            type="prismatic",
            parent="table.rail",
            child="mass.root",
            axis=(1, 0, 0),
            elements=mp.multibody.HingeElement(stiffness=100.0),
        ),
    )
    run = mp.simulate(mp.System(bodies={"table": table, "mass": mass}, joints=joints), t_end=1.0, start="steady")
    assert run["slide.displacement"] == pytest.approx(18.0 / (100.0 - 18.0), rel=1e-8)


def test_equilibrium_records_and_words_agree(arm):
    rest = mp.static_equilibrium(hanging(arm))
    assert isinstance(rest, Equilibrium)
    runs = [mp.simulate(hanging(arm), t_end=0.02, start=start) for start in (rest, "equilibrium")]
    assert np.array_equal(runs[0]["arm.modal"], runs[1]["arm.modal"])


def test_closed_loops_keep_the_lengths_of_their_start_values(arm):
    """A rod of the length at the start values carries the tip of a hanging arm."""
    rod = Closure(name="stay", type="distance", a="ground", b="arm.tip", position=(1.0, 1.0, 0))
    system = hanging(arm).with_(closures=(rod,))
    run = mp.simulate(system, t_end=0.05, start="equilibrium", method="rosenbrock")
    gap = np.linalg.norm(run["arm.tip.position"] - np.array([1.0, 1.0, 0]), axis=1)
    assert gap == pytest.approx(1.0, abs=1e-9)
    assert vibration(run) < STILL
    propped = 3 / 8 * LINE * 9.81 * LENGTH  # of a cantilever that is propped at its tip
    assert run["stay.force.y"] == pytest.approx(propped, rel=1e-3)


def test_vibrations_that_are_meant_have_no_note(arm):
    """An arm that is set into motion slowly, and one that a pulse hits while it is in motion."""
    slow = mp.simulate(spinning(arm, motion=TimeFunction("5*t**3")), t_end=1.0)
    assert not any("without the deflection" in note for note in slow.notes)
    still = mp.simulate(hanging(arm).with_(gravity=np.zeros(3)), t_end=0.1)
    assert not still.notes


def test_modal_coordinates_may_be_given(arm):
    plucked = {"arm.modal": [1e-3, *[0.0] * (arm.n - 1)], "arm.modal_rate": np.full(arm.n, 1e-4)}
    run = mp.simulate(hanging(arm), t_end=0.01, start=plucked)
    assert run["arm.modal"][0] == pytest.approx(plucked["arm.modal"])
    assert run["arm.modal_rate"][0] == pytest.approx(plucked["arm.modal_rate"])


@pytest.mark.parametrize(
    ("method", "step"), [("explicit", 2e-5), ("explicit", None), ("rosenbrock", 1e-3), ("generalised_alpha", 1e-3)]
)
def test_a_run_that_is_cut_at_ten_times_is_the_same(arm, method, step):
    """It goes on from the last step that was not cut to end at such a time."""
    system = spinning(arm, angle=0.3).with_(gravity=GRAVITY)
    options = {"method": method, "step": step, "output_step": 0.01}
    whole = mp.simulate(system, t_end=0.1, **options)
    part = "rest"
    for t in [*np.sort(np.random.default_rng(1).uniform(0.002, 0.058, 10)).tolist(), 0.1]:
        part = mp.simulate(system, t_end=t, start=part, **options)
    assert np.array_equal(part.time[1:], whole.time[6:])
    for name in ("arm.modal", "arm.modal_rate", "hub.angle", "energy.strain"):
        assert np.array_equal(part[name][1:], whole[name][6:]), name


def test_a_run_goes_on_where_another_ended(arm):
    method, step, agree = "rosenbrock", None, 5e-7  # rtol, of a twentieth of the body's size
    system = spinning(arm, angle=0.3).with_(gravity=GRAVITY)
    options = {"method": method, "step": step, "output_step": 0.01}
    whole = mp.simulate(system, t_end=0.1, **options)
    first = mp.simulate(system, t_end=0.04, **options)
    rest = mp.simulate(system, t_end=0.1, start=first, **options)
    assert rest.time == pytest.approx(whole.time[4:])
    assert rest["arm.tip.position"] == pytest.approx(whole["arm.tip.position"][4:], abs=agree)
    assert rest["arm.modal"] == pytest.approx(whole["arm.modal"][4:], abs=2 * agree)
    assert rest["energy.work"][-1] - rest["energy.work"][0] == pytest.approx(
        whole["energy.work"][-1] - whole["energy.work"][4], abs=1e-8
    )
    assert rest.stats["energy_error"] < 1e-4


@pytest.mark.parametrize("method", ["explicit", "rosenbrock", "generalised_alpha"])
def test_another_system_begins_where_a_run_ended(method):
    """A torque that was not there before does nothing to the time that is past: 50 N m on 1 kg m^2 from there on."""
    wheel = rigid("wheel", {"root": (0, 0, 0)})

    def spun(torque):
        drive = mp.multibody.HingeElement(drive=torque)
        joint = mp.Joint(name="j", type="revolute", parent="ground", child="wheel", rate=1.0, elements=drive)
        return mp.System(bodies={"wheel": wheel}, joints=(joint,))

    first = mp.simulate(spun("0.1*sin(t)"), t_end=0.7, method=method)
    rest = mp.simulate(spun("50"), t_end=1.2, start=first, method=method)
    begin = first["j.rate"][-1]
    assert rest["j.rate"][0] == begin
    assert rest["j.rate"][-1] == pytest.approx(begin + 0.5 * 50.0, rel=1e-9)
    assert rest["j.angle"][-1] - first["j.angle"][-1] == pytest.approx(0.5 * begin + 0.5**2 / 2 * 50.0, rel=1e-6)


def test_functions_of_time_go_on_too():
    wheel = rigid("wheel", {"root": (0, 0, 0)})
    law = TimeFunction("100*(t - 0.5)**2")
    system = mp.System(
        bodies={"wheel": wheel},
        joints=(mp.Joint(name="j", type="revolute", parent="ground", child="wheel", motion=law),),
    )
    first = mp.simulate(system, t_end=0.4)
    rest = mp.simulate(system, t_end=0.6, start=first)
    assert rest["j.angle"][[0, -1]] == pytest.approx([1.0, 1.0])


def test_a_state_of_a_file_starts_a_run(arm, tmp_path):
    system = spinning(arm, angle=0.3).with_(gravity=GRAVITY)
    run = mp.simulate(system, t_end=0.05)
    file = write_result(run, tmp_path / "run.h5")
    on = [mp.simulate(system, t_end=0.08, start=start) for start in (run, read_result(file), read_state(file))]
    assert all(np.array_equal(on[0]["hub.angle"], each["hub.angle"]) for each in on)
    middle = state_at(system, read_result(file), 0.03)
    kept = read_state(write_state(middle, tmp_path / "state.h5"))
    again = mp.simulate(system, t_end=0.05, start=kept)
    assert again["arm.tip.position"] == pytest.approx(run["arm.tip.position"][3:], abs=1e-5)


def test_states_of_free_and_spherical_joints_are_in_the_channels():
    """All coordinates and speeds of a state come back from the channels of a run."""
    names = ("a", "b")
    bodies = {name: rigid(name, {"root": (0, 0, 0), "end": (0.3, 0.1, 0)}) for name in names}
    joints = (
        mp.Joint(
            name="flight",
            type="free",
            parent="ground",
            child="a.root",
            position=(1.0, 2.0, 3.0),
            velocity=(0.1, 0.2, 0.3),
            angular_velocity=(1.0, 2.0, 3.0),
        ),
        mp.Joint(name="ball", type="spherical", parent="a.end", child="b.root", angular_velocity=(3.0, 2.0, 1.0)),
    )
    system = mp.System(bodies=bodies, joints=joints)
    run = mp.simulate(system, t_end=0.2)
    found = state_at(system, run)
    assert found.vector(system) == pytest.approx(run.state.vector(system), abs=1e-12)
    assert found.t == run.state.t


def slider_crank(arm):
    """A crank at a constant speed, at its upper dead centre, whose coupler is the arm."""
    crank = rigid("crank", {"root": (0, 0, 0), "pin": (0.1, 0, 0)})
    law = TimeFunction("pi/2 + 20*t")
    joints = (
        mp.Joint(name="main", type="revolute", parent="ground", child="crank.root", motion=law),
        mp.Joint(name="pin", type="revolute", parent="crank.pin", child="arm.root", angle=-np.pi / 2 - 0.1),
    )
    slot = Closure(name="slot", type="point_on_line", a="ground", b="arm.tip", axis=(1, 0, 0))
    return mp.System(bodies={"crank": crank, "arm": arm}, joints=joints, closures=(slot,))


def test_a_steady_loop_in_motion_starts_with_the_deflection_of_its_accelerations(arm):
    system = slider_crank(arm)
    steady = mp.simulate(system, t_end=0.01, start="steady")
    rest = mp.simulate(system, t_end=0.01)
    assert np.abs(steady["arm.modal"][0]).max() > 0.5 * np.abs(rest["arm.modal"]).max() / 2
    assert steady["slot.violation"].max() < 1e-9


def repeats(run, channel="arm.modal"):
    """Return the change of a channel from the first to the last output over its largest value."""
    values = run[channel]
    return np.abs(values[-1] - values[0]).max() / np.abs(values).max()


@pytest.mark.parametrize(
    ("start", "method", "most"),
    [
        ("periodic", "auto", STILL),
        ("periodic", "explicit", STILL),
        ("steady", "explicit", np.inf),
    ],
)
def test_a_slider_crank_at_a_constant_speed_does_not_ring(arm, start, method, most):
    """By default steps: 2e-7 by the Rosenbrock method, which "auto" chooses, 1e-10 by the explicit one."""
    turn = 2 * np.pi / 20
    run = mp.simulate(slider_crank(arm), t_end=turn, output_step=turn, start=start, method=method)
    assert repeats(run) < most
    assert run.stats["method"] == ("rosenbrock" if method == "auto" else method)
    if start == "steady":  # which has the deflection, but not its rate
        assert repeats(run) > 100 * STILL


def test_a_run_that_goes_on_from_a_periodic_one_does_not_ring_either(arm):
    turn = 2 * np.pi / 20
    options = {"output_step": turn / 2, "method": "rosenbrock"}
    first = mp.simulate(slider_crank(arm), t_end=turn / 2, start="periodic", **options)
    on = mp.simulate(slider_crank(arm), t_end=turn, start=first, **options)
    assert np.abs(on["arm.modal"][-1] - first["arm.modal"][0]).max() < STILL * np.abs(first["arm.modal"]).max()


def test_a_forced_vibration_in_closed_form():
    """A mass on a spring and a damper, whose base moves: ``m x'' + d x' + k x = -m a''`` of the relative travel x."""
    m, d, k, w, a = 2.0, 3.0, 800.0, 15.0, 0.01
    parts = {name: rigid(name, {"root": (0, 0, 0)}, mass=m) for name in ("base", "mass")}
    along = {"type": "prismatic", "axis": (1, 0, 0)}
    spring = mp.multibody.HingeElement(stiffness=k, damping=d)
    joints = (
        mp.Joint(name="shaker", parent="ground", child="base.root", motion=TimeFunction(f"{a}*sin({w}*t)"), **along),
        mp.Joint(name="slide", parent="base.root", child="mass.root", elements=spring, **along),
    )
    run = mp.simulate(mp.System(bodies=parts, joints=joints), t_end=0.1, start="periodic", period=2 * np.pi / w)
    x = a * m * w**2 / (k - m * w**2 + 1j * w * d)
    assert run["slide.displacement"][0] == pytest.approx(x.imag, rel=1e-8)
    assert run["slide.speed"][0] == pytest.approx((1j * w * x).imag, rel=1e-8)


@pytest.mark.parametrize("hinge", [{"motion": TimeFunction("20*t")}, {"rate": 20.0}], ids=["driven", "free"])
def test_an_arm_that_turns_in_gravity_does_not_ring(arm, hinge):
    turn = 2 * np.pi / 20
    system = spinning(arm, **hinge).with_(gravity=GRAVITY)
    run = mp.simulate(system, t_end=turn, output_step=turn, start="periodic")
    assert repeats(run) < STILL
    assert np.ptp(run["hub.angle"]) == pytest.approx(2 * np.pi, rel=3e-8)  # the tolerance


def rotor():
    """A free round body between bushings turns under its weight: its axis stands still, its modal coordinates turn."""
    shaft = beam(Iy=1e-8, Iz=1e-8, J=2e-8)
    ends = zip(("root", "tip"), (0.0, LENGTH), strict=True)
    bearings = [
        mp.multibody.Bushing(
            name=f"bearing {end}",
            between=("ground", f"shaft.{end}"),
            stiffness=[0, 1e6, 1e6, 0, 0, 0],
            position=[x, 0, 0],
        )
        for end, x in ends
    ]
    flight = mp.Joint(name="flight", type="free", parent="ground", child="shaft.root", angular_velocity=(100.0, 0, 0))
    return mp.System(bodies={"shaft": shaft}, joints=(flight,), loads=bearings, gravity=GRAVITY)


def test_a_rotor_keeps_its_sag_in_space():
    turn = 2 * np.pi / 100
    run = mp.simulate(rotor(), t_end=turn, output_step=turn, start="periodic")
    assert repeats(run, "shaft.modal") < STILL
    assert run["shaft.root.position.y"] == pytest.approx(-LINE * 9.81 * LENGTH / 2 / 1e6, rel=1e-4)
    assert run["flight.angular_velocity"][0, 0] == pytest.approx(100.0, rel=1e-6)


@pytest.fixture(scope="module")
def beginning(arm):
    """Return ``(system, state) = beginning(name)`` of motions without vibrations, each found once."""
    systems = {
        "hanging": (hanging(arm), "equilibrium"),
        "spinning": (spinning(arm, rate=SPIN), "steady"),
        "satellite": (satellite(arm), "steady"),
        "tether": (tethered(), "steady"),
        "crank": (slider_crank(arm), "periodic"),
        "rotor": (rotor(), "periodic"),
    }
    return cache(lambda name: (systems[name][0], started(*systems[name])))


@pytest.mark.parametrize(
    ("name", "channel", "t_end", "explicit", "alpha", "rosenbrock"),
    [
        ("hanging", "arm.modal", 0.02, 1000, 20, 20),
        ("spinning", "arm.modal", 0.02, 1000, 20, 20),
        ("satellite", "boom0.modal", 20.0, None, 20, 20),  # for which the explicit method takes 2e6 evaluations
        ("tether", "up.displacement", 2000.0, 500, 200, 200),
        ("crank", "arm.modal", np.pi / 10, 2500, 5000, 1000),  # a turn
        ("rotor", "shaft.modal", np.pi / 50, 2000, 1000, None),  # a turn of bushings that turn: order 1, 5e-5
    ],
)
def test_what_does_not_ring_does_not_by_fixed_steps_either(
    beginning, name, channel, t_end, explicit, alpha, rosenbrock
):
    """From the first to the last output; so many steps of each method."""
    system, state = beginning(name)
    for method, count in (("explicit", explicit), ("generalised_alpha", alpha), ("rosenbrock", rosenbrock)):
        if count:
            run = mp.simulate(system, t_end=t_end, output_step=t_end, start=state, method=method, step=t_end / count)
            assert repeats(run, channel) < STILL, method


def test_the_ringing_of_a_forced_motion_is_the_error_of_the_steps(beginning):
    """Of generalised-alpha, which is of order 2: half the step, a quarter of it."""
    system, state = beginning("crank")
    turn = np.pi / 10
    ringing = [
        repeats(
            mp.simulate(system, t_end=turn, output_step=turn, start=state, method="generalised_alpha", step=turn / n)
        )
        for n in (2500, 5000)
    ]
    assert ringing[0] / ringing[1] == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize(
    ("name", "method", "most"), [("rotor", "generalised_alpha", 8000), ("hanging", "rosenbrock", 50)]
)
def test_a_motion_without_vibrations_has_an_implicit_method(beginning, name, method, most):
    """Also where the explicit method takes 2e4 and 5e3 evaluations only."""
    system, state = beginning(name)
    t_end = 0.05 if name == "hanging" else np.pi / 50
    start = state if name == "hanging" else "periodic"
    run = mp.simulate(system, t_end=t_end, output_step=t_end, start=start)
    assert run.stats["method"] == method
    assert run.stats["evaluations"] < most


@pytest.mark.parametrize(
    ("hinge", "period", "says"),
    [
        ({"motion": TimeFunction("20*t")}, 0.3, "do not repeat after 0.3 s"),
        ({"motion": TimeFunction("sin(20*t)")}, None, "give the period"),
        ({"motion": TimeFunction("20*t")}, -1.0, "must be positive"),
        ({"motion": TimeFunction([(0.1, "0"), (np.inf, "(t - 0.1)**2")])}, 0.3, "do not repeat"),
    ],
)
def test_what_does_not_repeat_is_refused(arm, hinge, period, says):
    system = spinning(arm, **hinge).with_(gravity=GRAVITY)
    with pytest.raises(mp.InputError, match=says):
        mp.simulate(system, t_end=0.1, start="periodic", period=period)


def test_a_resonance_has_no_periodic_motion():
    spring = mp.multibody.HingeElement(stiffness=100.0)
    along = {"type": "prismatic", "axis": (1, 0, 0)}
    joints = (
        mp.Joint(name="slide", parent="ground", child="mass.root", elements=spring, **along),
        mp.Joint(name="wheel", type="revolute", parent="mass.root", child="wheel.root", motion=TimeFunction("10*t")),
    )
    bodies = {
        "mass": rigid("mass", {"root": (0, 0, 0)}, mass=0.5),
        "wheel": rigid_body(
            "wheel", mass=0.5, centre=np.array([0.01, 0, 0]), inertia=np.eye(3), interfaces={"root": np.zeros(3)}
        ),
    }
    with pytest.raises(mp.SimulationError, match="resonance"):
        mp.simulate(mp.System(bodies=bodies, joints=joints), t_end=0.1, start="periodic")


@pytest.mark.parametrize(
    ("start", "says"),
    [
        ("stedy", "did you mean 'steady'"),
        ({"arm.angle": [1.0]}, "neither 'body.modal' nor 'body.modal_rate'"),
        ({"leg.modal": [1.0]}, "'leg'"),
        ({"arm.modal": [1.0, 2.0]}, "of which 2 are given"),
        (SystemState(joints={"hub": np.array([np.nan])}), "not finite"),
        (SystemState(joints={"hip": np.array([0.0])}), "'hip'"),
        (SystemState(t=2.0), "not after its start"),
        ("equilibrium", "start = 'steady'"),
    ],
)
def test_a_wrong_start_is_refused(arm, start, says):
    with pytest.raises(mp.InputError, match=says):
        mp.simulate(spinning(arm, rate=1.0), t_end=0.1, start=start)


def test_a_state_needs_known_closures(arm):
    with pytest.raises(mp.InputError, match="closure"):
        mp.simulate(
            hanging(arm).with_(
                closures=(Closure(name="stay", type="distance", a="ground", b="arm.tip", position=(1, 1, 0)),)
            ),
            t_end=0.1,
            start=SystemState(closures={"rope": np.zeros(1)}),
        )


def test_ensembles_start_in_equilibrium(arm):
    cases = {"gravity.y": [-9.81, -4.905]}
    found = mp.simulate_many(hanging(arm), cases, t_end=0.02, start="equilibrium", channels=["arm.tip.position.y"])
    assert found["arm.tip.position.y"][:, -1] == pytest.approx([-SAG, -SAG / 2], rel=1e-5)
