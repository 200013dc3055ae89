"""States estimated from noisy measurements (Kalman-Bucy filter), and the controller that a regulator makes of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modalprep.errors import InputError
from modalprep.multibody.analysis.state_space import LinearSystem
from modalprep.multibody.control.marginal import unmoved
from modalprep.multibody.control.regulator import Regulator
from modalprep.multibody.control.riccati import solve_riccati
from modalprep.multibody.control.rows import places, positive
from modalprep.records import Record
from modalprep.suggest import refuse_other

SMALL = 1e-300  # least noise of a measurement


@dataclass(frozen=True, eq=False, kw_only=True)
class Estimator(Record):
    """Estimated states ``ze' = A ze + B i + L (o - C ze - D i)`` of measured outputs o and known inputs i.

    Attributes
    ----------
    L : (nz, no)
        Gains, units of the rate of the state per unit of the output.
    states, measured : tuple of str
        Rows and columns of L.
    covariance : (nz, nz)
        Of the error of the states once the filter has settled.
    poles : (nz,) complex
        Of the error, 1/s, the least damped first.
    plant : LinearSystem
    """

    L: np.ndarray
    states: tuple[str, ...]
    measured: tuple[str, ...]
    covariance: np.ndarray
    poles: NDArray[np.complex128]
    plant: LinearSystem

    @property
    def deviation(self) -> dict[str, float]:
        """Standard deviation of the error of each state, in its unit."""
        return dict(zip(self.states, np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).tolist(), strict=True))

    @property
    def filter(self) -> LinearSystem:
        """The filter: from the inputs of the plant and the measured outputs to the estimated states."""
        linear = self.plant
        C, D = _measured(linear, self.measured)
        n = len(linear.A)
        return LinearSystem(
            A=linear.A - self.L @ C,
            B=np.hstack([linear.B - self.L @ D, self.L]),
            C=np.eye(n),
            D=np.zeros((n, len(linear.inputs) + len(self.measured))),
            states=linear.states,
            inputs=(*linear.inputs, *self.measured),
            outputs=linear.states,
            notes=linear.notes,
        )


def kalman(linear: LinearSystem, process: Mapping[str, float], measured: Mapping[str, float]) -> Estimator:
    """Return the steady Kalman filter of a linear system under white noise.

    Parameters
    ----------
    process : {name: density}
        Noise at inputs, unit^2 s, two-sided: a white force of the density S (N^2/Hz, one-sided) has S / 2. Noise at a
        state's rate by the name of the state.
    measured : {name: density}
        Outputs that are measured, and the noise of each, unit^2 s, two-sided: a sampled one of the standard deviation
        d at every dt has d^2 dt.

    Returns
    -------
    Estimator

    Raises
    ------
    InputError
        When a name is unknown, a density is not positive, or the measurements do not see a motion that does not decay
        by itself, or no noise moves one.
    SimulationError
        When the Riccati equation is not solved accurately.

    References
    ----------
    R. E. Kalman, R. S. Bucy, New results in linear filtering and prediction theory, J. Basic Eng. 83 (1961) 95.

    Examples
    --------
    >>> mass = LinearSystem(A=np.array([[0, 1.0], [0, 0]]), B=np.array([[0], [1.0]]), C=np.array([[1.0, 0]]),
    ...                     D=np.zeros((1, 1)), states=("slide.displacement", "slide.speed"), inputs=("slide",),
    ...                     outputs=("slide.displacement",))
    >>> kalman(mass, {"slide": 1.0}, {"slide.displacement": 1.0}).L.ravel()  # sqrt(2), 1
    array([1.41421356, 1.        ])
    """
    refuse_other("kalman: the linear system", LinearSystem, linear)
    if not measured:
        raise InputError(f"kalman: name the measured outputs with their noise; {linear.outputs} are there")
    moved, through = _noise(linear, process)
    density = positive(process, "kalman: noise of")
    own = places(measured, linear.outputs, "kalman: output")
    noise = positive(measured, "kalman: noise of output", least=SMALL)
    C, through = linear.C[own], through[own]
    _refuse_unseen(linear, C, np.sqrt(density) * moved, list(measured))
    Q = (density * moved) @ moved.T
    R = np.diag(noise) + (density * through) @ through.T
    S = (density * moved) @ through.T
    covariance, gains, poles = solve_riccati(linear.A.T, C.T, Q, R, S, "kalman")
    return Estimator(
        L=gains.T, states=linear.states, measured=tuple(measured), covariance=covariance, poles=poles, plant=linear
    )


def compensator(regulator: Regulator, estimator: Estimator) -> LinearSystem:
    """Return the controller that feeds estimated states back (LQG), from the measured outputs to the inputs.

    Its poles with the plant are those of the regulator and those of the estimator.

    Returns
    -------
    LinearSystem
        Without feedthrough.

    Raises
    ------
    InputError
        When the two are of systems with other states.

    Examples
    --------
    >>> from modalprep.multibody.control.regulator import lqr
    >>> mass = LinearSystem(A=np.array([[0, 1.0], [0, 0]]), B=np.array([[0], [1.0]]), C=np.array([[1.0, 0]]),
    ...                     D=np.zeros((1, 1)), states=("x", "v"), inputs=("f",), outputs=("x",))
    >>> found = compensator(lqr(mass, {"x": 1.0}, {"f": 1.0}), kalman(mass, {"f": 1.0}, {"x": 1.0}))
    >>> found.inputs, found.outputs, found.poles.real.round(3).tolist()
    (('x',), ('f',), [-1.414, -1.414])
    """
    linear = estimator.plant
    if regulator.states != estimator.states:
        raise InputError("compensator: regulator and estimator are of systems with other states; take one for both")
    own = places(regulator.inputs, linear.inputs, "compensator: input")
    C, D = _measured(linear, estimator.measured)
    D = D[:, own]
    return LinearSystem(
        A=linear.A - linear.B[:, own] @ regulator.K - estimator.L @ (C - D @ regulator.K),
        B=estimator.L,
        C=-regulator.K,
        D=np.zeros((len(own), len(estimator.measured))),
        states=tuple(f"{name}.estimate" for name in linear.states),
        inputs=estimator.measured,
        outputs=regulator.inputs,
        notes=linear.notes,
    )


def _measured(linear: LinearSystem, names: tuple[str, ...]) -> tuple[np.ndarray, np.ndarray]:
    own = [linear.outputs.index(name) for name in names]
    return linear.C[own], linear.D[own]


def _noise(linear: LinearSystem, process: Mapping[str, float]) -> tuple[np.ndarray, np.ndarray]:
    """Return what unit noises do to the rates of the states (nz, k) and to the outputs (no, k)."""
    known = (*linear.inputs, *linear.states)
    own = places(process, known, "kalman: noise of")
    moved = np.hstack([linear.B, np.eye(len(linear.A))])[:, own]
    return moved, np.hstack([linear.D, np.zeros((len(linear.outputs), len(linear.A)))])[:, own]


def _refuse_unseen(linear: LinearSystem, C: np.ndarray, moved: np.ndarray, measured: list[str]) -> None:
    """Refuse measurements from which states cannot be found, and noise that lets the filter rely on a drift."""
    if found := unmoved(linear.A.T, C.T):
        told = ", ".join(map(repr, measured))
        raise InputError(
            f"kalman: {told} do not see {found.told(linear.states)}, which does not decay by itself; measure more"
        )
    if found := unmoved(linear.A, moved):
        raise InputError(
            f"kalman: no noise moves {found.told(linear.states)}, which does not decay by itself, so that its error "
            "would stay; give noise at one of its states"
        )
