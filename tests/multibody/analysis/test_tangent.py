"""Modes of systems whose stiffest body mode is 1e6 times as fast as the slowest motion, against massless springs."""

import numpy as np
import pytest
from compare import assert_close

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.multibody.model.time_function import TimeFunction

LENGTH, D, E, NU = 0.8, 0.03, 2.1e11, 0.3
SECOND, A = np.pi * D**4 / 64, np.pi * D**2 / 4
MASS, POLAR, ACROSS = 20.0, 0.6, 0.3  # of the disc


def shaft(rho):
    """Ten Euler-Bernoulli beams along x with fixed ends, six modes besides those of the interfaces."""
    section = mp.Beam(
        material=mp.Material(E=E, nu=NU, rho=rho), A=A, Iy=SECOND, Iz=SECOND, J=2 * SECOND, theory="euler-bernoulli"
    )
    ends = {"root": mp.Interface(group="root", kind="node"),
            "tip": mp.Interface(group="tip", kind="node", boundary="fixed")}  # fmt: skip
    model = mp.assemble(beam_mesh(10, LENGTH), {"beam": section}, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=6, truncation=()), name="shaft")


def rotor(rho, **joint):
    disc = mp.rigid_body("disc", mass=MASS, centre=np.zeros(3), inertia=np.diag([POLAR, ACROSS, ACROSS]),
                         interfaces={"c": np.zeros(3)})  # fmt: skip
    joints = (mp.Joint(name="wall", parent="ground", child="shaft.root", **joint),
              mp.Joint(name="hub", type="weld", parent="shaft.tip", child="disc"))  # fmt: skip
    return mp.System(bodies={"shaft": shaft(rho), "disc": disc}, joints=joints)


def whirl(spin):
    """Rates (rad/s, four, signed) of the disc on a massless shaft: ``y + i z`` and its slope, gyroscopic moment.

    ``m r'' + k11 r + k12 s = 0`` and ``J s'' - i spin Jp s' + k12 r + k22 s = 0``.
    """
    K = E * SECOND / LENGTH**3 * np.array([[12, -6 * LENGTH], [-6 * LENGTH, 4 * LENGTH**2]])
    M, G, none = np.diag([MASS, ACROSS]), np.diag([0, spin * POLAR]), np.zeros((2, 2))
    # r = exp(i w t): (K + w G - w^2 M) r = 0
    return np.linalg.eigvals(np.block([[none, np.eye(2)], [np.linalg.solve(M, K), np.linalg.solve(M, G)]])).real


@pytest.mark.parametrize("rho", [0.78, 0.078, 1e-3])
def test_disc_on_an_ever_lighter_shaft(rho):
    """Two pairs of bending modes, torsion and travel; the body's highest mode is 5e4 to 1.5e6 times as fast.

    The modes by accelerations were 0.1 % off at 0.078 and zero at 1e-3 kg/m^3.
    """
    modes = mp.system_modes(rotor(rho, type="weld"))
    bending = np.repeat(np.unique(np.abs(whirl(0.0)).round(9)), 2)
    torsion = np.sqrt(E / (2 * (1 + NU)) * 2 * SECOND / LENGTH / POLAR)
    exact = np.sort([*bending, torsion, np.sqrt(E * A / LENGTH / MASS)])
    weight = rho * A * LENGTH
    tolerance = weight * (1 / MASS + LENGTH**2 / ACROSS / 100) + 1e-8  # the shaft's own mass; tilting, a hundredth
    assert_close(modes.frequency[:6] * 2 * np.pi / exact, np.ones(6), tolerance)
    assert np.abs(modes.damping).max() < 1e-6  # nothing damps it


@pytest.mark.parametrize("spin", [20.0, 300.0])
def test_gyroscopic_parts_keep_their_digits(spin):
    """The spinning disc on a shaft of 1e-3 kg/m^3, in axes that turn with it: the rates of whirl less the spin."""
    turning = TimeFunction(f"{spin} * t")
    system = rotor(1e-3, type="revolute", axis=np.array([1.0, 0, 0]), motion=turning)
    found = mp.system_modes(system).frequency * 2 * np.pi
    for rate in np.abs(whirl(spin) - spin):
        assert np.abs(found - rate).min() < 1e-5 * max(rate, spin), rate  # 1e-3 kg/m^3: 2e-8 of the disc's mass
