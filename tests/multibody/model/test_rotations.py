"""One rotation said in three ways, in Python and in files."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import modalprep as mp
from modalprep.multibody import Bushing, Closure
from modalprep.pipeline.schema.reduction import RotationTable, rotation_matrix
from modalprep.vectors import as_rotation

AXIS, ANGLE = np.array([1.0, -2.0, 2.0]), 0.7
TURN = Rotation.from_rotvec(ANGLE * AXIS / 3)  # the axis has length 3
WAYS = {
    "matrix": TURN.as_matrix(),
    "rows": TURN.as_matrix().tolist(),
    "quaternion": TURN.as_quat(scalar_first=True),
    "axis and angle": (AXIS, ANGLE),
    "lists": [AXIS.tolist(), ANGLE],
}


@pytest.mark.parametrize("way", WAYS)
def test_the_ways_are_one_rotation(way):
    """Rodrigues' formula: the axis stays, what is across it turns by the angle."""
    R, e = as_rotation(WAYS[way], "it"), AXIS / 3
    across = np.cross(e, [0, 0, 1.0])
    np.testing.assert_allclose(R @ e, e, atol=1e-15)
    np.testing.assert_allclose(R @ across, np.cos(ANGLE) * across + np.sin(ANGLE) * np.cross(e, across), atol=1e-15)


@pytest.mark.parametrize("way", WAYS)
def test_records_take_them_all(way):
    records = {
        "joint": mp.Joint(name="j", type="weld", parent="ground", child="b", rotation=WAYS[way]).rotation,
        "closure": Closure(name="c", type="weld", a="a.x", b="b.x", rotation=WAYS[way]).rotation,
        "bushing": Bushing(name="m", between=("ground", "b.x"), stiffness=[1.0] * 6, rotation=WAYS[way]).rotation,
        "rest": Bushing(
            name="m", between=("ground", "b.x"), stiffness=[1.0] * 6, free_rotation=WAYS[way]
        ).free_rotation,
    }
    for name, found in records.items():
        np.testing.assert_allclose(found, TURN.as_matrix(), atol=1e-15, err_msg=name)


@pytest.mark.parametrize(
    "table",
    [
        {"axis": AXIS.tolist(), "angle": ANGLE},
        {"axis": AXIS.tolist(), "angle": f"{np.degrees(ANGLE)} deg"},
        {"quaternion": TURN.as_quat(scalar_first=True).tolist()},
        {"matrix": TURN.as_matrix().tolist()},
    ],
)
def test_files_say_the_same(table):
    np.testing.assert_allclose(rotation_matrix(RotationTable.model_validate(table)), TURN.as_matrix(), atol=1e-14)


@pytest.mark.parametrize(
    "table",
    [
        {"axis": [0, 0, 1]},
        {},
        {"quaternion": [1, 0, 0, 0], "angle": 1.0},
        {"axis": [1, 0, 0], "angle": 1, "matrix": np.eye(3).tolist()},
    ],
)
def test_files_say_it_once(table):
    with pytest.raises(ValueError, match="either 'axis' and 'angle', 'quaternion', or 'matrix'"):
        RotationTable.model_validate(table)


@pytest.mark.parametrize(
    "value", [np.diag([1.0, 1.0, -1.0]), 2 * np.eye(3), [1.0, 1.0, 0, 0], np.zeros(4), np.eye(2), "x", None, 1.0]
)
def test_what_is_no_rotation_is_refused(value):
    with pytest.raises(mp.InputError, match="joint 'j': rotation is no rotation: give an orthonormal matrix"):
        mp.Joint(name="j", type="weld", parent="ground", child="b", rotation=value)


def test_an_axis_needs_a_direction():
    with pytest.raises(mp.InputError, match=r"axis \[0.0, 0.0, 0.0\] with angle 1.0 has no direction"):
        as_rotation((np.zeros(3), 1.0), "it")
