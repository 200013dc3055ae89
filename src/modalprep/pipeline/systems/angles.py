"""Warnings of angles in radians that were probably meant in degrees."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import numpy as np

from modalprep.multibody.model.joint_types import ROTATIONS, TRANSLATIONS
from modalprep.pipeline.schema.base import Table
from modalprep.pipeline.schema.pipeline import OF_A_SYSTEM, Pipeline
from modalprep.pipeline.schema.system import HingeTable

ANGLES = ("angle", "free_angle", "tilt", "longitude", "inclination", "argument_of_latitude")
OF_A_HINGE = ("lower", "upper", "free_position")  # angles of a joint that has rotations alone


def implausible_angles(pipeline: Pipeline) -> tuple[str, ...]:
    """Return a note for each angle beyond a turn that is a multiple of 0.5; one note for equal angles.

    Examples
    --------
    >>> file = {"joints": {"hinge": {"type": "revolute", "child": "arm", "start": {"angle": 90}}}}
    >>> implausible_angles(Pipeline.model_validate(file | {"simulation": {"t_end": 1.0}}))
    ("the angle of [joints.hinge.start], 90 rad, is implausible: did you mean '90 deg'?",)
    """
    notes: dict[tuple[str, float], str] = {}
    for name in OF_A_SYSTEM:
        for where, key, value in _angles(getattr(pipeline, name), name, ANGLES):
            if abs(value) > 2 * math.pi and (2 * value).is_integer():
                note = f"the {key} of [{where}], {value:g} rad, is implausible: did you mean '{value:g} deg'?"
                notes.setdefault((key, value), note)
    return tuple(notes.values())


def _angles(value: Any, where: str, keys: tuple[str, ...]) -> Iterator[tuple[str, str, float]]:
    """Yield table, key and number of each angle that is given."""
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _angles(inner, f"{where}.{name}", keys)
    elif isinstance(value, list):
        for inner in value:
            yield from _angles(inner, where, keys)
    elif isinstance(value, Table):
        turns = isinstance(value, HingeTable) and value.type in ROTATIONS and value.type not in TRANSLATIONS
        for key in value.model_fields_set:
            own = keys + OF_A_HINGE * turns
            inner = getattr(value, key)
            if key in own and np.asarray(inner).dtype.kind == "f":
                yield from ((where, key, number) for number in np.ravel(inner).tolist())
            else:
                yield from _angles(inner, f"{where}.{key}", own)
