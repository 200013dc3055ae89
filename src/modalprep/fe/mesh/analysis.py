"""What a deck says of its analyses: static loads, and for each subcase or step supports, modes, damping, gravity."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from modalprep.records import Record

Damping = float | list[list[float]] | dict[str, float]


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadSet(Record):
    """A static load that a file brings; a reduction has it only where a `Load` names the set.

    Attributes
    ----------
    nodes : (k,) int
    forces : (k, 3) float
        N, mesh axes.
    moments : (k, 3) float
        N m, mesh axes.

    Examples
    --------
    >>> LoadSet.of_terms([(4, 0, 2.0), (4, 0, 1.0), (7, 5, 0.5)]).forces
    array([[3., 0., 0.],
           [0., 0., 0.]])
    """

    nodes: np.ndarray
    forces: np.ndarray
    moments: np.ndarray

    @classmethod
    def of_terms(cls, terms: Iterable[tuple[int, int, float]]) -> LoadSet:
        """Return the sum of terms (node, component 0 to 5, value in N or N m), mesh axes."""
        nodes, components, values = np.array([*terms], dtype=float).reshape(-1, 3).T
        own = np.zeros((len(nodes), 6))
        own[np.arange(len(nodes)), components.astype(int)] = values
        return cls.summed(nodes.astype(int), own)

    @classmethod
    def summed(cls, nodes: np.ndarray, values: np.ndarray) -> LoadSet:
        """Return the sum of forces and moments ``values (k, 6)`` on ``nodes (k,)``, which may occur several times."""
        own, row = np.unique(nodes, return_inverse=True)
        total = np.zeros((len(own), 6))
        np.add.at(total, row.ravel(), values)
        return cls(nodes=own, forces=total[:, :3], moments=total[:, 3:])

    @property
    def is_zero(self) -> bool:
        """Whether it has neither forces nor moments."""
        return not (np.any(self.forces) or np.any(self.moments))

    def renumbered(self, place: np.ndarray) -> LoadSet:
        """Return the same load where node i is ``place[i]``."""
        return self.with_(nodes=place[self.nodes])


@dataclass(frozen=True, eq=False, kw_only=True)
class AnalysisCase(Record):
    """What a file says of one subcase or step.

    Attributes
    ----------
    number : int
    name : str
        As the file has it: ``subcase 2``.
    supports : tuple of str
        Names among ``Mesh.supports``.
    loads : tuple of str
        Names among ``Mesh.loads``.
    modes : int or None
        How many modes are asked for.
    lowest, highest : float or None
        Hz, the band in which modes are asked for.
    damping : float, list of [Hz, ratio], {"alpha": 1/s, "beta": s} or None
        Of critical, or Rayleigh's.
    gravity : (3,) float
        m/s^2, mesh axes.
    said : tuple of str
        What else it says, and what of it is approximated.

    Examples
    --------
    >>> AnalysisCase(number=1, name="subcase 1", modes=12).damping is None
    True
    """

    number: int
    name: str
    supports: tuple[str, ...] = ()
    loads: tuple[str, ...] = ()
    modes: int | None = None
    lowest: float | None = None
    highest: float | None = None
    damping: Damping | None = None
    gravity: np.ndarray = field(default_factory=lambda: np.zeros(3))
    said: tuple[str, ...] = ()

    @property
    def is_empty(self) -> bool:
        """Whether it says nothing."""
        given = (self.modes, self.lowest, self.highest, self.damping)
        return not (self.supports or self.loads or self.said or any(self.gravity)) and given == (None,) * 4
