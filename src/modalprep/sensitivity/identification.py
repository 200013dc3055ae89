"""Parameters of a system from measured histories: least squares with the derivatives of runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import t as student

from modalprep.errors import InputError, SimulationError
from modalprep.multibody.model.system import System
from modalprep.multibody.results.result import Result
from modalprep.multibody.starts import Given
from modalprep.notebook import html_table
from modalprep.records import Record
from modalprep.sensitivity.fit_notes import notes_of
from modalprep.sensitivity.measurement import Measurement, measurement
from modalprep.sensitivity.parameters import ModalStart, Parameter, find, moved
from modalprep.sensitivity.run_sensitivities import run_sensitivities
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.verdicts.notes import told, with_warnings

NOT_NEGATIVE = ("stiffness", "damping", "friction", "mode_stiffness", "mode_damping", "mass")
ROUND_OFF = 1e-10  # singular value of the scaled Jacobian over the largest: no data beside it
TOLERANCE = 1e-7  # of the search, relative: far below the deviation of any estimate from data


@dataclass(frozen=True, eq=False, kw_only=True)
class Identified(Record):
    """Parameters that fit a measurement, and how well they are known.

    Attributes
    ----------
    parameters : tuple of str
    values : (np,)
        Estimates, in the units of the parameters.
    deviation : (np,)
        Standard deviations of the estimates; infinite where the measurement does not determine them.
    interval : (np, 2)
        Confidence intervals, by Student's distribution.
    correlation : (np, np)
        Of the errors of the estimates; NaN beside what is not determined.
    noise : dict of float
        Standard deviation of the noise of each channel: as given, or estimated from its residuals.
    time : (nt,)
        s.
    residuals : dict of (nt,)
        Measured minus simulated, by channel; NaN where nothing was measured.
    fitted : dict of (nt,)
        Simulated, by channel.
    system : System
        With the estimates.
    evaluations : int
        Number of runs with derivatives.
    message : str
        Why the search ended.
    notes : tuple of str
        What weakens the estimates.

    References
    ----------
    G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley 1989, chapters 2 and 5.
    """

    parameters: tuple[str, ...]
    values: np.ndarray
    deviation: np.ndarray
    interval: np.ndarray
    correlation: np.ndarray
    noise: dict[str, float]
    time: np.ndarray
    residuals: dict[str, np.ndarray]
    fitted: dict[str, np.ndarray]
    system: System
    evaluations: int
    message: str
    notes: tuple[str, ...] = field(default=())

    def __repr__(self) -> str:
        """Estimates with their standard deviations."""
        found = ", ".join(
            f"{name} = {value:.6g} +- {deviation:.2g}"
            for name, value, deviation in zip(self.parameters, self.values, self.deviation, strict=True)
        )
        return with_warnings(f"Identified({found})", self.notes)

    def _repr_html_(self) -> str:
        """Return estimates, deviations and intervals as an HTML table."""
        rows = zip(self.parameters, self.values, self.deviation, *self.interval.T, strict=True)
        return html_table(repr(self), ["parameter", "estimate", "deviation", "from", "to"], [list(row) for row in rows])

    def __getitem__(self, parameter: str) -> float:
        """Return the estimate of a parameter.

        Returns
        -------
        float
            In the unit of the parameter.
        """
        refuse_unknown(parameter, self.parameters, "Identified: parameter")
        return float(self.values[self.parameters.index(parameter)])


@told
def identify(
    system: System,
    measured: Result | Mapping[str, Any],
    parameters: Sequence[Parameter | str] | Mapping[str, tuple[float, float]],
    *,
    noise: Mapping[str, float] | None = None,
    confidence: float = 0.95,
    start: Given = "rest",
    method: str = "auto",
    step: float | None = None,
    rtol: float = 1e-8,
    atol: float = 1e-12,
    max_step: float | None = None,
    most_runs: int = 100,
) -> Identified:
    """Return the parameters with which a run of a system comes nearest to measured histories.

    The sum of squares of the differences, each over the noise of its channel, is minimised from the values that the
    system has. Standard deviations are those of the linearised problem at the estimates.

    Parameters
    ----------
    measured : Result or {"time": (nt,), channel: (nt,)}
        Single numbers among the channels of a run, such as ``hinge.angle`` and ``arm.tip.position.x``; NaN where
        nothing was measured. `read_result` reads a CSV file with a column ``time``. Times are s from the start of
        the run, not before it.
    parameters : sequence of str or Parameter, or {name: (lower, upper)}
        As `run_sensitivities` takes them, with bounds. Stiffness, damping, friction and mass are never negative.
    noise : {channel: standard deviation}
        Of independent errors, in the unit of the channel. Without it that of each channel is estimated from its
        residuals, and a misfit of the model counts as noise.
    confidence : float
        Of the intervals, between 0 and 1.
    start, method, step, rtol, atol, max_step
        As `simulate` has them.
    most_runs : int
        With derivatives; then the search ends with a note.

    Returns
    -------
    Identified
        Notes name parameters that the measurement does not determine, that are at a bound, or that are correlated by
        more than 0.95, and residuals that are no white noise.

    Raises
    ------
    InputError
        When a name is unknown, the measurement has no such times, or fewer numbers than there are parameters.
    SimulationError
        When a run of the search cannot be integrated; its parameters are told.

    References
    ----------
    G. A. F. Seber, C. J. Wild, Nonlinear Regression, Wiley 1989, chapters 2 and 5.

    Examples
    --------
    >>> from modalprep.body.rigid import rigid_body
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.model.joint_element import HingeElement
    >>> disc = rigid_body("disc", mass=1.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    >>> spring = HingeElement(stiffness=3.0)
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="disc", rate=1.0, elements=spring)
    >>> time = np.linspace(0.1, 5.0, 50)
    >>> measured = {"time": time, "hinge.angle": np.sin(2 * time) / 2}
    >>> identify(System(bodies={"disc": disc}, joints=(hinge,)), measured, ["hinge.stiffness"])["hinge.stiffness"]
    4.0
    """
    refuse_other("identify: the system", System, system)
    if not 0 < confidence < 1:
        raise InputError(f"identify: confidence = {confidence} must be between 0 and 1")
    given = find(system, list(parameters))
    _refuse_starts(given)
    data = measurement(measured, noise)
    bounds = _bounds(given, parameters if isinstance(parameters, Mapping) else {})
    options = {"start": start, "method": method, "step": step, "rtol": rtol, "atol": atol, "max_step": max_step}
    if data.count <= len(given):
        raise InputError(f"identify: {data.count} measured numbers do not determine {len(given)} parameters; give more")
    search = _Search(system, given, data, options)
    scale = data.spread if noise is None else data.deviations(noise)
    found = search.run(np.array([each.value for each in given]), scale, bounds, most_runs)
    if noise is None:
        scale = search.spread_of_residuals(found.x)
        found = search.run(found.x, scale, bounds, most_runs)
    return _record(search, found, scale, bounds, confidence, noise is not None)


class _Search:
    """Residuals and Jacobians of the fit, and how often they were made."""

    def __init__(
        self, system: System, parameters: Sequence[Parameter], data: Measurement, options: Mapping[str, Any]
    ) -> None:
        self.system, self.parameters = system, parameters
        self.data, self.options = data, options
        self.count = 0
        self._at: tuple[float, ...] | None = None

    def evaluate(self, x: np.ndarray) -> None:
        """Run at parameters; the last run is kept."""
        if self._at == tuple(x):
            return
        self.count += 1
        system, own = moved(self.system, self.parameters, x)
        try:
            found = run_sensitivities(
                system, self.data.channels, own, self.data.duration, times=self.data.time, **self.options
            )
        except SimulationError as error:
            told = ", ".join(f"{each.name} = {each.value:.6g}" for each in own)
            raise SimulationError(f"identify: no run with {told}: {error}; give narrower bounds") from None
        self._at = tuple(x)
        self.found = found

    def residuals(self, x: np.ndarray) -> np.ndarray:
        """Return measured minus simulated (nt, nc), NaN where nothing was measured."""
        self.evaluate(x)
        return self.data.values - self.found.values

    def jacobian(self, x: np.ndarray) -> np.ndarray:
        """Return the derivatives (nt, nc, np) of what is simulated."""
        self.evaluate(x)
        return np.moveaxis(self.found.derivatives, 0, -1)

    def run(self, x: np.ndarray, scale: np.ndarray, bounds: np.ndarray, most_runs: int) -> Any:
        """Minimise the sum of squares of the residuals over their scales (nc,)."""
        there = self.data.there
        return least_squares(
            lambda x: (self.residuals(x) / scale)[there],
            np.clip(x, *bounds),
            jac=lambda x: -(self.jacobian(x) / scale[:, None])[there],
            bounds=bounds,
            x_scale=[each.step for each in self.parameters],
            xtol=TOLERANCE,
            ftol=TOLERANCE,
            gtol=TOLERANCE,
            max_nfev=most_runs,
        )

    def spread_of_residuals(self, x: np.ndarray) -> np.ndarray:
        """Return the standard deviations (nc,) of the residuals, for the parameters that were fitted."""
        squares = np.nansum(self.residuals(x) ** 2, axis=0)
        count = np.sum(self.data.there, axis=0)
        left = count * (1 - len(x) / np.sum(count))
        least = np.finfo(float).eps * self.data.spread
        return np.maximum(np.sqrt(squares / left), least)


def _refuse_starts(parameters: Sequence[Parameter]) -> None:
    for each in parameters:
        if isinstance(each, ModalStart):
            raise InputError(f"identify: {each.name!r} is a start value of a mode, which does not stand in the system")


def _bounds(parameters: Sequence[Parameter], given: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """Return lower and upper bounds (2, np)."""
    found = np.full((2, len(parameters)), np.inf)
    for k, each in enumerate(parameters):
        lower = 0.0 if NOT_NEGATIVE and any(part in NOT_NEGATIVE for part in each.name.split(".")[1:]) else -np.inf
        pair = given.get(each.name, (lower, np.inf))
        if np.shape(pair) != (2,) or not pair[0] < pair[1]:
            raise InputError(f"identify: the bounds of {each.name!r} are {pair}; give a lower and a larger upper one")
        found[:, k] = max(lower, pair[0]), pair[1]
        if not found[0, k] <= each.value <= found[1, k]:
            raise InputError(
                f"identify: {each.name!r} is {each.value:g} in the system, outside of its bounds {pair[0]:g} and "
                f"{pair[1]:g}; the search begins there"
            )
    return found


def _record(
    search: _Search, found: Any, scale: np.ndarray, bounds: np.ndarray, confidence: float, given: bool
) -> Identified:
    """Return estimates with their errors: the inverse of the information matrix ``J' J``."""
    data, x = search.data, found.x
    residuals = search.residuals(x)
    J = (search.jacobian(x) / scale[:, None])[data.there]
    covariance = _covariance(J, np.array([each.step for each in search.parameters]))
    deviation = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore"):
        correlation = covariance / np.outer(deviation, deviation)
    width = student.ppf((1 + confidence) / 2, np.inf if given else data.count - len(x)) * deviation
    return Identified(
        parameters=tuple(each.name for each in search.parameters),
        values=x,
        deviation=deviation,
        interval=np.column_stack([x - width, x + width]),
        correlation=correlation,
        noise=dict(zip(data.channels, scale.tolist(), strict=True)),
        time=data.time,
        residuals=dict(zip(data.channels, residuals.T, strict=True)),
        fitted=dict(zip(data.channels, search.found.values.T, strict=True)),
        system=moved(search.system, search.parameters, x)[0],
        evaluations=search.count,
        message=found.message,
        notes=notes_of(
            search.parameters, found, deviation, correlation, bounds, _scaled(data, residuals, scale), given
        ),
    )


def _scaled(data: Measurement, residuals: np.ndarray, scale: np.ndarray) -> dict[str, np.ndarray]:
    """Return the residuals by channel, in units of its noise."""
    return dict(zip(data.channels, (residuals / scale).T, strict=True))


def _covariance(J: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the covariance (np, np) of the estimates, infinite on the diagonal where J (n, np) does not know them."""
    _, s, Vt = np.linalg.svd(J * size, full_matrices=False)
    known = s > ROUND_OFF * s.max(initial=0.0)
    V = Vt[known].T * size[:, None]
    covariance = (V / s[known] ** 2) @ V.T
    lost = np.any(np.abs(Vt[~known]) > np.sqrt(ROUND_OFF), axis=0)
    covariance[lost, lost] = np.inf
    return covariance
