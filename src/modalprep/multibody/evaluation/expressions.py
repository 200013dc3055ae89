"""Expressions of time and of what moves in a running system: for events and control laws."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from itertools import chain
from typing import Any

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.elements.bushing import rotation_vector
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.evaluation.stresses import stress_reader
from modalprep.multibody.model.functions.safe_expression import read_expression
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.coordinate_names import numbered, words_of
from modalprep.multibody.packing.packed import Packed
from modalprep.suggest import find_interface, suggestion

CHANNEL = re.compile(r"[^\W\d]\w*(?:\.\w+)+")
AXES = {"x": 0, "y": 1, "z": 2}
PARTS = ("position", "rotation", "velocity", "angular_velocity")
MODES = ("modal", "modal_rate")
POSITION, RATE = 0, 2  # of `Words`
KNOWN = (
    "<joint>.angle, .rate, .displacement, .speed or .angular_velocity (.angle.2 the second), "
    "<body>.<interface>.position.x, .rotation.x, .velocity.x or .angular_velocity.x, <body>.modal.<number>, "
    ".modal_rate.<number>, .stress.<point>.<component>, of an event also "
    "<closure>.gap or .multiplier, <body>.recovery.<name>.<place>.<component>"
)
Others = Callable[[str, str], Callable[[State], float] | None]


def channel_expression(
    system: System, packed: Packed, text: str, what: str, loops: Loops | None = None, others: Others | None = None
) -> Callable[[float, State], float]:
    """Return ``(t, state) -> value`` of an expression of channels and ``t``, for states of the packed system.

    Channels: ``<joint>.angle``, ``.rate``, ``.displacement``, ``.speed``, ``.angle.2`` the second, of a spherical or
    free joint also ``.quaternion.1`` and ``.angular_velocity.1`` (axes of the child);
    ``<body>.<interface>.position.x``, ``.velocity.x``, ``.angular_velocity.x`` and ``.rotation.x``, the rotation
    vector (rad, below pi), inertial axes; ``<body>.modal.<number>``, ``.modal_rate.<number>``,
    ``<body>.stress.<point>.<component>`` (Pa), also its ``.von_mises``. With `loops`, whose work belongs to the state:
    ``<closure>.gap`` (m, rad) and
    ``<closure>.multiplier`` (N, N m; positive where it pushes b along the axis, or the ends apart) of closures with
    one condition, active or not. With `others`, ``(name, what) -> reader or None``, the channels that it knows.

    Raises
    ------
    InputError
        When the expression cannot be read or names no channel; `what` begins the sentence.
    """
    value, known, numbers = read_channels(system, packed, text, what, loops, others)
    compiled = compile_expressions(known, [value])
    return lambda t, state: float(compiled(numbers(t, state))[0])


def read_channels(
    system: System, packed: Packed, text: str, what: str, loops: Loops | None = None, others: Others | None = None
) -> tuple[Any, tuple[str, ...], Callable[[float, State], np.ndarray]]:
    """Return the expression of `channel_expression` as symengine's, its symbols, ``(t, state) -> their values``."""
    names = list(dict.fromkeys(CHANNEL.findall(text)))
    readers = [(others and others(name, what)) or _reader(system, packed, name, what, loops) for name in names]
    symbols = {name: f"channel_{k}" for k, name in enumerate(names)}
    known = ("t", *symbols.values())
    value = read_expression(CHANNEL.sub(lambda match: symbols[match[0]], text), f"{what}: {text[:60]!r}", known)
    return value, known, lambda t, state: np.array([t, *(read(state) for read in readers)])


def compile_expressions(known: Sequence[str], values: Sequence[Any]) -> Callable[[np.ndarray], np.ndarray]:
    """Return ``numbers -> values`` of symengine's expressions of the `known` symbols."""
    import symengine

    return symengine.Lambdify([symengine.Symbol(name) for name in known], values)


def _reader(system: System, packed: Packed, name: str, what: str, loops: Loops | None) -> Callable[[State], float]:
    """Return ``state -> value`` of a channel."""
    owner, _, part = name.partition(".")
    joint = next((j for j in system.joints if j.name == owner), None)
    found = None if joint is None else _joint_reader(packed, joint, part)
    if found is None and owner in system.bodies:
        found = _body_reader(system, owner, part, what)
    closures = [closure.name for closure in system.closures] if loops else []
    if found is None and loops and owner in closures:
        found = _closure_reader(loops, closures.index(owner), part, what)
    if found is None:
        known = suggestion(owner, [*(j.name for j in system.joints), *system.bodies, *closures], "known are")
        raise InputError(f"{what}: no channel {name!r}; give {KNOWN}; {known}")
    return found


def _joint_reader(packed: Packed, joint: Joint, part: str) -> Callable[[State], float] | None:
    words = [words_of(packed, link) for link in packed.links_of(joint.name)]
    names = [numbered(chain.from_iterable(each[kind] for each in words)) for kind in (POSITION, RATE)]
    places = dict(zip(chain(*names), chain(*packed.places_of(joint.name)), strict=True))
    place = places.get(part, places.get(part.removesuffix(".1")))
    return None if place is None else lambda state: float(state.value_at(place))


def _body_reader(system: System, body: str, part: str, what: str) -> Callable[[State], float] | None:
    words = part.split(".")
    if len(words) == 2 and words[0] in MODES and words[1].isdigit() and 0 < int(words[1]) <= system.bodies[body].n:
        return lambda state: float(getattr(state, words[0])(body)[int(words[1]) - 1])
    if words[0] == "stress" and (stress := stress_reader(system.bodies[body], part.removeprefix("stress."))):
        return lambda state: stress(state.modal(body))
    if len(words) == 3 and words[1] in PARTS and words[2] in AXES:
        _, k = find_interface(system.bodies, f"{body}.{words[0]}", what)
        axis = AXES[words[2]]
        if words[1] == "rotation":
            return lambda state: rotation_vector(tuple(state.frame(body, k).rotation.ravel().tolist()))[0][axis]
        return lambda state: float(getattr(state.frame(body, k), words[1])[axis])
    return None


def _closure_reader(loops: Loops, number: int, part: str, what: str) -> Callable[[State], float] | None:
    rows = loops.closing.normal(number)
    if part not in ("gap", "multiplier"):
        return None
    if len(rows) != 1:
        name = loops.system.closures[number].name
        raise InputError(f"{what}: closure {name!r} has no {part}, it makes {len(rows)} conditions")
    values = loops.work.phi if part == "gap" else loops.work.multiplier
    return lambda state: float(values[rows[0]])
