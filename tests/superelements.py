"""A pipe reduced by plain formulas: the superelement that other programs would hand over."""

from itertools import pairwise

import numpy as np
from scipy.sparse.linalg import eigsh, splu

import modalprep as mp

MODES = 16
SI = (1.0, 1.0)


def pipe(unit=SI):
    """A pipe bent in space with an eccentric pump, three interfaces; its numbers in units of (m, kg)."""
    length, mass = unit
    stress = mass / length  # kg / (m s^2)
    corners = np.array([[0.2, 0.1, 0], [1.1, 0.2, 0.3], [1.3, 1.0, 0.1], [2.0, 1.1, 0.9]])
    points = np.concatenate([np.linspace(a, b, 7)[:-1] for a, b in pairwise(corners)] + [corners[-1:]]) / length
    cells = {
        "line": np.stack([np.arange(18), np.arange(1, 19)], axis=1),
        "vertex": np.array([[0], [9], [18], [4]]),
    }
    groups = {"pipe": {"line": np.arange(18)}}
    groups |= {name: {"vertex": np.array([k])} for k, name in enumerate(("root", "saddle", "tip", "pump"))}
    steel = mp.Material(E=2.1e11 / stress, nu=0.3, rho=7850.0 / mass * length**3)
    section = mp.Beam(material=steel, A=8e-4 / length**2, Iy=6e-7 / length**4, Iz=4e-7 / length**4, J=1e-6 / length**4)
    pump = mp.PointMass(
        mass=6.0 / mass,
        inertia=tuple(np.array([0.03, 0.05, 0.04, 0.004, -0.002, 0.001]) / (mass * length**2)),
        offset=tuple(np.array([0.05, 0.1, -0.08]) / length),
    )
    ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "saddle", "tip")}
    return mp.assemble(mp.fe.Mesh(points=points, cells=cells, groups=groups), {"pipe": section, "pump": pump}, ends)


def craig_bampton_matrices(model, modes=MODES):
    """Mass and stiffness (n_b + modes) by plain formulas."""
    K, M = ((model.C.T @ A @ model.C).tocsc() for A in (model.K, model.M))
    b = np.searchsorted(model.free, np.concatenate([frame.dofs for frame in model.interfaces]))
    i = np.setdiff1d(np.arange(len(model.free)), b)
    K_ii, M_ii = (A[i][:, i].tocsc() for A in (K, M))
    T = np.zeros((len(model.free), len(b) + modes))
    T[b, np.arange(len(b))] = 1.0
    T[i, : len(b)] = -splu(K_ii).solve(K[i][:, b].toarray())
    if modes:
        w2, Phi = eigsh(K_ii, modes, M_ii, sigma=0, tol=1e-12, v0=np.ones(len(i)))
        T[i, len(b) :] = Phi[:, np.argsort(w2)]
    mass, stiffness = (T.T @ (A @ T) for A in (M, K))
    return (mass + mass.T) / 2, (stiffness + stiffness.T) / 2
