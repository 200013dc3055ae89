"""The work of preparing a run grows with the number of bodies, not with its square; what is packed is packed once."""

import gc
import sys
import threading
import weakref
from dataclasses import fields
from typing import NamedTuple

import numpy as np
import pytest

import modalprep as mp
from modalprep.compiler.by_address import Addressed, by_address
from modalprep.examples import uniform_beam
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.packing.constraints import pack_constraints
from modalprep.multibody.packing.packed import MOST_PATTERNS
from modalprep.multibody.packing.tree import PACKED, pack, pack_changed
from modalprep.multibody.preparation import prepare
from modalprep.multibody.results.record import Recorder

LINK = mp.rigid_body(
    "link", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3),
    interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])},
)  # fmt: skip
HALF = LINK.with_(m=LINK.m / 2, s0=LINK.s0 / 2, E0=LINK.E0 / 2)


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
    """Of each further link it is the same; a search of all names for each link would cost 50 steps more."""
    work(3)  # what is made once in a process
    few, some, many = (steps_of_python(lambda count=count: work(count)) for count in (50, 100, 150))
    assert many - some < 1.02 * (some - few) + 100  # sorting, and growing lists


def test_a_system_is_packed_once():
    """Runs and analyses of the same system share its constants; a changed system has its own."""
    system = chain(2)
    assert pack(system) is pack(system) is Evaluator(system).packed
    assert pack(system.with_(gravity=np.ones(3))) is not pack(system)


def numbers(value):
    """Return all numbers of records of arrays, and where each stands."""
    if isinstance(value, Addressed):
        return [each for name, inner in zip(value._fields, value, strict=True) for each in (name, *numbers(inner))]
    return [(value.shape, value.tobytes()) if isinstance(value, np.ndarray) else value]


def everything(system, packed):
    """Return what runs read of a packed system."""
    cached = packed.softest, packed.flexible, packed.linear.tolist(), packed.types.tolist(), packed.columns
    joints, bodies = [joint.name for joint in system.joints], list(system.bodies)
    places = [packed.places_of(name) for name in joints], [packed.link_of(name) for name in bodies]
    loads, loops = numbers(Loading(system, packed, 1.0).arrays), Loading(system, packed, 1.0).loops
    links = [(id(joint), hinge, body) for joint, hinge, body in packed.links]
    return (numbers(packed.model), numbers(packed.data()), packed.nu, packed.depleting, cached, links, places, loads,
            numbers(loops.arrays) if loops else None)  # fmt: skip


PLANE = mp.multibody.Closure(name="plane", type="point_on_plane", a="ground", b="link.tip")


def screw():
    """A flexible arm on a screw, whose tip carries a link by a planar joint, and a rod that nothing holds."""
    joints = (
        mp.Joint(name="screw", type="screw", parent="ground", child="arm", pitch=0.1, axis=[0, 0.6, 0.8]),
        mp.Joint(name="slab", type="planar", parent="arm.tip", child="link"),
        mp.Joint(name="foot", type="free", parent="ground", child="rod"),
    )
    return mp.System(bodies={"arm": uniform_beam(modes=2), "link": LINK, "rod": LINK}, joints=joints, closures=(PLANE,))


TURN = np.array([[0, -1.0, 0], [1.0, 0, 0], [0, 0, 1.0]])
OTHER = {  # by field of a joint: changes of the three joints
    "name": [{"name": "bolt"}], "type": [{}, {"type": "gimbal"}], "parent": [{}, {"parent": "rod.tip"}],
    "child": [{"child": "rod"}, {}, {"child": "arm"}], "axis": [{"axis": [0, 0.8, 0.6]}],
    "second_axis": [{}, {"second_axis": [0, 1.0, 0]}], "pitch": [{"pitch": 0.2}],
    "position": [{"position": [1.0, 0, 0]}], "rotation": [{"rotation": TURN}],
    "angle": [{"angle": 0.3}], "rate": [{"rate": 0.4}],
    "displacement": [{}, {"displacement": [0.5, 0.6]}], "speed": [{}, {"speed": [0.7, 0.8]}],
    "velocity": [{}, {}, {"velocity": np.ones(3)}], "angular_velocity": [{}, {}, {"angular_velocity": np.ones(3)}],
    "motion": [{"motion": "sin(t)"}], "elements": [{"elements": mp.multibody.HingeElement(stiffness=3.0)}],
    "keep_start": [{"keep_start": True}], "range": [{"range": (-1.0, 1.0)}],
}  # fmt: skip


@pytest.mark.parametrize("name", [field.name for field in fields(mp.Joint)])
def test_a_changed_joint_is_packed_as_anew(name):
    """By whatever field it differs: what is taken over of the system before is the same as what would be made."""
    system = screw()
    everything(system, pack(system))  # keeps all that can be kept
    changes = [*OTHER[name], {}, {}][:3]
    changed = system.with_(joints=tuple(map(lambda joint, own: joint.with_(**own), system.joints, changes)))
    found = everything(changed, pack_changed(changed, system))
    del PACKED[changed]
    assert found == everything(changed, pack(changed))


OTHER_SYSTEM = {
    "bodies": {"arm": uniform_beam(modes=3), "link": LINK, "rod": LINK}, "gravity": np.array([1.0, 2.0, 3.0]),
    "orbit": mp.multibody.Orbit(rate=1e-3),
    "loads": (mp.PointForce(name="push", at="link.tip", force=(1.0, 0, 0)),),
    "depletions": (mp.multibody.Depletion(name="tank", body="link", mass="1 - 0.1*t", levels=(HALF,)),),
    "closures": (PLANE.with_(axis=[0, 1.0, 0]),),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHER_SYSTEM)
def test_a_changed_system_is_packed_as_anew(name):
    system = screw()
    everything(system, pack(system))
    changed = system.with_(**{name: OTHER_SYSTEM[name]})
    found = everything(changed, pack_changed(changed, system))
    del PACKED[changed]
    assert found == everything(changed, pack(changed))


def test_other_starts_share_the_model():
    """Also in another field of gravity, all but that; an axis that cannot be normalised twice alike stays as it is."""
    system = screw()
    joint = system.joints[0].with_(angle=0.3, rate=0.1)
    assert joint.axis is system.joints[0].axis
    changed = system.with_(joints=(joint, *system.joints[1:]))
    assert pack_changed(changed, system).model is pack(system).model
    heavy = changed.with_(gravity=np.ones(3))
    assert pack_changed(heavy, system).model.links is pack(system).model.links


def test_other_starts_are_checked():
    """As those of a new joint are; all else is that of the joint before."""
    one, two, three = screw().joints
    with pytest.raises(mp.InputError, match=r"displacement \[1.0, 2.0, 3.0\] must be 2 number"):
        two.with_(displacement=[1.0, 2.0, 3.0])
    with pytest.raises(mp.InputError, match="a screw joint has no speed"):
        one.with_(speed=1.0)
    moved = two.with_(displacement=np.array([1.0, 2.0]))
    assert not moved.displacement.flags.writeable
    changed = screw().with_(joints=(one, moved, three))
    assert changed.carrier("link") is moved
    with pytest.raises(mp.InputError, match="body 'arm' is the child of 2 joints"):
        changed.with_(joints=(one, moved, three.with_(child="arm")))
    with pytest.raises(mp.InputError, match="body 'rod' is the child of 0 joints"):
        changed.with_(joints=(one, moved))


def test_changed_systems_do_not_stay():
    """What they share holds none of them, and does not grow: each of these springs has its own rows."""
    system, made = screw(), []
    for k in range(MOST_PATTERNS + 10):
        spring = mp.multibody.AxialSpring(name="stay", between=("ground", "link.tip"), stiffness=1.0 + k)
        changed = system.with_(loads=(spring,)).with_(joints=system.joints)
        pack_changed(changed, system)
        Recorder(prepare(changed, np.array([0.0, 1.0]), method="explicit", rtol=1.0, atol=1.0), 2)
        made.append(weakref.ref(changed))
    del changed
    gc.collect()
    assert [ref() for ref in made] == [None] * len(made)
    assert 10 <= len(pack(system).patterns) <= MOST_PATTERNS


@by_address
class Inner(NamedTuple):
    x: np.ndarray


@by_address
class Outer(NamedTuple):
    inner: Inner


def test_threads_that_need_one_record_for_another_do_not_wait_for_each_other():
    """With the locks of `functools.cached_property`, which all records share, they do within the first hundreds."""

    def find(whole):
        for _ in range(5000):
            record = Outer(Inner(np.zeros(3)))
            assert (record if whole else record.inner).__index__() > 0

    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    threads = [threading.Thread(target=find, args=(whole,), daemon=True) for whole in (True, False)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    sys.setswitchinterval(before)
    assert not any(thread.is_alive() for thread in threads)
