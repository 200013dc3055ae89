"""A system at other values of its parameters, and the parameters there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from modalprep.multibody.model.system import System
from modalprep.sensitivity.parameters import Parameter, changed


def moved(system: System, parameters: Sequence[Parameter], values: np.ndarray) -> tuple[System, list[Parameter]]:
    """Return a system with other values of parameters, and the parameters at these values.

    They change the system that was given first, as factors do.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.sensitivity.parameters import find
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> there, (own,) = moved(arm, find(arm, ["hinge.angle"]), np.array([0.5]))
    >>> there.joints[0].angle, own.value, own.change(there, 0.6).joints[0].angle
    (0.5, 0.5, 0.6)
    """

    def along(k: int) -> Callable[[System, float], System]:
        def change(_: System, value: float) -> System:
            beside = [*map(float, values)]
            beside[k] = value
            return changed(system, parameters, beside)

        return change

    own = [replace(each, value=float(values[k]), change=along(k)) for k, each in enumerate(parameters)]
    return changed(system, parameters, values.tolist()), own
