"""Figures of a reduction against pyYeti's Craig-Bampton tools, on matrices that plain formulas make of the same model.

``T = [1 0; -K_ii^-1 K_ib Phi]`` by SciPy alone; pyYeti then sees ``T^T M T`` and ``T^T K T``, boundary first.
"""

import io
from functools import partial
from types import SimpleNamespace
from unittest.mock import patch

import numpy as np
import pytest
from scipy.linalg import eigh
from scipy.sparse.linalg import eigsh
from superelements import MODES, craig_bampton_matrices, pipe

import modalprep as mp
from modalprep.reduction.projected import body_matrices, interface_motion
from modalprep.reduction.synthesis import synthesise

INCH = (0.0254, 0.45359237 * 9.80665 / 0.0254)  # m in an inch, kg in a slinch


@pytest.fixture(scope="module")
def cb():
    """PyYeti's Craig-Bampton tools, which set how numpy prints."""
    with np.printoptions():
        yield pytest.importorskip("pyyeti.cb")


@pytest.fixture(scope="module")
def n2p():
    with np.printoptions():
        yield pytest.importorskip("pyyeti.nastran.n2p")


def checked(cb, n2p, model, mass, stiffness, **options):
    """PyYeti's check, the interfaces as grids 1, 2, .. and the root as reference; what it printed too."""
    uset = None
    for number, frame in enumerate(model.interfaces, 1):
        uset = n2p.addgrid(uset, number, "b", 0, frame.position, 0)
    b, text = np.arange(6 * len(model.interfaces)), io.StringIO()
    start = np.random.default_rng(0).standard_normal(len(mass))  # else one of chance, and with it the last digits
    with patch("scipy.sparse.linalg.eigsh", partial(eigsh, v0=start)):
        found = cb.cbcheck(
            text, mass, stiffness, b, b[:6], uset, uref=1, n_freefree_modes=min(20, len(mass) - 1), **options
        )
    return SimpleNamespace(**vars(found), b=b, text=text.getvalue())


@pytest.fixture(scope="module", params=["pipe", "bracket"])
def case(request, cb, n2p):
    """A model of beams and a mass, or of solids behind rigid links: pyYeti's view and ours."""
    model = pipe() if request.param == "pipe" else request.getfixturevalue("bracket_model")
    mass, stiffness = craig_bampton_matrices(model)
    reduction = mp.craig_bampton(model, modes=MODES, truncation=())
    return SimpleNamespace(
        model=model,
        mass=mass,
        stiffness=stiffness,
        table=reduction.table,
        body=mp.flexible_body(model, reduction, name=request.param, damping=0.02),
        pyyeti=checked(cb, n2p, model, mass, stiffness),
    )


def free_free(text):
    """Frequencies (Hz) of the floating body in what pyYeti printed, with six decimals."""
    rows = text[text.index("FREE-FREE MODES") : text.index("FIXED-BASE MODES")].splitlines()
    return np.array([float(row.split()[1]) for row in rows if row.strip() and row.split()[0].isdigit()])


def fixed(table):
    return np.array([kind == "fixed-interface" for kind in table.kind])


def test_fixed_interface_frequencies(case):
    np.testing.assert_allclose(case.table.frequency[fixed(case.table)], case.pyyeti.cb_frq, rtol=1e-8)


def test_effective_masses(case):
    """About the root in kg and kg m^2, and in percent of the body's rigid mass."""
    ours = case.table.effective_mass[fixed(case.table)]
    theirs = (case.pyyeti.m[np.ix_(range(len(case.pyyeti.b), len(case.mass)), case.pyyeti.b)] @ case.pyyeti.rbg) ** 2
    scale = case.table.total
    np.testing.assert_allclose(ours / scale, theirs / scale, atol=1e-8)
    np.testing.assert_allclose(100 * case.table.fraction[fixed(case.table)], case.pyyeti.effmass_percent, atol=1e-6)


def test_rigid_mass_and_centre_of_gravity(cb, case):
    """The rigid motions of the interfaces carry the whole mass: m, s0 and E0 of the model."""
    rigid, motion = case.model.rigid, case.pyyeti.rbs
    at_root = motion.T @ case.pyyeti.m @ motion
    np.testing.assert_allclose(np.diag(at_root), case.table.total, rtol=1e-8)
    at_centre, centre, _, _, inertia, _ = cb.cgmass((at_root + at_root.T) / 2, all6=True)
    size = np.ptp(case.model.points)
    np.testing.assert_allclose(np.diag(at_centre)[:3], rigid.m, rtol=1e-8)
    np.testing.assert_allclose(centre, rigid.s0 / rigid.m, atol=1e-8 * size)
    E = rigid.E0 - np.outer(rigid.s0, rigid.s0) / rigid.m
    np.testing.assert_allclose(inertia, np.trace(E) * np.eye(3) - E, atol=1e-8 * rigid.m * size**2)


def test_mass_matrix_of_the_free_body(case):
    """Its root is pyYeti's boundary, its moments those of the same rigid body."""
    M, _ = body_matrices(case.body)
    motion = case.pyyeti.rbs
    np.testing.assert_allclose(M[:6, :6], motion.T @ case.pyyeti.m @ motion, atol=1e-8 * np.abs(M[:6, :6]).max())


def test_interface_positions_from_the_stiffness_alone(cb, case):
    found = cb.cbcoordchk(case.stiffness, case.pyyeti.b, case.pyyeti.b[:6], verbose=False)
    size = np.ptp(case.model.points)
    np.testing.assert_allclose(found.coords, case.body.interface_position, atol=1e-7 * size)
    assert found.refpoint_chk == "pass"


def test_frequencies_of_the_floating_body(case):
    """The body stands in the frame of its root; afloat, it has the frequencies that pyYeti finds."""
    ours = synthesise({"a": case.body}).frequency[6:]
    full = np.sqrt(eigh(case.pyyeti.k, case.pyyeti.m, eigvals_only=True)[6:]) / (2 * np.pi)
    np.testing.assert_allclose(ours, full, rtol=1e-7)
    theirs = free_free(case.pyyeti.text)
    assert np.all(theirs[:6] < 1e-4 * theirs[6])
    # pyYeti shifts by 1 (rad/s)^2, at which modes of kilohertz keep two or three digits; those of the pipe, 54 Hz, all
    tolerance = 1e-7 if ours[0] < 100 else 1e-2
    np.testing.assert_allclose(theirs[6:], ours[: len(theirs) - 6], rtol=tolerance, atol=1e-6)


def transfer(cb, mass, damping, stiffness, frequency):
    """Force and moment (6, f) on the root, and accelerations (n, f), per unit acceleration of the root along x, y."""
    base = np.array([1.0, 1.0, 0, 0, 0, 0])
    found = cb.cbtf(mass, damping, stiffness, base, frequency, np.arange(6))
    return found.frc, found.a


def relative(case, n):
    """Coordinates (n, n) in which the other interfaces move relative to the root: pyYeti shakes one rigid boundary."""
    A = np.eye(n)
    A[6 : len(case.pyyeti.b), :6] = case.pyyeti.rbg[6:]
    return A


def test_transfer_functions_of_the_body(cb, case):
    """Shaken at the root, the modal body answers as the matrices with every interface kept do."""
    body = case.body
    frequency = np.array([0.3, 0.97, 1.05, 1.6]) * body.frequency[0]
    M, K = body_matrices(body)
    force, acceleration = transfer(cb, M, np.zeros_like(M), np.diag(K), frequency)
    A = relative(case, len(case.mass))
    exact, there = transfer(cb, *(A.T @ B @ A for B in (case.mass, 0 * case.mass, case.stiffness)), frequency)
    np.testing.assert_allclose(force, exact, atol=1e-7 * np.abs(exact).max())
    there = (A @ there)[: len(case.pyyeti.b)]
    ours = np.concatenate([interface_motion(body, k) @ acceleration for k in range(len(body.interface_name))])
    np.testing.assert_allclose(ours, there, atol=1e-7 * np.abs(there).max())


def test_damped_transfer_function_is_the_modal_sum(cb, case):
    """Damped, ``F = (M_bb + M_bq H M_qb) a`` with ``H_k = w^2 / (w_k^2 - w^2 + i D_k w)``."""
    body = case.body
    M, K = body_matrices(body)
    frequency = np.array([0.5, 1.0, 2.0]) * body.frequency[0]
    force, _ = transfer(cb, M, np.diag(np.append(np.zeros(6), body.D)), np.diag(K), frequency)
    w = 2 * np.pi * frequency[:, None]
    H = w**2 / (body.K - w**2 + 1j * w * body.D)
    base = np.array([1.0, 1.0, 0, 0, 0, 0])
    ours = (M[:6, :6] @ base)[:, None] + M[:6, 6:] @ (H.T * (M[6:, :6] @ base)[:, None])
    np.testing.assert_allclose(ours, force, atol=1e-9 * np.abs(force).max())


def test_guyan(cb, case):
    """Condensed to the interfaces alone: their places, the frequencies and the answer to a shaken root."""
    mass, stiffness = craig_bampton_matrices(case.model, 0)
    body = mp.flexible_body(case.model, mp.guyan(case.model), name="guyan")
    held = np.sqrt(eigh(stiffness[6:, 6:], mass[6:, 6:], eigvals_only=True)) / (2 * np.pi)
    np.testing.assert_allclose(body.frequency, held, rtol=1e-8)
    found = cb.cbcoordchk(stiffness, case.pyyeti.b, case.pyyeti.b[:6], verbose=False)
    size = np.ptp(case.model.points)
    np.testing.assert_allclose(found.coords, body.interface_position, atol=1e-7 * size)
    M, K = body_matrices(body)
    frequency = np.array([0.4, 0.9, 1.2]) * body.frequency[0]
    force, _ = transfer(cb, M, np.zeros_like(M), np.diag(K), frequency)
    A = relative(case, len(mass))
    exact, _ = transfer(cb, *(A.T @ B @ A for B in (mass, 0 * mass, stiffness)), frequency)
    np.testing.assert_allclose(force, exact, atol=1e-7 * np.abs(exact).max())


def test_free_interface_modes(cb, n2p):
    """With every fixed-interface mode kept, pyYeti's free-free frequencies are our free-interface modes."""
    model = pipe()
    every = len(model.free) - 18
    mass, stiffness = craig_bampton_matrices(model, every - 1)  # ARPACK finds all but one
    theirs = free_free(checked(cb, n2p, model, mass, stiffness).text)
    ours = mp.reduction.free_interface(model, modes=12).table.frequency[:12]
    np.testing.assert_allclose(ours, theirs[6:18], rtol=1e-6)


def test_craig_bampton_in_other_units(cb):
    """In inches and slinches from the start, the matrices are those that pyYeti converts; the frequencies stay."""
    model, inch = pipe(), pipe(INCH)
    mass, stiffness = craig_bampton_matrices(model)
    mass_inch, stiffness_inch = craig_bampton_matrices(inch)
    b = np.arange(18)
    sign = np.sign(np.sum(cb.cbconvert(mass, b, "m2e")[:18, 18:] * mass_inch[:18, 18:], axis=0))
    sign = np.append(np.ones(18), sign)
    for ours, exact in ((mass, mass_inch), (stiffness, stiffness_inch)):
        ours = cb.cbconvert(ours, b, "m2e") * np.outer(sign, sign)
        size = np.sqrt(np.abs(np.diag(exact)))
        np.testing.assert_allclose(ours / np.outer(size, size), exact / np.outer(size, size), atol=1e-7)
    frequency = [mp.craig_bampton(m, modes=6, truncation=()).frequency for m in (model, inch)]
    np.testing.assert_allclose(frequency[0], frequency[1], rtol=1e-9)
