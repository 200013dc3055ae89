"""A run that is killed goes on from what was kept of it, by the very steps that it would have taken."""

import numpy as np
import pytest
from size import some

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import Closure, join_runs

GRAVITY = np.array([0, -9.81, 0])
T_END = 0.5


class Killed(Exception):
    """What a power cut is here."""


def pendulum():
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.4)
    return mp.System(bodies={"arm": uniform_beam(modes=3)}, joints=(hinge,), gravity=GRAVITY)


def four_bar():
    """An arm whose tip a rod holds, with a rigid crank."""
    rod = Closure(name="rod", type="distance", a="ground", b="arm.tip", position=(8.0, 4.0, 0))
    return pendulum().with_(closures=(rod,))


def killed(system, count, **options):
    """Return the run so far of one that is killed at a checkpoint."""
    kept = []

    def checkpoint(run):
        kept.append(run)
        if len(kept) == count:
            raise Killed

    with pytest.raises(Killed):
        mp.simulate(system, t_end=T_END, checkpoint=checkpoint, checkpoint_every=1e-9, **options)
    return kept[-1]


@pytest.mark.parametrize("count", some([3, 1], 1))
@pytest.mark.parametrize(
    ("method", "step"), [("explicit", 2e-5), ("rosenbrock", 5e-5), ("generalised_alpha", 5e-5), ("explicit", None)]
)
def test_a_tree_goes_on_bit_for_bit(method, step, count):
    options = {"method": method, "output_step": 0.003, **({"step": step} if step else {"max_step": 2e-5})}
    whole = mp.simulate(pendulum(), t_end=T_END, **options)
    first = killed(pendulum(), count, **options)
    assert first.status == "running"
    assert 0 < first.time[-1] <= first.state.t < T_END
    joined = join_runs(first, mp.simulate(pendulum(), t_end=T_END, start=first, **options))
    assert np.array_equal(joined.time, whole.time)
    for name in ("hinge.angle", "hinge.rate", "arm.modal", "arm.modal_rate", "energy.work"):
        assert np.array_equal(joined[name], whole[name]), name
    assert joined.stats["energy_error"] == pytest.approx(whole.stats["energy_error"], rel=1e-6)
    assert joined.status == "done"


def test_closed_loops_go_on_to_the_tolerance():
    options = {"method": "explicit", "step": 2e-5, "output_step": 0.003}
    whole = mp.simulate(four_bar(), t_end=T_END, **options)
    first = killed(four_bar(), 2, **options)
    joined = join_runs(first, mp.simulate(four_bar(), t_end=T_END, start=first, **options))
    assert joined["arm.modal"] == pytest.approx(whole["arm.modal"], abs=1e-9)
    assert joined["rod.force"] == pytest.approx(whole["rod.force"], rel=1e-6, abs=1e-5)


def test_runs_that_do_not_follow_each_other_are_refused():
    run = mp.simulate(pendulum(), t_end=0.1)
    with pytest.raises(mp.InputError, match="does not start where"):
        join_runs(run, mp.simulate(pendulum(), t_end=0.1))
    with pytest.raises(mp.InputError, match="checkpoint_every = 0"):
        mp.simulate(pendulum(), t_end=0.1, checkpoint=print, checkpoint_every=0.0)
