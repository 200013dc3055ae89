"""Convergence of recoveries in the coordinates of a body, against bodies that have the first modes alone."""

import numpy as np
import pytest
from reduction.recoveries.test_error import LENGTH, SECTION, UP_TO, harmonic, unit_loads

import modalprep as mp
from modalprep.examples import beam_mesh
from modalprep.reduction.free_interface_basis import free_interface
from modalprep.reduction.recoveries import convergence as module
from modalprep.reduction.recoveries.convergence import recovery_convergence

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
    """Reduced anew with modes 1 to k, their own truncation vectors or residual modes, and their own recoveries."""
    reduction = METHODS[method](made, "all")
    whole = body_of(made, reduction)
    found = recovery_convergence(whole, reduction.spans, UP_TO)
    assert found.count[[0, -1]].tolist() == [0, MODES]
    assert found.recoveries == tuple(WANTED)
    assert np.all(found.error[:, -1] == 0)
    omega = module.harmonic_frequencies(whole.K, 2 * np.pi * UP_TO)
    for k in (1, 3):
        some = body_of(made, METHODS[method](made, list(range(1, found.count[k] + 1))))
        for i, name in enumerate(WANTED):
            worst = max(difference(some, whole, name, w, made[0].rigid.m) for w in omega)
            assert found.error[i, k] == pytest.approx(worst, rel=1e-5, abs=1e-8), (name, k)


def difference(some, whole, name, w, m):
    units = np.array(whole.recovery[name].units)
    values = [(harmonic(some, *load, w)[name], harmonic(whole, *load, w)[name]) for load in loads_of(whole, m)]
    found = 0.0
    for unit in set(units):
        off = np.array([np.abs(a - b)[:, units == unit].max() for a, b in values])
        size = np.array([np.abs(b)[:, units == unit].max() for _, b in values])
        real = size > 1e-2 * size.max()
        found = max(found, np.max(off[real] / size[real], initial=0.0))
    return found


def loads_of(body, m):
    """The unit loads of `test_error` on each interface but the root."""
    for k, (drives, loads) in enumerate(unit_loads(m)):
        for at in range(1, len(body.phi)) if k >= 6 else (1,):
            own = np.zeros((1, len(body.phi), 6))
            own[0, at] = loads[0, 1]
            yield drives, own


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
