"""Convergence of recoveries in the coordinates of a body, against bodies that have the first modes alone."""

import numpy as np
import pytest
from reduction.recoveries.test_error import LENGTH, SECTION, UP_TO

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.reduction.free_interface_basis import free_interface
from modalprep.reduction.recoveries import convergence as module
from modalprep.reduction.recoveries.convergence import Asked, recovery_convergence
from modalprep.reduction.recoveries.unit_loads import body_loads
from modalprep.reduction.table import DIRECTIONS
from modalprep.response import harmonic_response

Recover = mp.fe.Recover
WANTED = {
    "beam": Recover(kind="section_force"),
    "bare": Recover(kind="section_force", method="displacement"),
    "feel": Recover(kind="acceleration", group="tip"),
    "move": Recover(kind="displacement", group="tip"),
}
MODES = 10


@pytest.fixture(scope="module")
def made():
    """A beam over two spans, whose tip is free: constraint modes and truncation vectors are there too."""
    mesh = beam_mesh(8, LENGTH)
    ends = {
        "root": mp.Interface(group="root", kind="node"),
        "middle": mp.Interface(near=(LENGTH / 2, 0, 0), kind="node"),
        "tip": mp.Interface(group="tip", kind="node", boundary="free"),
    }
    model = mp.assemble(mesh, {"beam": SECTION}, ends)
    return model, mp.fe.model_recovery(model, mesh, WANTED)


def body_of(made, reduction):
    return mp.flexible_body(made[0], reduction, name="b", recovery=made[1], second_order_mass=False)


METHODS = {
    "craig_bampton": lambda made, keep: mp.craig_bampton(made[0], modes=MODES, keep=keep, recovery=made[1]),
    "no truncation vectors": lambda made, keep: mp.craig_bampton(
        made[0], modes=MODES, keep=keep, truncation=(), recovery=made[1]
    ),
    "free_interface": lambda made, keep: free_interface(made[0], modes=MODES, keep=keep, recovery=made[1]),
}


@pytest.mark.parametrize("method", METHODS)
def test_the_errors_are_those_of_bodies_with_the_first_modes(made, method):
    """Reduced anew with modes 1 to k, their own truncation vectors or residual modes, by `harmonic_response`."""
    reduction = METHODS[method](made, "all")
    whole = body_of(made, reduction)
    found = recovery_convergence(whole, reduction.spans, UP_TO)
    assert found.count[[0, -1]].tolist() == [0, MODES]
    assert found.recoveries == tuple(WANTED)
    assert np.all(found.error[:, -1] == 0)
    f = module.harmonic_frequencies(whole.K, Asked("", body_loads(whole), np.ones_like, 0.0, UP_TO, module.DAMPING))
    full = figures(whole, f)
    for k in (1, 3):
        some = figures(body_of(made, METHODS[method](made, list(range(1, found.count[k] + 1)))), f)
        for i, name in enumerate(WANTED):
            worst = difference(some, full, np.array(whole.recovery[name].units), name)
            assert found.error[i, k] == pytest.approx(worst, rel=1e-5, abs=1e-8), (name, k)


def figures(body, f):
    """Peaks and root mean squares of each channel under unit loads of 1 N (1 N m per metre of the body's size)."""
    size = float(np.ptp(body.points, axis=0).max())
    inputs = {f"base.{d}": 1 / (body.m * (1 if k < 3 else size)) for k, d in enumerate(DIRECTIONS)}
    inputs |= {f"{at}.{d}": 1.0 if k < 3 else size for at in body.interface_name[1:] for k, d in enumerate(DIRECTIONS)}
    found = []
    for key, value in inputs.items():
        one = harmonic_response(body, {key: value}, f, damping=module.DAMPING, refine=False)
        power = {name: np.abs(one[name]) ** 2 for name in one.names}
        found.append({name: (np.sqrt(x.max()), np.sqrt(np.trapezoid(x, f))) for name, x in power.items()})
    return {name: np.array([each[name] for each in found]) for name in found[0]}


def difference(some, full, units, name):
    names = [x for x in full if x.startswith(f"{name}.")]
    every = np.tile(units, len(names) // len(units)) if len(units) < len(names) else units
    worst = 0.0
    for unit in set(units):
        own = [x for x, u in zip(names, every, strict=True) if u == unit]
        for kind in (0, 1):
            size = max(full[x][:, kind].max() for x in own)
            off = max(np.abs(some[x] - full[x])[:, kind].max() for x in own)
            worst = max(worst, off / size if size else 0.0)
    return worst


def test_errors_are_relative_to_the_load_that_matters(made):
    """A thousandth of a load across another counts for a thousandth: errors are those of the larger one alone."""
    reduction = METHODS["craig_bampton"](made, "all")
    body = body_of(made, reduction)
    columns = body_loads(body)[:, [1, 2]] * [1.0, 1e-3]
    both, one = (
        recovery_convergence(body, reduction.spans, asked=[Asked("sine", x, np.ones_like, 1.0, UP_TO, 0.02)])
        for x in (columns, columns[:, :1])
    )
    i = list(WANTED).index("beam")
    assert both.loads == ("sine",)
    assert both.error[i] == pytest.approx(one.error[i], abs=2e-3)
    assert np.all(np.diff(both.error[i]) < 0.05)


def test_large_recoveries_are_followed_at_some_of_their_places(made, monkeypatch):
    monkeypatch.setattr(module, "ROWS", 24)
    reduction = METHODS["craig_bampton"](made, "all")
    found = recovery_convergence(body_of(made, reduction), reduction.spans, None)
    assert found.share.tolist() == [4 / 16, 4 / 16, 1.0, 1.0]
    assert found.up_to == pytest.approx(reduction.spans.frequency[-1] / 2)


def test_there_is_none_without_recoveries_or_modes(made):
    reduction = METHODS["craig_bampton"](made, "all")
    assert recovery_convergence(body_of(made, reduction).with_(recovery={}), reduction.spans, None) is None
    assert recovery_convergence(body_of(made, reduction), None, None) is None
    assert mp.reduction.free_interface(made[0], modes=3).spans is None


def test_many_numbers_of_modes_are_halved():
    """Up to eight modes all numbers; of more none, all, three quarters, halves of halves."""
    assert module.counts(8) == list(range(9))
    assert module.counts(9) == [0, 1, 2, 4, 7, 9]
