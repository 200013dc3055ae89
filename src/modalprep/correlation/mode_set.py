"""Mode shapes at points, of a body or of a test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.frames import in_mean_axes
from modalprep.errors import InputError
from modalprep.records import Record

BOUNDARIES = ("clamped", "free")


@dataclass(frozen=True, eq=False, kw_only=True)
class ModeSet(Record):
    """Modes at points; a component that was not measured is NaN in all modes.

    Attributes
    ----------
    name : str
    points : (p, 3)
        m.
    shape : (p, 3, n) float or complex
        Displacements along the axes of the points; 1/sqrt(kg) where `unit_mass`, else of any scale.
    frequency : (n,)
        Hz.
    damping : (n,)
        Fraction of critical damping, NaN where it is unknown.
    labels : (p,) int
        Numbers of the points.
    lines : (m, 2) int
        Pairs of points that a picture joins.
    unit_mass : bool
        Whether the modal mass of each shape is 1 kg.
    axes : (p, 3, 3) or None
        Directions of the three components of each point, by rows; None: x, y, z.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body_modes(uniform_beam(modes=4))
    ModeSet('beam', 4 modes, 0.6044..7.566 Hz, 123 components of 41 points)
    """

    name: str
    points: np.ndarray
    shape: np.ndarray
    frequency: np.ndarray
    damping: np.ndarray
    labels: np.ndarray
    lines: np.ndarray
    unit_mass: bool = False
    axes: np.ndarray | None = None

    def __repr__(self) -> str:
        """Name, frequency range, and what is measured."""
        band = f"{self.frequency[0]:.4g}..{self.frequency[-1]:.4g} Hz" if self.n else "none"
        count = f"{np.count_nonzero(self.measured)} components of {len(self.points)} points"
        return f"ModeSet({self.name!r}, {self.n} modes, {band}, {count})"

    @property
    def n(self) -> int:
        """Number of modes."""
        return len(self.frequency)

    @property
    def measured(self) -> np.ndarray:
        """Which components (p, 3) are known, in all modes."""
        return np.logical_not(np.isnan(self.shape).any(axis=2))

    def select(self, modes: np.ndarray) -> ModeSet:
        """Return some of the modes, by their number from 0.

        Returns
        -------
        ModeSet
        """
        return self.with_(shape=self.shape[:, :, modes], frequency=self.frequency[modes], damping=self.damping[modes])

    def moved(self, origin: np.ndarray, rotation: np.ndarray) -> ModeSet:
        """Return the modes in another frame at `origin` (3,), m, whose axes in the present ones are the rows (3, 3).

        Returns
        -------
        ModeSet
        """
        axes = None if self.axes is None and np.array_equal(rotation, np.eye(3)) else self._directions @ rotation.T
        return self.with_(points=(self.points - origin) @ rotation.T, axes=axes)

    @property
    def _directions(self) -> np.ndarray:
        return np.tile(np.eye(3), (len(self.points), 1, 1)) if self.axes is None else self.axes

    @property
    def vectors(self) -> np.ndarray:
        """Displacements (p, 3, n) along x, y, z; components that were not measured count as zero."""
        known = np.nan_to_num(self.shape)
        return known if self.axes is None else np.einsum("pab,pan->pbn", self.axes, known)

    def sees(self, shape: np.ndarray) -> np.ndarray:
        """Return the components (p, 3, n) that the points measure of displacements along x, y, z.

        Returns
        -------
        (p, 3, n)
        """
        return shape if self.axes is None else np.einsum("pab,pbn->pan", self.axes, shape)

    def real(self) -> ModeSet:
        """Return real modes: each complex shape turned to the phase in which it is largest.

        Returns
        -------
        ModeSet

        References
        ----------
        N. Niedbal, Analytical determination of real normal modes from measured complex responses, SDM 1984.
        """
        if not np.iscomplexobj(self.shape):
            return self
        known = np.nan_to_num(self.shape.reshape(-1, self.n))
        phase = np.angle((known**2).sum(axis=0)) / 2
        return self.with_(shape=(self.shape * np.exp(-1j * phase)).real)


def body_modes(body: FlexibleBody, boundary: Literal["clamped", "free"] = "clamped") -> ModeSet:
    """Return the modes of a body at the points of its mesh, in its frame.

    Parameters
    ----------
    body : FlexibleBody
    boundary : "clamped" or "free"
        At the root interface, or free: the elastic modes of the floating body, at points from the root all the same.

    Returns
    -------
    ModeSet

    Raises
    ------
    InputError
        When the body has no modes, or no mesh.
    """
    if boundary not in BOUNDARIES:
        raise InputError(f"boundary = {boundary!r} is neither 'clamped' nor 'free'")
    if not (body.n and len(body.points)):
        raise InputError(f"body {body.name!r} has no modes at the points of a mesh to compare")
    moving = in_mean_axes(body) if boundary == "free" else body
    omega = np.sqrt(moving.K)
    damping = np.divide(moving.D, 2 * omega, out=np.full(moving.n, np.nan), where=omega > 0)
    return ModeSet(
        name=body.name,
        points=body.points,
        shape=moving.shape,
        frequency=moving.frequency,
        damping=damping,
        labels=np.arange(1, len(body.points) + 1),
        lines=np.zeros((0, 2), dtype=int),
        unit_mass=moving.normalised,
    )
