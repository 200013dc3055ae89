"""Integrals and unit-load matrices of one uniform cantilever from a beam, a shell and a solid mesh: closed forms."""

from itertools import combinations

import numpy as np
import pytest
from analytic import cantilever_frequency, cantilever_roots
from beam_series import blade, critical_acceleration, effective_masses, unit_loads
from scipy.linalg import eigh
from scipy.optimize import brentq
from scipy.special import jv
from structured import box, surface

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.multibody.analysis.spin import spin_modes

LENGTH, WIDTH, THICK = 1.0, 0.04, 0.005
STEEL = mp.Material(E=200e9, nu=0.0, rho=8000.0)  # nu = 0: no anticlastic bending, which no beam has
RHO_A, EI = 8000.0 * WIDTH * THICK, 200e9 * WIDTH * THICK**3 / 12
TIME = np.sqrt(RHO_A * LENGTH**4 / EI)
MODES = 4
MESHES = ("beam", "shell", "solid")

# discretisation (order h^2) and the slenderness t / L = 1/200, whose shear and rotary inertia lower lambda_4 by 4e-4
RELATIVE = {"beam": 2e-3, "shell": 4e-3, "solid": 2e-3}


def strip_mesh(kind):
    """Along x, bending softly towards z; groups strip, root, tip."""
    if kind == "beam":
        return beam_mesh(60, LENGTH).with_(groups=_renamed(beam_mesh(60, LENGTH).groups))
    if kind == "shell":
        points, cells = surface(40, 1, "quad", lambda s, t: (LENGTH * s, WIDTH * (t - 0.5), 0 * s))
        cell = "quad"
    else:
        points, cells = box("hexahedron20", (60, 1, 1), (LENGTH, WIDTH, THICK))
        points, cell = points - [0, WIDTH / 2, THICK / 2], "hexahedron20"
    ends = [np.flatnonzero(np.abs(points[:, 0] - x) < 1e-9) for x in (0.0, LENGTH)]
    groups = {"strip": {cell: np.arange(len(cells))}, "root": {"vertex": np.arange(len(ends[0]))},
              "tip": {"vertex": len(ends[0]) + np.arange(len(ends[1]))}}  # fmt: skip
    return mp.fe.Mesh(points=points, cells={cell: cells, "vertex": np.concatenate(ends)[:, None]}, groups=groups)


def _renamed(groups):
    return {"strip": groups["beam"], "root": groups["root"], "tip": groups["tip"]}


def section(kind):
    if kind == "beam":
        Iy, Iz = WIDTH * THICK**3 / 12, THICK * WIDTH**3 / 12
        return mp.Beam(material=STEEL, A=WIDTH * THICK, Iy=Iy, Iz=Iz, J=4 * Iy, ky=5 / 6, kz=5 / 6)
    return mp.Shell(material=STEEL, thickness=THICK) if kind == "shell" else mp.Solid(material=STEEL)


def strip(kind, modes=14, tip_mass=0.0, truncation=()):
    link = "node" if kind == "beam" else "rbe2"
    ends = {name: mp.Interface(group=name, kind=link, boundary="free") for name in ("root", "tip")}
    mesh, properties = strip_mesh(kind), {"strip": section(kind)}
    if tip_mass:
        nodes = mesh.cells["vertex"][mesh.groups["tip"]["vertex"], 0]
        vertices = np.concatenate([mesh.cells["vertex"], nodes[:, None]])
        groups = {f"mass{k}": {"vertex": np.array([len(mesh.cells["vertex"]) + k])} for k in range(len(nodes))}
        mesh = mesh.with_(cells={**mesh.cells, "vertex": vertices}, groups={**mesh.groups, **groups})
        properties |= {f"mass{k}": mp.PointMass(mass=tip_mass / len(nodes)) for k in range(len(nodes))}
    model = mp.assemble(mesh, properties, ends)
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=truncation), name=kind)


def soft(body):
    """The first bending modes towards z, and the signs that make their tips move by +, -, +, -."""
    modes = np.flatnonzero(np.abs(body.S[2]) > 0.1 * np.sqrt(body.m))[:MODES]
    return modes, np.sign(body.phi[1, 2, modes]) * (-1) ** np.arange(MODES)


def table(body, matrix):
    modes, sign = soft(body)
    return matrix[np.ix_(modes, modes)] * sign * sign[:, None]


def nearest(found, expected):
    """Frequencies (lambda) next to the expected ones: torsion and stiff bending lie between."""
    values = found.frequency * 2 * np.pi * TIME
    return np.array([values[np.argmin(np.abs(values - e))] for e in expected])


UNIT_LOADS = {
    "centrifugal": lambda b: -b.Kg_W[0, 0],
    "acceleration": lambda b: -b.Kg_A[0] * LENGTH,
    "tip force": lambda b: b.Kg_F[1, 0] * RHO_A * LENGTH**2,
}


@pytest.fixture(scope="module")
def bodies():
    return {kind: strip(kind) for kind in MESHES}


@pytest.mark.parametrize("kind", MESHES)
def test_frequencies_and_modal_integrals(bodies, kind):
    body = bodies[kind]
    modes, sign = soft(body)
    exact = cantilever_frequency(MODES, EI, RHO_A, LENGTH) / (2 * np.pi)
    np.testing.assert_allclose(body.frequency[modes], exact, rtol=RELATIVE[kind])
    unit = np.sqrt(RHO_A * LENGTH)
    np.testing.assert_allclose(body.S[2, modes] * sign / unit, np.sqrt(effective_masses(MODES)[0]), rtol=RELATIVE[kind])
    np.testing.assert_allclose(
        body.H[2, 0, modes] * sign / (unit * LENGTH), 2 / cantilever_roots(MODES) ** 2, rtol=2 * RELATIVE[kind]
    )
    np.testing.assert_allclose(table(body, body.P[2, 2]), np.eye(MODES), atol=1e-3)  # rotary inertia


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("load", UNIT_LOADS)
def test_unit_load_matrices(bodies, kind, load):
    pick, expected = UNIT_LOADS[load], unit_loads(MODES)[load]
    found, scale = table(bodies[kind], pick(bodies[kind])), np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs((found - expected) / scale).max() < 2 * RELATIVE[kind]


@pytest.mark.parametrize("load", UNIT_LOADS)
def test_meshes_agree_with_each_other(bodies, load):
    pick, expected = UNIT_LOADS[load], unit_loads(MODES)[load]
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    found = {kind: table(body, pick(body)) for kind, body in bodies.items()}
    for a, b in combinations(MESHES, 2):
        assert np.abs((found[a] - found[b]) / scale).max() < 2 * (RELATIVE[a] + RELATIVE[b]), (a, b)


@pytest.mark.parametrize("kind", MESHES)
def test_other_unit_loads_do_not_stiffen_a_straight_strip(bodies, kind):
    body = bodies[kind]
    others = [body.Kg_A[1], body.Kg_A[2], body.Kg_W[1, 1], body.Kg_W[2, 2], body.Kg_W[1, 0], body.Kg_W[2, 0]]
    largest = np.abs(table(body, body.Kg_W[0, 0])).max()
    assert max(np.abs(table(body, Kg)).max() for Kg in others) < 2.5e-5 * largest  # (t / L)^2: it is not all slender


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("gamma", [2, 6])
def test_rotating_strip(bodies, kind, gamma):
    """The soft bending is lag when the strip spins about y, flap when it spins about z."""
    flap = blade(gamma)[:3]
    for axis, expected in {"y": np.sqrt(flap**2 - gamma**2), "z": flap}.items():
        spin = gamma / TIME * np.array([0.0, axis == "y", axis == "z"])
        found = nearest(spin_modes(bodies[kind], spin), expected)
        np.testing.assert_allclose(found, expected, rtol=2 * RELATIVE[kind])


@pytest.mark.parametrize("kind", MESHES)
def test_buckling_under_axial_acceleration(bodies, kind):
    """``rho A a L^3 / EI = 9/4 z^2`` with the first zero z of ``J_(-1/3)``: Greenhill (1881)."""
    body = bodies[kind]
    modes, _ = soft(body)
    Kg = body.Kg_A[0][np.ix_(modes, modes)]
    factor = 1 / eigh(-Kg, np.diag(body.K[modes]), eigvals_only=True)[-1]
    zero = brentq(lambda z: jv(-1 / 3, z), 1.0, 2.5)
    assert critical_acceleration() == pytest.approx(9 / 4 * zero**2, rel=1e-9)  # the series, used below
    assert factor * RHO_A * LENGTH**3 / EI == pytest.approx(9 / 4 * zero**2, rel=2 * RELATIVE[kind])


@pytest.mark.parametrize("kind", MESHES)
def test_tip_mass_in_the_unit_loads(kind):
    """The tip mass is part of the unit inertia loads."""
    body = strip(kind, modes=8, tip_mass=RHO_A * LENGTH, truncation=("inertia",))
    factor = 1 / eigh(-body.Kg_A[0], np.diag(body.K), eigvals_only=True)[-1]
    assert factor * RHO_A * LENGTH**3 / EI == pytest.approx(critical_acceleration(1.0), rel=2 * RELATIVE[kind])
    for gamma in (0, 2, 8):
        flap = blade(gamma, tip_mass=1.0)[:2]
        expected = {"y": np.sqrt(flap**2 - gamma**2), "z": flap}  # soft bending is lag, or flap
        for axis, value in expected.items():
            spin = gamma / TIME * np.array([0.0, axis == "y", axis == "z"])
            np.testing.assert_allclose(nearest(spin_modes(body, spin), value), value, rtol=3 * RELATIVE[kind])
