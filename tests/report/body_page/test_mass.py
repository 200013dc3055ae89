"""Mass and reactions on the page: parallel axes, principal axes, a cuboid in closed form, balances."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.body.rigid import rigid_body
from modalprep.examples import cantilever_model, uniform_beam
from modalprep.reduction.basis import held_mass
from modalprep.report.body_page.mass import inertia_table, mass_balance, mass_section, reaction_table
from modalprep.report.body_page.reactions import G
from modalprep.vectors import rotation_matrix


def numbers(body):
    return {row[0]: np.array(row[2:], dtype=float) for row in inertia_table(body).rows}


def tensor(found, place):
    """The inertia tensor about a place from its two rows of the table."""
    moments, (xy, yz, zx) = (found[f"inertia about the {place}: {what}"] for what in ("xx, yy, zz", "xy, yz, zx"))
    return np.diag(moments) + np.array([[0, xy, zx], [xy, 0, yz], [zx, yz, 0]])


@pytest.fixture
def cuboid():
    """1 x 2 x 3 m of 6 kg, turned, with its centre away from the origin."""
    R = rotation_matrix(np.array([0.3, -0.2, 0.5]))
    moments = 6.0 / 12 * np.array([2**2 + 3**2, 1**2 + 3**2, 1**2 + 2**2])
    inertia = R @ np.diag(moments) @ R.T
    place = {"centre": np.array([0.4, 1.0, -2.0]), "interfaces": {"root": np.zeros(3)}}
    return rigid_body("box", mass=6.0, inertia=inertia, **place), moments, R, inertia


def test_principal_moments_and_axes_of_a_turned_cuboid(cuboid):
    """m (b^2 + c^2) / 12 about the axes of the cuboid."""
    body, moments, R, inertia = cuboid
    found = numbers(body)
    np.testing.assert_allclose(tensor(found, "centre of mass"), inertia, rtol=1e-9)
    np.testing.assert_allclose(found["principal moments of inertia"], np.sort(moments), rtol=1e-9)
    axes = np.array([found[f"principal axis {k}"] for k in (1, 2, 3)])
    np.testing.assert_allclose(np.abs(axes @ R[:, np.argsort(moments)]), np.eye(3), atol=1e-9)


def test_origin_and_centre_of_mass_differ_by_the_parallel_axis_theorem(cuboid):
    body = cuboid[0]
    found, c = numbers(body), np.array([0.4, 1.0, -2.0])
    np.testing.assert_allclose(found["centre of mass"], c, rtol=1e-12)
    steiner = 6.0 * (c @ c * np.eye(3) - np.outer(c, c))
    np.testing.assert_allclose(tensor(found, "origin") - tensor(found, "centre of mass"), steiner, rtol=1e-9)


def test_parts_of_the_mass_sum_up_to_the_body():
    """Modes, what the root holds and what was left out; with all modes of the mesh nothing is left out."""
    model = cantilever_model()
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=60, truncation=()), name="beam")
    body = body.with_(modes=body.modes.with_(held_mass=held_mass(model)))
    table = mass_balance(body)
    parts = {row[0]: np.array(row[1:]) for row in table.rows}
    np.testing.assert_allclose(sum(parts.values()), table.total[1:], rtol=1e-5)
    np.testing.assert_array_equal(parts["modes left out"], 0.0)
    assert parts["held at the root"][1] == pytest.approx(held_mass(model)[1], rel=1e-12)
    few = mass_balance(uniform_beam(modes=2))
    assert [row[0] for row in few.rows] == ["modes of the body", "not in the modes"]


def test_reactions_of_the_table_carry_the_weight():
    model = cantilever_model(tip="fixed")
    body = mp.flexible_body(model, mp.craig_bampton(model, modes=2), name="beam")
    rows = reaction_table(body).rows
    assert [row[2] for row in rows] == ["root"] * 3 + ["root", "tip", "sum"] * 3
    for row in rows:
        if row[2] == "sum" or row[0] == "root":
            force = -G * body.m * np.eye(3)["xyz".index(row[1])]
            np.testing.assert_allclose(row[3:6], force, atol=1e-5 * G * body.m)


def test_a_body_without_reactions_says_why():
    body = uniform_beam(modes=2)
    assert "moves without strain" in mass_section(body.with_(K=np.array([0.0, 1.0]))).html
