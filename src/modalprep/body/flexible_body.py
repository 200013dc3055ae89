"""The modal body: all arrays of one flexible body for multibody simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Self

import numpy as np

from modalprep.body.recovery import BodyMotion, Recovery
from modalprep.body.stations.record import Stations
from modalprep.body.stress import StressModes
from modalprep.drawing import Animated
from modalprep.records import Record, filled, given
from modalprep.reduction.table import ModalBody, ModeTable
from modalprep.verdicts.notes import with_warnings

ORIGIN, AXES = "origin at the root interface", "axes of the mesh"


@dataclass(frozen=True, eq=False, kw_only=True)
class FlexibleBody(Record, ModalBody, Animated):
    """A flexible body in modal coordinates (theory 4).

    Frame B has its origin at the root interface and the axes of the mesh, unless `frame` says otherwise
    (frames.py); every vector is resolved in B. SI units. With ``u_a(x) = phi_a(x) q`` the modal displacement and
    ``rho dV`` the mass:

    Attributes
    ----------
    name : str
    m, s0, E0 : (), (3,), (3, 3)
        ``int rho``, ``int rho x_a`` (kg m), ``int rho x_a x_b`` (kg m^2) about the origin of B.
    S : (3, n)
        ``int rho phi_a``.
    H : (3, 3, n)
        ``H[a, b] = int rho x_b phi_a``.
    P : (3, 3, n, n)
        ``P[a, b] = int rho phi_a^T phi_b``, so that ``P[0,0] + P[1,1] + P[2,2] = I``.
    Kg_A, Kg_W : (3, n, n), (3, 3, n, n)
        Geometric stiffness for the inertia loads of unit specific acceleration ``A_a = 1`` and of
        ``W_ab = 1`` (``W = alpha~ + w~ w~``); zero in a body without geometric stiffness.
    T : (n, n, n) or None
        Second order of the modal mass, ``T[i, j, k] = int rho phi_i Gamma_jk`` with the displacement
        ``phi q + Gamma_jk q_j q_k / 2``; symmetric in j, k. None where it is not taken.
    Kg_F, Kg_T : (n_if, 3, n, n)
        The same for a unit force / moment on each interface; zero for the root, except in mean axes.
    phi, psi : (n_if, 3, n)
        Translation / rotation of each interface per modal coordinate; zero for the root, except in mean axes.
    K, D : (n,)
        Modal stiffness ``(2 pi frequency)^2`` and modal damping, ``2 zeta omega`` and the diagonal of viscous dampers.
    coupled_damping : (n, n) or None
        The whole damping matrix, 1/s, where viscous dampers couple the modes; D is its diagonal.
    frequency : (n,)
        Hz, with the root interface clamped; in mean axes free-free.
    interface_name : tuple of str
        The root is the first.
    interface_position : (n_if, 3)
        m, in B.
    points, cells, shape : (n_points, 3), {type: (n_cells, nodes)}, (n_points, 3, n)
        The mesh in B and its nodal displacement per modal coordinate, for pictures.
    energy : {type: (n_cells, n)}
        Strain energy (J) of each cell at unit modal coordinate; its sum over all cells is ``K / 2``. Empty if
        unknown: a body from bare matrices, or in other modes than those of its reduction.
    volume : {type: (n_cells,)}
        m^3 of each cell, 0 for springs and masses; with `energy`, to draw its density.
    stress : {point: StressModes}
        Stress at chosen points; as `energy`, in the modes of the reduction and those that follow from them.
    recovery : {name: Recovery}
        Forces, moments, stress and accelerations that were asked for, or that the supplier of a reduced body recovers;
        in the same modes as `stress`.
    modal_mass : (n, n)
        ``int rho phi^T phi``; the identity, except for a body with the modes of another fill level (levels.py).
    truncation : (n,)
        Share of each mode in the truncation vectors, 0 to 1: what has most of it there is no mode of the structure, and
        its frequency no resonance (theory 3.4).
    modes : ModeTable
        The candidates of the reduction with the reason for keeping or dropping each.
    provenance : dict of str
        Sources of the body and their hashes.
    stations : Stations or None
        Parts of a body that deflects by more than a tenth of its size (theory 4.10); None: its modes alone move it.
    mode_names : tuple of str
        What moves in each mode, and how, such as "1st bending in y"; empty where the masses of the nodes are not known.
    notes : tuple of str
        What the user should know of the body; those that need action are warnings (`modalprep.verdicts.notes`).

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> body.n, body.interface_name
    (2, ('root', 'tip'))
    >>> bool(np.allclose(body.P[0, 0] + body.P[1, 1] + body.P[2, 2], np.eye(2)))
    True
    """

    name: str
    m: float
    s0: np.ndarray
    E0: np.ndarray
    S: np.ndarray
    H: np.ndarray
    P: np.ndarray
    Kg_A: np.ndarray
    Kg_W: np.ndarray
    Kg_F: np.ndarray
    Kg_T: np.ndarray
    phi: np.ndarray
    psi: np.ndarray
    K: np.ndarray
    D: np.ndarray
    frequency: np.ndarray
    interface_name: tuple[str, ...]
    interface_position: np.ndarray
    points: np.ndarray
    cells: dict[str, np.ndarray]
    shape: np.ndarray
    modes: ModeTable
    provenance: dict[str, str] = field(default_factory=dict)
    energy: dict[str, np.ndarray] = field(default_factory=dict)
    volume: dict[str, np.ndarray] = field(default_factory=dict)
    stress: dict[str, StressModes] = field(default_factory=dict)
    recovery: dict[str, Recovery] = field(default_factory=dict)
    modal_mass: np.ndarray = given(converter=filled, default=None)
    T: np.ndarray | None = None
    truncation: np.ndarray = given(converter=filled, default=None)
    stations: Stations | None = None
    coupled_damping: np.ndarray | None = None
    mode_names: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Assume normalised modes unless a modal mass is given, and no truncation vectors."""
        if self.modal_mass is None:
            object.__setattr__(self, "modal_mass", np.eye(len(self.K)))
        if self.truncation is None:
            object.__setattr__(self, "truncation", np.zeros(len(self.K)))
        super().__post_init__()

    @property
    def n(self) -> int:
        """Number of modal coordinates."""
        return len(self.K)

    @property
    def damping_matrix(self) -> np.ndarray:
        """Modal damping (n, n), 1/s."""
        return np.diag(self.D) if self.coupled_damping is None else self.coupled_damping

    @cached_property
    def normalised(self) -> bool:
        """Whether the modal mass is 1."""
        return np.array_equal(self.modal_mass, np.eye(self.n))

    @property
    def frame(self) -> str:
        """Origin and axes of B."""
        return f"{self.provenance.get('origin', ORIGIN)}, {self.provenance.get('axes', AXES)}"

    @cached_property
    def at_root(self) -> bool:
        """Whether B sits on the root interface and moves with it, as all joints except a free one need."""
        return not any(np.any(x[0]) for x in (self.interface_position, self.phi, self.psi))

    @cached_property
    def has_geometric_stiffness(self) -> bool:
        """Whether any geometric stiffness is stored."""
        return any(np.any(k) for k in (self.Kg_A, self.Kg_W, self.Kg_F, self.Kg_T))

    def with_(self, **changes: Any) -> Self:
        """Return a copy with the named fields changed.

        New modes (`K`) have no `energy`, `stress`, `recovery`, `truncation`, `T`, `stations` and names, and mass 1,
        unless given; new modes or another D have no `coupled_damping`.

        Returns
        -------
        FlexibleBody
            The changed copy.
        """
        none = {"energy": {}, "stress": {}, "recovery": {}, "modal_mass": None, "T": None}
        none |= {"truncation": None, "mode_names": (), "stations": None}
        own = {"coupled_damping": None} if {"K", "D"} & set(changes) else {}
        return super().with_(**((none if "K" in changes else {}) | own | changes))

    def stresses(self, q: np.ndarray) -> dict[str, np.ndarray]:
        """Return the stress (Pa) by ``point.component`` at modal coordinates ``q (..., n)``, m sqrt(kg), as ``(...)``.

        Each point has its components and ``von_mises``. Stress is linear in q: second-order displacements, represented
        by the geometric stiffness, cause no strain.

        Returns
        -------
        dict of (...) float
            Pa, in the axes of the point's element or fibre.

        References
        ----------
        Theory 7.6.

        Examples
        --------
        >>> from modalprep.examples import uniform_beam
        >>> uniform_beam(modes=2).stresses(np.zeros(2))
        {}
        """
        return {
            f"{name}.{component}": values
            for name, point in self.stress.items()
            for component, values in point.histories(q).items()
        }

    def recovered(self, motion: BodyMotion) -> dict[str, np.ndarray]:
        """Return the histories of every recovery by ``name.place.component``, and ``.von_mises`` of stress.

        Returns
        -------
        dict of (nt,) float
            In the units of the recovery.

        References
        ----------
        Theory 4.9.

        Examples
        --------
        >>> from modalprep.body.recovery import at_rest
        >>> from modalprep.examples import uniform_beam
        >>> uniform_beam(modes=2).recovered(at_rest(np.zeros((1, 2)), interfaces=2))
        {}
        """
        return {
            f"{name}.{row}": values
            for name, block in self.recovery.items()
            for row, values in block.histories(motion).items()
        }

    def conventional(self) -> FlexibleBody:
        """Return the body without geometric stiffness, T and stations: the prematurely linearised theory.

        Returns
        -------
        FlexibleBody
            In the same modes.

        References
        ----------
        Theory 4.5.
        """
        names = ("Kg_A", "Kg_W", "Kg_F", "Kg_T")
        return self.with_(**{name: np.zeros_like(getattr(self, name)) for name in names}, T=None, stations=None)

    def ruthless(self) -> FlexibleBody:
        """Return the body linearised in the modes ("ruthless" in the book), without geometric stiffness.

        Without P the moment of inertia is of first order in q, the angular-elastic coupling is constant, and the modes
        feel neither centrifugal softening nor Coriolis forces: ``q'' + D q' + K q = -(S_a A_a + W_ab H_ab)``. The mass
        matrix stays that of an energy, so balances close. For spins well below the first frequency, where stress
        stiffening does not matter.

        Returns
        -------
        FlexibleBody
            In the same modes.

        References
        ----------
        A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, section 6.7; theory 4.5.
        """
        return self.conventional().with_(P=np.zeros_like(self.P))

    def __repr__(self) -> str:
        """Name, size, mass and frequency range, and the warnings."""
        band = f"{self.frequency[0]:.4g}..{self.frequency[-1]:.4g} Hz" if self.n else "rigid"
        text = f"FlexibleBody({self.name!r}, m={self.m:.4g} kg, {self.n} modes, {band})"
        return with_warnings(text, self.notes)
