"""Damping: of a body's modes, Rayleigh's, and that of components from a target damping of their system."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.records import Record
from modalprep.reduction.dampers import damping_fields
from modalprep.reduction.synthesis import SynthesisedModes
from modalprep.reduction.table import AnyBody, ModalBody
from modalprep.suggest import refuse_unknown

Ratio = float | Mapping[float, float] | np.ndarray
METHODS = ("least_squares", "back_projection")
ROUND_OFF = 1e-12  # of the terms of a Rayleigh constant
OWN = 1e-9  # rad/s; below it a component coordinate has no frequency, and no damping
PREFERENCE = 1e-6  # weight of the distance to the target ratios among equally good component dampings


@dataclass(frozen=True, eq=False, kw_only=True)
class Rayleigh(Record):
    """Proportional damping ``C = alpha M + beta K``, so that ``zeta = alpha / (2 w) + beta w / 2``.

    Attributes
    ----------
    alpha : float
        1/s.
    beta : float
        s.

    Raises
    ------
    InputError
        When one of them is negative.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, section 10.3.

    Examples
    --------
    >>> Rayleigh(alpha=0.0, beta=0.01).ratio(np.array([1.0])).round(4)
    array([0.0314])
    """

    alpha: float
    beta: float

    def __post_init__(self) -> None:
        """Refuse constants that add energy to a motion."""
        if not (self.alpha >= 0 and self.beta >= 0):
            raise InputError(f"Rayleigh damping alpha = {self.alpha:g}, beta = {self.beta:g} must not be negative")
        super().__post_init__()

    def ratio(self, frequency: np.ndarray) -> np.ndarray:
        """Return the damping ratios (n,) at frequencies (n,) in Hz, above 0.

        Returns
        -------
        (n,) float
            Fractions of critical damping.
        """
        w = 2 * np.pi * np.asarray(frequency, dtype=float)
        return self.alpha / (2 * w) + self.beta * w / 2

    def damping(self, body: ModalBody) -> np.ndarray:
        """Return the body's D (n,): ``alpha + beta K``; `alpha` damps its deformation, not its rigid motion.

        Returns
        -------
        (n,) float
            1/s, in the body's modal coordinates.
        """
        return self.alpha + self.beta * body.K


def rayleigh(frequency: tuple[float, float], ratio: tuple[float, float]) -> Rayleigh:
    """Return the Rayleigh damping with two given ratios at two frequencies (Hz).

    ``beta = 2 (z2 w2 - z1 w1) / (w2^2 - w1^2)``, ``alpha = 2 w1 w2 (z1 w2 - z2 w1) / (w2^2 - w1^2)``.

    Returns
    -------
    Rayleigh
        With alpha (1/s) and beta (s).

    Raises
    ------
    InputError
        When the frequencies are equal or not positive, or the ratios need a negative constant.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, section 10.3
    (proportional damping).

    Examples
    --------
    >>> rayleigh((1.0, 3.0), (0.02, 0.02)).ratio(np.array([1.0, 3.0])).round(12)
    array([0.02, 0.02])
    """
    w1, w2 = (2 * np.pi * f for f in frequency)
    z1, z2 = (float(_checked(z)) for z in ratio)
    if not (w1 > 0 and w2 > 0 and w1 != w2):
        raise InputError(f"the two frequencies {frequency[0]:g} and {frequency[1]:g} Hz must be positive and differ")
    constants = np.array([w1 * w2 * (z1 * w2 - z2 * w1), z2 * w2 - z1 * w1]) * 2 / (w2**2 - w1**2)
    size = np.array([w1 * w2, 1.0]) * (z1 + z2) * (w1 + w2) / abs(w2**2 - w1**2)
    constants[np.abs(constants) < ROUND_OFF * size] = 0.0
    if np.any(constants < 0):
        low, high = sorted((w1 / w2, w2 / w1))
        raise InputError(
            f"ratios {z1:g} and {z2:g} at {frequency[0]:g} and {frequency[1]:g} Hz need a negative Rayleigh constant; "
            f"the second over the first must lie between {low:.4g} and {high:.4g}"
        )
    alpha, beta = constants.tolist()
    return Rayleigh(alpha=alpha, beta=beta)


def damping_ratio(target: Ratio | Rayleigh, frequency: np.ndarray) -> np.ndarray:
    """Return a damping ratio (n,) for every frequency (n,) in Hz.

    Parameters
    ----------
    target : float, {frequency in Hz: ratio}, Rayleigh or (n,)
        One ratio for all; a table, interpolated linearly and constant beyond; or one ratio per frequency.

    Raises
    ------
    InputError
        When a ratio is negative or no number, or their count is wrong.

    Examples
    --------
    >>> damping_ratio({10: 0.01, 20: 0.02}, np.array([5.0, 15.0, 40.0]))
    array([0.01 , 0.015, 0.02 ])
    """
    if isinstance(target, Rayleigh):
        return target.ratio(frequency)
    if isinstance(target, Mapping):
        if not target:
            raise InputError("the table of damping ratios is empty; give at least one frequency and its ratio")
        at = sorted(target)
        target = np.interp(frequency, at, [_checked(target[f]) for f in at])
    ratio = _checked(target)
    if ratio.ndim > 1 or (ratio.ndim == 1 and ratio.size != len(frequency)):
        raise InputError(f"{ratio.size} damping ratios for {len(frequency)} modes; give one, or one per mode")
    return np.broadcast_to(ratio, len(frequency)).copy()


def _checked(ratio: float | np.ndarray) -> np.ndarray:
    ratio = np.asarray(ratio, dtype=float)
    if not np.all(ratio >= 0):
        raise InputError(f"damping ratio {float(ratio.min()):g} must not be negative; it is a fraction of critical")
    return ratio


def modal_damping(body: ModalBody, target: Ratio | Rayleigh) -> np.ndarray:
    """Return ``D = 2 zeta w`` (n,) of a body: ``body.with_(D=modal_damping(body, 0.01))``; Rayleigh's is `damping`.

    Returns
    -------
    (n,) float
        1/s.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, section 10.3.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> bool(np.allclose(modal_damping(body, 0.01), 0.02 * np.sqrt(body.K)))
    True
    """
    if isinstance(target, Rayleigh):
        return target.damping(body)
    w = np.sqrt(body.K)
    return 2 * damping_ratio(target, w / (2 * np.pi)) * w


@dataclass(frozen=True, eq=False, kw_only=True)
class ComponentDamping(Record):
    """Damping of components and the resulting damping of the system.

    Attributes
    ----------
    damping : {name: (n,) or (n, n)}
        D of each body, 1/s: of each modal coordinate, or a full matrix.
    frequency : (s,)
        Hz; the elastic system modes.
    target, achieved : (s,)
        Damping ratios ``Phi_s^T C Phi_s / (2 w_s)``.
    coupling : float
        Largest ``|c_rs| / sqrt(c_rr c_ss)`` between two system modes; 0 for uncoupled modes. The
        achieved ratios are those of the damped system if the coupling is small, or the damping light and the modes
        well separated.
    """

    damping: dict[str, np.ndarray]
    frequency: np.ndarray
    target: np.ndarray
    achieved: np.ndarray
    coupling: float

    def applied(self, bodies: Mapping[str, AnyBody]) -> dict[str, AnyBody]:
        """Return the bodies with this damping, of a full matrix the whole.

        Returns
        -------
        dict of ModalBody
            By the names of the components.
        """
        whole = {name: np.diag(d) if d.ndim == 1 else d for name, d in self.damping.items()}
        fields = {name: damping_fields(np.zeros(len(C)), C) for name, C in whole.items()}
        return {name: body.with_(**fields.get(name, {})) for name, body in bodies.items()}

    def __repr__(self) -> str:
        """Number of modes and the largest deviation."""
        miss = float(np.abs(self.achieved - self.target).max(initial=0.0))
        return (
            f"ComponentDamping({len(self.target)} system modes, ratios within {miss:.2g}, coupling {self.coupling:.2g})"
        )


def system_damping(modes: SynthesisedModes, damping: Mapping[str, np.ndarray] | None = None) -> np.ndarray:
    """Return ``C = Phi^T C_bodies Phi`` (s, s), 1/s: the damping of the bodies in the system's modes.

    Parameters
    ----------
    damping : {name: (n,) or (n, n)} or None
        Used instead of the bodies' own D.
    """
    C = np.zeros((len(modes.frequency),) * 2)
    for name, x in modes.coordinates.items():
        own = modes.bodies[name]
        whole = own.D if own.coupled_damping is None else own.coupled_damping
        D = np.asarray(whole if damping is None else damping[name])
        q = x[6:]
        C += q.T @ (D[:, None] * q if D.ndim == 1 else D @ q)
    return C


def component_damping(
    modes: SynthesisedModes,
    target: Ratio | Rayleigh,
    method: Literal["least_squares", "back_projection"] = "least_squares",
) -> ComponentDamping:
    """Return the damping of the components that gives the system its target damping.

    Least squares: one ``d_j >= 0`` per component coordinate, such that ``sum_j Phi_js^2 d_j = 2 zeta_s w_s`` in the
    least squares of relative errors (Lawson & Hanson, Solving Least Squares Problems, chapter 23: NNLS; theory 3.8).
    With more coordinates than system modes the solution is not unique; the one nearest to the target ratios at the
    component's own frequencies is taken (`PREFERENCE`).

    Back projection: ``C = Phi^-T diag(2 zeta w) Phi^-1`` with the inverse ``Phi^-1 = diag(w^-2) Phi^T K`` of modes
    that ``Phi^T K Phi = diag(w^2)``, so that no rigid motion is damped, restricted to the block of each body:
    ``C_i = K_i Phi_i diag(2 zeta / w^3) Phi_i^T K_i``, full and positive semidefinite. What the blocks between bodies
    held is lost, unless C is proportional to K: then ``C_i = beta K_i``, exact with all modes and no redundant
    condition.

    Parameters
    ----------
    modes : SynthesisedModes
        The modes to be damped, without those that the components do not resolve.
    target : float, {frequency in Hz: ratio}, Rayleigh or (s,)
        As in `damping_ratio`; an array has one for each elastic mode.

    Returns
    -------
    ComponentDamping
        Damping of each component, by its name, and the ratios that the system then has.

    Raises
    ------
    InputError
        When a ratio is negative, the method is unknown, or the system has no elastic mode.

    References
    ----------
    C. L. Lawson, R. J. Hanson, Solving Least Squares Problems, SIAM 1995, chapter 23; theory 3.8.
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, sections 10.3 and 17.
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, chapter 7.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.reduction.synthesis import synthesise
    >>> arm = uniform_beam(modes=3)
    >>> pair = synthesise({"a": arm, "b": arm}, [("a.tip", "b.root")], ground=["a.root"], modes=2)
    >>> component_damping(pair, 0.01).achieved.round(6)
    array([0.01, 0.01])
    """
    refuse_unknown(method, METHODS, "damping: method")
    frequency = modes.frequency[modes.rigid :]
    if not len(frequency):
        raise InputError("the system has no elastic mode to damp; keep more modes")
    ratio = damping_ratio(target, frequency)
    w = 2 * np.pi * frequency
    found = _least_squares(modes, w, ratio, target) if method == METHODS[0] else _back_projection(modes, w, ratio)
    C = system_damping(modes, found)[modes.rigid :, modes.rigid :]
    own = np.diag(C)
    size = np.sqrt(np.where(own > 0, own, np.inf))
    coupling = float(np.abs((C - np.diag(own)) / size / size[:, None]).max())
    return ComponentDamping(damping=found, frequency=frequency, target=ratio, achieved=own / (2 * w), coupling=coupling)


def _least_squares(modes: SynthesisedModes, w: np.ndarray, ratio: np.ndarray, target: Any) -> dict[str, np.ndarray]:
    """Solve for d over that of the largest target ratio; at the component's own frequencies it should be `prior`."""
    from scipy.optimize import nnls  # which takes a tenth of a second to import

    q = np.vstack([x[6:, modes.rigid :] for x in modes.coordinates.values()])
    own = np.sqrt(np.concatenate([body.K for body in modes.bodies.values()]))
    table = target if not np.ndim(target) else dict(zip(modes.frequency[modes.rigid :], ratio, strict=True))
    prior = damping_ratio(table, np.maximum(own, OWN) / (2 * np.pi)) / (ratio.max() or 1.0)
    unit = 2 * (ratio.max() or 1.0) * own
    size = 2 * np.where(ratio > 0, ratio, ratio.max() or 1.0) * w
    A = (q**2 * unit[:, None]).T / size[:, None]
    x, _ = nnls(
        np.vstack([A, PREFERENCE * np.eye(len(own))]), np.concatenate([2 * ratio * w / size, PREFERENCE * prior])
    )
    ends = np.cumsum([body.n for body in modes.bodies.values()])
    return dict(zip(modes.bodies, np.split(x * unit, ends[:-1]), strict=True))


def _back_projection(modes: SynthesisedModes, w: np.ndarray, ratio: np.ndarray) -> dict[str, np.ndarray]:
    out = {}
    for name, x in modes.coordinates.items():
        KPhi = modes.bodies[name].K[:, None] * x[6:, modes.rigid :]
        out[name] = (KPhi * (2 * ratio / w**3)) @ KPhi.T
    return out
