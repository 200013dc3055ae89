"""Images of records, and the places of the numbers that an importing program may change."""

import numpy as np

import modalprep as mp
from modalprep.examples import small_systems
from modalprep.multibody.evaluation.evaluate import build_equations
from modalprep.multibody.evaluation.loading import Loading
from modalprep.multibody.model.joint_element import HingeElement
from modalprep.multibody.packing.tree import pack
from modalprep.runtime.changes import Change, changes, with_inputs
from modalprep.runtime.image import Image
from modalprep.runtime.kinds import KINDS, example, kind_of
from modalprep.runtime.places import Places


def equations(system):
    packed = pack(system)
    return build_equations(packed, Loading(system, packed, 1.0), packed.data())


def test_an_image_does_not_depend_on_where_records_lie():
    system = small_systems()["flexible bodies in closed loops"]
    one, keep, other = equations(system), np.zeros(1000), equations(system)
    assert Image(one).relocations == Image(other).relocations
    assert np.mean(Image(one).words != Image(other).words) < 0.01  # memory that is written before it is read
    assert keep.size


def test_every_kind_has_equations_of_its_own():
    names = {kind: equations(example(kind))._type.name for kind in KINDS}
    assert len(set(names.values())) == len(KINDS)
    assert all(kind_of(equations(example(kind))) == kind for kind in KINDS)


def hinged():
    motor = HingeElement(stiffness=3.0, damping=2.0, drive=5.0)
    rod = small_systems()["rigid bodies in trees"].bodies["rod"]
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="rod", elements=motor)
    return mp.System(bodies={"rod": rod}, joints=(hinge,), gravity=np.array([0, 0, -9.81]))


def test_places_are_those_of_the_numbers():
    """A number that is put into its places gives the image of the system that has it."""
    system = with_inputs(hinged())
    places = Places(system, 1.0, None)
    for change in changes(system):
        words = Image(equations(system)).words
        found = places.of(change)
        assert found, change.name
        for at, factor, _ in found:
            words[at // 8 :][:1].view(float)[:] = factor * (change.value + 0.7)
        wanted = Image(equations(change.make(system, change.value + 0.7))).words
        assert np.array_equal(words, wanted), change.name


def test_what_is_not_proportional_has_no_places():
    system = with_inputs(hinged())
    squared = Change("k", "", "", 2.0, lambda s, v: changes(s)[-2].make(s, v * v))
    assert Places(system, 1.0, None).of(squared) is None
