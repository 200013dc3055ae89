"""Multi-point constraints: equivalent links and supports, statics by hand, loops, and what grounds the model."""

import numpy as np
import pytest
from structured import random_rotation

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.fe import Equation, Link, Mesh
from modalprep.fe.links.constraints import PlacedEquation, constrain
from modalprep.vectors import skew

NODE = {"root": mp.Interface(group="root", kind="node")}


def frequencies(model, n=6):
    return mp.craig_bampton(model, modes=n).table.frequency[:n]


def arms(node, others, points, R):
    """The equations of an rbe2, along the axes of R, every row: follower - (frame + rotation x arm) = 0."""
    found = []
    for other in others:
        motion = np.block([[np.eye(3), -skew(points[other] - points[node])], [np.zeros((3, 3)), np.eye(3)]])
        turned = np.kron(np.eye(2), R.T)
        found += [Equation(nodes=np.array([other, node]), coefficients=np.array([turned[k], -turned[k] @ motion]),
                           name=f"equation {k}") for k in range(6)]  # fmt: skip
    return tuple(found)


@pytest.fixture
def fork():
    """A beam that carries two arms, whose ends a frame beside them joins."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0.5, 0], [2, -0.4, 0.3], [2.2, 0, 0.1]])
    lines = np.array([[0, 1], [1, 2], [1, 3]])
    groups = {"beam": {"line": np.arange(3)}, "root": {"vertex": np.zeros(1, dtype=int)}}
    return Mesh(points=points, cells={"line": lines, "vertex": np.zeros((1, 1), dtype=int)}, groups=groups)


@pytest.mark.parametrize("seed", [None, 3])
def test_equations_of_rigid_arms_are_an_rbe2(fork, seed):
    """Along the mesh axes, and along others."""
    R = np.eye(3) if seed is None else random_rotation(seed)
    by_link = fork.with_(links=(Link(kind="rbe2", node=4, nodes=np.array([2, 3])),))
    by_equations = fork.with_(equations=arms(4, [2, 3], fork.points, R))
    sections = {"beam": spinup_section()}
    models = [mp.assemble(mesh, sections, NODE) for mesh in (by_link, by_equations)]
    np.testing.assert_allclose(frequencies(models[1]), frequencies(models[0]), rtol=1e-9)
    assert len(models[0].free) == len(models[1].free)
    assert all(check.passed for check in mp.body.check_model(models[1]))
    assert not [note for note in models[1].notes if "equation" in note]


def test_a_lever_by_hand():
    """A lever of arms 2 and 1: u_a = -2 u_b; springs k at a and c at b: F / (k + c / 4) for a force at a."""
    points = np.array([[0.0, 0, 0], [0, 2, 0], [0, -1, 0], [3.0, 2, 0], [3, -1, 0]])
    terms = [(3, 0, 1.0), (4, 0, 2.0), (0, 0, -3.0), (0, 5, 0.0)]
    mesh = Mesh(
        points=points,
        cells={"line": np.array([[0, 1], [0, 2], [1, 3], [2, 4]])},
        groups={"held": {"line": np.array([0, 1])}, "a": {"line": np.array([2])}, "b": {"line": np.array([3])}},
        equations=(Equation.of_terms(terms, length=1.0, name="lever"),),
    )
    rigid = mp.Spring(translation=(1e9,) * 3, rotation=(1e9,) * 3)
    soft = {"a": mp.Spring(translation=(5e3, 1e6, 1e6)), "b": mp.Spring(translation=(8e3, 1e6, 1e6))}
    model = mp.assemble(mesh, {"held": rigid, **soft}, {"root": mp.Interface(node=1, kind="node")})
    K = (model.C.T @ model.K @ model.C).toarray()
    load = np.zeros(model.n_dof)
    load[model.dof[3, 0]] = 10.0
    keep = np.setdiff1d(np.arange(len(model.free)), np.searchsorted(model.free, model.interfaces[0].dofs))
    x = np.zeros(len(model.free))
    x[keep] = np.linalg.lstsq(K[np.ix_(keep, keep)], (model.C.T @ load)[keep], rcond=1e-12)[0]
    u = model.C @ x
    assert u[model.dof[3, 0]] == pytest.approx(10 / (5e3 + 8e3 / 4), rel=1e-4)  # the springs that hold: 1e-5
    assert u[model.dof[4, 0]] == pytest.approx(-u[model.dof[3, 0]] / 2, rel=1e-12)
    assert not [note for note in model.notes if "rigid" in note]  # 1 + 2 - 3 = 0, and 2 - 2 = 0 about z


def test_equations_may_refer_to_each_other_in_any_order():
    """u0 = u1 + u2, u1 = 2 u0 - u3, u2 = u1 - u4: solved by numpy, which driven DOF each chose aside."""
    rows = [([0, 1, 2], [1.0, -1, -1]), ([1, 0, 3], [1.0, -2, 1]), ([2, 1, 4], [1.0, -1, 1])]
    A = np.zeros((3, 5))
    equations = []
    for row, (dofs, values) in zip(A, rows, strict=True):
        row[dofs] = values
        equations.append(PlacedEquation("equation", np.array(dofs), np.array(values)))
    for order in ([0, 1, 2], [2, 1, 0], [1, 0, 2]):
        found = constrain([], 5, [equations[k] for k in order])
        assert found.C.shape == (5, 2)
        np.testing.assert_allclose(A @ found.C.toarray(), 0, atol=1e-14)
        assert np.linalg.matrix_rank(found.C.toarray()) == 2
        d = found.C @ np.array([0.3, -0.7])
        moved = np.zeros(5)
        moved[found.free] = d[found.free]
        np.testing.assert_allclose(found.with_dependent(moved), d, atol=1e-14)
        force = np.arange(5.0)
        np.testing.assert_allclose(found.transferred(force)[found.free], found.C.T @ force, atol=1e-12)


def test_a_long_chain_and_a_repeated_equation():
    n = 400
    chain = [PlacedEquation(f"e{k}", np.array([k, k + 1]), np.array([1.0, -1.0])) for k in range(n - 1)]
    found = constrain([], n, [*chain, PlacedEquation("again", np.array([0, n - 1]), np.array([2.0, -2.0]))])
    np.testing.assert_array_equal(found.C.toarray(), np.ones((n, 1)))
    assert found.notes == ("equations that others contain are left out (1, the first is again)",)


def test_an_equation_on_a_driven_node_drives_another(fork):
    """Its first DOF follows a link: the frame of that link becomes dependent, and the constraint holds."""
    link = Link(kind="rbe2", node=4, nodes=np.array([2, 3]))
    equation = Equation.of_terms([(2, 0, 1.0), (3, 0, -1.0)], length=1.0, name="equal")
    model = mp.assemble(fork.with_(links=(link,), equations=(equation,)), {"beam": spinup_section()}, NODE)
    apart = model.C[[model.dof[2, 0]]] - model.C[[model.dof[3, 0]]]
    root = np.searchsorted(model.free, model.interfaces[0].dofs)
    rigid = np.zeros(model.C.shape[1])
    rigid[root[:3]] = 1.0
    assert abs(apart.toarray()[0, np.setdiff1d(np.arange(len(rigid)), root)]).max() < 1e-12
    assert any("equations that rigid motions break" in note for note in model.notes)  # rotations open it


def test_an_equation_that_grounds_the_model_is_a_support_and_is_said():
    """u_y = 0 at the tip: a support of the tip, at the frame of the root."""
    mesh, sections = beam_mesh(8), {"beam": spinup_section()}
    held = mp.assemble(mesh, sections, NODE, supports={"tip": mp.Support(group="tip", components="2")})
    zero = Equation.of_terms([(8, 1, 3.0)], length=1.0, name="MPC 5")
    model = mp.assemble(mesh.with_(equations=(zero,)), sections, NODE)
    np.testing.assert_allclose(frequencies(model), frequencies(held), rtol=1e-10)
    assert any(
        "hold the model at the frame of its root (1): in the first, MPC 5, a translation along y leaves 1 of" in note
        for note in model.notes
    )
    R = model.rigid_body()
    np.testing.assert_allclose(model.C @ R[model.free], R, atol=1e-12)


def test_an_equation_cannot_hold_an_interface():
    mesh = beam_mesh(4).with_(equations=(Equation.of_terms([(0, 1, 1.0), (4, 1, -1.0)], length=1.0, name="MPC 5"),))
    ends = {**NODE, "tip": mp.Interface(group="tip", kind="node")}
    with pytest.raises(mp.InputError, match="MPC 5 would hold an interface"):
        mp.assemble(mesh, {"beam": spinup_section()}, ends)
