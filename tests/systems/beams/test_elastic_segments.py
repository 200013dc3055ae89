"""Beams in elastic segments, modal bodies welded tip to root: large deflection, frequencies, roll-up."""

import numpy as np
import pytest
from analytic import cantilever_roots
from beam_series import hermite
from scipy.linalg import eigh
from systems.planar_chain import Chain
from systems.segments import order
from systems.shipped import run_shipped, shipped

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.multibody.analysis.equilibrium import static_equilibrium
from modalprep.multibody.analysis.linearise import linearise
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.reference.equations import body_states, node_motion
from modalprep.reduction.prestress import interface_load

EI, MU, LENGTH = 140.0, 1.2, 10.0
ROOT = 1.8751040687119611  # of cos x cosh x = -1
STATIC = ("force", "moment")  # shapes: the answers to both at the tip
# tip at 1, 2 .. 5 s, geometrically exact beam of Exudyn: see SLEW in test_segmented_beams.py
TIP = np.array([(9.7816, -0.0377), (6.6693, -0.7802), (6.0792, 2.8777), (1.9043, 8.7614), (-1.7203, 9.7586)])


def segment(length, modes, truncation):
    slender = mp.Material(E=1e12, nu=0.3, rho=MU / 1e-3)
    section = mp.Beam(material=slender, A=1e-3, Iy=1e-8, Iz=EI / 1e12, J=1e-8, theory="euler-bernoulli")
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(beam_mesh(4, length), {"beam": section}, ends)
    loads = {
        "force": interface_load(model, "tip", force=(0, 1.0, 0)),
        "moment": interface_load(model, "tip", moment=(0, 0, 1.0)),
    }
    basis = mp.craig_bampton(model, modes=modes, truncation=truncation, loads={key: loads[key] for key in truncation})
    return mp.flexible_body(model, basis, name="segment")


def beam(count, modes=0, truncation=STATIC, motion=None, torque=0.0):
    """Clamped to the ground, or to a shaft in motion; a torque at the tip."""
    body = segment(LENGTH / count, modes, truncation)
    names = [f"s{k}" for k in range(count)]
    parents = ["ground", *(f"{name}.tip" for name in names[:-1])]
    joints = [
        mp.Joint(name=f"weld{name}", type="weld", parent=parent, child=name)
        for name, parent in zip(names, parents, strict=True)
    ]
    if motion:
        joints[0] = mp.Joint(name="shaft", type="revolute", parent="ground", child="s0", motion=motion)
    load = mp.PointForce(name="load", at=f"{names[-1]}.tip", torque=(0, 0, torque))
    return mp.System(bodies=dict.fromkeys(names, body), joints=tuple(joints), loads=(load,))


def frequencies(system):
    """Over ``sqrt(EI / (mu L^4))``."""
    unit = np.sqrt(EI / MU) / LENGTH**2
    return np.sort(np.abs(np.linalg.eigvals(linearise(system).A)))[::2] / unit


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    (run,) = run_shipped("elastic-segments", tmp_path_factory.mktemp("segments")).runs.values()
    return run


def test_slew(run):
    """Against the geometrically exact beam; distances as the header says."""
    rows = [int(np.argmin(np.abs(run.time - t))) for t in (1, 2, 3, 4, 5)]
    apart = np.linalg.norm(run["arm10.tip.position"][rows, :2] - TIP, axis=1)
    assert (apart < [0.004, 0.065, 0.05, 0.12, 0.12]).all()
    assert run.stats["energy_error"] < 1e-8


def test_slew_converges_with_order_three(run):
    """Rods have order two. The beam is known to 1e-3 until 3 s, which is what 20 segments lack."""
    motion = mp.multibody.TimeFunction([(2.0, "pi/2*(t/2 - sin(pi*t)/(2*pi))"), (np.inf, "pi/2")])
    apart = []
    for count in (5, 10, 20):
        fine = mp.simulate(beam(count, motion=motion), t_end=4, output_step=1.0, method="explicit", rtol=1e-6)
        apart.append(np.linalg.norm(fine[f"s{count - 1}.tip.position"][2:, :2] - TIP[1:4], axis=1))
    assert order([errors[:2] for errors in apart[:2]]).min() >= 2.8  # 3.09 and 3.44 at 2 and 3 s
    assert apart[2].max() < 0.003  # 40 rods: 0.018
    shipped_tip = run["arm10.tip.position"][[40, 60, 80], :2]
    np.testing.assert_allclose(np.linalg.norm(shipped_tip - TIP[1:4], axis=1), apart[1], atol=2e-5)  # rtol 1e-6


def cubic_elements(count):
    """Frequencies of a cantilever of cubic elements with consistent mass, over ``sqrt(EI / (mu L^4))``."""
    K, M = hermite(count)
    return np.sqrt(eigh(K[2:, 2:], M[2:, 2:], eigvals_only=True))


def test_small_vibration_is_that_of_cubic_elements(tmp_path):
    """Force and moment at the tip bend a segment as the two cubics of a beam element: the same chain, in joints."""
    np.testing.assert_allclose(
        frequencies(shipped("elastic-segments", tmp_path)[0])[:8], cubic_elements(10)[:8], rtol=1e-6
    )
    exact = cantilever_roots(2) ** 2
    found = frequencies(beam(5))[:2]
    np.testing.assert_allclose(found, cubic_elements(5)[:2], rtol=1e-6)
    forty_rods = Chain(40, 1.0, 1.0, EI=1.0).frequencies()[:2]
    assert (abs(found - exact) < abs(forty_rods - exact)).all()


def test_modes_of_a_free_tip_are_too_stiff():
    """A moment turns the tip of a mode by psi^2 / omega^2 (2.753, 3.516): too little, however finely cut."""
    coarse, fine = (frequencies(beam(count, modes=1, truncation=()))[0] for count in (20, 40))
    slope = 2 * ROOT * 0.734096  # of the tip, of a mode of unit modal mass on unit length
    assert 2 * fine - coarse == pytest.approx(3.516015**2 / slope, rel=2e-3)  # order one; what is left, of order two


def test_roll_up():
    """A moment turns every segment by M l / EI, to the fourth order of the turn; places to its third."""
    apart, turns = [], []
    for count in (12, 48, 96):
        system = beam(count, torque=2 * EI / LENGTH)
        state, packed = static_equilibrium(system), pack(system)
        last = body_states(system, packed, state.y, np.zeros((len(packed.links), 3)))[-1]
        arm, turn, *_ = node_motion(last.body, 1, np.zeros(3), last.q, 0 * last.q)
        tip, turn = last.p + last.R @ arm, last.R @ turn
        exact = LENGTH * np.array([np.sin(2) / 2, (1 - np.cos(2)) / 2, 0])
        apart.append(np.linalg.norm(tip - exact))
        turns.append(np.arctan2(turn[1, 0], turn[0, 0]) - 2)
    np.testing.assert_allclose(order(apart[1:]), 3.0, atol=0.2)  # 2.43, 2.74 and 2.88 from 12 segments on
    np.testing.assert_allclose(order(turns[1:]), 4.0, atol=0.1)
    assert apart[0] < 3e-4  # with displacements of second order alone: 1.3e-3
    assert abs(turns[0]) < 0.1 * 2 * (2 / 12) ** 4
