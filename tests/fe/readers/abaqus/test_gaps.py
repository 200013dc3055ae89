"""Ties that keep a gap, rotation nodes of rigid bodies, and parameters that nothing reads."""

import numpy as np
import pytest
from fe.abaqus_decks import BEAM, CUBE, SECTION, STEEL, E, displacements

import modalprep as mp

HIGH = 0.1


def cubes(adjust, warp=0.0):
    """Two unit cubes, the upper one `HIGH` above the lower; `warp` lifts a corner of the master face."""
    lower = CUBE.replace("7, 1, 1, 1\n", f"7, 1, 1, {1 + warp}\n")
    upper = "".join(f"{k + 10}, {x}, {y}, {z + 1 + HIGH}\n" for k, (x, y, z) in enumerate(UNIT, 1))
    text = (
        lower.replace("*ELEMENT", upper + "*ELEMENT")
        + "*ELEMENT, TYPE=C3D8, ELSET=d\n2, 11, 12, 13, 14, 15, 16, 17, 18\n"
    )
    text += "*SOLID SECTION, ELSET=d, MATERIAL=steel\n*SURFACE, NAME=m\nc, S2\n*SURFACE, NAME=s\nd, S1\n"
    return text + f"*TIE, NAME=t, POSITION TOLERANCE=.3{adjust}\ns, m\n" + STEEL


UNIT = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


@pytest.mark.parametrize("warp", [0.0, 0.05])
def test_nodes_that_are_not_adjusted_stay_and_move_rigidly_with_the_face(read, warp):
    """Every rigid motion satisfies the equations, also about axes in the face, which turn the gap."""
    mesh = read(cubes(", ADJUST=NO", warp))
    assert mesh.points[8:12, 2] == pytest.approx(1 + HIGH)
    assert not any("moved onto" in note for note in mesh.notes)
    assert len(mesh.equations) == 12
    for axis in np.eye(3):
        for motion in (np.tile(axis, (16, 1)), np.cross(axis, mesh.points - 0.3)):
            for equation in mesh.equations:
                left = np.sum(equation.coefficients[:, :3] * motion[equation.nodes])
                assert left == pytest.approx(0.0, abs=1e-12)


def test_nodes_that_are_adjusted_move_onto_the_face(read):
    mesh = read(cubes(""))
    assert mesh.points[8:12, 2] == pytest.approx(1.0)
    assert any("moved onto the master surface by up to 0.1" in note for note in mesh.notes)


def test_a_gap_between_solids_is_an_arm(read):
    """A force across on the upper cube bends the lower one by the whole lever, the moment of the gap included.

    The reaction at the held base is that of statics, F (2 + gap), which constraints without the arm would change.
    """
    text = cubes(", ADJUST=NO") + "*NSET, NSET=base\n1, 2, 3, 4\n*BOUNDARY\nbase, 1, 3\n"
    mesh = read(text)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(kind="support")}, supports={"held": mp.Support(set="boundary")})
    u = displacements(mesh, {(k, 0): 1.0 for k in (15, 16, 17, 18)})
    x = np.zeros(model.n_dof)
    dof = model.dof[: len(mesh.points), :3]
    x[dof] = u[:, :3]
    force = (model.K @ x)[dof]
    assert force[:4].sum(axis=0) == pytest.approx([-4, 0, 0], abs=1e-6)
    assert force[:4, 2] @ mesh.points[:4, 0] == pytest.approx(4 * (2 + HIGH), rel=1e-9)


def test_two_plates_at_a_distance_bend_as_a_sandwich(read):
    """Strips of 1 m by .1 m by .01 m, .04 m apart: P / 3 E I with E I = 2 E b (t^3 / 12 + t h^2 / 4).

    Between two of the n ties, which are rigid, each strip bends by its half of the force, and shears:
    (P / 2) l^3 / (12 E b t^3 / 12) and P l / (5/6 G 2 b t) with l = L / n.
    """
    n, b, t, h = 20, 0.1, 0.01, 0.04
    nodes = lines = ""
    for layer in (0, 1):
        for k in range(n + 1):
            for j in (0, 1):
                nodes += f"{1000 * layer + 2 * k + j + 1}, {k / n}, {b * j}, {h * layer}\n"
        first = 1000 * layer
        lines += f"*ELEMENT, TYPE=S4, ELSET=s{layer}\n"
        lines += "".join(
            f"{first + k + 1}, {first + 2 * k + 1}, {first + 2 * k + 3}, {first + 2 * k + 4}, {first + 2 * k + 2}\n"
            for k in range(n)
        )
    text = f"*NODE\n{nodes}{lines}*ELSET, ELSET=s\ns0, s1\n*SHELL SECTION, ELSET=s, MATERIAL=steel\n{t}\n"
    text += (
        f"*SURFACE, NAME=m\ns0, SPOS\n*SURFACE, NAME=s\ns1, SNEG\n*TIE, POSITION TOLERANCE={2 * h}, ADJUST=NO\ns, m\n"
    )
    text += (
        "*NSET, NSET=root\n1, 2\n*BOUNDARY\nroot, 1, 6\n*MATERIAL, NAME=steel\n*ELASTIC\n2e11, 0.\n*DENSITY\n7800.\n"
    )
    u = displacements(read(text), {(2 * n + 1, 2): 500.0, (2 * n + 2, 2): 500.0})
    stiffness = 2 * E * b * (t**3 / 12 + t * h**2 / 4)
    between = n * 500 / n**3 / (E * b * t**3) + 1000 / (5 / 6 * E / 2 * 2 * b * t)
    assert u[2 * n, 2] == pytest.approx(1000 / (3 * stiffness) + between, rel=2e-3)


# ---------------------------------------------------------------- rotation nodes

BODY = BEAM + SECTION + STEEL + "*NODE\n8, 0, 0, 0\n9, 0, 0, 0\n*NSET, NSET=rb\n1\n"


@pytest.mark.parametrize(("held", "same"), [("1, 3", "4, 6"), ("2, 2", "5, 5"), ("1, 2", "4, 5")])
def test_displacements_of_the_rotation_node_are_rotations_of_the_reference_node(read, held, same):
    with_node = read(BODY + f"*RIGID BODY, NSET=rb, REF NODE=8, ROT NODE=9\n*BOUNDARY\n8, 1, 3\n9, {held}\n")
    without = read(BODY + f"*RIGID BODY, NSET=rb, REF NODE=8\n*BOUNDARY\n8, 1, 3\n8, {same}\n")
    for name in ("nodes", "components"):
        np.testing.assert_array_equal(*(getattr(m.supports["boundary"], name) for m in (with_node, without)))


def test_equations_of_the_rotation_node_are_of_rotations(read):
    body = BODY + "*RIGID BODY, NSET=rb, REF NODE=8, ROT NODE=9\n*EQUATION\n2\n9, 2, 1., 3, 3, -2.\n"
    [equation] = read(body).equations
    np.testing.assert_array_equal(equation.nodes, [3, 2])
    np.testing.assert_array_equal(equation.coefficients, [[0, 0, 0, 0, 1, 0], [0, 0, -2, 0, 0, 0]])


def test_a_rotation_node_of_several_nodes_is_refused(read):
    with pytest.raises(mp.InputError, match="as ROT NODE"):
        read(BODY + "*RIGID BODY, NSET=rb, REF NODE=8, ROT NODE=8\n")


# ---------------------------------------------------------------- parameters


def test_parameters_that_nothing_reads_are_noted(read):
    text = BEAM + SECTION.replace("SECTION=RECT", "SECTION=RECT, LUMPED=NO, TEMPERATURE=VALUES") + STEEL
    assert read(text).notes == (
        "left out: 1 parameter LUMPED of *BEAM SECTION (line 8); model them otherwise where they matter",
    )


def test_parameters_that_count_later_are_no_note(read):
    """Those of surfaces and couplings, which are used after all keywords are read, or never."""
    text = CUBE + STEEL + "*NODE\n9, .5, .5, 2\n*NSET, NSET=t\n5, 6, 7, 8\n*SURFACE, TYPE=NODE, NAME=u\nt\n"
    text += "*SURFACE, TYPE=NODE, NAME=unused\nt\n*ORIENTATION, NAME=o, SYSTEM=CYLINDRICAL\n-9, 0, 0, -9, 0, 1\n"
    text += "*COUPLING, CONSTRAINT NAME=c, REF NODE=9, SURFACE=u, ORIENTATION=o\n*KINEMATIC\n2, 3\n"
    assert read(text).notes == ()


# ---------------------------------------------------------------- couplings along axes, and with weights


def test_components_of_a_kinematic_coupling_along_a_cylinder(read):
    """Radii are free: nodes on a circle may move outwards, and follow around and along the axis of the cylinder."""
    ring = [(1, 0), (0, 1), (-1, 0), (0, -1)]
    nodes = "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate([(*p, z) for z in (0, 1) for p in ring], 1))
    text = f"*NODE\n{nodes}9, 0, 0, 1\n*ELEMENT, TYPE=C3D8, ELSET=c\n1, 1, 2, 3, 4, 5, 6, 7, 8\n"
    text += "*SOLID SECTION, ELSET=c, MATERIAL=steel\n*NSET, NSET=t\n5, 6, 7, 8\n*SURFACE, TYPE=NODE, NAME=u\nt\n"
    text += "*ORIENTATION, NAME=o, SYSTEM=CYLINDRICAL\n0, 0, 0, 0, 0, 1\n"
    text += "*COUPLING, CONSTRAINT NAME=c, REF NODE=9, SURFACE=u, ORIENTATION=o\n*KINEMATIC\n2, 3\n" + STEEL
    mesh = read(text)
    model = mp.assemble(mesh, {}, {"root": mp.Interface(node=9, kind="node")})
    u = model.C @ np.random.default_rng(0).standard_normal(model.C.shape[1])
    at = model.dof[8]
    for k, (x, y) in enumerate(ring, 4):
        apart = u[model.dof[k, :3]] - u[at[:3]] - np.cross(u[at[3:]], mesh.points[k] - mesh.points[8])
        assert apart @ (-y, x, 0) == pytest.approx(0, abs=1e-12)
        assert apart[2] == pytest.approx(0, abs=1e-12)
        assert abs(apart @ (x, y, 0)) > 0.01


def test_a_distributing_coupling_has_weights(read):
    """A force at its node stands in each of its nodes by their weights, 1 to 3, without a moment."""
    text = CUBE + STEEL + "*NODE\n9, .5, .5, 2\n*ELEMENT, TYPE=DCOUP3D, ELSET=d\n2, 9\n*NSET, NSET=a\n5, 8\n"
    mesh = read(
        text
        + "*DISTRIBUTING COUPLING, ELSET=d\na, 1.\n6, 3.\n7, 3.\n*NSET, NSET=base\n1, 2, 3, 4\n*BOUNDARY\nbase, 1, 3\n"
    )
    [link] = mesh.links
    assert (link.kind, link.node, dict(zip(link.nodes.tolist(), link.weights, strict=True))) == (
        "rbe3", 8, {4: 1.0, 7: 1.0, 5: 3.0, 6: 3.0},
    )  # fmt: skip
    u = displacements(mesh, {(9, 2): 1e6})
    tops = u[4:8, 2] @ (1, 3, 3, 1) / 8
    lever = 0.25  # the mean of x is .75 by the weights, and its node stands at .5
    slope = (u[5, 2] + u[6, 2] - u[4, 2] - u[7, 2]) / 2
    assert u[8, 2] == pytest.approx(tops - lever * slope, rel=1e-9)


@pytest.mark.parametrize("lines", ["9, 1.\n", "a, -1.\n", ""])
def test_distributing_couplings_that_cannot_be(read, lines):
    text = CUBE + STEEL + "*NODE\n9, .5, .5, 2\n*ELEMENT, TYPE=DCOUP3D, ELSET=d\n2, 9\n*NSET, NSET=a\n5, 8\n"
    with pytest.raises(mp.InputError, match="couples no nodes, its own node, or has a weight"):
        read(text + "*DISTRIBUTING COUPLING, ELSET=d\n" + lines)
