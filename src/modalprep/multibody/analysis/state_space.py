"""Linear equations with inputs and outputs, and their response to harmonic inputs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.vectors import VectorLike


@dataclass(frozen=True, eq=False, kw_only=True)
class StateSpace(Record):
    """``z' = A z + B i``, ``o = C z + D i`` about a state, z = changes of n independent [coordinates | speeds].

    Coordinates are minimal: closed loops leave n of the tree's nu independent, without loops all are. A spherical
    joint's three are the rotation vector of the child relative to the reference, in its axes; a free joint's six the
    displacement and that rotation, in the body's axes. With nonzero speeds the reference itself moves.

    Attributes
    ----------
    A, B, C, D : (2 n, 2 n), (2 n, ni), (no, 2 n), (no, ni)
    inputs, outputs : tuple of str
    owner : tuple of (str, str)
        What each of the nu coordinates belongs to: ``("joint", name)`` or ``("body", name)``.
    independent : (n,) int
        Indices of the coordinates in z.
    R : (nu, n)
        Derivative of all coordinates by the independent ones.
    y : (nx + nu,)
        The state; `coordinates` reads it by name.
    udot : (nu,)
        Accelerations there; zero at rest or in a steady motion.
    error : float
        Largest estimated error of an entry of A, relative to its column, the coordinates counted in their sizes; or of
        C, relative to its largest entry.
    error_estimate : (2 n, 2 n)
        Estimated error of each entry of A.
    notes : tuple of str
        What was differentiated by differences, and what was held constant.

    References
    ----------
    Theory 5.6.
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    owner: tuple[tuple[str, str], ...]
    independent: np.ndarray
    R: np.ndarray
    y: np.ndarray
    udot: np.ndarray
    error: float
    error_estimate: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the 2 n numbers of z: ``hinge``, ``ball.2``, ``arm.modal.1``, then ``hinge.rate`` and so on."""
        number = [sum(each == of for each in self.owner[:k]) + 1 for k, of in enumerate(self.owner)]
        counts = {of: self.owner.count(of) for of in self.owner}
        names = [
            f"{name}.modal.{number[k]}"
            if kind == "body"
            else name
            if counts[kind, name] == 1
            else f"{name}.{number[k]}"
            for k, (kind, name) in enumerate(self.owner)
        ]
        kept = tuple(names[k] for k in self.independent)
        return (*kept, *(f"{name}.rate" for name in kept))


def frequency_response(linear: StateSpace, frequency: VectorLike) -> NDArray[np.complex128]:
    """Return ``C (i omega - A)^-1 B + D`` (nf, no, ni): outputs per unit of harmonic inputs.

    Parameters
    ----------
    frequency : (nf,)
        Hz.

    Returns
    -------
    (nf, no, ni) complex
        Unit of the output per unit of the input.

    Raises
    ------
    InputError
        When there are no inputs or outputs, or a frequency is an undamped pole.

    References
    ----------
    Theory 5.6.

    Examples
    --------
    >>> oscillator = StateSpace(A=np.array([[0, 1.0], [-4.0, 0]]), B=np.array([[0], [1.0]]), C=np.array([[1.0, 0]]),
    ...                         D=np.zeros((1, 1)), inputs=("f",), outputs=("x",), owner=(("joint", "x"),),
    ...                         y=np.zeros(2), udot=np.zeros(1), independent=np.arange(1), R=np.eye(1), error=0.0,
    ...                         error_estimate=np.zeros((2, 2)))
    >>> frequency_response(oscillator, np.array([1 / (2 * np.pi)])).real.round(9).tolist()
    [[[0.333333333]]]
    """
    if not linear.inputs or not linear.outputs:
        raise InputError("a frequency response needs inputs and outputs; name them to linearise")
    omega = 2j * np.pi * np.asarray(frequency, dtype=float).reshape(-1, 1, 1)
    try:
        moved = np.linalg.solve(omega * np.eye(len(linear.A)) - linear.A, linear.B.astype(complex))
    except np.linalg.LinAlgError:
        raise InputError("a frequency is an undamped pole; change it, or add damping") from None
    return np.asarray(linear.C @ moved + linear.D, dtype=np.complex128)
