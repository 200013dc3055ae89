"""Sentences name the cause: each of these named another one, or ended in a traceback."""

import json

import numpy as np
import pytest
from bad.good import BEAM, MESHES, SOLID

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.cli import main
from modalprep.multibody import AxialSpring, Callback

ENDS = "interfaces = { root = [0, 0, 0], tip = [1, 0, 0] }"
ARM = f"{{ mass = 1.0, centre = [0.5, 0, 0], inertia = [0.01, 0.1, 0.1], {ENDS} }}"
TWO = f"""
bodies.a = {ARM}
bodies.b = {ARM}
joints.p = {{ type = "revolute", child = "a.root" }}
joints.q = {{ type = "revolute", parent = "a.tip", child = "b.root" }}
environment.gravity = [0, -9.81, 0]
"""
UPRIGHT = TWO.replace('child = "a.root" }', 'child = "a.root", start = { angle = 1.5707963267948966 } }')
GIMBAL = 'type = "gimbal", second_axis = [1, 0, 0], child = "a.root", start = { angle = [0, 1.5707963267948966, 0] } }'


def said_by(capsys, *arguments):
    """Return the exit code of a command and all that it printed."""
    code = main([str(argument) for argument in arguments])
    return code, "".join(capsys.readouterr())


def of(tmp_path, text, *, run="simulation.t_end = 0.01\n"):
    file = tmp_path / "x.toml"
    file.write_text(text + run)
    return file


def body(inertia=(0.1, 0.1, 0.1)):
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    return rigid_body("b", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.diag(inertia), interfaces=ends)


def pendulum(kind="revolute", inertia=(0.1, 0.1, 0.1), **more):
    hinge = mp.Joint(name="hub", type=kind, parent="ground", child="b.root")
    return mp.System(bodies={"b": body(inertia)}, joints=(hinge,), gravity=np.array([0, 0, -9.81]), **more)


@pytest.mark.parametrize(
    ("text", "code", "words"),
    [
        (
            TWO.replace('type = "revolute", child = "a.root" }', GIMBAL),
            1,
            "gimbal 'p' is locked: its second angle is 90",
        ),
        (TWO + 'closures.c = { type = "distance", a = "b.tip", position = [2, 0, 0] }\n', 2, "is zero at the start"),
        (
            TWO.replace('"revolute", child', '"prismatic", torque = 1.0, child'),
            2,
            "torque: a joint of type 'prismatic'",
        ),
        (TWO.replace('"revolute", child', '"revolute", force = 1.0, child'), 2, "does not slide; give torque"),
    ],
    ids=["gimbal", "distance", "torque", "force"],
)
def test_cause_of_a_run(tmp_path, capsys, text, code, words):
    found, said = said_by(capsys, "simulate", of(tmp_path, text))
    assert found == code
    assert words in " ".join(said.split())


def test_analyses_say_that_inertia_is_missing():
    """As a run does; they blamed the deflection of a rigid body."""
    for call in (lambda s: mp.simulate(s, t_end=0.1), mp.system_modes, mp.linearise):
        with pytest.raises(mp.SimulationError, match="'b' can turn or move without any mass or inertia"):
            call(pendulum("spherical", (0.0, 0.1, 0.1)))


def test_callback_names_what_it_could_mean():
    law = Callback(name="law", function=lambda t, state: {"hubb": [1.0]})
    with pytest.raises(mp.InputError, match="load on 'hubb' acts on nothing; did you mean 'hub'"):
        mp.simulate(pendulum(loads=(law,)), t_end=0.1)


@pytest.mark.parametrize("tension", [1e-6, 1.0, 200.0])
def test_free_body_with_a_preload_is_in_equilibrium(beam_body, tension):
    """What is left of forces that cancel is round-off: 1e-17 N m was refused."""
    free = mp.Joint(name="free", type="free", parent="ground", child="arm.root")
    spring = AxialSpring(name="c", between=("arm.root", "arm.tip"), stiffness=1e5, free_length=1 - tension / 1e5)
    rest = mp.static_equilibrium(mp.System(bodies={"arm": beam_body}, joints=(free,), loads=(spring,)))
    shift = np.linalg.norm(rest["arm.tip.position"] - rest["arm.root.position"]) - 1.0
    stiffness = 2.1e11 * 0.02 * 0.01  # EA / L of the beam beside the spring
    assert shift == pytest.approx(-tension / (stiffness + 1e5), rel=1e-4)  # its modes, and L^2


def test_free_body_under_a_force_is_not_in_equilibrium(beam_body):
    free = mp.Joint(name="free", type="free", parent="ground", child="arm.root")
    weight = mp.System(bodies={"arm": beam_body}, joints=(free,), gravity=np.array([0, -1e-9, 0]))
    with pytest.raises(mp.SimulationError, match="no static equilibrium"):
        mp.static_equilibrium(weight)


@pytest.fixture(scope="module")
def beam_body():
    """A beam of 1 m with a free tip."""
    section = mp.Beam(material=mp.Material(E=2.1e11, nu=0.3, rho=7850.0), A=2e-4, Iy=6.7e-9, Iz=1.7e-9, J=4.6e-9)
    from modalprep.examples import beam_mesh

    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(beam_mesh(8, 1.0), {"beam": section}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=4), name="arm")


def test_double_pendulum_upside_down_is_unstable(tmp_path, capsys):
    """Two real pairs, growth 2.66 and 6.77 1/s: the moments of gravity have the sign of springs that push away.

    K = -m g L diag(3/2, 1/2) and M of absolute angles: m L^2 (1.35, .5; .5, .35), by eigenvalues of M^-1 K.
    """
    M, K = np.array([[1.35, 0.5], [0.5, 0.35]]), 9.81 * np.diag([1.5, 0.5])
    rates = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real)
    code, said = said_by(capsys, "analyse", of(tmp_path, UPRIGHT, run='analysis.about = "start"\n'))
    assert code == 0
    for rate in rates:
        assert f"unstable: grows by {rate:.4g} 1/s, without vibration" in said
    assert f"the system is unstable about this state: 2 of its modes grow, the fastest by {max(rates):.4g} 1/s" in said


def test_joint_and_body_of_one_name_both_move(tmp_path, capsys):
    """The segments of chains: the table was empty."""
    chain = f"""
    chains.c = {{ count = 3, through = "tip", segment = {ARM}, joint = {{ type = "revolute", stiffness = 100.0 }} }}
    analysis = {{ about = "start", modes = 4 }}
    """
    code, said = said_by(capsys, "analyse", of(tmp_path, chain, run=""), "--json")
    assert code == 0
    assert json.loads(said)["modes"]["moves_most"] == ["c1", "c2", "c3"]


def test_measured_up_to_below_the_first_mode(project, tmp_path, capsys):
    text = BEAM.replace("beam.msh", str(project / "meshes" / "beam.msh"))
    text = text.replace("modes = 3\n", "modes = 3\nup_to = 0.1\ntarget_error = 1e-3\n")
    code, said = said_by(capsys, "run", of(tmp_path, text, run=""), "--no-pictures")
    assert code == 0, said
    assert "below 0.1 Hz, where it has no modes" in said


@pytest.mark.parametrize("value", ["1e308", "inf", "nan", "-1e200"])
def test_far_node_of_a_mesh(tmp_path, project, capsys, value):
    mesh = (project / "meshes" / "beam.msh").read_text()
    head, _, rest = mesh.partition("$EndNodes")
    lines = head.splitlines()
    lines[-1] = " ".join([*lines[-1].split()[:-1], value])
    (tmp_path / "beam.msh").write_text("\n".join(lines) + "\n$EndNodes" + rest)
    code, said = said_by(capsys, "run", of(tmp_path, BEAM, run=""), "--no-pictures")
    assert code == 2
    assert "have coordinates that are not numbers below 1e+30 m" in said


@pytest.mark.parametrize("nu", [0.49999999, 0.49999999999])
def test_incompressible_solid_is_no_mechanism(nu, tmp_path, capsys):
    """Modes are missed with nu = .49999999, and the stiffness is singular in its round-off with more nines."""
    with pytest.raises(mp.InputError, match=f"nearly incompressible with nu = {nu!r}: its elements lock"):
        mp.Solid(material=mp.Material(E=70e9, nu=nu, rho=2700.0))
    job = tmp_path / "job.toml"
    job.write_text(SOLID.replace("nu = 0.33", f"nu = {nu!r}").replace("bracket.msh", str(MESHES / "bracket.msh")))
    code, said = said_by(capsys, "run", job, "--no-pictures")
    assert code == 2
    assert "give at most nu = 0.49999" in said
    assert "body" in said
