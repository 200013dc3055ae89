"""Mechanisms with closed loops of published data."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.multibody.model.constraints import Closure, Coupler


def link(name, mass, centre, inertia, **interfaces):
    """Planar rigid body: centre and interfaces in the x-y plane, moment of inertia about the centre."""
    frames = {"root": np.zeros(3)} | {key: np.array([*value, 0.0]) for key, value in interfaces.items()}
    return rigid_body(name, mass=mass, centre=np.array([*centre, 0.0]), inertia=inertia * np.eye(3), interfaces=frames)


def crank_rod():
    """Elastic rod of Simeon's slider crank: its modal integrals as published, and the mass-normal basis.

    Problem "crank" of the Test Set for IVP Solvers (Mazzia and Magherini, 2008), after Simeon (1996).

    Modes sin(pi x), sin(2 pi x) across, quadratic element (middle, end) along; M_Q as published, without a factor 1/15.
    """
    M2, L2, J2, E, b, rho = 0.151104, 0.30, 0.0045339259, 0.2e12, 0.008, 7870.0
    pi = 3.1415927
    FB, FK = rho * b * b * L2, E * b * b / L2
    M, K = np.diag([FB / 2, FB / 2, 8 * FB, 2 * FB]), np.zeros((4, 4))
    M[2, 3] = M[3, 2] = FB
    K[0, 0] = FK * pi**4 / 24 * (b / L2) ** 2
    K[1, 1], K[2, 2], K[3, 3] = 16 * K[0, 0], 16 / 3 * FK, 7 / 3 * FK
    K[2, 3] = K[3, 2] = -8 / 3 * FK
    B = np.zeros((4, 4))
    B[0, 2], B[0, 3], B[1, 3] = -16 * FB / pi**3, FB * (8 / pi**3 - 1 / pi), FB / (2 * pi)
    w2, V = eigh(K, M)
    S, H, P, phi = np.zeros((3, 4)), np.zeros((3, 3, 4)), np.zeros((3, 3, 4, 4)), np.zeros((2, 3, 4))
    S[0], S[1] = [0, 0, 2 * FB / 3, FB / 6], [2 * FB / pi, 0, 0, 0]
    H[0, 0], H[1, 0] = [0, 0, L2 * FB / 3, L2 * FB / 6], [L2 * FB / pi, -L2 * FB / (2 * pi), 0, 0]
    P[0, 0, 2:, 2:], P[1, 1, :2, :2] = M[2:, 2:], M[:2, :2]
    P[1, 0], P[0, 1] = -B, -B.T  # int rho phi_y phi_x of a mode across and one along
    phi[1, 0, 3] = 1.0
    rigid = rigid_body(
        "rod", mass=M2, centre=np.array([L2 / 2, 0, 0]), inertia=(J2 - M2 * L2**2 / 4) * np.eye(3),
        interfaces={"root": np.zeros(3), "tip": np.array([L2, 0, 0])},
    )  # fmt: skip
    pair = (V.T @ P) @ V
    rod = rigid.with_(
        S=S @ V, H=H @ V, P=pair, Kg_A=np.zeros((3, 4, 4)), Kg_W=np.zeros((3, 3, 4, 4)), Kg_F=np.zeros((2, 3, 4, 4)),
        Kg_T=np.zeros((2, 3, 4, 4)), phi=phi @ V, psi=np.zeros((2, 3, 4)), K=w2, D=np.zeros(4),
        frequency=np.sqrt(w2) / (2 * np.pi), shape=np.zeros((len(rigid.points), 3, 4)),
    )  # fmt: skip
    return rod, V


def slider_crank():
    """Simeon's slider crank with elastic rod: three conditions, two of the loop and one of the drive; and V."""
    rod, V = crank_rod()
    M1, L1, J1, M3 = 0.36, 0.15, 0.002727, 0.075552
    bodies = {
        "crank": link("crank", M1, (L1 / 2, 0), J1 - M1 * L1**2 / 4, end=(L1, 0)),
        "rod": rod,
        "slider": link("slider", M3, (0, 0), 1e-4),
    }
    joints = (
        mp.Joint(name="crank", type="revolute", parent="ground", child="crank"),
        mp.Joint(name="knee", type="revolute", parent="crank.end", child="rod"),
        mp.Joint(name="slide", type="prismatic", parent="ground", child="slider", axis=np.array([1.0, 0, 0])),
    )
    closures = (
        Closure(name="pin", type="spherical", a="slider.root", b="rod.tip"),
        Coupler(name="drive", factors={"crank": 1.0}, value="150*t"),
    )
    return mp.System(bodies=bodies, joints=joints, closures=closures), V
