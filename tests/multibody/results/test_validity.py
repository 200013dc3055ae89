"""What a run says against itself: deflections beyond the theory, an energy that does not balance, divergence."""

import json
import re

import numpy as np
import pytest

import modalprep as mp
from modalprep.cli import main
from modalprep.examples import uniform_beam
from modalprep.multibody.results.validity import failures, large_deflections
from modalprep.pipeline.systems import analysis, systems

WELD = mp.Joint(name="wall", type="weld", parent="ground", child="arm")
FILE = """
[bodies.arm]
file = "arm.h5"

[joints.wall]
type = "weld"
child = "arm.root"

[environment]
gravity = [0, {gravity}, 0]
"""
SPINNING = """
[bodies.arm]
file = "arm.h5"

[joints.axle]
type = "revolute"
child = "arm.root"
motion = "t**2"

[simulation]
t_end = 4.0
output_step = 0.05
geometric_stiffness = {stiff}
"""


def hanging(gravity, modes=4):
    """The beam of 12 kg, 10 m and EI = 1.4e4 N m^2, welded at its root: static tip deflection ``m g L^3 / 8 EI``."""
    return mp.System(bodies={"arm": uniform_beam(modes=modes)}, joints=(WELD,), gravity=np.array([0, -gravity, 0]))


@pytest.fixture
def folder(tmp_path):
    mp.write_body(uniform_beam(modes=3), tmp_path / "arm.h5")
    return tmp_path


def job(folder, text, command, *options):
    (folder / "job.toml").write_text(text)
    return main([command, str(folder / "job.toml"), *options])


# --- deflections --------------------------------------------------------------------------------------------------


def test_a_run_beyond_a_tenth_says_so():
    """Released without weight the beam swings to twice its static deflection of 1.05 m, a tenth of it stays silent."""
    run = mp.simulate(hanging(9.81), t_end=1.5)
    reach = np.linalg.norm(run["arm.tip.deflection"], axis=1)
    assert reach.max() == pytest.approx(2.1, rel=0.03)  # the higher modes add 2 %
    note, start = run.notes
    assert "starts without the deflection" in start
    metres, seconds = (
        float(x) for x in re.match(r"body 'arm' deflects by (\S+) m at t = (\S+) s, 21 %", note).groups()
    )
    assert metres == pytest.approx(
        reach.max(), rel=5e-3
    )  # along the beam only the affine part of the shortening counts
    assert reach[np.argmin(np.abs(run.time - seconds))] == pytest.approx(reach.max(), rel=1e-3)
    assert "starts without the deflection" in mp.simulate(hanging(0.981), t_end=1.5).notes[0]


def test_an_equilibrium_beyond_a_tenth_says_so():
    """1.05 m of 10 m by the linear theory, 1.04 m; at half the gravity it is silent."""
    (note,) = mp.static_equilibrium(hanging(9.81)).notes
    assert "body 'arm' deflects by 1.04 m at t = 0 s, 10 % of its size" in note
    assert mp.static_equilibrium(hanging(4.9)).notes == ()


def test_the_largest_node_counts_not_the_interfaces():
    """The middle of a beam held at both ends, in the second of three rows; rigid bodies have nothing to say."""
    body = uniform_beam(modes=4)
    q = np.zeros((3, 4))
    q[1] = 2.0 / np.linalg.norm(body.shape @ np.eye(4)[0], axis=1).max() * np.eye(4)[0]
    rigid = mp.rigid_body("r", mass=1, centre=np.zeros(3), inertia=np.eye(3), interfaces={"a": np.zeros(3)})
    bodies = {"one": body.with_(phi=0 * body.phi), "two": rigid}
    (note,) = large_deflections(bodies, np.array([0.0, 0.5, 1.0]), {"one": q, "two": np.zeros((3, 0))})
    assert re.search(r"deflects by 1\.9\d m at t = 0.5 s, (19|20) % of its size", note)
    assert large_deflections(bodies, np.array([0.0, 0.5, 1.0]), {"one": q * 0.49, "two": np.zeros((3, 0))}) == ()


@pytest.mark.parametrize(("twist", "off"), [(0.1, 0), (0.28, 0), (0.6, 5.5), (1.0, 15)])
def test_a_body_that_twists_says_so(twist, off):
    """A shaft of 1 m with an arm of 80 mm, twisted by a torque: the arm's end moves by the angle, not by its sine."""
    points = np.vstack([np.linspace([0, 0, 0], [1.0, 0, 0], 5), [[1.0, 0.08, 0.0]]])
    lines = np.column_stack([np.arange(5), np.arange(1, 6)])
    groups = {"shaft": {"line": np.arange(4)}, "arm": {"line": np.array([4])}}
    groups |= {name: {"vertex": np.array([k])} for k, name in enumerate(("r", "t", "a"))}
    cells = {"line": lines, "vertex": np.array([[0], [4], [5]])}
    steel = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
    shaft = mp.Beam(material=steel, A=7e-5, Iy=4e-10, Iz=4e-10, J=8e-10)
    arm = mp.Beam(material=mp.Material(E=2.1e13, nu=0.3, rho=10.0), A=7e-4, Iy=4e-8, Iz=4e-8, J=8e-8)
    ends = {"root": mp.Interface(group="r", kind="node")}
    ends |= {k: mp.Interface(group=k[0], kind="node", boundary="free") for k in ("tip", "arm")}
    model = mp.assemble(mp.fe.Mesh(points=points, cells=cells, groups=groups), {"shaft": shaft, "arm": arm}, ends)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=6, truncation=("interfaces",)), name="s")
    weld = mp.Joint(name="w", type="weld", parent="ground", child="s")
    push = mp.PointForce(name="F", at="s.tip", torque=(2.1e11 / 2.6 * 8e-10 * twist, 0, 0))
    found = mp.static_equilibrium(mp.System(bodies={"s": body}, joints=(weld,), loads=(push,)))
    moved = found["s.arm.position.z"] / (0.08 * np.sin(twist)) - 1
    if not off:
        assert (found.notes, moved < 0.02) == ((), True)
        return
    (note,) = found.notes
    said = re.match(r"body 's' turns within itself by (\S+) rad at '\w+' at t = 0 s, .* about (\d+) % too far", note)
    assert float(said[1]) == pytest.approx(twist, rel=0.04)  # at most: the torque keeps its axis
    assert 100 * moved == pytest.approx(off, rel=0.15)
    assert float(said[2]) == pytest.approx(off, rel=0.15)


def test_notes_reach_terminal_json_and_file(folder, capsys):
    text = FILE.format(gravity=-9.81) + "[analysis]\nmodes = 2\n[simulation]\nt_end = 1.5\n"
    assert job(folder, text, "simulate") == 0
    assert "warning: body 'arm' deflects by 2.1" in capsys.readouterr().out
    notes = mp.read_result(folder / "output/job/job-run.h5").notes
    assert "21 % of its size" in notes[0]
    assert job(folder, text, "simulate", "--json") == 0
    (run,) = json.loads(capsys.readouterr().out)["runs"].values()
    assert run["notes"] == list(notes)
    assert job(folder, text, "analyse") == 0
    assert "warning: body 'arm' deflects by 1.04 m" in " ".join(capsys.readouterr().out.split())
    assert job(folder, text, "run", "--json") == 0
    found = json.loads(capsys.readouterr().out)
    assert [("1.04 m" in said, "2.1" in said) for said in found["notes"] if "deflects" in said] == [
        (True, False),
        (False, True),
    ]
    assert "1.04 m" in found["analysis"]["notes"][0]


# --- the audit ----------------------------------------------------------------------------------------------------


def audited(error, energies=1.0, status="done", rest=0.0):
    channels = {"energy.kinetic": np.full(2, energies), "energy.error": np.array([0.0, error * energies + rest])}
    return mp.Result(time=np.arange(2.0), channels=channels, status=status, message="arm grew",
                     stats={"energy_error": error})  # fmt: skip


@pytest.mark.parametrize(("error", "rtol", "fails"), [
    (1.0, 1e-5, True), (0.02, 1e-5, True), (5e-3, 1e-5, False), (1e-4, 1e-8, True), (0.2, 1.0, True),
    (0.05, 1.0, False),
])  # fmt: skip
def test_balance_against_the_tolerance(error, rtol, fails):
    """A thousand times rtol, at most a tenth."""
    assert bool(failures(audited(error), rtol, 1.0)) == fails


def test_round_off_of_a_system_at_rest_is_no_failure():
    """Energies of 1e-20 J, or changes of 1e-12 of the energies, have no balance to speak of."""
    assert failures(audited(1.0, energies=1e-20), 1e-5, 1.0) == ()
    channels = {"energy.gravity": np.full(2, 1e6), "energy.error": np.full(2, 1e-6)}
    still = mp.Result(time=np.arange(2.0), channels=channels, status="done", message="", stats={"energy_error": 1.0})
    assert failures(still, 1e-5, 1.0) == ()
    assert failures(mp.simulate(hanging(0.0), t_end=0.1), 1e-5, 12.0) == ()


def test_a_diverged_run_ends_with_exit_code_1(folder, capsys):
    """In every command that simulates; its files are written, and the conventional theory alone diverges."""
    diverging = SPINNING.format(stiff="false")
    assert job(folder, diverging, "simulate") == 1
    said = capsys.readouterr()
    assert "the run did not reach its end: diverged at t = " in said.err
    assert (folder / "output/job/job-run.h5").exists()
    assert job(folder, diverging, "run", "--json") == 1
    said = capsys.readouterr()
    assert "diverged at" in json.loads(said.out)["verdict"]["requirements"][0]["says"]
    assert "diverged at" in said.err
    assert job(folder, diverging, "batch", "--json") == 1
    (row,) = json.loads(capsys.readouterr().out)["jobs"]
    assert (row["status"], "diverged at" in row["cause"]) == ("failed", True)
    assert job(folder, SPINNING.format(stiff="true"), "simulate") == 0
    compared = SPINNING.format(stiff="true") + "compare_conventional = true\n"
    assert job(folder, compared, "simulate") == 0


def test_a_balance_that_fails_ends_with_exit_code_1(folder, capsys, monkeypatch):
    """Once the integrator has lost half of the energy."""

    def lossy(*args, **options):
        run = mp.simulate(*args, **options)
        lost = np.linspace(0, 0.5, len(run.time)) * run["energy.strain"].max()
        return run.with_(channels=run.channels | {"energy.error": -lost}, stats=run.stats | {"energy_error": 0.5})

    text = FILE.format(gravity=-1) + "[simulation]\nt_end = 0.5\n"
    assert job(folder, text, "simulate") == 0
    monkeypatch.setattr(systems, "simulate", lossy)
    for command in ("simulate", "run"):
        capsys.readouterr()
        assert job(folder, text, command) == 1
        said = capsys.readouterr().err
        assert "the energy balances to 5e-01 only, which is worse than 1e-02 (1000 times rtol" in said


def test_linear_equations_that_are_not_accurate_end_with_exit_code_1(folder, capsys, monkeypatch):
    text = FILE.format(gravity=-1) + '[analysis]\nmodes = 2\ninputs = ["arm.tip.force.y"]\noutputs = ["arm.modal.1"]\n'
    assert job(folder, text, "analyse") == 0
    monkeypatch.setattr(analysis, "LINEAR", -1.0)
    assert job(folder, text, "analyse", "--json") == 1
    said = capsys.readouterr()
    assert "the linear equations have errors of" in said.err
    assert job(folder, text, "run") == 1
