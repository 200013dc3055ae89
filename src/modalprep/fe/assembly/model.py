"""The assembled finite-element model (theory 1)."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.drawing import Viewed
from modalprep.fe.assembly.geometric_stiffness import PrestressStiffness
from modalprep.fe.assembly.group_energy import Groups
from modalprep.fe.assembly.parts import Elements
from modalprep.fe.assembly.rotating_mass import RotatingMass
from modalprep.fe.assembly.strain_energy import StrainEnergy
from modalprep.fe.assembly.totals import MassTensor
from modalprep.fe.elements.mass import RigidInertia
from modalprep.fe.links.interface import InterfaceFrame
from modalprep.records import Record
from modalprep.vectors import skew
from modalprep.verdicts.notes import with_warnings


class AddedTerm(NamedTuple):
    """What a term of a user adds to a model.

    Attributes
    ----------
    K, M : (n_dof, n_dof) csr or None
        Its part of stiffness and mass; None where it adds nothing.
    """

    K: csr_array | None
    M: csr_array | None


@dataclass(frozen=True, eq=False, kw_only=True)
class FEModel(Record, Viewed):
    """The assembled model, in a frame with the root interface at its origin and the axes of the mesh.

    The DOFs are those of the mesh nodes, then six for each RBE2 or RBE3 frame. ``u = C @ u[free]`` expresses them by
    the independent ones, because the nodes of a rigid link follow its frame; ``C.T @ K @ C`` is the stiffness of the
    independent DOFs.

    Attributes
    ----------
    points : (n_points, 3)
        Mesh nodes, m.
    cells : {type: (k, nodes)}
        The structural cells.
    dof : (n_nodes, 6) int
        Number of each DOF (ux, uy, uz, rx, ry, rz), -1 where a node has none; mesh nodes, then frames.
    K, M : (n_dof, n_dof) csr
        Stiffness (N/m, N, N m) and mass (kg, kg m, kg m^2), mesh axes.
    g : (n_dof, 3)
        ``int rho N_a``.
    h : (n_dof, 3, 3)
        ``h[:, a, b] = int rho x_b N_a``.
    M_ab : MassTensor
        ``M_ab[a, b] (n_dof, n_dof)`` is ``int rho N_a^T N_b``.
    rigid : RigidInertia
        m, s0, E0 about the origin.
    C : (n_dof, n_free) csr
    free : (n_free,) int
        The independent DOFs.
    interfaces : tuple of InterfaceFrame
        The root first.
    geometric_stiffness : PrestressStiffness
        ``(d, load) -> (n_dof, n_dof) csr``: the stiffness of the prestress due to displacement ``d (n_dof,)`` under
        the nodal load ``load (n_dof,)``.
    rotating_mass : RotatingMass
        Contribution of eccentric mass to the geometric stiffness under inertia loads.
    origin : (3,)
        The root interface in mesh coordinates, m.
    strain_energy : StrainEnergy or None
        ``Phi (n_dof, n) -> {type: (n_cells, n)}``; None where the elements are not known.
    groups : Groups or None
        Mass and kinetic energy of the mesh groups; None where the elements are not known.
    elements : Elements or None
        The elements with their properties; None where they are not known.
    damping : (n_dof, n_dof) csr or None
        Viscous damping of the dampers of the mesh (N s/m, N s, N m s), mesh axes; None without any.
    terms : dict of AddedTerm
        What `Term`, `Foundation` and `AddedMass` add to K and M, by name.
    loads : {name: (n_dof,)}
        Nodal loads (N, N m) of the terms that are loads.
    source : dict of str
        Name and hash of the mesh.
    notes : tuple of str
        Messages for the user: cells left out, hidden hinges.
    scale : float
        The length unit of the mesh file, m.

    References
    ----------
    Theory 1.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> model = cantilever_model(elements=4)
    >>> model.K.shape, round(model.rigid.m, 9)
    ((30, 30), 12.0)
    """

    points: np.ndarray
    cells: dict[str, np.ndarray]
    dof: np.ndarray
    K: csr_array
    M: csr_array
    g: np.ndarray
    h: np.ndarray
    M_ab: MassTensor
    rigid: RigidInertia
    C: csr_array
    free: np.ndarray
    interfaces: tuple[InterfaceFrame, ...]
    geometric_stiffness: PrestressStiffness
    rotating_mass: RotatingMass
    origin: np.ndarray
    strain_energy: StrainEnergy | None = None
    groups: Groups | None = None
    elements: Elements | None = None
    damping: csr_array | None = None
    terms: dict[str, AddedTerm] = field(default_factory=dict)
    loads: dict[str, np.ndarray] = field(default_factory=dict)
    source: dict[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    scale: float = 1.0

    @property
    def n_dof(self) -> int:
        """Number of DOFs, dependent ones included."""
        return self.K.shape[0]

    @property
    def inertia_loads(self) -> np.ndarray:
        """Inertia loads (n_dof, 12) of unit ``A_a`` (3), then unit ``W_ab`` (9, row by row): ``-g_a``, ``-h_ab``."""
        return -np.concatenate([self.g, self.h.reshape(-1, 9)], axis=1)

    def rigid_body(self) -> np.ndarray:
        """Return the displacements (n_dof, 6) of unit translations and unit rotations about the origin, mesh axes."""
        frames = [frame.position for frame in self.interfaces if len(frame.nodes)]
        return rigid_motions(np.concatenate([self.points, np.reshape(frames, (-1, 3))]), self.dof, self.n_dof)

    def __repr__(self) -> str:
        """Size, mass and interfaces, and the warnings."""
        names = ", ".join(f.name for f in self.interfaces)
        size = f"{len(self.points)} nodes, {self.n_dof} DOFs, m={self.rigid.m:.6g} kg"
        return with_warnings(f"FEModel({size}; interfaces {names})", self.notes)


def rigid_motions(nodes: np.ndarray, dof: np.ndarray, n: int) -> np.ndarray:
    """Return the displacements ``(n, 6)`` of unit translations and unit rotations about the origin.

    `nodes (n_nodes, 3)` in m, ``dof (n_nodes, 6)`` with -1 where a node has none.

    Examples
    --------
    >>> rigid_motions(np.array([[2.0, 0, 0]]), np.array([[0, 1, 2, -1, -1, -1]]), 3)[:, 5]
    array([0., 2., 0.])
    """
    full = np.zeros((len(nodes), 6, 6))
    full[:] = np.eye(6)
    full[:, :3, 3:] = -skew(nodes)
    R = np.zeros((n, 6))
    R[dof[dof >= 0]] = full[dof >= 0]
    return R
