"""Colour of a film by a recovered quantity over the mesh."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import BodyMotion
from modalprep.errors import InputError
from modalprep.multibody.results.fields import node_field, on_mesh
from modalprep.multibody.results.recovered import body_motion
from modalprep.multibody.results.result import Result
from modalprep.suggest import suggestion


class RecoveredColour:
    """The values of one recovered component at the nodes of the bodies of a run.

    Parameters
    ----------
    bodies : {name: FlexibleBody}
    result : Result
    colour : str
        ``<recovery>.<component>``, of nodes or of elements, in one body or several.

    Raises
    ------
    InputError
        When no body recovers it over its mesh.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> run = Result(time=np.zeros(1), channels={}, status="done", message="")
    >>> RecoveredColour({"arm": uniform_beam(modes=1)}, run, "skin.von_mises")
    Traceback (most recent call last):
    modalprep.errors.InputError: colour 'skin.von_mises' is not displacement, and no body recovers it over its mesh; \
there are no recoveries
    """

    def __init__(self, bodies: Mapping[str, FlexibleBody], result: Result, colour: str) -> None:
        self.name, _, self.component = colour.rpartition(".")
        known = {
            f"{key}.{component}": unit
            for body in bodies.values()
            for key, block in body.recovery.items()
            if on_mesh(block)
            for component, unit in zip(block.full_components, block.full_units, strict=True)
        }
        if colour not in known:
            there = suggestion(colour, known, "there are") if known else "there are no recoveries"
            raise InputError(f"colour {colour!r} is not displacement, and no body recovers it over its mesh; {there}")
        self.unit = known[colour]
        self.name_of_colour = colour
        self.bodies = {name: body for name, body in bodies.items() if self.name in body.recovery}
        self.motions = {name: body_motion(body, name, result.channels) for name, body in self.bodies.items()}

    def values(self, name: str, k: int) -> np.ndarray | None:
        """Return the values at the nodes of a body ``(n_points,)`` at a row of the result; None where it has none."""
        if name not in self.bodies:
            return None
        block = self.bodies[name].recovery[self.name]
        now = BodyMotion(*(x[k : k + 1] for x in self.motions[name]))
        return node_field(self.bodies[name], block, block.full_values(now)[0], self.component)
