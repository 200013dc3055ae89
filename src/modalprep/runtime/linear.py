"""Linear equations as an FMU has them."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator, Mapping

import numpy as np

from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.runtime.model import CHANNELS, GIVEN, HEAD, RATES, STATES, TOKEN, Model, Variable, unique
from modalprep.runtime.units import OF_PART, RATE_OF
from modalprep.suggest import refuse_unknown

MAGIC = b"MPLINEAR"
LINEAR = "linear"  # kind of the library


def linear_model(linear: LinearSystem, t_end: float, step: float, start: Mapping[str, float]) -> Model:
    """Return linear equations as the C part reads them; `start` has values of states and inputs by their names.

    Raises
    ------
    InputError
        When a name is unknown or stands twice.
    """
    names = [*linear.states, *linear.inputs]
    for name in start:
        refuse_unknown(name, names, "start value")
    begin = np.array([float(start.get(name, 0.0)) for name in names])
    sizes = {"states": len(linear.states), "inputs": len(linear.inputs), "width": len(linear.outputs)}
    head = struct.pack(f"<{len(HEAD)}q", *(sizes.get(name, 0) for name in HEAD))
    arrays = (begin, np.ones(len(linear.states)), linear.A, linear.B, linear.C, linear.D)
    body = head + b"".join(np.ascontiguousarray(each, dtype=float).tobytes() for each in arrays)
    token = hashlib.sha256(MAGIC + body).hexdigest()[:32]
    content = MAGIC + token.encode().ljust(TOKEN, b"\0") + body
    variables = unique([*_variables(linear, begin)])
    run = 0.0, t_end, step, 1e-6, "exponential"
    return Model(LINEAR, token, content, variables, *run, linear.notes, differentiable=True)


def _variables(linear: LinearSystem, start: np.ndarray) -> Iterator[Variable]:
    n = len(linear.states)
    for k, name in enumerate(linear.inputs):
        yield Variable(name, GIVEN + k, "input", "", f"input {name}", float(start[n + k]))
    for k, name in enumerate(linear.states):
        yield Variable(name, STATES + k, "state", _unit(name), f"change of {name}", float(start[k]))
    for k, name in enumerate(linear.states):
        unit = RATE_OF.get(_unit(name), "")
        yield Variable(f"der({name})", RATES + k, "local", unit, f"rate of {name}", derivative=STATES + k)
    for k, name in enumerate(linear.outputs):
        if not _is_state(linear, k):
            yield Variable(name, CHANNELS + k, "output", _unit(name), f"change of {name}")


def _is_state(linear: LinearSystem, k: int) -> bool:
    """Whether an output is the state of the same name."""
    wanted = [float(name == linear.outputs[k]) for name in linear.states]
    return any(wanted) and not np.any(linear.D[k]) and np.array_equal(linear.C[k], wanted)


def _unit(name: str) -> str:
    parts = [part for part in name.split(".") if not part.isdigit() and part not in "xyz"]
    return OF_PART.get(parts[-1], "")
