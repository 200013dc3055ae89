"""The work of preparing a run grows with the number of bodies, not with its square; what is packed is packed once."""

import sys

import numpy as np
import pytest

import modalprep as mp
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.packing.constraints import pack_constraints
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.results.record import Recorder
from modalprep.multibody.simulate import prepare

LINK = mp.rigid_body(
    "link", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3),
    interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])},
)  # fmt: skip


class Name(str):
    """A name whose comparisons are steps of Python, so that a search of a list of names counts as what it costs."""

    __hash__ = str.__hash__

    def __eq__(self, other):
        return str.__eq__(self, other)


def chain(count, springs=False, closed=False):
    """Links in a row, with each tip on a plane; or each on the ground, with a spring to it.

    A spring acts on all links between it and the ground: in a row, these are as many as the square of the links.
    """
    names = [Name(f"l{i}") for i in range(count)]
    parents = ["ground"] * count if springs else ["ground", *(f"{name}.tip" for name in names[:-1])]
    joints = [
        mp.Joint(name=Name(f"j{name}"), type="revolute", parent=parent, child=name)
        for name, parent in zip(names, parents, strict=True)
    ]
    loads = [
        mp.multibody.RotationalSpring(name=Name(f"s{name}"), between=("ground", f"{name}.tip"), stiffness=1.0)
        for name in names * springs
    ]
    planes = [
        mp.multibody.Closure(name=Name(f"c{name}"), type="point_on_plane", a="ground", b=f"{name}.tip")
        for name in names * closed
    ]
    return mp.System(bodies=dict.fromkeys(names, LINK), joints=joints, loads=tuple(loads), closures=tuple(planes))


def steps_of_python(work):
    """Count the lines of Python that `work` runs."""
    count = 0

    def traced(frame, event, argument):
        nonlocal count
        count += 1
        return traced

    before = sys.gettrace()
    sys.settrace(traced)
    try:
        work()
    finally:
        sys.settrace(before)
    return count


def prepared(**options):
    """Return ``count -> work``: build a chain, prepare its run, make its result and a table of that."""

    def work(count):
        system = chain(count, **options)
        integration = prepare(system, np.array([0.0, 1.0]), method="explicit", rtol=1e-5, atol=1e-10)
        recorder = Recorder(integration, 2)
        recorder.rows[:], recorder.count = 0.0, 2
        recorder.result("done", "", {}).table()

    return work


def evaluated(count):
    Evaluator(chain(count))


def closed(count):
    system = chain(count, closed=True)
    closing = pack_constraints(system, pack(system), 1.0)
    assert sum(len(closing.of(k)) for k in range(count)) == count


@pytest.mark.parametrize("work", [prepared(), prepared(springs=True), evaluated, closed],
                         ids=["run", "springs", "evaluator", "closures"])  # fmt: skip
def test_work_grows_with_the_bodies(work):
    """Of each further link it is the same; a search of all names for each link would cost 100 steps more."""
    work(3)  # what is made once in a process
    few, some, many = (steps_of_python(lambda count=count: work(count)) for count in (100, 200, 300))
    assert many - some < 1.02 * (some - few) + 100  # sorting, and growing lists


def test_a_system_is_packed_once():
    """Runs and analyses of the same system share its constants; a changed system has its own."""
    system = chain(2)
    assert pack(system) is pack(system) is Evaluator(system).packed
    assert pack(system.with_(gravity=np.ones(3))) is not pack(system)
