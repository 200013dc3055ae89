"""Derivatives of smooth functions of one parameter, by differences of the fourth order.

They are taken of forces at given accelerations, of start states and of channels at given states: algebraic functions,
never of runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.model.system import System
from modalprep.sensitivity.parameters import Parameter

RELATIVE = 2e-3  # step, in sizes of the parameter: the error of the formula is then near round-off


class Stencil(NamedTuple):
    """Places, in steps, and weights, per step, of a formula for a derivative."""

    places: tuple[float, ...]
    weights: tuple[float, ...]


LINEAR = Stencil((0.0, 1.0), (-1.0, 1.0))  # of linear functions
CENTRAL = Stencil((-2.0, -1.0, 1.0, 2.0), (1 / 12, -2 / 3, 2 / 3, -1 / 12))
ONE_SIDED = Stencil((0.0, 1.0, 2.0, 3.0, 4.0), (-25 / 12, 4.0, -3.0, 4 / 3, -1 / 4))  # a value that is not below zero


class Neighbours(NamedTuple):
    """Systems beside a system, along one parameter.

    Attributes
    ----------
    values : (k,)
        Of the parameter.
    weights : (k,)
        Of the derivative.
    systems : tuple of System
    """

    values: np.ndarray
    weights: np.ndarray
    systems: tuple[System, ...]

    def derivative(self, found: Sequence[np.ndarray]) -> np.ndarray:
        """Return the derivative of what was found for the systems, one by one."""
        return weighted(self.weights, found)


def weighted(weights: np.ndarray, values: Sequence[np.ndarray]) -> np.ndarray:
    """Return the sum of some values of one shape with their weights.

    Examples
    --------
    >>> weighted(np.array([-1.0, 2.0]), [np.ones(2), np.arange(2.0)])
    array([-1.,  1.])
    """
    return sum((w * each for w, each in zip(weights, values, strict=True)), np.zeros_like(values[0]))


def neighbours(system: System, parameter: Parameter) -> Neighbours:
    """Return the systems from whose forces the derivative by a parameter is found.

    Raises
    ------
    InputError
        When the system cannot have values beside that of the parameter.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.sensitivity.parameters import find
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,), gravity=np.array([0, -10.0, 0]))
    >>> beside = neighbours(arm, find(arm, ["gravity.y"])[0])
    >>> beside.derivative([system.gravity for system in beside.systems]).round(9)
    array([0., 1., 0.])
    """
    step = RELATIVE * parameter.step
    try:
        return _along(system, parameter, CENTRAL, step)
    except InputError:
        pass
    try:
        return _along(system, parameter, ONE_SIDED, step)
    except InputError as error:
        raise InputError(
            f"parameter {parameter.name!r}: the system cannot have values beside {parameter.value:g}: {error}"
        ) from None


def _along(system: System, parameter: Parameter, stencil: Stencil, step: float) -> Neighbours:
    values = parameter.value + step * np.array(stencil.places)
    systems = tuple(parameter.change(system, float(value)) for value in values)
    return Neighbours(values, np.array(stencil.weights) / step, systems)


def directional(function: Callable[[float], np.ndarray], step: float) -> np.ndarray:
    """Return the derivative at zero of a function of one number.

    Examples
    --------
    >>> bool(abs(directional(np.exp, 1e-3) - 1.0) < 1e-12)
    True
    """
    parts = [w * function(step * s) for s, w in zip(*CENTRAL, strict=True)]
    return sum(parts[1:], parts[0]) / step
