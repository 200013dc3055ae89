"""Stress over a mesh and resultants of shells: the finite-element solution, plates by hand, sums over elements."""

import numpy as np
import pytest
from body.solids import horn_mesh, horn_model
from structured import random_surface, shell_model

import modalprep as mp
from modalprep.body.recovery import at_rest
from modalprep.examples import block_model
from modalprep.fe.recovery.fields import Fields, chosen
from modalprep.fe.recovery.nodes import residual
from modalprep.fe.recovery.surfaces import face_stress, node_stress, resultants

Recover = mp.fe.Recover
STEEL = mp.Material(E=2e11, nu=0.0, rho=7800.0)
LENGTH, WIDTH, T = 1.0, 0.2, 0.01


def strip(kind="quad", nx=8, ny=2, turn=0.0):
    """A cantilever strip of shells along x, turned about z, clamped at x = 0, with an interface on its end."""
    x, y = np.meshgrid(np.linspace(0, LENGTH, nx + 1), np.linspace(-WIDTH / 2, WIDTH / 2, ny + 1), indexing="ij")
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    corner = (np.arange(nx)[:, None] * (ny + 1) + np.arange(ny)).ravel()
    quads = np.stack([corner, corner + ny + 1, corner + ny + 2, corner + 1], axis=1)
    cells = quads if kind == "quad" else np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    c, s = np.cos(turn), np.sin(turn)
    points = points @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    ends = np.arange(ny + 1)
    vertices = np.concatenate([ends, nx * (ny + 1) + ends])[:, None]
    return mp.fe.Mesh(
        points=points,
        cells={kind: cells, "vertex": vertices},
        groups={
            "strip": {kind: np.arange(len(cells))},
            "clamp": {"vertex": ends},
            "end": {"vertex": ny + 1 + ends},
        },
    )


def strip_body(mesh, **wanted):
    sections = {"strip": mp.Shell(material=STEEL, thickness=T)}
    ends = {"root": mp.Interface(group="clamp"), "end": mp.Interface(group="end")}
    model = mp.assemble(mesh, sections, ends)
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    return mp.flexible_body(model, mp.guyan(model), name="strip", recovery=recovery)


def static(body, load):
    """Static coordinates of a load on the last interface."""
    motion = np.concatenate([body.phi[-1], body.psi[-1]])
    loads = np.zeros((1, len(body.phi), 6))
    loads[0, -1] = load
    return at_rest((np.asarray(load) @ motion / body.K)[None], len(body.phi), loads)


# --- the finite-element solution --------------------------------------------------------------------------------------


@pytest.mark.parametrize("method", ["displacement", "acceleration"])
def test_whole_mesh_has_the_stress_of_the_finite_element_solution(method):
    """All modes kept: the modal sum is the recovery of K^-1 f, at every node and component."""
    model, mesh = horn_model(), horn_mesh()
    wanted = {"all": Recover(kind="stress", method=method)}
    recovery = mp.fe.model_recovery(model, mesh, wanted)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=10_000, truncation=()), name="horn", recovery=recovery)
    k = body.interface_name.index("right")
    loads = np.zeros((1, len(body.phi), 6))
    loads[0, k, :3] = force = np.array([30.0, -50.0, 20.0])
    load = mp.reduction.interface_load(model, "right", force=tuple(force))
    free = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    K = (model.C.T @ model.K @ model.C).toarray()
    x = np.zeros(len(K))
    x[free] = np.linalg.solve(K[np.ix_(free, free)], (model.C.T @ load)[free])
    full = recovery.quantities["all"].values(Fields.static((model.C @ x)[:, None]))[..., 0]
    found = body.recovery["all"].values(at_rest((force @ body.phi[k] / body.K)[None], len(body.phi), loads))[0]
    assert len(found) == len(model.points)
    assert found == pytest.approx(full, abs=1e-8 * np.abs(full).max())
    assert np.array_equal(body.points[body.recovery["all"].node], body.recovery["all"].position)


def test_stress_at_a_node_is_that_of_the_stress_point():
    model, mesh = horn_model(), horn_mesh()
    quantity = mp.fe.model_recovery(model, mesh, {"all": Recover(kind="stress")}).quantities["all"]
    points = mp.fe.stress_recovery(model, mesh, {"all": mp.fe.StressPoint(group="body")})
    u = np.random.default_rng(0).standard_normal((model.n_dof, 2))
    values, at = quantity.values(Fields.static(u)), points(u)
    for place, own in zip(quantity.places, values, strict=True):
        assert own == pytest.approx(at[f"all.{place}"].modes, rel=1e-10, abs=1e-10 * np.abs(values).max())


# --- plates by hand ---------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["quad", "triangle"])
@pytest.mark.parametrize("turn", [0.0, 0.4])
def test_resultants_of_a_strip(kind, turn):
    """Nx = F / b, Mx = M / b under forces and moments on the end, along the strip whichever way it points."""
    axis = (np.cos(turn), np.sin(turn), 0.0)
    body = strip_body(
        strip(kind, turn=turn),
        plate=Recover(kind="resultant", axis=axis),
        skin=Recover(kind="stress", axis=axis, allowable=1e7),
    )
    F, M = 600.0, 5.0
    along, across = np.array(axis), np.array([-axis[1], axis[0], 0.0])
    motion = static(body, np.concatenate([F * along, M * across]))
    found = body.recovery["plate"].values(motion)[0]
    # a moment about y across the strip stretches the side of the positive normal; the normal follows the nodes' order
    expected = [F / WIDTH, 0, 0, M / WIDTH, 0, 0, 0, 0]
    assert found == pytest.approx(np.tile(expected, (len(found), 1)), abs=1e-7 * F / WIDTH)
    top, bottom = (F / WIDTH / T + side * 6 * M / WIDTH / T**2 for side in (1, -1))
    stress = body.recovery["skin"].full_values(motion)[0].reshape(-1, 2, 4)
    assert stress[:, 0] == pytest.approx(np.tile([top, 0, 0, top], (len(stress), 1)), abs=1e-7 * abs(top))
    assert stress[:, 1, :3] == pytest.approx(np.tile([bottom, 0, 0], (len(stress), 1)), abs=1e-7 * abs(top))


def test_shear_and_moment_of_a_strip_under_a_tip_load():
    """Qx = F / b, Mx = -F (L - x) / b at the middle of each element; poisson's ratio is zero."""
    body = strip_body(strip(ny=1), plate=Recover(kind="resultant"))
    F, block = 10.0, body.recovery["plate"]
    found, x = block.values(static(body, [0, 0, F, 0, 0, 0]))[0], block.position[:, 0]
    assert found[:, 3] == pytest.approx(-F * (LENGTH - x) / WIDTH, rel=1e-6)  # of the condensed end
    assert found[:, 6] == pytest.approx(F / WIDTH, rel=1e-6)


def test_other_axes_see_the_same_state():
    """Resultants turned by 30 degrees: the invariants of membrane forces and moments, the length of the shear."""
    mesh = strip()
    turned = (np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0)
    body = strip_body(mesh, a=Recover(kind="resultant"), b=Recover(kind="resultant", axis=turned))
    motion = static(body, [30.0, 20, -7, 1, 2, 3])
    a, b = (body.recovery[name].values(motion)[0] for name in "ab")
    for first in (0, 3):
        x, y, xy = a[:, first : first + 3].T
        c, s = np.cos(np.pi / 6), np.sin(np.pi / 6)
        assert b[:, first] == pytest.approx(c * c * x + s * s * y + 2 * c * s * xy, rel=1e-9, abs=1e-9)
        assert b[:, first + 2] == pytest.approx((y - x) * c * s + xy * (c * c - s * s), rel=1e-9, abs=1e-9)
    assert np.linalg.norm(b[:, 6:], axis=1) == pytest.approx(np.linalg.norm(a[:, 6:], axis=1), rel=1e-9)


def test_a_box_takes_the_elements_within():
    box = ((0.49, -1.0, -1.0), (2.0, 1.0, 1.0))
    body = strip_body(strip(), half=Recover(kind="resultant", box=box))
    assert len(body.recovery["half"].places) == 8
    assert body.recovery["half"].position[:, 0].min() > 0.5


# --- sums over elements -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["block", "horn", "strip lumped", "triangle6", "quad9"])
def test_forces_of_all_elements_are_what_the_model_needs(case):
    """K u + M a + g A + h W element by element adds up to the model's, whatever form the mass has."""
    if case == "block":
        model = block_model()
        mesh = mp.fe.Mesh(points=model.points + model.origin, cells=model.cells, groups={})
    elif case == "horn":
        model, mesh = horn_model(kind="tetra10"), horn_mesh(kind="tetra10")
    elif case in ("triangle6", "quad9"):
        points, cells = random_surface(case)
        model = shell_model(points, cells, mp.Shell(material=STEEL, thickness=T, offset=0.02))
        mesh = mp.fe.Mesh(points=points, cells={case: cells}, groups={})
    else:
        mesh = strip()
        sections = {"strip": mp.Shell(material=STEEL, thickness=T, nsm=3.0)}
        model = mp.assemble(mesh, sections, {"root": mp.Interface(group="clamp")}, mass="lumped")
    random = np.random.default_rng(0)
    fields = Fields(*(random.standard_normal((n, 3)) for n in (model.n_dof, model.n_dof, 12)))
    total = np.zeros_like(fields.u)
    for piece in chosen(model, mesh, None):
        np.add.at(total, piece.dofs, piece.forces(fields))
    expected = residual(model, fields)
    assert total == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())  # round-off
    inert = fields._replace(u=0 * fields.u)
    total[:] = 0.0
    for piece in chosen(model, mesh, None):
        np.add.at(total, piece.dofs, piece.forces(inert))
    expected = residual(model, inert)
    assert total == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


def test_shells_and_solids_together_are_refused():
    model = block_model()
    mesh = mp.fe.Mesh(points=model.points + model.origin, cells=model.cells, groups={})
    with pytest.raises(mp.InputError, match="give each a table of its own"):
        mp.fe.model_recovery(model, mesh, {"all": Recover(kind="stress")})
    pieces = chosen(model, mesh, None)
    assert len(face_stress(pieces, None).places) == 2 * 3
    assert len(node_stress(model, mesh, pieces).places) == 8
    with pytest.raises(mp.InputError, match="zero or normal to some of the shells"):
        resultants(pieces, (0.0, 0.0, 1.0)).values(Fields.static(np.zeros((model.n_dof, 1))))
