"""The stations of a body: its parts, each with a mean frame that moves linearly in the modes relative to the next."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from modalprep.errors import InputError
from modalprep.records import Record

FLAT = 1e-9  # of a part's largest moment of inertia: about an axis of less mass nothing is said to turn


@dataclass(frozen=True, eq=False, kw_only=True)
class OutsideBasis(Record):
    """Static derivatives outside the basis: coordinates q lack ``z products[r] z`` of each, ``z = shapes q``.

    Attributes
    ----------
    shapes : (k, n)
        The softest shapes, at unit strain energy, in the modal coordinates.
    products : (m, k, k)
    moved, turned : (N, 3, m)
        Mean displacement and rotation of each part.
    phi, psi : (n_if, 3, m)
        Translation and rotation of the interfaces.
    """

    shapes: np.ndarray
    products: np.ndarray
    moved: np.ndarray
    turned: np.ndarray
    phi: np.ndarray
    psi: np.ndarray


@dataclass(frozen=True, eq=False, kw_only=True)
class Stations(Record):
    """Parts of a body along the ways from its root, parents first (theory 4.10); in the axes of the body, SI units.

    Attributes
    ----------
    parent : (N,) int
        The neighbour nearer the root, -1 where the root is.
    m : (N,)
        kg.
    centre : (N, 3)
        Centre of mass, m.
    E : (N, 3, 3)
        ``int rho x_a x_b`` about the centre, kg m^2.
    S : (N, 3, n)
        ``int rho phi_a`` over the part.
    H : (N, 3, 3, n)
        ``H[p, a, b] = int rho x_b phi_a`` about the centre.
    owner : (n_if,) int
        The part that each interface is on, -1 of the root.
    part : (n_points,) int
        The part that each mesh node is on, -1 of nodes without elements.
    outside : OutsideBasis or None
        Derivatives beyond those of the basis, for the statement of its error.
    idle_below : float
        Of the body's size: runs and equilibria leave the stations out where the modes alone move interfaces and centre
        of mass to this as they do (`large_deflection = "auto"`); 0, never.

    Examples
    --------
    >>> from modalprep.examples import large_cantilever
    >>> stations = large_cantilever(modes=2, stations=4).stations
    >>> assert stations is not None
    >>> len(stations), stations.parent, stations.m.round(9)
    (4, array([-1,  0,  1,  2]), array([3., 3., 3., 3.]))
    """

    parent: np.ndarray
    m: np.ndarray
    centre: np.ndarray
    E: np.ndarray
    S: np.ndarray
    H: np.ndarray
    owner: np.ndarray
    part: np.ndarray
    outside: OutsideBasis | None = None
    idle_below: float = 0.0

    def __len__(self) -> int:
        """Number of parts."""
        return len(self.m)

    def __repr__(self) -> str:
        """Number of parts and of ways that end."""
        ends = len(set(range(len(self))) - set(self.parent.tolist()))
        return f"Stations({len(self)} parts, {ends} ends)"

    def in_basis(self, Y: np.ndarray) -> Stations:
        """Return the stations in coordinates p of ``q = Y p``.

        Returns
        -------
        Stations

        Examples
        --------
        >>> from modalprep.examples import large_cantilever
        >>> stations = large_cantilever(modes=2, stations=4).stations
        >>> assert stations is not None
        >>> stations.in_basis(np.eye(10)[:, :3]).S.shape
        (4, 3, 3)
        """
        outside = self.outside and self.outside.with_(shapes=self.outside.shapes @ Y)
        return self.with_(S=self.S @ Y, H=self.H @ Y, outside=outside)

    @cached_property
    def J(self) -> np.ndarray:
        """Moments of inertia (N, 3, 3) about the centres, kg m^2."""
        return np.trace(self.E, axis1=1, axis2=2)[:, None, None] * np.eye(3) - self.E

    @cached_property
    def moved(self) -> np.ndarray:
        """Mean displacement (N, 3, n) of each part per modal coordinate."""
        return self.S / self.m[:, None, None]

    @cached_property
    def turned(self) -> np.ndarray:
        """Mean rotation (N, 3, n) of each part per modal coordinate: that of the rigid motion nearest in the mass."""
        return mean_turns(self.J, self.H)


def mean_turns(J: np.ndarray, H: np.ndarray) -> np.ndarray:
    """Return the mean rotations (N, 3, n) of parts of inertia ``J (N, 3, 3)``; ``H (N, 3, 3, n)`` as in `Stations`."""
    moment = np.stack([H[:, 2, 1] - H[:, 1, 2], H[:, 0, 2] - H[:, 2, 0], H[:, 1, 0] - H[:, 0, 1]], axis=1)
    size, axes = np.linalg.eigh(J)
    has = size > FLAT * size[:, -1:]
    inverse = np.divide(1.0, size, out=np.zeros_like(size), where=has)
    return np.einsum("pac,pc,pbc,pbn->pan", axes, inverse, axes, moment)


def refuse_stations(what: str, stations: Stations | None, instead: str = "") -> None:
    """Refuse what does not know large deflections.

    Examples
    --------
    >>> refuse_stations("an orbit", None)
    """
    if stations is not None:
        advice = instead or "build the body with large_deflection = false"
        raise InputError(f"{what} does not work with a body of stations (large_deflection) yet; {advice}")
