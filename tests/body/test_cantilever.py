"""Integrals and unit-load matrices of one uniform cantilever from a beam, a shell and a solid mesh (CASES 5.3)."""

from itertools import combinations

import numpy as np
import pytest
from analytic import ROTATING_FLAP, cantilever_frequency
from scipy.linalg import eigh
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

# Of the unit cantilever with int phi^2 = 1 and phi(1) = 2 (-1)^(i+1); closed forms 2 sigma / beta and 2 / beta^2, and
# int (1-x^2)/2 phi' phi', int (1-x) phi' phi', int phi' phi' by quadrature.
BETA, SIGMA = np.array([[1.8751041, 4.6940911, 7.8547574, 10.9955407], [0.734096, 1.018467, 0.999224, 1.000034]])
CENTRIFUGAL = [[1.193336, -0.685855, -0.792379, -0.546413], [-0.685855, 6.478225, 0.169408, -2.911851],
               [-0.792379, 0.169408, 17.859520, 3.274272], [-0.546413, -2.911851, 3.274272, 36.055388]]  # fmt: skip
AXIAL = [[1.570878, -0.42232, -1.072085, -0.873138], [-0.42232, 8.647143, 1.890055, -3.643385],
         [-1.072085, 1.890055, 24.952113, 8.33829], [-0.873138, -3.643385, 8.33829, 51.459105]]  # fmt: skip
TIP_FORCE = [[4.647778, -7.379875, 3.941515, -6.593388], [-7.379875, 32.417399, -22.352444, 13.582471],
             [3.941515, -22.352444, 77.298891, -35.648270], [-6.593388, 13.582471, -35.648270, 142.901849]]  # fmt: skip

# Cantilever whose tip carries its own mass: lambda of flap against gamma; Bir, NREL/CP-500-47953 (2010), table 5
TIP_MASS_FLAP = {0: (1.5573, 16.2501), 1: (1.9017, 16.7570), 2: (2.6696, 18.1910), 4: (4.5429, 23.0229),
                 6: (6.5091, 29.2917), 8: (8.4945, 36.2133)}  # fmt: skip
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
    "centrifugal": (lambda b: -b.Kg_W[0, 0], CENTRIFUGAL),
    "axial acceleration": (lambda b: -b.Kg_A[0] * LENGTH, AXIAL),
    "tip force": (lambda b: b.Kg_F[1, 0] * RHO_A * LENGTH**2, TIP_FORCE),
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
    np.testing.assert_allclose(body.S[2, modes] * sign / unit, 2 * SIGMA / BETA, rtol=RELATIVE[kind])
    np.testing.assert_allclose(body.H[2, 0, modes] * sign / (unit * LENGTH), 2 / BETA**2, rtol=2 * RELATIVE[kind])
    np.testing.assert_allclose(table(body, body.P[2, 2]), np.eye(MODES), atol=1e-3)  # rotary inertia


@pytest.mark.parametrize("kind", MESHES)
@pytest.mark.parametrize("load", UNIT_LOADS)
def test_unit_load_matrices(bodies, kind, load):
    pick, expected = UNIT_LOADS[load]
    found, scale = table(bodies[kind], pick(bodies[kind])), np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    assert np.abs((found - expected) / scale).max() < 2 * RELATIVE[kind]


@pytest.mark.parametrize("load", UNIT_LOADS)
def test_meshes_agree_with_each_other(bodies, load):
    pick, expected = UNIT_LOADS[load]
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
    """CASES 3.3: the soft bending is lag when the strip spins about y, flap when it spins about z."""
    flap = np.array(ROTATING_FLAP[gamma])
    for axis, expected in {"y": np.sqrt(flap**2 - gamma**2), "z": flap}.items():
        spin = gamma / TIME * np.array([0.0, axis == "y", axis == "z"])
        found = nearest(spin_modes(bodies[kind], spin), expected)
        np.testing.assert_allclose(found, expected, rtol=2 * RELATIVE[kind])


@pytest.mark.parametrize("kind", MESHES)
def test_buckling_under_axial_acceleration(bodies, kind):
    """CASES 3.4: rho A a L^3 / EI = 7.837347, exact by Bessel functions."""
    body = bodies[kind]
    modes, _ = soft(body)
    Kg = body.Kg_A[0][np.ix_(modes, modes)]
    factor = 1 / eigh(-Kg, np.diag(body.K[modes]), eigvals_only=True)[-1]
    assert factor * RHO_A * LENGTH**3 / EI == pytest.approx(7.837347, rel=2 * RELATIVE[kind])


@pytest.mark.parametrize("kind", MESHES)
def test_tip_mass_in_the_unit_loads(kind):
    """CASES 5.4 (ii): the tip mass is part of the unit inertia loads."""
    body = strip(kind, modes=8, tip_mass=RHO_A * LENGTH, truncation=("inertia",))
    factor = 1 / eigh(-body.Kg_A[0], np.diag(body.K), eigvals_only=True)[-1]
    assert factor * RHO_A * LENGTH**3 / EI == pytest.approx(1.895974, rel=2 * RELATIVE[kind])
    for gamma, flap in TIP_MASS_FLAP.items():
        expected = {"y": np.sqrt(np.array(flap) ** 2 - gamma**2), "z": np.array(flap)}  # soft bending is lag, or flap
        for axis, value in expected.items():
            spin = gamma / TIME * np.array([0.0, axis == "y", axis == "z"])
            np.testing.assert_allclose(nearest(spin_modes(body, spin), value), value, rtol=3 * RELATIVE[kind])
