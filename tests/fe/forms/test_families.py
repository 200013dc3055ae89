"""The plain forms against the compiled elements: the same matrices on one distorted element of every formulation."""

import numpy as np
import pytest
from element_cases import ELEMENTS, built
from skfem import asm
from skfem.assembly.form.form import FormExtraParams
from skfem.element import DiscreteField
from structured import random_rotation

from modalprep.fe.elements.mass import PAIRS
from modalprep.fe.forms.basis import DofMap
from modalprep.fe.forms.elements import interpolated
from modalprep.fe.forms.families import PLAIN, plain
from modalprep.fe.forms.mass import added, mass, mass_of_pair, mass_vectors, rigid_inertia

SAME = 1e-11  # of the largest entry: rounding of some thousand operations
NAMES = [name for name in ELEMENTS if ELEMENTS[name][0] in PLAIN]


def both(name):
    """Return an element and its weak forms; its DOFs are numbered node by node."""
    block = built(name)
    n, c = block.nodes.size, block.components
    dof = np.where(np.arange(6) < c, c * np.arange(n)[:, None] + np.arange(6), -1)
    return block, plain(block, DofMap(ELEMENTS[name][2] @ random_rotation(3).T, dof, n * c))


def agree(found, wanted):
    """Compare entries, relative to the largest one."""
    np.testing.assert_allclose(found, wanted, rtol=0, atol=SAME * np.abs(wanted).max())


def total(terms):
    return sum(asm(term.form, term.basis, **term.given) for term in terms).toarray()


def work(term, y, z):
    """Return the value of a bilinear form for two displacements: as all entries of its matrix, but sooner."""
    fields = [interpolated(term.basis, x, k) for x in (y, z) for k in range(len(term.basis.basis[0]))]
    grads = [interpolated_gradient(term.basis, x, k) for x in (y, z) for k in range(len(term.basis.basis[0]))]
    given = FormExtraParams(term.basis.default_parameters() | term.given)
    both = [DiscreteField(*parts) for parts in zip(fields, grads, strict=True)]
    return np.sum(term.form.form(*both, given) * term.basis.dx)


def interpolated_gradient(basis, d, k):
    if basis.basis[0][k].grad is None:
        return None
    return sum(d[dofs][:, None] * own[k].grad for dofs, own in zip(basis.element_dofs, basis.basis, strict=True))


@pytest.mark.parametrize("name", NAMES)
def test_stiffness(name):
    block, own = both(name)
    agree(total(own.stiffness()), block.stiffness()[0])


@pytest.mark.parametrize("name", NAMES)
def test_geometric_stiffness(name):
    block, own = both(name)
    d, *some = 0.01 * np.random.default_rng(1).standard_normal((6, block.nodes.size * block.components))
    terms = own.geometric_stiffness(d)
    K = block.geometric_stiffness(d[None])[0]
    found = [[sum(work(term, y, z) for term in terms) for y in some] for z in some]
    agree(found, np.array(some) @ K @ np.array(some).T)


@pytest.mark.parametrize("name", ["beam", "quad", "tetra10", "curved triangle"])
def test_assembled_geometric_stiffness(name):
    block, own = both(name)
    d = 0.01 * np.random.default_rng(1).standard_normal(block.nodes.size * block.components)
    agree(total(own.geometric_stiffness(d)), block.geometric_stiffness(d[None])[0])


@pytest.mark.parametrize("name", NAMES)
def test_mass(name):
    """M, one block of the mass tensor, the twelve vectors and the rigid inertia."""
    block, own = both(name)
    masses, wanted = own.masses(), block.mass()
    agree(added(mass, masses).toarray(), wanted.matrix()[0])
    g, h = mass_vectors(masses, block.nodes.size * block.components)
    agree(g, wanted.g[0])
    agree(h, wanted.h[0])
    rigid = rigid_inertia(masses)
    assert rigid.m == pytest.approx(wanted.rigid.m, rel=SAME)
    agree(rigid.s0, wanted.rigid.s0)
    agree(rigid.E0, wanted.rigid.E0)
    if wanted.form == "pairs":
        agree(added(mass_of_pair, masses, a=0, b=2).toarray(), wanted.tensor[0, PAIRS.index((0, 2))])
