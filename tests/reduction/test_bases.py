"""Free-interface and improved reductions, selection, and the measured error of a reduction."""

import numpy as np
import pytest

import modalprep as mp
from modalprep.examples import beam_mesh, cantilever_model, spinup_section
from modalprep.reduction.craig_bampton import craig_bampton, guyan
from modalprep.reduction.error import reduction_error, to_target
from modalprep.reduction.free_interface_basis import free_interface, improved_guyan
from modalprep.reduction.selection import select


@pytest.fixture(scope="module")
def model():
    return cantilever_model(20, tip="fixed")


def full_frequencies(model, n):
    """Root held, by LAPACK."""
    from scipy.linalg import eigh

    free = np.setdiff1d(np.arange(model.n_dof), model.interfaces[0].dofs)
    K, M = (A.toarray()[np.ix_(free, free)] for A in (model.K, model.M))
    return np.sqrt(eigh(K, M, eigvals_only=True)[:n]) / (2 * np.pi)


def test_free_interface_modes_are_those_of_a_floating_beam(model):
    """cos(kL) cosh(kL) = 1: 4.7300, 7.8532; soft plane first (rotary inertia and shear below 2e-3)."""
    red = free_interface(model, modes=4)
    k = np.array([4.730041, 7.853205]) / 10.0
    exact = k**2 * np.sqrt(1.4e4 / 1.2) / (2 * np.pi)
    np.testing.assert_allclose(red.table.frequency[[0, 2]], exact * [1, 1], rtol=6e-3)


@pytest.mark.parametrize("modes", [0, 2])
def test_free_interface_is_exact_in_statics(model, modes):
    """Forces and moments on both interfaces, inertia relief included: the residual attachment modes see to it."""
    red = free_interface(model, modes=modes)
    load = model.C.T @ red.loads[:, 18:24]  # on the tip, root held
    exact = red.static[:, 18:24]
    w2 = (2 * np.pi * red.frequency) ** 2
    found = red.basis @ ((red.basis.T @ red.loads[:, 18:24]) / w2[:, None])
    np.testing.assert_allclose(found, exact, atol=1e-8 * np.abs(exact).max())
    assert load.shape[1] == 6


def test_free_interface_converges_as_craig_bampton_does(model):
    exact = full_frequencies(model, 6)
    for method in (free_interface, craig_bampton):
        few, many = (method(model, modes=n).frequency[:6] / exact - 1 for n in (4, 16))
        assert np.all(many > -1e-9)  # Rayleigh: from above
        assert np.all(np.abs(many) < 2e-5)
        assert np.abs(few).max() > 10 * np.abs(many).max()


def test_free_interface_is_a_body(model):
    body = mp.flexible_body(model, free_interface(model, modes=6), name="free")
    assert [check.name for check in mp.check_body(body) if not check.passed] == []


def test_improved_guyan_is_better_and_exact_in_statics(model):
    exact = full_frequencies(model, 2)
    plain, better = (method(model).frequency[:2] / exact - 1 for method in (guyan, improved_guyan))
    # a cantilever by its tip, deflection and slope: one cubic element, 0.48 % high; IRS closes it by a factor 50
    np.testing.assert_allclose(plain, 0.0048, atol=1e-4)
    assert np.all((better > -1e-9) & (better < plain / 50))


def test_floating_mechanism_is_named():
    """Two beams that only share a ball (a spring without rotation) float with nine motions."""
    mesh = beam_mesh(4)
    cells = {"line": np.concatenate([mesh.cells["line"], mesh.cells["line"] + 5, [[4, 5]]]), "vertex": np.array([[0]])}
    points = np.concatenate([mesh.points, mesh.points + np.array([10.0, 0, 0])])
    groups = {"beam": {"line": np.arange(8)}, "ball": {"line": np.array([8])}, "root": {"vertex": np.array([0])}}
    both = mp.fe.Mesh(points=points, cells=cells, groups=groups)
    ball = mp.Spring(translation=(1e6, 1e6, 1e6), rotation=(0, 0, 0))
    held = {"root": mp.Interface(group="root", kind="node"), "tip": mp.Interface(near=(20.0, 0, 0), kind="node")}
    loose = mp.assemble(both, {"beam": spinup_section(), "ball": ball}, held)
    with pytest.raises(mp.MechanismError, match="rigid-body motions, not six"):
        free_interface(loose, modes=3)


FRACTION = np.array([[0.5, 0, 0, 0, 0, 0.2], [0.3, 0, 0, 0, 0, 0.3], [0.1, 0.6, 0, 0, 0, 0], [0.05, 0.01, 0, 0, 0, 0]])
HERTZ = np.array([1.0, 2.0, 3.0, 4.0])


@pytest.mark.parametrize(
    ("keep", "kept"),
    [
        ("cumulative < 70%", [1, 1, 1, 1]),  # y has 61 % in all: its last 1 % is asked for
        ("cumulative < 55%", [1, 1, 1, 0]),  # x by 1, rz by 2 and 1, y by 3
        ("cumulative < 10%", [1, 1, 1, 0]),  # the heaviest of each direction
        ("static > 5%", [0, 1, 0, 1]),
        ("static > 5% and frequency < 3", [0, 1, 0, 0]),
        ("1.5 Hz < frequency < 3.5e-3 kHz", [0, 1, 1, 0]),
        ([1, 4], [1, 0, 0, 1]),
        ([], [0, 0, 0, 0]),
    ],
)
def test_selection(keep, kept):
    found, reason = select(keep, HERTZ, FRACTION, np.array([0.01, 0.2, 0.0, 0.06]))
    assert found.astype(int).tolist() == kept
    assert all(reason)


def test_cumulative_target_takes_the_fewest():
    """70 % in x needs modes 1 and 2; the light mode 4 joins only when the target is beyond the others."""
    fraction = np.array([[0.5, 0, 0, 0, 0, 0], [0.3, 0, 0, 0, 0, 0], [0.15, 0, 0, 0, 0, 0], [0.05, 0, 0, 0, 0, 0]])
    assert select("cumulative < 50%", HERTZ, fraction)[0].tolist() == [True, False, False, False]
    assert select("cumulative < 70%", HERTZ, fraction)[0].tolist() == [True, True, False, False]
    assert select("cumulative < 99%", HERTZ, fraction)[0].tolist() == [True, True, True, True]


def test_listed_modes_must_exist():
    with pytest.raises(mp.InputError, match="keep lists mode 7, but there are 4 candidates"):
        select([1, 7], HERTZ, FRACTION)


def test_static_share_is_that_of_a_cantilever():
    """First mode under uniform acceleration: 4 * 0.7830^2 / 1.8751^4 over 1/20 = 0.992, more under spin-up."""
    red = craig_bampton(cantilever_model(30), modes=6, keep="static > 90%")
    assert red.table.kept[:6].tolist() == [True, True, False, False, False, False]  # one in each plane
    assert red.table.reason[0].startswith("static share 99")


def test_error_of_an_exact_reduction_is_round_off(model):
    everything = craig_bampton(model, modes=model.n_dof)
    found = reduction_error(model, everything, up_to=20.0)
    assert len(found.full) == 5
    assert len(found.sweep) > 2
    assert found.worst < 1e-7


def test_error_sees_what_is_missing(model):
    """Without the first mode the frequencies are wrong; without truncation vectors the statics of a free tip.

    The good one is off by 0.7 % at a resonance of 1 % damping, whose frequency is off by 3e-5.
    """
    keeps = ("all", "mode > 1")
    good, bad = (
        reduction_error(model, craig_bampton(model, modes=12, keep=keep, truncation=()), up_to=10.0) for keep in keeps
    )
    assert good.worst < 1e-2 < bad.worst
    assert good.frequency.max() < 1e-4
    free = cantilever_model(20)
    with_vectors = reduction_error(free, craig_bampton(free, modes=3), up_to=2.0)
    without = reduction_error(free, craig_bampton(free, modes=3, truncation=()), up_to=2.0)
    assert with_vectors.static.max() < 1e-9
    assert without.static.max() > 1e-3


def test_target_error_picks_the_number_of_modes(model):
    for target in (1e-2, 1e-5):
        red, error = to_target(model, lambda n: craig_bampton(model, modes=n), target, up_to=15.0, modes=2)
        assert error.worst < target
        fewer = np.sum([kind == "fixed-interface" for kind in red.table.kind]) // 2
        assert reduction_error(model, craig_bampton(model, modes=int(fewer)), up_to=15.0).worst > error.worst


def test_unreachable_target_is_reported():
    free = cantilever_model(6)
    with pytest.raises(mp.AccuracyError, match="above the target"):
        to_target(free, lambda n: craig_bampton(free, modes=min(n, 2), truncation=()), 1e-6, up_to=50.0)


def test_effective_masses_of_truncation_vectors(model):
    """Vectors that are orthonormal in the mass matrix have no more than the mass of the body."""
    table = craig_bampton(model, modes=3, truncation=("inertia",)).table
    few, more = (
        sum(table.effective_mass[k] for k, kind in enumerate(table.kind) if kind in kinds)
        for kinds in (("fixed-interface",), ("fixed-interface", "truncation"))
    )
    assert np.all(more <= table.total * (1 + 1e-9))
    assert np.all(more[[1, 2]] > few[[1, 2]])


def test_inertial_responses_are_static_solutions(model):
    """K x = M w off the root, for every mode w of the basis, also of truncation vectors."""
    reduction = craig_bampton(model, modes=3, truncation=("inertia",))
    rest = np.setdiff1d(np.arange(model.n_dof), model.interfaces[0].dofs)
    expected = (model.M @ reduction.basis)[rest]
    found = (model.K @ reduction.inertial)[rest]
    assert np.all(np.abs(found - expected).max(axis=0) <= 1e-6 * np.abs(expected).max(axis=0))
