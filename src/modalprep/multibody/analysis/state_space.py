"""Linear equations with inputs and outputs, and their response to harmonic inputs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from modalprep.drawing import Plotted
from modalprep.errors import InputError
from modalprep.extras import need
from modalprep.records import Record
from modalprep.vectors import VectorLike

if TYPE_CHECKING:
    from modalprep.multibody.analysis.tangent import Tangent


@dataclass(frozen=True, eq=False, kw_only=True)
class LinearSystem(Record, Plotted):
    """``z' = A z + B i``, ``o = C z + D i`` with the names of states z, inputs i and outputs o.

    Attributes
    ----------
    A, B, C, D : (nz, nz), (nz, ni), (no, nz), (no, ni)
    states, inputs, outputs : tuple of str
    notes : tuple of str
        What was approximated.

    References
    ----------
    Theory 5.6.

    Examples
    --------
    >>> mass = LinearSystem(A=np.array([[0, 1.0], [0, 0]]), B=np.array([[0], [0.5]]), C=np.eye(2)[:1],
    ...                     D=np.zeros((1, 1)), states=("slide.displacement", "slide.speed"), inputs=("slide",),
    ...                     outputs=("slide.displacement",))
    >>> mass.poles
    array([0.+0.j, 0.+0.j])
    """

    A: np.ndarray
    B: np.ndarray
    C: np.ndarray
    D: np.ndarray
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    notes: tuple[str, ...] = ()

    @property
    def poles(self) -> NDArray[np.complex128]:
        """Eigenvalues of A (nz,), 1/s, the least damped first."""
        found = np.linalg.eigvals(self.A).astype(np.complex128)
        return found[np.argsort(-found.real, kind="stable")]

    def to_control(self) -> Any:
        """Return the system as a ``control.StateSpace`` of python-control.

        Names keep their order; python-control has no dots in names, each is an underscore there.

        Returns
        -------
        control.StateSpace

        Raises
        ------
        NotInstalledError
            When python-control is not installed.

        Examples
        --------
        >>> mass = LinearSystem(A=np.zeros((1, 1)), B=np.ones((1, 1)), C=np.ones((1, 1)), D=np.zeros((1, 1)),
        ...                     states=("slide.speed",), inputs=("slide",), outputs=("slide.speed",))
        >>> from importlib.util import find_spec
        >>> mass.to_control().output_labels if find_spec("control") else ["slide_speed"]
        ['slide_speed']
        """
        need("control", "a state space of python-control")
        import control

        names = {
            key: [name.replace(".", "_") for name in getattr(self, key)] for key in ("states", "inputs", "outputs")
        }
        return control.StateSpace(self.A, self.B, self.C, self.D, **names, remove_useless_states=False)


@dataclass(frozen=True, eq=False, kw_only=True)
class StateSpace(LinearSystem):
    """``z' = A z + B i``, ``o = C z + D i`` about a state, z = changes of n independent [coordinates | speeds].

    Coordinates are minimal: closed loops leave n of the tree's nu independent, without loops all are. A spherical
    joint's three are the rotation vector of the child relative to the reference, in its axes; a free joint's six the
    displacement and that rotation, in the body's axes. With nonzero speeds the reference itself moves.

    Attributes
    ----------
    A, B, C, D : (2 n, 2 n), (2 n, ni), (no, 2 n), (no, ni)
    states, inputs, outputs : tuple of str
        States have the names of outputs: ``hinge.angle``, ``ball.rotation.2``, ``arm.modal.1``, then the speeds
        ``hinge.rate``, ``ball.angular_velocity.2``, ``arm.modal_rate.1``.
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
    equations : Tangent
        The same equations with mass, damping and stiffness apart, before they are solved.
    notes : tuple of str
        What was differentiated by differences, and what was held constant.

    References
    ----------
    Theory 5.6.
    """

    owner: tuple[tuple[str, str], ...]
    independent: np.ndarray
    R: np.ndarray
    y: np.ndarray
    udot: np.ndarray
    error: float
    equations: Tangent

    @property
    def error_estimate(self) -> np.ndarray:
        """Estimated error (2 n, 2 n) of each entry of A: the root mean square of what rounding errors make."""
        n = len(self.equations.M)
        inverse = self.equations.solve(np.eye(n))
        error = np.sqrt(inverse**2 @ self.equations.force_errors(self.A[n:]) ** 2)
        return np.vstack([np.zeros((n, 2 * n)), error])


def frequency_response(linear: LinearSystem, frequency: VectorLike) -> NDArray[np.complex128]:
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
    >>> oscillator = LinearSystem(A=np.array([[0, 1.0], [-4.0, 0]]), B=np.array([[0], [1.0]]), C=np.array([[1.0, 0]]),
    ...                           D=np.zeros((1, 1)), states=("x", "v"), inputs=("f",), outputs=("x",))
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
