"""Forms of a user in the matrices of a model."""

import numpy as np
import pytest
import skfem
from skfem.helpers import ddot, dot, grad
from structured import box, random_rotation, random_surface, surface

import modalprep as mp
from modalprep.errors import InputError
from modalprep.fe.elements.mass import PAIRS
from modalprep.reduction.clamped import clamp

STEEL = mp.Material(E=2e11, nu=0.3, rho=8000.0)
LIGHT = mp.Material(E=2e11, nu=0.3, rho=1e-6)
R = random_rotation(5)
ROOT = {"root": mp.Interface(node=1, kind="node")}


def shell(kind="quad", *, terms=None, curved=False, **section):
    points, cells = random_surface(kind) if curved else surface(3, 3, kind, distort=0.2)
    mesh = mp.fe.Mesh(
        points=points @ R.T,
        cells={kind: cells},
        groups={"skin": {kind: np.arange(len(cells))}},
    )
    return mp.assemble(mesh, {"skin": mp.Shell(thickness=0.01, **section)}, ROOT, terms=terms)


def block_mesh(kind):
    points, cells = box(kind, (2, 1, 1), size=(1.0, 0.5, 0.4), distort=0.1)
    return mp.fe.Mesh(points=points, cells={kind: cells}, groups={"body": {kind: np.arange(len(cells))}})


def block(kind="tetra10", terms=None, material=STEEL):
    mesh = block_mesh(kind)
    root = mp.Interface(plane=((0.0, 0, 0), (1.0, 0, 0)))
    return mp.assemble(mesh, {"body": mp.Solid(material=material)}, {"root": root}, terms=terms)


def equal(first, second, tolerance=1e-10):
    """Whether K, M and every integral of the mass agree."""
    for a, b in ((first.K, second.K), (first.M, second.M), *((first.M_ab[p], second.M_ab[p]) for p in PAIRS)):
        assert abs(a - b).max() <= tolerance * abs(b).max()
    r, s = first.rigid, second.rigid
    for a, b in ((first.g, second.g), (first.h, second.h), (r.m, s.m), (r.s0, s.s0), (r.E0, s.E0)):
        np.testing.assert_allclose(a, b, atol=tolerance * np.abs(b).max())


@pytest.mark.parametrize("kind", ["triangle", "quad", "quad8"])
def test_mass_on_shells_is_that_of_the_section(kind):
    """``nsm`` of a section against the same mass as a term, in every integral; nsm counts in rotary inertia too."""
    nsm = 30.0
    own = shell(kind, material=LIGHT, terms={"paint": mp.AddedMass(group="skin", mass_per_area=nsm)})
    section = shell(kind, material=LIGHT, nsm=nsm)
    equal(own, section, tolerance=2e-4)  # t^2 / 12 over the area of an element: 8e-6 / 0.05


def test_mass_on_solids_is_that_of_their_density():
    form = skfem.BilinearForm(lambda u, v, w: 500.0 * dot(u, v))
    own = block(terms={"filling": mp.fe.Term(form=form, group="body", to="mass")})
    equal(own, block(material=mp.Material(E=2e11, nu=0.3, rho=8500.0)))


def test_layer_on_solids_is_that_of_their_modulus():
    """A layer of half the material in Python: K is that of 1.5 E, and no rigid motion strains it."""
    lam, mu = (0.5 * STEEL.E * x for x in (0.3 / (1.3 * 0.4), 1 / 2.6))

    def elastic(u, v, w):
        e = (grad(u) + np.einsum("ij...->ji...", grad(u))) / 2
        return lam * np.einsum("ii...", grad(u)) * np.einsum("ii...", grad(v)) + 2 * mu * ddot(e, grad(v))

    own = block(terms={"more": mp.fe.Term(form=skfem.BilinearForm(elastic), group="body", to="stiffness")})
    equal(own, block(material=mp.Material(E=3e11, nu=0.3, rho=8000.0)))


def test_geometric_stiffness_of_solids():
    """The form of theory 7.5 in Python: twice the geometric stiffness, assembled and projected."""
    lam, mu = (STEEL.E * x for x in (0.3 / (1.3 * 0.4), 1 / 2.6))

    def form(u, v, w):
        e = (grad(w.d) + np.einsum("ij...->ji...", grad(w.d))) / 2
        sigma = lam * np.einsum("ii...", e) * np.eye(3)[..., None, None] + 2 * mu * e
        return np.einsum("kl...,ik...,il...->...", sigma, grad(u), grad(v))

    term = mp.fe.Term(form=skfem.BilinearForm(form), group="body", to="geometric_stiffness")
    own, plain = block("tetra", terms={"again": term}), block("tetra")
    d = np.random.default_rng(0).standard_normal(own.n_dof)
    d[own.interfaces[0].dofs] = 0.0
    load = own.K @ d
    Phi = np.random.default_rng(1).standard_normal((own.n_dof, 3))
    Phi[own.interfaces[0].dofs] = 0.0
    added = Phi.T @ (own.geometric_stiffness(d, load) - plain.geometric_stiffness(d, load)) @ Phi
    elements = plain.geometric_stiffness
    bare = Phi.T @ (elements(d, load) - elements.links(d, load)) @ Phi
    np.testing.assert_allclose(added, bare, rtol=1e-9, atol=1e-9 * np.abs(bare).max())
    both = (model.geometric_stiffness.project(d[:, None], load[:, None], Phi)[0] for model in (own, plain))
    np.testing.assert_allclose(np.subtract(*both), bare, rtol=1e-9, atol=1e-9 * np.abs(bare).max())
    recover = {"feet": mp.fe.Recover(kind="mpc_force")}  # the links are those of the plain model
    feet = [mp.fe.model_recovery(model, block_mesh("tetra"), recover).quantities["feet"] for model in (own, plain)]
    assert feet[0].places == feet[1].places


@pytest.mark.parametrize("curved", [False, True])
def test_fluid_moves_along_the_normal(curved):
    """All of its weight, but no inertia of a motion along the plate; the body's integrals are consistent."""
    fluid = mp.AddedMass(group="skin", fluid_density=1000.0, depth=0.2)
    wet, dry = (shell(curved=curved, material=STEEL, terms=terms) for terms in ({"water": fluid}, {}))
    area = dry.rigid.m / (STEEL.rho * 0.01)
    assert wet.rigid.m - dry.rigid.m == pytest.approx(200 * area, rel=1e-12)
    if not curved:  # the last node alone
        tip = np.zeros(wet.n_dof)
        tip[wet.dof[-1, :3]] = R[:, 0]
        assert tip @ (wet.M - dry.M) @ tip == pytest.approx(0, abs=1e-12 * abs(wet.M).max())
        tip[wet.dof[-1, :3]] = R[:, 2]
        assert tip @ (wet.M - dry.M) @ tip > 0.1 * 200 * area / 9 / 9
    reduction = mp.craig_bampton(wet, modes=6)
    checks = mp.body.check_projection(wet, reduction, mp.flexible_body(wet, reduction, name="wet"))
    assert all(check.within for check in checks), checks


def test_fluid_slows_bending():
    """Of a plate held at its edges: ``w^2 (rho t + rho_f d) = const`` in bending."""
    added = 80.0  # as much as the plate has
    points, cells = surface(6, 6, "quad")
    edges = {
        f"edge{k}": mp.Support(plane=((x, x, 0.0), e))
        for k, (x, e) in enumerate((x, e) for x in (0.0, 1.0) for e in ((1.0, 0, 0), (0, 1.0, 0)))
    }
    mesh = mp.fe.Mesh(points=points, cells={"quad": cells}, groups={"skin": {"quad": np.arange(len(cells))}})
    root = {"root": mp.Interface(kind="support", position=(0.0, 0, 0))}
    section = {"skin": mp.Shell(material=STEEL, thickness=0.01)}
    fluid = {"water": mp.AddedMass(group="skin", fluid_density=1000.0, depth=added / 1000)}
    dry, wet = (
        mp.craig_bampton(mp.assemble(mesh, section, root, supports=edges, terms=terms), modes=1).frequency
        for terms in ({}, fluid)
    )
    assert wet[0] / dry[0] == pytest.approx(np.sqrt(0.5), rel=1e-3)  # rotary inertia


def test_loads_and_facets():
    """A traction of 5 N/m^2 on one end of a block, as a load that truncation vectors may name."""
    form = skfem.LinearForm(lambda v, w: 5.0 * v[2])
    term = mp.fe.Term(form=form, group="body", to="load", on="facets", where=lambda x: x[0] > 0.99)
    model = block(terms={"wind": term})
    total = model.rigid_body().T @ model.loads["wind"]
    np.testing.assert_allclose(total[:3], [0, 0, 5 * 0.2], atol=1e-12)
    reduction = mp.craig_bampton(model, modes=2, truncation=("wind",))
    clamped = clamp(model)
    exact = clamped.factor.solve((model.C.T @ model.loads["wind"])[clamped.i])
    basis = reduction.basis[model.free][clamped.i]
    q = (basis.T @ (model.C.T @ model.loads["wind"])[clamped.i]) / (2 * np.pi * reduction.frequency) ** 2
    np.testing.assert_allclose(basis @ q, exact, rtol=0, atol=1e-9 * np.abs(exact).max())


def bilinear(form):
    return skfem.BilinearForm(form)


@pytest.mark.parametrize(
    ("term", "message"),
    [
        (
            {"form": bilinear(lambda u, v, w: u[0] * v[1]), "to": "stiffness"},
            "term 'mine': its matrix is not symmetric",
        ),
        ({"form": bilinear(lambda u, t, v, s, w: u[0] * v[0]), "to": "stiffness"}, r"have \(u, v, w\), on beams"),
        ({"form": bilinear(lambda u, v, w: 0 * u[0] * v[0]), "to": "stiffness"}, "its matrix is zero"),
        ({"form": bilinear(lambda u, v, w: u[0] * v[0] + 2 * u[1] * v[1]), "to": "mass"}, "differs between directions"),
        ({"form": bilinear(lambda u, v, w: -dot(u, v)), "to": "mass"}, "density is zero or negative"),
        (
            {"form": bilinear(lambda u, v, w: dot(u, v) + ddot(grad(u), grad(v))), "to": "mass"},
            "gradients or rotations",
        ),
        ({"form": bilinear(lambda u, v, w: dot(u, v)), "to": "geometric_stiffness"}, "must be linear in w.d"),
        ({"form": bilinear(lambda u, v, w: dot(u, v)), "to": "mass", "on": "lines"}, "has tetra10 cells, but no lines"),
        ({"form": bilinear(lambda u, v, w: dot(u, v)), "to": "mass", "group": "bdy"}, "did you mean 'body'"),
        ({"form": skfem.LinearForm(lambda v, w: 0 * v[0]), "to": "load"}, "its load is zero"),
    ],
)
def test_refused(term, message):
    with pytest.raises(InputError, match=message):
        block(terms={"mine": mp.fe.Term(**{"group": "body", **term})})


@pytest.mark.parametrize(
    ("term", "message"),
    [
        ({"form": bilinear(lambda u, v, w: 0), "to": "load"}, "must be of type LinearForm, not BilinearForm"),
        ({"form": bilinear(lambda u, v, w: 0), "to": "damping"}, "term: to"),
        ({"form": bilinear(lambda u, v, w: 0), "to": "mass", "where": lambda x: x}, "'where' has no effect"),
    ],
)
def test_refused_at_once(term, message):
    with pytest.raises(InputError, match=message):
        mp.fe.Term(**{"group": "body", **term})
