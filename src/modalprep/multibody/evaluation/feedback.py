"""Control laws as expressions of the time and of channels."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.evaluation.expressions import channel_expression
from modalprep.multibody.evaluation.state import State
from modalprep.multibody.model.loads import Callback


def feedback(
    name: str, at: str, values: Sequence[str | float], axes: Literal["inertial", "body"] = "inertial"
) -> Callback:
    """Return a load whose components are expressions of ``t`` and of channels as in `Event`.

    Parameters
    ----------
    at : str
        ``body.interface``, whose three values are a force (N), six a force and a torque (N m); or a joint, with a value
        for each of its speeds (N or N m, travels before turns).
    axes : {"inertial", "body"}
        Of values on an interface; body axes turn with it.

    Returns
    -------
    Callback
        One of the `loads` of a system.

    Raises
    ------
    InputError
        When a run begins: an expression cannot be read, or names no channel.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.simulate import simulate
    >>> from modalprep.multibody.model.system import System
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", angle=0.1)
    >>> law = feedback("law", "hinge", ["-4e3*hinge.angle - 4e3*hinge.rate"])
    >>> run = simulate(System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,), loads=(law,)), t_end=2.0)
    >>> bool(run["hinge.angle"][-1] < 0.08)
    True
    """
    if axes not in ("inertial", "body"):
        raise InputError(f"control {name!r}: axes {axes!r} is neither 'inertial' nor 'body'")
    if axes == "body" and len(values) not in (3, 6):
        raise InputError(f"control {name!r}: body axes need a force (3), or a force and a torque (6) on an interface")
    known: dict = {}

    def function(t: float, state: State) -> dict[str, np.ndarray]:
        if known.get("packed") is not state.packed:  # the first call of a run
            laws = [channel_expression(state.system, state.packed, str(value), f"control {name!r}") for value in values]
            known.update(packed=state.packed, laws=laws)
        components = np.array([law(t, state) for law in known["laws"]])
        if axes == "body":
            components = (components.reshape(-1, 3) @ state[at].rotation.T).ravel()
        return {at: components}

    return Callback(name=name, function=function, laws=tuple(map(str, values)))
