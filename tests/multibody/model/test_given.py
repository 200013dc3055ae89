"""Fields that users give as one type and that records keep as another: converted once, refused with their name."""

from dataclasses import dataclass

import numpy as np
import pytest

import modalprep as mp
from modalprep.records import CHANGED, Record, given


def joint(**options):
    return mp.Joint(**{"name": "a", "type": "revolute", "parent": "ground", "child": "b"} | options)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"axis": [1, 0]}, r"joint 'a': axis \[1.0, 0.0\] is not three numbers"),
        ({"axis": "x"}, "joint 'a': axis 'x' has no numbers"),
        ({"velocity": [1, 0], "type": "free"}, r"velocity \[1.0, 0.0\] must be 3 number"),
    ],
)
def test_what_is_no_vector_is_refused(options, said):
    with pytest.raises(mp.InputError, match=said):
        joint(**options)


def test_gravity_in_words_is_refused():
    with pytest.raises(mp.InputError, match="gravity 'down' has no numbers"):
        mp.System(bodies={}, joints=(), gravity="down")


def test_each_field_is_converted_once():
    """When a record is made, and of a copy only the fields that differ: ensembles make thousands of copies."""
    converted = []

    def noted(value, what=""):
        converted.append(what)
        return np.asarray(value, dtype=float)

    @dataclass(frozen=True, eq=False, kw_only=True)
    class Two(Record):
        a: np.ndarray = given(converter=noted, default=(0.0,))
        b: np.ndarray = given(converter=noted, default=(0.0,))

        def __post_init__(self):
            self._convert("two: ")
            super().__post_init__()

    two = Two(a=[1])
    assert converted == ["two: a", "two: b"]
    other = two.with_(b=[2])
    assert converted[2:] == ["two: b"]
    assert (other.a.tolist(), other.b.tolist(), other.b.flags.writeable) == ([1], [2], False)
    assert CHANGED not in vars(two) | vars(other)
    with pytest.raises(TypeError):
        two.with_(c=1)
