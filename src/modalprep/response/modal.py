"""Equations of motion of a body in uncoupled modes, driven at its root and on its interfaces (theory 11.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import DRIVES
from modalprep.errors import InputError
from modalprep.records import Record, filled, given
from modalprep.reduction.dampers import COUPLED
from modalprep.reduction.damping import Ratio, Rayleigh, damping_ratio
from modalprep.reduction.table import DIRECTIONS
from modalprep.response.dropped import BASE, acts_statically
from modalprep.suggest import suggestion
from modalprep.vectors import UNIT, skew

Damping = Ratio | Rayleigh | np.ndarray | None


@dataclass(frozen=True, eq=False, kw_only=True)
class ModalEquations(Record):
    """Equations ``M q'' + D q' + K q = B u`` of a body in uncoupled modes.

    Attributes
    ----------
    inputs : tuple of str, length k
        Such as ``base.x`` and ``tip.rz``.
    units : tuple of str, length k
        Of the inputs.
    K : (n,)
        1/s^2.
    D : (n,) or (n, n)
        1/s; a matrix where damping couples the modes.
    B : (n, k)
        Modal force of unit inputs.
    drives : (12 + 6 n_if, k)
        A, W and interface loads of unit inputs, as recoveries take them.
    basis : (m, n)
        Coordinates of the body of these modes.
    M : (n,)
        Modal mass: 1, or 0 of coordinates that act statically, ``q = B u / K`` without acceleration and damping.

    References
    ----------
    Theory 11.1.
    """

    inputs: tuple[str, ...]
    units: tuple[str, ...]
    K: np.ndarray
    D: np.ndarray
    B: np.ndarray
    drives: np.ndarray
    basis: np.ndarray
    M: np.ndarray = given(converter=filled, default=None)

    def __post_init__(self) -> None:
        """All coordinates have mass unless it is said."""
        if self.M is None:
            object.__setattr__(self, "M", np.ones(len(self.K)))
        super().__post_init__()

    @property
    def coupled(self) -> bool:
        """Whether damping couples the modes."""
        return self.D.ndim == 2

    @cached_property
    def resonances(self) -> tuple[np.ndarray, np.ndarray]:
        """Frequencies (Hz, ascending) and damping ratios of the modes that vibrate; of coupled ones their poles'."""
        if not self.coupled:
            some = (self.K > 0) & (self.M > 0)
            w = np.sqrt(self.K[some])
            return w / (2 * np.pi), self.D[some] / (2 * w)
        moving = self.moving
        n = len(moving.K)
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(moving.K), -moving.D]])
        poles = np.linalg.eigvals(A)
        poles = poles[(poles.imag > 0)]
        poles = poles[np.argsort(np.abs(poles))]
        return np.abs(poles) / (2 * np.pi), -poles.real / np.abs(poles)

    @cached_property
    def moving(self) -> ModalEquations:
        """The equations of the coordinates with mass."""
        some = self.M > 0
        if some.all():
            return self
        D = self.D[np.ix_(some, some)] if self.coupled else self.D[some]
        return self.with_(M=self.M[some], K=self.K[some], D=D, B=self.B[some], basis=self.basis[:, some])

    def solve(self, f: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the complex coordinates ``q (nf, n, r)`` under inputs ``u (nf, k, r)`` at frequencies f (nf,), Hz.

        Returns
        -------
        (nf, n, r) complex
            m sqrt(kg).

        Raises
        ------
        InputError
            When a frequency is that of a mode without damping.
        """
        w = 2 * np.pi * np.asarray(f, dtype=float)
        force = self.B @ u
        if self.coupled:
            n = np.arange(len(self.K))
            found = np.empty(force.shape, dtype=complex)
            for k, s in enumerate(w):
                Z = 1j * s * self.D
                Z[n, n] += self.K - s**2 * self.M
                found[k] = np.linalg.solve(Z, force[k])
            return found
        Z = self.K - w[:, None] ** 2 * self.M + 1j * w[:, None] * self.D
        if not np.all(Z):
            at = f[np.flatnonzero((Z == 0).any(axis=1))[0]]
            raise InputError(f"the response at {at:g} Hz is infinite: this is a mode without damping; give damping")
        return force / Z[..., None]


def modal_equations(
    body: FlexibleBody, inputs: Sequence[str], damping: Damping = None, up_to: float | None = None
) -> ModalEquations:
    """Return the modal equations of a body under named inputs.

    Parameters
    ----------
    inputs : sequence of str
        ``base.x`` ... ``base.rz``: acceleration of the root; ``<interface>.x`` ... ``.rz``: force or moment there.
    damping : float, {Hz: ratio}, (n,), Rayleigh, or (n, n)
        Instead of the body's own: ratios, or a damping matrix (1/s) in the coordinates of the body.
    up_to : float or None
        Hz, the end of the band of the response, infinite for histories: truncation vectors that would resonate in it
        act statically (`acts_statically`). None: all modes move.

    Returns
    -------
    ModalEquations
        In modes with unit mass, or without mass.

    Raises
    ------
    InputError
        When an input is not known, or the frame of the body does not move with its root.

    References
    ----------
    Theory 11.1.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> modal_equations(uniform_beam(modes=2), ["base.y"], damping=0.01).resonances[0].round(3)
    array([0.604, 1.209])
    """
    if not body.at_root or not body.n:
        raise InputError(
            f"body {body.name!r} has no modes with its frame on the root interface, as its response needs; "
            "keep modes, and use modalprep.body.reroot for another frame"
        )
    drives, units = unit_inputs(body, inputs)
    K, Y = _uncoupled(body)
    fields = np.vstack([-body.S, -body.H.reshape(9, -1), *np.concatenate([body.phi, body.psi], axis=1)])
    B = Y.T @ fields.T @ drives
    D = _damping(body, damping, K, Y)
    M = 1.0 - acts_statically(body, np.sqrt(K) / (2 * np.pi), Y, 0.0 if up_to is None else up_to)
    D = D * (M if D.ndim == 1 else np.outer(M, M))
    return ModalEquations(inputs=tuple(inputs), units=units, K=K, D=D, B=B, drives=drives, basis=Y, M=M)


def _uncoupled(body: FlexibleBody) -> tuple[np.ndarray, np.ndarray]:
    """Return K and the basis of modes with unit mass."""
    if body.normalised:
        return body.K, np.eye(body.n)
    K, Y = scipy.linalg.eigh(np.diag(body.K), body.modal_mass)
    return np.maximum(K, 0.0), Y


def _damping(body: FlexibleBody, given: Damping, K: np.ndarray, Y: np.ndarray) -> np.ndarray:
    """Return D in the modes with unit mass: (n,), or (n, n) where it couples them."""
    if isinstance(given, Rayleigh):
        return given.alpha + given.beta * K
    if given is not None and (isinstance(given, Mapping) or np.ndim(given) < 2):
        w = np.sqrt(K)
        return 2 * damping_ratio(given, w / (2 * np.pi)) * w
    D = body.damping_matrix if given is None else np.asarray(given, dtype=float)
    if D.shape != (body.n, body.n):
        raise InputError(f"a damping matrix of shape {D.shape} is given for {body.n} modes; give ({body.n}, {body.n})")
    D = Y.T @ D @ Y
    off = D - np.diag(np.diag(D))
    return D if np.abs(off).max(initial=0.0) > COUPLED * np.abs(D).max(initial=0.0) else np.diag(D).copy()


def unit_inputs(body: FlexibleBody, inputs: Sequence[str]) -> tuple[np.ndarray, tuple[str, ...]]:
    """Return A, W and interface loads (12 + 6 n_if, k) of each unit input, and its unit.

    Raises
    ------
    InputError
        When an input is not known.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> columns, units = unit_inputs(uniform_beam(modes=1), ["base.y", "tip.rx"])
    >>> columns.nonzero()[0], units
    (array([ 1, 21]), ('m/s^2', 'N m'))
    """
    known = input_names(body.interface_name)
    E = np.zeros((DRIVES + 6 * len(body.interface_name), len(inputs)))
    units = []
    for column, name in enumerate(inputs):
        if name not in known:
            raise InputError(f"response: there is no input {name!r}; {suggestion(name, known, 'there are')}")
        place, _, direction = name.rpartition(".")
        k = DIRECTIONS.index(direction)
        if place != BASE:
            E[DRIVES + 6 * body.interface_name.index(place) + k, column] = 1.0
        elif k < 3:
            E[k, column] = 1.0
        else:
            E[3:DRIVES, column] = skew(UNIT[k - 3]).ravel()
        units.append((("N", "N m") if place != BASE else ("m/s^2", "rad/s^2"))[k >= 3])
    return E, tuple(units)


def input_names(interfaces: Sequence[str]) -> list[str]:
    """Return the names of all inputs of a body with these interfaces, the root first.

    Raises
    ------
    InputError
        When an interface other than the root is called base.

    Examples
    --------
    >>> input_names(["root", "tip"])[5:8]
    ['base.rz', 'tip.x', 'tip.y']
    """
    if BASE in interfaces[1:]:
        raise InputError(
            "an interface that is not the root is called 'base', as the input is; rename it for a response"
        )
    return [f"{place}.{d}" for place in (BASE, *interfaces[1:]) for d in DIRECTIONS]
