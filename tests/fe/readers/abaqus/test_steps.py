"""Steps of Abaqus and CalculiX decks: loads, modes, damping, retained nodes."""

import numpy as np
import pytest
from fe.abaqus_decks import CUBE, QUAD, STEEL

SHELL = QUAD + "*SHELL SECTION, ELSET=s, MATERIAL=steel\n.01\n" + STEEL
SOLID = CUBE + STEEL
FACES = "*SURFACE, NAME=top\ns, SPOS\n*SURFACE, NAME=under\ns, SNEG\n"


def step(text, *more):
    return "".join(f"*STEP\n{one}\n*END STEP\n" for one in (text, *more))


def force(mesh, name="step_1"):
    return mesh.loads[name].forces.sum(axis=0)


@pytest.mark.parametrize(
    ("deck", "load", "expected"),
    [
        (SHELL, "*CLOAD\n2, 3, 5.\n4, 1, 2.", (2, 0, 5)),
        (SHELL, "*DLOAD\ns, P, 6.", (0, 0, 6)),
        (SHELL + FACES, "*DSLOAD\ntop, P, 6.", (0, 0, -6)),
        (SHELL + FACES, "*DSLOAD\nunder, P, 6.", (0, 0, 6)),
        (SOLID, "*DLOAD\nc, P1, 6.", (0, 0, 6)),
        (SOLID, "*DLOAD\nc, P2, 6.", (0, 0, -6)),
        (SOLID, "*DLOAD\nc, P3, 6.", (0, 6, 0)),
        (SOLID, "*DLOAD\n1, P4, 6.", (-6, 0, 0)),
        (SOLID + "*SURFACE, NAME=f\n1, S6\n", "*DSLOAD\nf, P, 6.", (6, 0, 0)),
    ],
)
def test_static_loads(read, deck, load, expected):
    np.testing.assert_allclose(force(read(deck + step(load))), expected, atol=1e-12)


def test_forces_along_the_axes_of_transform(read):
    mesh = read(
        SHELL + "*TRANSFORM, NSET=t\n0, 1, 0, -1, 0, 0\n*NSET, NSET=t\n2\n" + step("*CLOAD\n2, 1, 5.\n2, 6, 3.")
    )
    np.testing.assert_allclose(force(mesh), [0, 5, 0], atol=1e-12)
    np.testing.assert_allclose(mesh.loads["step_1"].moments, [[0, 0, 3]], atol=1e-12)


def test_units(read):
    """In mm and t: N, N mm and mm/s^2."""
    mesh = read(SHELL + step("*CLOAD\n2, 1, 5.\n2, 6, 3.\n*DLOAD\ns, GRAV, 9810., 0, 0, -2."), "mm", "t")
    np.testing.assert_allclose(mesh.loads["step_1"].forces, [[5, 0, 0]])
    np.testing.assert_allclose(mesh.loads["step_1"].moments, [[0, 0, 3e-3]])
    np.testing.assert_allclose(mesh.cases[0].gravity, [0, 0, -9.81])


def test_steps_are_cases(read):
    """Names by number; what is not used is said, output is not."""
    mesh = read(
        SHELL
        + "*BOUNDARY\n1, 1, 6\n"
        + step("*FREQUENCY\n12, 5., 500.\n*NODE FILE\nU", "*STATIC\n*CLOAD\n2, 3, 1.\n*TEMPERATURE\n1, 20.")
    )
    first, second = mesh.cases
    assert (first.name, first.modes, first.lowest, first.highest) == ("step 1", 12, 5.0, 500.0)
    assert (first.supports, first.said, second.loads) == (("boundary",), (), ("step_2",))
    assert second.said == ("left out: 1 *TEMPERATURE (line 27); of this step these are not used",)


@pytest.mark.parametrize(
    ("keyword", "damping"),
    [
        ("*MODAL DAMPING\n1, 9, .03", 0.03),
        ("*MODAL DAMPING\n1, 4, .03\n5, 9, .03", 0.03),
        ("*MODAL DAMPING, STRUCTURAL\n1, 9, .03", 0.015),
        ("*MODAL DAMPING, DEFINITION=FREQUENCY RANGE\n10., .03\n90., .01", [[10.0, 0.03], [90.0, 0.01]]),
        ("*MODAL DAMPING, RAYLEIGH\n1, 9, 2., 3.E-5", {"alpha": 2.0, "beta": 3e-5}),
        ("*GLOBAL DAMPING, ALPHA=2., BETA=3.E-5", {"alpha": 2.0, "beta": 3e-5}),
        ("*GLOBAL DAMPING, STRUCTURAL=.04", 0.02),
    ],
)
def test_damping_of_a_step(read, keyword, damping):
    assert read(SHELL + step(keyword)).cases[0].damping == damping


def test_damping_by_mode_is_said(read):
    [case] = read(SHELL + step("*MODAL DAMPING\n1, 4, .03\n5, 9, .02")).cases
    assert case.damping is None
    assert "1 *MODAL DAMPING with ratios by mode" in case.said[0]


@pytest.mark.parametrize(
    ("options", "damping"),
    [("ALPHA=2., BETA=3.E-5", {"alpha": 2.0, "beta": 3e-5}), ("STRUCTURAL=.04", 0.02)],
)
def test_damping_of_the_material(read, options, damping):
    text = SHELL + f"*DAMPING, {options}\n"
    [case] = read(text + step("*FREQUENCY\n4")).cases
    assert case.damping == damping
    [case] = read(text + "*MATERIAL, NAME=b\n*ELASTIC\n1e9, .3\n" + step("*FREQUENCY\n4")).cases
    assert case.damping is None
    assert "a *DAMPING of their own each" in case.said[-1]


def test_the_nodes_of_a_substructure_are_a_group(read):
    mesh = read(SHELL + step("*SUBSTRUCTURE GENERATE\n*RETAINED NODAL DOFS\n2, 1, 6\n3, 1, 3"))
    assert mesh.labels[mesh.nodes("retained")].tolist() == [2, 3]


@pytest.mark.parametrize(
    ("load", "said"),
    [
        ("*CLOAD\n99, 1, 5.", "'99' is no node"),
        ("*CLOAD\n2, 8, 5.", "1 *CLOAD in component 8"),
        ("*DLOAD\ns, CENTRIF, 5.", "*DLOAD of type CENTRIF"),
        ("*DLOAD\ns, GRAV, 9.81", "gravity has no direction"),
        ("*DSLOAD\nno, P, 5.", "names the surface 'no'"),
        ("*BASE MOTION\n1, 1.", "1 *BASE MOTION"),
    ],
)
def test_a_load_that_cannot_be_read_does_not_keep_the_model_out(read, load, said):
    mesh = read(SHELL + step(load))
    assert mesh.loads == {}
    assert said in mesh.cases[0].said[0]
