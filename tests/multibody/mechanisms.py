"""Mechanisms with closed loops of published data."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.multibody.closures import Closure, Coupler
from modalprep.multibody.loads import AxialSpring, PointForce


def link(name, mass, centre, inertia, **interfaces):
    """Planar rigid body: centre and interfaces in the x-y plane, moment of inertia about the centre."""
    frames = {"root": np.zeros(3)} | {key: np.array([*value, 0.0]) for key, value in interfaces.items()}
    return rigid_body(name, mass=mass, centre=np.array([*centre, 0.0]), inertia=inertia * np.eye(3), interfaces=frames)


def squeezer():
    """Andrews' squeezing mechanism: data of Hairer and Wanner, Solving ODEs II, section VI.9; start by CASES 9.3."""
    d, da, e, ea, rr, ra, ss, sa, sb, sc, sd = (
        0.028,
        0.0115,
        0.02,
        0.01421,
        0.007,
        9.2e-4,
        0.035,
        0.01874,
        0.01043,
        0.018,
        0.02,
    )
    ta, tb, u, ua, ub, zf, zt, fa = 0.02308, 0.00916, 0.04, 0.01228, 0.00449, 0.02, 0.04, 0.01421
    m = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498]
    inertia = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5]
    bodies = {
        "K1": link("K1", m[0], (ra, 0), inertia[0], end=(rr, 0)),
        "K2": link("K2", m[1], (-da, 0), inertia[1], end=(-d, 0)),
        "K3": link("K3", m[2], (sa, sb), inertia[2], end=(0, -ss), spring=(sd, -sc)),
        "K5": link("K5", m[4], (ta, tb), inertia[4], end=(zt, 0)),
        "K4": link("K4", m[3], (0, ea - e), inertia[3], end=(0, -e)),
        "K7": link("K7", m[6], (ua, ub), inertia[6], end=(0, -u)),
        "K6": link("K6", m[5], (zf - fa, 0), inertia[5], end=(zf, 0)),
    }
    A, B, C = np.array([-0.06934, -0.00227, 0]), np.array([-0.03635, 0.03273, 0]), np.array([0.014, 0.072, 0])
    angles = {
        "beta": -0.0617138900142764, "Theta": 0.0, "gamma": 0.455279819163070, "Phi": 0.222668390165886,
        "delta": 0.487364979543843, "Omega": -0.222668390165886, "epsilon": 1.23054744454982,
    }  # fmt: skip
    places = [
        ("beta", "ground", "K1", np.zeros(3)), ("Theta", "K1.end", "K2", np.zeros(3)), ("gamma", "ground", "K3", B),
        ("delta", "ground", "K5", A), ("Phi", "K5.end", "K4", np.zeros(3)), ("epsilon", "ground", "K7", A),
        ("Omega", "K7.end", "K6", np.zeros(3)),
    ]  # fmt: skip
    joints = tuple(
        mp.Joint(name=name, type="revolute", parent=parent, child=child, position=position, angle=angles[name])
        for name, parent, child, position in places
    )
    closures = tuple(
        Closure(name=f"pin {body}", type="spherical", a="K2.end", b=f"{body}.end") for body in ("K3", "K4", "K6")
    )
    loads = (
        PointForce(name="drive", at="K1.root", torque=(0, 0, 0.033)),
        AxialSpring(name="spring", between=("ground", "K3.spring"), stiffness=4530, length=0.07785, position=C),
    )
    return mp.System(bodies=bodies, joints=joints, closures=closures, loads=loads)


def crank_rod():
    """Elastic rod of Simeon's slider crank (CASES 9.2): its modal integrals as published, and the mass-normal basis.

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
