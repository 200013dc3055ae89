"""Elastic foundations against closed forms of Winkler beams and plates."""

import numpy as np
import pytest
import skfem
from structured import surface

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.reduction.clamped import clamp

STEEL = mp.Material(E=2e11, nu=0.3, rho=8000.0)
SECTION = mp.Beam(material=STEEL, A=1e-4, Iy=8e-10, Iz=8e-10, J=1.6e-9)
T = 0.01  # thickness of the plate, m


def beam(n, length, terms, **supports):
    """A beam along x whose frame of the root is held by what supports and terms say."""
    mesh = mp.fe.Mesh(
        points=np.linspace((0.0, 0, 0), (length, 0, 0), n + 1),
        cells={"line": np.arange(n)[:, None] + [0, 1]},
        groups={"beam": {"line": np.arange(n)}},
    )
    held = {name: mp.Support(near=at, components=digits) for name, (at, digits) in supports.items()}
    root = mp.Interface(kind="support", position=(0.0, 0.0, 0.0))
    return mp.assemble(mesh, {"beam": SECTION}, {"root": root}, supports=held, terms=terms)


def plate(terms, n=8):
    """A simply supported unit square."""
    points, quads = surface(n, n, "quad")
    edges = [
        mp.Support(plane=((x, x, 0.0), e), components="123") for x in (0.0, 1.0) for e in ((1.0, 0, 0), (0, 1.0, 0))
    ]
    mesh = mp.fe.Mesh(points=points, cells={"quad": quads}, groups={"plate": {"quad": np.arange(n * n)}})
    supports = {f"edge{k}": edge for k, edge in enumerate(edges)}
    section = mp.Shell(material=STEEL, thickness=T)
    root = mp.Interface(kind="support", position=(0.0, 0.0, 0.0))
    return mp.assemble(mesh, {"plate": section}, {"root": root}, supports=supports, terms=terms)


def squares(model: FEModel, n=4):
    """Squared circular frequencies with the root held."""
    return np.sort((2 * np.pi * mp.craig_bampton(model, modes=n, truncation=()).frequency) ** 2)


def static(model: FEModel, load):
    clamped = clamp(model)
    x = np.zeros(clamped.K.shape[0])
    x[clamped.i] = clamped.factor.solve((model.C.T @ load)[clamped.i])
    return model.C @ x


def test_plate_on_a_bed():
    """``w^2 = w_0^2 + k / (rho t)``: the bed has the shapes of the mass, to its rotary inertia (t / a)^2 = 1e-4."""
    k = 2e7
    free, bedded = (
        squares(plate(terms)) for terms in ({}, {"bed": mp.Foundation(group="plate", stiffness_per_area=k)})
    )
    np.testing.assert_allclose(bedded - free, k / (STEEL.rho * T), rtol=1e-3)


def test_beam_on_a_bed():
    """A pinned beam, bed in both directions across it: ``w^2 = w_0^2 + k / (rho A)``, to the rotary inertia."""
    k, pins = 1e5, {"left": ((0.0, 0, 0), "1234"), "right": ((2.0, 0, 0), "23")}
    bed = mp.Foundation(group="beam", stiffness_per_length=k)
    free, bedded = (squares(beam(16, 2.0, terms, **pins)) for terms in ({}, {"bed": bed}))
    np.testing.assert_allclose(bedded - free, k / (STEEL.rho * SECTION.A), rtol=1e-3)
    omega = (np.pi / 2.0) ** 4 * STEEL.E * SECTION.Iy / (STEEL.rho * SECTION.A)
    assert bedded[0] == pytest.approx(omega + k / (STEEL.rho * SECTION.A), rel=1e-4)


def test_long_beam_under_a_force():
    """Winkler: ``w = P beta / (2 k)`` under the force and ``M = P / (4 beta)``, ``beta = (k / (4 E I))^(1/4)``."""
    k, P = 1e5, 100.0
    beta = (k / (4 * STEEL.E * SECTION.Iy)) ** 0.25
    length = 16 / beta  # the ends move by e^-8 of the middle
    model = beam(64, length, {"bed": mp.Foundation(group="beam", stiffness_per_length=k)}, end=((0.0, 0, 0), "14"))
    load = np.zeros(model.n_dof)
    load[model.dof[32, 2]] = P
    w = static(model, load)[model.dof[:, 2]]
    assert w[32] == pytest.approx(P * beta / (2 * k), rel=2e-3)  # e^-8, and (beta h)^4 / 100 of the elements
    x = beta * abs(model.points[:, 0] - length / 2)
    np.testing.assert_allclose(w[16:49], (w[32] * np.exp(-x) * (np.cos(x) + np.sin(x)))[16:49], atol=2e-3 * w[32])


@pytest.mark.parametrize("k", [3e6, (1e6, 2e6, 3e6)])
def test_own_form_is_the_foundation(k):
    """A Winkler form in Python, of the bases themselves: the same stiffness to the last digits."""

    def bed(u, t, v, s, w):
        stiffness = k * w.n if np.isscalar(k) else np.reshape(k, (3, 1, 1))
        return sum(stiffness[a] * u[a] * v[a] * (abs(w.n[a]) if np.isscalar(k) else 1) for a in range(3))

    own = mp.fe.Term(form=skfem.BilinearForm(bed), group="plate", to="stiffness")
    first, second = plate({"bed": mp.Foundation(group="plate", stiffness_per_area=k)}), plate({"bed": own})
    assert abs(first.K - second.K).max() <= 1e-12 * abs(first.K).max()


def test_bed_moves_with_the_root():
    """No rigid motion of the body strains the bed, and its reaction is at the root."""
    model = plate({"bed": mp.Foundation(group="plate", stiffness_per_area=(1e6, 2e6, 3e6))})
    R = model.rigid_body()
    assert abs(model.K @ R).max() < 1e-9 * abs(model.K).max()
    root = model.interfaces[0].dofs
    lift = R[:, 2].copy()
    lift[root] = 0.0  # the body alone
    assert (model.terms["bed"].K @ lift)[root[2]] == pytest.approx(-3e6, rel=1e-9)


def test_bed_under_faces_of_a_solid():
    """The group of faces needs no property; the whole load of a lifted face."""
    mesh = solid()
    root = mp.Interface(plane=((0.0, 0, 0), (1.0, 0, 0)))
    bed = mp.Foundation(group="floor", stiffness_per_area=4e6)
    model = mp.assemble(mesh, {"body": mp.Solid(material=STEEL)}, {"root": root}, terms={"bed": bed})
    lift = model.rigid_body()[:, 2].copy()
    lift[model.interfaces[0].dofs] = 0.0
    assert lift @ model.terms["bed"].K @ lift == pytest.approx(4e6 * 0.5, rel=1e-12)
    bed = mp.Foundation(group="floor", stiffness_per_length=4e6)
    with pytest.raises(InputError, match="term 'bed': group 'floor' has quad cells, but no lines"):
        mp.assemble(mesh, {"body": mp.Solid(material=STEEL)}, {"root": root}, terms={"bed": bed})


def solid():
    """Two cubes beside each other, and their floor."""
    points = np.array([[x, y, z] for z in (0.0, 0.5) for y in (0.0, 0.5) for x in (0.0, 0.5, 1.0)])
    hexes = np.array([[0, 1, 4, 3, 6, 7, 10, 9], [1, 2, 5, 4, 7, 8, 11, 10]])
    cells = {"hexahedron": hexes, "quad": hexes[:, [0, 3, 2, 1]]}
    return mp.fe.Mesh(
        points=points,
        cells=cells,
        groups={"body": {"hexahedron": np.arange(2)}, "floor": {"quad": np.arange(2)}},
    )


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "exactly one of stiffness_per_area, stiffness_per_length; it has none"),
        (
            {"stiffness_per_area": 1.0, "stiffness_per_length": 1.0},
            "it has stiffness_per_area and stiffness_per_length",
        ),
        ({"stiffness_per_area": -1.0}, "must not be negative"),
        ({"stiffness_per_area": (1.0, 2.0)}, "has 2 numbers; give one, or those along x, y and z"),
    ],
)
def test_refused(given, message):
    with pytest.raises(InputError, match=message):
        mp.Foundation(group="plate", **given)
