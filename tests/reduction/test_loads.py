"""Loads of the user: resultants, pressure on curved faces, and static responses made exact by truncation vectors."""

import numpy as np
import pytest
from compare import assert_close

import modalprep as mp
from modalprep.errors import InputError
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.reduction.loads import Load, nodal_load


@pytest.fixture(scope="module")
def bracket(project):
    """The solid bracket held at one bolt, its other hole free, and its mesh."""
    mesh = mp.read_mesh(project / "meshes" / "bracket.msh", "mm")
    section = mp.Solid(material=mp.Material(E=70e9, nu=0.33, rho=2700.0))
    return mp.assemble(mesh, {"body": section}, {"bolt_a": mp.Interface(group="bolt_a")}), mesh


def plate(kind, points, nodes):
    """A group of faces alone, on a shell, as a mesh and its model."""
    mesh = mp.fe.Mesh(points=points, cells={kind: nodes}, groups={"face": {kind: np.arange(len(nodes))}})
    shell = mp.Shell(material=mp.Material(E=7e10, nu=0.3, rho=2700.0), thickness=1e-3)
    return mp.assemble(mesh, {"face": shell}, {"root": mp.Interface(node=1, kind="node")}), mesh


def static_error(model, reduction, F):
    """Strain energy of the error of the static response over that of the answer, by a direct solution."""
    rows = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    C = model.C[:, rows]
    exact = C @ mp.linalg.factorise((C.T @ model.K @ C).tocsr()).solve(C.T @ F)
    found = reduction.basis @ ((reduction.basis.T @ F) / (2 * np.pi * reduction.frequency) ** 2)
    error = found - exact
    return (error @ (model.K @ error)) / (exact @ (model.K @ exact))


def test_truncation_makes_a_load_exact():
    """A force and a moment in the middle of a beam; the error of 4 modes alone is of the order of 1e-2."""
    model, mesh = cantilever_model(20), beam_mesh(20)
    F = nodal_load(model, mesh, "jet", Load(near=(5.0, 0, 0), force=(100.0, 300.0, -50.0), moment=(20.0, 0, 7.0)))
    for scale in (1.0, 1e-6, 1e9):  # the size of a load does not matter
        with_it = mp.craig_bampton(model, modes=4, truncation=("interfaces", "jet"), loads={"jet": scale * F})
        assert static_error(model, with_it, F) < 1e-9
    without = mp.craig_bampton(model, modes=4, truncation=("interfaces", "inertia"), loads={"jet": F})
    assert static_error(model, without, F) > 1e-5


@pytest.mark.parametrize("size", [1e-3, 1.0, 1e4])
def test_truncation_is_exact_at_every_scale(size):
    """Beams from 1 cm to 100 km: forces and moments on the tip weigh alike, so that none is taken for round-off."""
    section = spinup_section(A=4e-4 * size**2, Iy=8e-7 * size**4, Iz=2e-7 * size**4, J=5e-7 * size**4)
    ends = {"root": mp.Interface(group="root", kind="node"),
            "tip": mp.Interface(group="tip", kind="node", boundary="free")}  # fmt: skip
    model = mp.assemble(beam_mesh(8, 10.0 * size), {"beam": section}, ends)
    reduction = mp.craig_bampton(model, modes=3, truncation=("interfaces",))
    for dof in model.interfaces[1].dofs:
        F = np.zeros(model.n_dof)
        F[dof] = 1.0
        assert static_error(model, reduction, F) < 1e-9


def test_truncation_makes_a_load_on_a_solid_exact(bracket):
    model, mesh = bracket
    F = nodal_load(model, mesh, "bolt", Load(group="bolt_b", force=(0, 40.0, 10.0), moment=(0.3, 0, 0.1)))
    reduction = mp.craig_bampton(model, modes=5, truncation=("bolt",), loads={"bolt": F})
    assert static_error(model, reduction, F) < 1e-9


def test_resultant_is_force_and_moment(bracket):
    model, mesh = bracket
    force, moment, at = np.array([3.0, -2.0, 5.0]), np.array([0.1, 0.2, -0.3]), np.array([0.01, 0.02, 0.03])
    load = Load(group="bolt_b", force=tuple(force), moment=tuple(moment), position=tuple(at))
    found = model.rigid_body().T @ nodal_load(model, mesh, "bolt", load)
    np.testing.assert_allclose(found[:3], force, rtol=1e-9)
    np.testing.assert_allclose(found[3:], moment + np.cross(at - model.origin, force), rtol=1e-9)


def test_force_on_a_cylinder_acts_on_its_axis(bracket):
    """A pin in the hole pushes on its axis wherever the mesh has more nodes."""
    model, mesh = bracket
    pin = Load(cylinder=((0, 0, 0), (0, 0, 1), 0.0045), force=(3.0, -2.0, 0.0))
    found = model.rigid_body().T @ nodal_load(model, mesh, "pin", pin)
    assert_close(found[:3], pin.force, 1e-12)
    at = np.concatenate([model.origin[:2], [0]])  # the frame is in the middle of the other description of the hole
    assert_close(found[3:] + np.cross(at, pin.force), np.zeros(3), 1e-5, scale=3 * 0.0045)


def test_a_force_beside_its_only_node_turns_it():
    """Its moment about the node is ``(position - node) x force``; without rotations it is refused."""
    model, mesh = cantilever_model(), beam_mesh(10)
    at = Load(
        group="tip", force=(0, 3.0, 0), position=tuple(mesh.points[mesh.group("tip")["vertex"][0, 0]] + [0.2, 0, 0])
    )
    F = nodal_load(model, mesh, "tip", at)
    assert_close(F[-6:], [0, 3.0, 0, 0, 0, 0.6], 1e-12)
    with pytest.raises(InputError, match="'position' has no effect without 'force'"):
        Load(group="tip", moment=(0, 0, 1.0), position=(1.0, 0, 0))


def test_force_is_shared_evenly():
    model = cantilever_model(10)
    F = nodal_load(model, beam_mesh(10), "row", Load(box=((2.0, 0, 0), (5.0, 0, 0)), force=(0, 8.0, 0)))
    np.testing.assert_allclose(F[model.dof[2:6, 1]], 2.0)
    assert np.count_nonzero(np.abs(F) > 1e-12) == 4


def skewed(family, count):
    """One flat face, a sheared rectangle of area 2 or half of it, in the plane with normal (0, -3, 4) / 5."""
    corners = np.array([(0, 0), (1, 0.3), (1, 2.3), (0, 2)] if family == "quad" else [(0, 0), (1, 0.3), (0, 2.0)])
    mids = (corners + np.roll(corners, -1, axis=0)) / 2
    flat = np.vstack([corners, mids, [corners.mean(axis=0)]])[:count]
    return flat @ np.array([[1.0, 0, 0], [0, 0.8, 0.6]])


@pytest.mark.parametrize(
    ("kind", "count", "share"),
    [
        ("triangle", 3, 1 / 3),
        ("triangle6", 6, 0.0),
        ("quad", 4, 1 / 4),
        ("quad8", 8, -1 / 12),
        ("quad9", 9, 1 / 36),
    ],
)
def test_pressure_on_a_flat_face(kind, count, share):
    """Force = p A n through the centroid; corners take their known shares of ``int N dA``."""
    family = kind.rstrip("689")
    points, normal = skewed(family, count), np.array([0, -0.6, 0.8])
    area, corners = (2.0, 4) if family == "quad" else (1.0, 3)
    model, mesh = plate(kind, points, np.arange(count)[None])
    F = nodal_load(model, mesh, "wind", Load(group="face", pressure=1.0))
    total = model.rigid_body().T @ F
    np.testing.assert_allclose(total[:3], area * normal, atol=1e-14)
    through = np.cross(points[:corners].mean(axis=0) - model.origin, area * normal)
    np.testing.assert_allclose(total[3:], through, atol=1e-14)
    np.testing.assert_allclose(F[model.dof[:corners, :3]] @ normal, share * area, atol=1e-14)


def test_pressure_in_a_model():
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.0]])
    model, mesh = plate("quad", points, np.array([[0, 1, 2, 3]]))
    F = nodal_load(model, mesh, "wind", Load(group="face", pressure=3.0))
    np.testing.assert_allclose(F[model.dof[:, 2]], 1.5)  # 3 Pa on 2 m^2, a quarter each
    assert np.abs(F[model.dof[:, [0, 1, 5]]]).max() < 1e-14  # and moments, as at the ends of a clamped strip


def test_pressure_on_a_closed_surface_has_no_resultant(bracket):
    """All boundary faces of curved tetrahedra, from outside: ``int n dA = 0`` and ``int x x n dA = 0``."""
    model, mesh = bracket
    tetra = mesh.cells["tetra10"]
    faces = np.concatenate([tetra[:, f] for f in ([0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8],
                                                  [2, 0, 3, 6, 7, 9])])  # fmt: skip
    _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
    skin = faces[first[count == 1]]
    own = {"triangle6": np.arange(len(skin))}
    closed = mp.fe.Mesh(points=mesh.points, cells={"triangle6": skin}, groups={"skin": own})
    F = nodal_load(model, closed, "gas", Load(group="skin", pressure=1.0))
    total = model.rigid_body().T @ F
    size = np.abs(F).sum()
    assert np.abs(total[:3]).max() < 1e-12 * size
    assert np.abs(total[3:]).max() < 1e-12 * size * np.ptp(mesh.points)


@pytest.mark.parametrize(
    ("load", "words"),
    [
        (dict(group="tip"), "zero"),
        (dict(group="beam", pressure=1.0), "triangles or quads"),
        (dict(near=(5.0, 0, 0), pressure=1.0), "triangles or quads"),
        (dict(near=(5.0, 0, 0), line_load=(1.0, 0, 0)), "need a mesh group of lines"),
        (
            dict(group="tip", line_load=(1.0, 0, 0)),
            "load 'thrust': line_load: group 'tip' has vertex cells, but no lines",
        ),
        (dict(group="wing", force=(1.0, 0, 0)), "no group 'wing'"),
    ],
)
def test_bad_loads_are_refused(load, words):
    with pytest.raises(InputError, match=words):
        nodal_load(cantilever_model(10), beam_mesh(10), "thrust", Load(**load))


def test_a_moment_about_the_line_of_its_nodes_turns_them():
    """Their translations cannot: as many equal torques."""
    model = cantilever_model(10)
    F = nodal_load(model, beam_mesh(10), "screw", Load(box=((2.0, 0, 0), (5.0, 0, 0)), moment=(3.0, 0, 0)))
    torque = F[model.dof[:, 3]]
    np.testing.assert_allclose(torque[torque != 0], np.full(4, 3.0 / 4), rtol=1e-12)
    assert np.abs(F).sum() == pytest.approx(3.0, rel=1e-12)


def test_a_node_of_a_solid_takes_no_moment(bracket):
    with pytest.raises(InputError, match="no rotations for a moment"):
        nodal_load(*bracket, "screw", Load(near=(0, 0, 0), moment=(1.0, 0, 0)))


@pytest.mark.parametrize(
    ("loads", "truncation", "words"),
    [
        ({"inertia": np.ones(66)}, (), "built-in"),
        ({"jet": np.ones(5)}, (), "66 finite numbers"),
        ({"jet": np.full(66, np.nan)}, (), "66 finite numbers"),
        ({"jet": np.eye(66)[0]}, (), "fixed interfaces only"),
        ({"jet": np.ones(66)}, ("jets",), "did you mean 'jet'"),
    ],
)
def test_bad_load_vectors_are_refused(loads, truncation, words):
    with pytest.raises(InputError, match=words):
        mp.craig_bampton(cantilever_model(10), modes=2, loads=loads, truncation=truncation)


def test_loads_count_for_the_static_share():
    """The inertia load of mode 6 is answered by mode 6 alone."""
    model = cantilever_model(20)
    sixth = mp.craig_bampton(model, modes=6, truncation=()).basis[:, 5]
    loads = {"own": model.M @ sixth}
    plain, loaded = (mp.craig_bampton(model, modes=8, keep="static > 50%", loads=given) for given in ({}, loads))
    assert np.flatnonzero(plain.table.kept[:8]).tolist() == [0, 1]
    assert np.flatnonzero(loaded.table.kept[:8]).tolist() == [0, 1, 5]
    assert loaded.table.reason[5] == "static share 100% > 50%"
