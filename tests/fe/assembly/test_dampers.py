"""Viscous dampers of a mesh: the body has the complex eigenvalues of the full model."""

import numpy as np
import pytest
from scipy.linalg import block_diag

import modalprep as mp
from modalprep.body import reroot
from modalprep.body.checks import check_body
from modalprep.formats.modalfile import read_body, write_body
from modalprep.multibody.analysis.spin import spin_modes
from modalprep.response.modal import modal_equations

STEEL = mp.Material(E=2.1e11, nu=0.3, rho=7800.0)
SECTION = mp.Beam(material=STEEL, A=1e-3, Iy=2e-7, Iz=1e-7, J=3e-7)
FRAME = np.array([[0, 0, 0], [1, 0, 0], [2, 0.2, 0], [2, 1, 0], [1, 1, 0.3], [0.0, 1, 0.3]])
DAMPERS = {  # from node to node
    "across": (1, 4, mp.Spring(translation_damping=(40.0, 10.0, 20.0), rotation_damping=(3.0, 2.0, 1.0))),
    "mount": (2, 5, mp.Spring(translation=(2e4, 0, 0), translation_damping=(25.0, 0, 0))),
}


def frame(rho=7800.0, **more):
    """A frame of five beams with a damper across, and a spring with a damper."""
    ends = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), *((a, b) for a, b, _ in DAMPERS.values())]
    groups = {"beams": {"line": np.arange(5)}} | {name: {"line": np.array([5 + k])} for k, name in enumerate(DAMPERS)}
    groups |= {f"at{k}": {"vertex": np.array([k])} for k in range(6)}
    mesh = mp.fe.Mesh(points=FRAME, cells={"line": np.array(ends), "vertex": np.arange(6)[:, None]}, groups=groups)
    beam = mp.Beam(material=mp.Material(E=2.1e11, nu=0.3, rho=rho), A=1e-3, Iy=2e-7, Iz=1e-7, J=3e-7)
    sections = {"beams": beam, **{name: own for name, (_, _, own) in DAMPERS.items()}, **more}
    return mesh, sections


def poles(K, C, M):
    """Complex eigenvalues of ``M q'' + C q' + K q = 0``, sorted by imaginary and real part."""
    n = len(K)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    found = np.linalg.eigvals(A)
    return found[np.lexsort((found.real.round(3), found.imag.round(3)))]


def held(model):
    """Stiffness, damping and mass of the free DOFs but for those of the root."""
    root = np.searchsorted(model.free, model.interfaces[0].dofs)
    keep = np.setdiff1d(np.arange(len(model.free)), root)
    return [(model.C.T @ A @ model.C).toarray()[np.ix_(keep, keep)] for A in (model.K, model.damping, model.M)]


def of_body(body):
    return poles(np.diag(body.K), body.damping_matrix, np.eye(body.n))


def assert_alike(ours, theirs, rtol):
    assert len(ours) == len(theirs)
    np.testing.assert_allclose(ours, theirs, rtol=0, atol=rtol * np.abs(theirs).max())
    assert np.ptp(ours.real) > 1e-3 * np.abs(ours).max() or ours.real.min() < -1  # it is damped


def test_a_damper_loses_the_power_of_its_relative_motion_and_none_in_rigid_motion():
    """``v^T C v`` is ``c (e1 . (v_b - v_a))^2`` of a damper along the line between its ends."""
    mesh, sections = frame()
    model = mp.assemble(
        mesh, {**sections, "across": mp.Spring(translation_damping=(7.0, 0, 0))}, {"root": mp.Interface(node=1)}
    )
    v = np.random.default_rng(1).normal(size=model.n_dof)
    power = 0.0
    for a, b, c in ((1, 4, 7.0), (2, 5, 25.0)):
        along = (FRAME[b] - FRAME[a]) / np.linalg.norm(FRAME[b] - FRAME[a])
        power += c * (along @ (v[model.dof[b, :3]] - v[model.dof[a, :3]])) ** 2
    assert v @ model.damping @ v == pytest.approx(power, rel=1e-12)
    assert abs(model.damping @ model.rigid_body()).max() < 1e-12 * abs(model.damping).max()


def test_craig_bampton_with_all_modes_has_the_poles_of_the_full_model():
    mesh, sections = frame()
    ends = {
        "root": mp.Interface(group="at0", kind="node"),
        "tip": mp.Interface(group="at3", kind="node", boundary="fixed"),
    }
    model = mp.assemble(mesh, sections, ends)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=100, truncation=()), name="frame")
    assert_alike(of_body(body), poles(*held(model)), 1e-9)  # of the largest; round-off of a non-symmetric eigenproblem
    f, ratio = modal_equations(body, ["base.x"]).resonances
    full = poles(*held(model))
    full = full[full.imag > 0]
    full = full[np.argsort(np.abs(full))][: len(f)]
    np.testing.assert_allclose(f[:10], np.abs(full[:10]) / (2 * np.pi), rtol=1e-7)
    np.testing.assert_allclose(ratio[:10], -full[:10].real / np.abs(full[:10]), rtol=1e-5)
    assert any("viscous dampers couple the modes" in note for note in body.notes)
    assert all(check.passed for check in check_body(body))
    assert spin_modes(body, np.zeros(3)).frequency[0] == pytest.approx(full[0].imag / (2 * np.pi), rel=1e-7)


def test_a_system_has_the_poles_of_the_full_model():
    """The root on a hinge with a spring and a damper, which stand in one more row of the matrices of the model."""
    mesh, sections = frame()
    model = mp.assemble(mesh, sections, {"root": mp.Interface(group="at0", kind="node")})
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=100, truncation=()), name="frame")
    root = np.searchsorted(model.free, model.interfaces[0].dofs)
    keep = np.setdiff1d(np.arange(len(model.free)), root[[0, 1, 2, 3, 4]])
    turn = int(np.searchsorted(keep, root[5]))
    K, C, M = ((model.C.T @ A @ model.C).toarray()[np.ix_(keep, keep)] for A in (model.K, model.damping, model.M))
    K[turn, turn] += 3e4
    C[turn, turn] += 20.0
    mount = mp.multibody.HingeElement(stiffness=3e4, damping=20.0)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="frame", axis=(0, 0, 1), elements=mount)
    system = mp.System(bodies={"frame": body}, joints=(hinge,))
    expected = poles(K, C, M)
    expected = expected[expected.imag > 0]
    expected = expected[np.argsort(np.abs(expected))]
    found = mp.system_modes(system).eigenvalue
    found = found[found.imag > 0]
    found = found[np.argsort(np.abs(found))]
    assert len(found) == len(expected)
    np.testing.assert_allclose(found[:12], expected[:12], rtol=1e-7)  # round-off of the largest, 1e4 times as large
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    diagonal = mp.system_modes(system.with_(bodies={"frame": body.with_(D=body.D)})).eigenvalue
    assert np.abs(diagonal[0].real - found[0].real) > 0.05 * abs(found[0].real)


def test_guyan_is_exact_where_mass_and_dampers_are_at_its_interfaces():
    """The beams are massless; the masses and the ends of the dampers are at the interfaces."""
    mass = mp.PointMass(mass=5.0, inertia=(0.1, 0.2, 0.3, 0.0, 0.0, 0.0))
    where = {f"at{k}": mass for k in (1, 2, 4, 5)}
    mesh, sections = frame(0.0, **where)
    ends = {"root": mp.Interface(group="at0", kind="node")}
    ends |= {name: mp.Interface(group=name, kind="node", boundary="fixed") for name in where}
    model = mp.assemble(mesh, sections, ends)
    body = mp.flexible_body(model, mp.guyan(model), name="frame")
    K, C, M = held(model)
    moving = np.flatnonzero(np.diag(M) > 1e-6 * np.diag(M).max())  # beams without mass get a slight one
    others = np.setdiff1d(np.arange(len(M)), moving)
    K = K[np.ix_(moving, moving)] - K[np.ix_(moving, others)] @ np.linalg.solve(
        K[np.ix_(others, others)], K[np.ix_(others, moving)]
    )
    C, M = (A[np.ix_(moving, moving)] for A in (C, M))
    assert len(moving) == 24
    assert_alike(of_body(body), poles(K, C, M), 1e-6)  # the slight mass


def test_damping_of_the_modes_and_of_dampers_add_up(tmp_path):
    mesh, sections = frame()
    model = mp.assemble(mesh, sections, {"root": mp.Interface(group="at0", kind="node")})
    reduction = mp.craig_bampton(model, modes=8, truncation=())
    body = mp.flexible_body(model, reduction, name="frame", damping=0.01)
    dampers = reduction.basis.T @ model.damping @ reduction.basis
    np.testing.assert_allclose(
        body.damping_matrix, dampers + np.diag(0.02 * np.sqrt(body.K)), atol=1e-10 * dampers.max()
    )
    np.testing.assert_array_equal(body.D, np.diag(body.damping_matrix))
    again = read_body(write_body(body, tmp_path / "frame.h5"))
    np.testing.assert_array_equal(again.coupled_damping, body.coupled_damping)
    without = mp.flexible_body(
        mp.assemble(
            mesh,
            sections | {"across": mp.Spring(translation=(1.0, 0, 0)), "mount": mp.Spring(translation=(2e4, 0, 0))},
            {"root": mp.Interface(group="at0", kind="node")},
        ),
        reduction,
        name="x",
    )
    assert without.coupled_damping is None


def free_poles(body):
    K, C = (block_diag(np.zeros((6, 6)), A) for A in (np.diag(body.K), body.damping_matrix))
    return poles(K, C, mp.body.mass_matrix(body, np.zeros(body.n)))


def test_a_body_in_another_frame_keeps_its_poles():
    """Free at all interfaces, the poles do not depend on the interface that the frame sits on."""
    mesh, sections = frame()
    ends = {f"i{k}": mp.Interface(group=f"at{k}", kind="node") for k in (0, 3)}
    model = mp.assemble(mesh, sections, ends)
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=6), name="frame")
    moved = reroot(body, "i3")
    free = [free_poles(own) for own in (body, moved)]
    some = [own[np.abs(own.imag) > 10] for own in free]
    np.testing.assert_allclose(some[0], some[1], rtol=0, atol=1e-6 * np.abs(some[0]).max())
