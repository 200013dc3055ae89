"""Recovery matrices of a modal body: forces, moments, stress and accelerations that are linear in its motion."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from modalprep.body.stress import VON_MISES, von_mises
from modalprep.errors import InputError
from modalprep.records import Record, filled, given
from modalprep.vectors import skew

DRIVES = 12  # columns of `loads` before those of the interfaces: A (3), W (9)
STRESS, ACCELERATION, DISPLACEMENT = "stress", "acceleration", "displacement"  # kinds with rules of their own


class BodyMotion(NamedTuple):
    """Motion and loads of a body at nt times, in the axes of its frame B.

    Attributes
    ----------
    q, qd, qdd : (nt, n)
        Modal coordinates, m sqrt(kg), and their rates.
    A : (nt, 3)
        Specific acceleration of the origin of B (acceleration less gravity), m/s^2.
    omega, alpha : (nt, 3)
        Angular velocity and acceleration of B, rad/s and rad/s^2.
    interface_loads : (nt, n_if, 6)
        Force (N) and moment (N m) on each interface; those on the root do nothing.

    Examples
    --------
    >>> at_rest(np.array([[1e-3, 0.0]]), interfaces=2).drives().shape
    (1, 24)
    """

    q: np.ndarray
    qd: np.ndarray
    qdd: np.ndarray
    A: np.ndarray
    omega: np.ndarray
    alpha: np.ndarray
    interface_loads: np.ndarray

    def drives(self) -> np.ndarray:
        """Return what `Recovery.loads` multiplies.

        Returns
        -------
        (nt, 12 + 6 n_if) float
            A (m/s^2), ``W = alpha~ + omega~ omega~`` row by row (1/s^2), and the interface loads (N, N m).

        References
        ----------
        Theory 4.9.
        """
        w = skew(self.omega)
        nt = len(self.q)
        W = skew(self.alpha) + w @ w
        loads = self.interface_loads.reshape(nt, 6 * self.interface_loads.shape[1])
        return np.hstack([self.A, W.reshape(nt, 9), loads])


def at_rest(q: np.ndarray, interfaces: int, interface_loads: np.ndarray | None = None) -> BodyMotion:
    """Return the motion of a body whose frame is at rest without gravity.

    Parameters
    ----------
    q : (nt, n)
        Modal coordinates, m sqrt(kg).
    interfaces : int
        Their number.
    interface_loads : (nt, interfaces, 6)
        Force (N) and moment (N m); none by default.

    Returns
    -------
    BodyMotion
        Without rates and accelerations.

    Examples
    --------
    >>> at_rest(np.zeros((3, 2)), interfaces=1).A.shape
    (3, 3)
    """
    nt = len(q)
    loads = np.zeros((nt, interfaces, 6)) if interface_loads is None else np.asarray(interface_loads, dtype=float)
    still = np.zeros((nt, 3))
    return BodyMotion(q, np.zeros_like(q), np.zeros_like(q), still, still, still, loads)


@dataclass(frozen=True, eq=False, kw_only=True)
class Recovery(Record):
    """A named block of recovered quantities: p places with c components each (theory 4.9).

    At a motion (`BodyMotion`) the values are ``q Q^T + q'' R^T + (A, W, interface loads) L^T``. Mode displacement has
    Q alone; mode acceleration adds the static response of the dropped modes, R and L. Accelerations have ``Q = 0``.
    A matrix that is None is zero.

    Attributes
    ----------
    kind : str
        ``section_force``, ``reaction``, ``resultant``, ``stress`` (which has von Mises stress), ``force``,
        ``acceleration``, ``displacement``, or another word.
    places : tuple of str, length p
        Names of elements with their ends, nodes or interfaces; unique.
    components : tuple of str, length c
        Such as ``N, Vy, Vz, T, My, Mz``; a single one may be the empty text, where places are names of rows.
    units : tuple of str, length c or p c
        Of the components, or of each place's components.
    q : (p, c, n)
        Per modal coordinate.
    qdd : (p, c, n) or None
        Per modal acceleration. Of accelerations: the mode shapes at the places, in `axes`.
    loads : (p, c, 12 + 6 n_if) or None
        Per specific acceleration A of the origin of B (3), per ``W = alpha~ + omega~ omega~`` (9, row by row), then per
        force and moment on each interface; in the axes of B.
    axes : (3, 3)
        Rows: the axes of the components in B, where all places share them.
    position : (p, 3) or None
        m, in B.
    node : (p,) int or None
        Mesh nodes of the places, for pictures.
    cell : (p,) int or None
        Their cells, counted over the body's cell types in alphabetical order.
    allowable : float or None
        Largest value that is allowed, of von Mises stress or of each component's magnitude.

    Raises
    ------
    InputError
        When places repeat, or the shapes of the matrices do not agree.

    References
    ----------
    R. L. Bisplinghoff, H. Ashley, R. L. Halfman, Aeroelasticity, Addison-Wesley 1955, section 10-5: mode displacement
    and mode acceleration. Theory 4.9.

    Examples
    --------
    >>> strut = Recovery(kind="force", places=("strut",), components=("N",), units=("N",), q=np.array([[[2.0, 0.0]]]))
    >>> strut.values(at_rest(np.array([[1.0, 5.0], [3.0, 5.0]]), interfaces=1)).ravel()
    array([2., 6.])
    """

    kind: str
    places: tuple[str, ...]
    components: tuple[str, ...]
    units: tuple[str, ...]
    q: np.ndarray
    qdd: np.ndarray | None = None
    loads: np.ndarray | None = None
    axes: np.ndarray = given(converter=filled, default=None)
    position: np.ndarray | None = None
    node: np.ndarray | None = None
    cell: np.ndarray | None = None
    allowable: float | None = None

    def __post_init__(self) -> None:
        """Check the shapes; axes default to those of B."""
        if self.axes is None:
            object.__setattr__(self, "axes", np.eye(3))
        super().__post_init__()
        p, c, n = self.q.shape
        if (len(self.places), len(self.components)) != (p, c) or len(self.units) not in (c, p * c):
            raise InputError(f"a recovery of {p} places and {c} components needs as many names, and units")
        if len(set(self.places)) < p or len(set(self.components)) < c:
            raise InputError("places and components of a recovery need different names")
        if self.qdd is not None and self.qdd.shape != (p, c, n):
            raise InputError(f"qdd of a recovery has shape {self.qdd.shape} instead of {(p, c, n)}")
        width = 0 if self.loads is None else self.loads.shape[-1]
        if self.loads is not None and (self.loads.shape != (p, c, width) or width < DRIVES or width % 6):
            raise InputError(f"loads of a recovery have shape {self.loads.shape} instead of ({p}, {c}, 12 + 6 n_if)")

    @classmethod
    def of_rows(cls, *, kind: str, labels: tuple[str, ...], units: tuple[str, ...], rows: np.ndarray) -> Recovery:
        """Return a matrix of single rows, such as an output transformation matrix of a supplier.

        Parameters
        ----------
        kind : str
        labels, units : tuple of str
            Of each row.
        rows : (p, n)
            Per modal coordinate.

        Returns
        -------
        Recovery
            Of p places with one component without a name.

        Examples
        --------
        >>> bar = Recovery.of_rows(kind="force", labels=("7.axial",), units=("N",), rows=np.array([[2.0, 1.0]]))
        >>> bar.histories(at_rest(np.array([[1.0, 0.0], [0.0, 3.0]]), interfaces=1))
        {'7.axial': array([2., 3.])}
        """
        return cls(kind=kind, places=tuple(labels), components=("",), units=tuple(units), q=rows[:, None])

    @property
    def strained(self) -> bool:
        """Whether rigid motions of the frame do not change it, as they do displacements relative to it."""
        return self.kind != DISPLACEMENT

    @property
    def moves(self) -> bool:
        """Whether it needs accelerations and loads, not only the modal coordinates (mode displacement)."""
        return self.loads is not None or self.qdd is not None

    def values(self, motion: BodyMotion) -> np.ndarray:
        """Return the values at the times of a motion.

        Returns
        -------
        (nt, p, c) float
            In `units`.
        """
        found = np.tensordot(motion.q, self.q, (1, 2))
        if self.qdd is not None:
            found += np.tensordot(motion.qdd, self.qdd, (1, 2))
        if self.loads is not None:
            found += np.tensordot(motion.drives(), self.loads, (1, 2))
        return found + self._carried(motion)

    def _carried(self, motion: BodyMotion) -> np.ndarray | float:
        """Return ``W u + 2 omega x u'`` of accelerations along x, y, z; else nothing."""
        if self.kind != ACCELERATION or self.components != ("x", "y", "z") or self.qdd is None:
            return 0.0
        u, v = (np.tensordot(x, self.qdd, (1, 2)) for x in (motion.q, motion.qd))
        w, alpha = (skew(x @ self.axes.T) for x in (motion.omega, motion.alpha))
        return u @ np.swapaxes(alpha + w @ w, 1, 2) + 2 * v @ np.swapaxes(w, 1, 2)

    def histories(self, motion: BodyMotion) -> dict[str, np.ndarray]:
        """Return the histories by ``place.component``; of stress also ``place.von_mises``.

        Returns
        -------
        dict of (nt,) float
            In `units`.

        Examples
        --------
        >>> at = Recovery(kind="stress", places=("7",), components=("xx",), units=("Pa",), q=np.array([[[2.0]]]))
        >>> at.histories(at_rest(np.array([[-3.0]]), interfaces=1))
        {'7.xx': array([-6.]), '7.von_mises': array([6.])}
        """
        values = self.full_values(motion)
        return {
            f"{place}.{name}".rstrip("."): values[:, i, j]
            for i, place in enumerate(self.places)
            for j, name in enumerate(self.full_components)
        }

    @property
    def full_components(self) -> tuple[str, ...]:
        """The components, of stress with ``von_mises``."""
        return (*self.components, VON_MISES) if self.kind == STRESS else self.components

    @property
    def full_units(self) -> tuple[str, ...]:
        """The units of `full_components`."""
        return (*self.units, *self.units[:1]) if self.kind == STRESS else self.units

    def full_values(self, motion: BodyMotion) -> np.ndarray:
        """Return the values of `full_components` at the times of a motion.

        Returns
        -------
        (nt, p, c) float
            In `full_units`.
        """
        values = self.values(motion)
        if self.kind != STRESS:
            return values
        size = von_mises(dict(zip(self.components, np.moveaxis(values, -1, 0), strict=True)))
        return np.concatenate([values, size[..., None]], axis=2)

    def in_basis(self, Y: np.ndarray) -> Recovery:
        """Return the recovery in the coordinates p of ``q = Y p``, ``Y (n, r)``.

        Returns
        -------
        Recovery
            Of r coordinates.
        """
        return self.with_(q=self.q @ Y, qdd=None if self.qdd is None else self.qdd @ Y)

    def in_frame(self, c: np.ndarray, Q: np.ndarray) -> Recovery:
        """Return the recovery for a frame with its origin at c (m) and the columns of Q as axes, in the present ones.

        Returns
        -------
        Recovery
            The components keep their axes; the loads are those of the new frame.
        """
        changed: dict[str, np.ndarray] = {"axes": self.axes @ Q}
        if self.position is not None:
            changed["position"] = (self.position - c) @ Q
        if self.loads is not None:
            p, m = self.loads.shape[:2]
            A = self.loads[..., :3]
            W = self.loads[..., 3:DRIVES].reshape(p, m, 3, 3)
            W = Q.T @ (W - A[..., None] * c) @ Q
            forces = self.loads[..., DRIVES:].reshape(p, m, -1, 3) @ Q
            changed["loads"] = np.concatenate([A @ Q, W.reshape(p, m, 9), forces.reshape(p, m, -1)], axis=2)
        return self.with_(**changed)

    def following(self, a: np.ndarray) -> Recovery:
        """Return the recovery for a frame that moves by ``-a q``, ``a (6, n)``: translation (m), rotation (rad).

        Returns
        -------
        Recovery
            To first order in the motion of the frame.
        """
        if self.loads is None:
            return self
        p, m = self.loads.shape[:2]
        turn = np.moveaxis(skew(a[3:].T), 0, 2).reshape(9, -1)
        more = self.loads[..., :DRIVES] @ np.vstack([a[:3], turn])
        return self.with_(qdd=more.reshape(p, m, -1) if self.qdd is None else self.qdd + more)
