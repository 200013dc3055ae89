"""Accelerations that many generalised forces make at once, against the inverse dynamics."""

import numpy as np
import pytest
from compare import assert_close
from multibody.trees import ROOTS, random_state, random_tree

import modalprep as mp
from modalprep.multibody.evaluation.evaluator import Evaluator


def responses(system, y, factor=1.0):
    """Return what unit forces of all speeds accelerate, beside other columns that stay, and the mass matrix."""
    evaluator = Evaluator(system)
    mass, nu = evaluator.mass(y), evaluator.nu
    evaluator.load(y)
    evaluator.accelerations(np.zeros(nu))
    out = np.full((nu + 2, nu + 3), 7.0)
    sizes = evaluator.respond(factor, np.eye(nu), out, 1, 2)
    found = out[1:-1, 2:-1].copy()
    out[1:-1, 2:-1] = 7.0
    assert np.all(out == 7.0)
    assert_close(sizes, np.abs(found / evaluator.scale[:, None]).max(axis=0), 1e-14)
    return found, mass


@pytest.mark.parametrize("root", ROOTS)
def test_they_are_columns_of_the_inverse_mass_matrix(root):
    """Of trees with every joint, rigid and flexible bodies, from rest and in motion."""
    system = random_tree(12 + ROOTS.index(root), root=root)
    found, mass = responses(system, random_state(system, 3), factor=-2.0)
    assert_close(mass @ found, -2.0 * np.eye(len(mass)), 1e-10)


def test_elements_that_add_mass_count():
    """A rod in water carries some of it."""
    water = mp.multibody.Water()
    system = random_tree(4, root="free", most=1)
    rod = mp.multibody.ImmersedRod(name="b0", body="b0", ends=("a", "b"), diameter=0.6, water=water)
    y = random_state(system, 1)
    dry, wet = (responses(each, y) for each in (system, system.with_(loads=(rod,))))
    assert_close(wet[1] @ wet[0], np.eye(len(wet[1])), 1e-10)
    assert np.abs(wet[1] - dry[1]).max() > 1e-3
