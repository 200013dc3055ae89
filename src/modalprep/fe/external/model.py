"""The finite-element model of stiffness and mass matrices that another program assembled."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.fe.assembly.assemble import root_first, without_unused_dofs
from modalprep.fe.assembly.link_stiffness import LinkStiffness
from modalprep.fe.assembly.matrix_checks import (
    Places,
    real_square,
    refuse_parts,
    refuse_strain,
    refuse_unequal_mass,
    symmetric,
)
from modalprep.fe.assembly.matrix_mass import linear_vectors, mass_tensor, rigid_inertia
from modalprep.fe.assembly.model import FEModel, rigid_motions
from modalprep.fe.assembly.placing import NOTHING, place
from modalprep.fe.assembly.rotating_mass import RotatingMass
from modalprep.fe.links.constraints import constrain
from modalprep.fe.links.interface import Interface, interface_position
from modalprep.fe.mesh.mesh import Mesh, SupportSet
from modalprep.fe.readers.entries import cloud
from modalprep.fe.readers.read import LENGTH_UNITS, MASS_UNITS, refuse_units

DRAWN = 20_000  # couplings of the stiffness that are drawn as lines, at most
NO_STIFFENING = (
    "no geometric stiffness: built from matrices; the body is for small speeds of rotation and accelerations only"
)
ROTATIONS = (
    "built from matrices with rotations: the symmetric part of H and the parts of P are approximate, by the order of "
    "rotary inertia and of (element length / body length)^2"
)

NO_FACES = "built from matrices without faces: every node of an rbe3 counts alike, whatever its area"

NO_ARMS = (
    "built from matrices with rotations: what mass beside the nodes (rotary inertia, offsets) adds to the geometric "
    "stiffness under inertia loads is not known and left out"
)

StressStiffness = Callable[[np.ndarray], Any]


def model_from_matrices(
    K: Any,
    M: Any,
    nodes: np.ndarray | Mesh,
    dof: np.ndarray | None = None,
    *,
    interfaces: Mapping[str, Interface],
    root: str | None = None,
    length_unit: str = "m",
    mass_unit: str | None = None,
    geometric_stiffness: StressStiffness | None = None,
    held: Mapping[str, SupportSet] = NOTHING,
) -> FEModel:
    """Return the model of the free (unsupported) structure whose matrices another program assembled.

    Rows belong to displacements and rotations along global axes. Of the mass integrals, m, s0, E0, g, the
    antisymmetric part of h and the sum of the mass tensor are exact; where nodes have no rotations (solids) all
    integrals are exact. The others are approximate.

    Parameters
    ----------
    K, M : (n, n) sparse or dense
        Symmetric.
    nodes : (n_nodes, 3) or Mesh
        Coordinates in `length_unit`; a mesh (in m) also brings groups, node numbers and cells to draw.
    dof : (n_nodes, 6) int, or (n, 2) int
        Row of each node's ux, uy, uz, rx, ry, rz, -1 where it has none; or (row of the node in `nodes`, component
        0..5) per row of the matrices. Default three or six rows per node, in the order of the nodes.
    interfaces : {name: Interface}
        At least one, positions in m.
    root : str
        The interface at which the body frame sits; default the first.
    length_unit, mass_unit : str
        Units of the matrices, with seconds; ``mass_unit`` may be left out with metres (kg).
    geometric_stiffness : callable
        ``d (n,) -> (n, n)``, SI: the geometric stiffness of the prestress due to displacement d. Without it the
        model has none, and a note states this.
    held : {name: SupportSet}
        Components of nodes that are held at the frame of the root interface, which may then be of kind "support".

    Returns
    -------
    FEModel
        In a frame at the root interface with the axes of the nodes, SI units; without stress recovery.

    Raises
    ------
    InputError
        When the matrices are not those of a free elastic structure with these nodes.

    References
    ----------
    Theory 8.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.fe.links.interface import Interface
    >>> beam = cantilever_model(4)
    >>> model = model_from_matrices(beam.K, beam.M, beam.points, interfaces={"root": Interface(node=1, kind="node")})
    >>> round(model.rigid.m, 9), model.notes[0][:23]
    (12.0, 'no geometric stiffness:')
    """
    length, mass = unit_factors(length_unit, mass_unit)
    mesh = nodes.with_(links=(), equations=()) if isinstance(nodes, Mesh) else cloud(nodes, length)
    K, M = real_square(K, "stiffness"), real_square(M, "mass")
    if K.shape != M.shape:
        raise InputError(f"stiffness has {K.shape[0]} rows, mass {M.shape[0]}; export both with the same DOFs")
    dof = dof_table(dof, len(mesh.points), K.shape[0], mesh.labels)
    at = Places(dof, mesh.labels)
    scale = _scale(dof, K.shape[0], length)
    K, M = (
        (symmetric(A, name, at) * scale * scale[:, None] * mass).tocsr() for A, name in ((K, "stiffness"), (M, "mass"))
    )
    used = np.unique(np.nonzero(dof >= 0)[0][(K.diagonal() + M.diagonal())[dof[dof >= 0]] > 0])
    for name in (name for name, spec in interfaces.items() if spec.kind == "support" and not held):
        raise InputError(f"interface {name!r} is of kind 'support', but matrices have no supports; name its nodes")
    on_ground = [support.nodes for support in held.values()]
    sets = {
        name: np.unique(np.concatenate(on_ground)) if spec.kind == "support" else spec.nodes(mesh, used)
        for name, spec in ((name, interfaces[name]) for name in root_first(interfaces, root))
    }
    place_of = {name: interface_position(mesh, name, interfaces[name], own) for name, own in sets.items()}
    edges = _edges(K, dof)
    ties = [at[None] for name, at in sets.items() if interfaces[name].kind != "node"]
    ties += [nodes[None] for nodes in on_ground]
    refuse_parts([edges, *ties], used, mesh.points, at)
    _refuse_bad_motion(
        K, M, rigid_motions(mesh.points - next(iter(place_of.values())), dof, K.shape[0]), mesh.points, at
    )
    drawn = mesh.with_(cells=_drawn(mesh, edges))
    return _model(K, M, drawn, dof, (interfaces, sets, place_of, held), geometric_stiffness)


def _model(K, M, mesh, dof, placed, stress_stiffness) -> FEModel:
    """Add the frames of the interfaces to the DOFs and take every integral from M."""
    interfaces, sets, at, held = placed
    origin = next(iter(at.values()))
    n = K.shape[0]
    at_frames = [position for name, position in at.items() if interfaces[name].kind != "node"]
    dof = np.concatenate([dof, n + np.arange(6 * len(at_frames)).reshape(-1, 6)])
    K, M = (_widened(A, n + 6 * len(at_frames)) for A in (K, M))
    frames, links, _, unlike = place(mesh, interfaces, sets, at, dof, held)
    unlike += (NO_FACES,) if any(link.kind == "rbe3" and link.mean_points is None for link in links) else ()
    constraints = constrain(links, K.shape[0])
    C, free = without_unused_dofs(constraints.C, constraints.free, K.diagonal() + M.diagonal(), frames)
    R = rigid_motions(np.concatenate([mesh.points, np.reshape(at_frames, (-1, 3))]) - origin, dof, K.shape[0])
    g, h = linear_vectors(M, dof, R)
    supplied = Supplied(stress_stiffness, LinkStiffness(K, constraints), n)
    said = () if stress_stiffness else (NO_STIFFENING,)
    turns = (ROTATIONS,) if np.any(dof[: len(mesh.points), 3:] >= 0) else ()
    turns += (NO_ARMS,) if turns and stress_stiffness else ()
    return FEModel(
        points=mesh.points - origin,
        cells=mesh.cells,
        dof=dof,
        K=K,
        M=M,
        g=g,
        h=h,
        M_ab=mass_tensor(M, dof),
        rigid=rigid_inertia(M, R),
        C=C,
        free=free,
        interfaces=frames,
        geometric_stiffness=supplied if stress_stiffness else Missing(),
        rotating_mass=RotatingMass([], dof),
        origin=origin,
        source={"mesh": mesh.source, "mesh_sha256": mesh.sha256, "notes": "; ".join((*said, *turns))},
        notes=(*mesh.notes, *said, *turns, *unlike),
    )


class Missing:
    """The missing geometric stiffness of a model from matrices."""

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Refuse: zero would be wrong."""
        raise InputError(
            "a model from matrices has no geometric stiffness, so that buckling and modes under load are not known; "
            "give geometric_stiffness to model_from_matrices, or assemble the mesh"
        )

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return none: zeros ``(k, n, n)``, which make a body without geometric stiffness."""
        return np.zeros((loads.shape[1], Phi.shape[1], Phi.shape[1]))


@dataclass(frozen=True, eq=False)
class Supplied:
    """The user's geometric stiffness, and that of the rigid links of the interfaces.

    Attributes
    ----------
    given : callable
        ``d (n,) -> (n, n)``, over the DOFs of the user's matrices, SI.
    links : LinkStiffness
    n : int
        Rows of the user's matrices.
    """

    given: StressStiffness
    links: LinkStiffness
    n: int

    def __call__(self, d: np.ndarray, load: np.ndarray) -> csr_array:
        """Return ``Kg (n_dof, n_dof)`` of the prestress due to displacement d under the nodal load (N)."""
        Kg = real_square(self.given(d[: self.n]), "geometric stiffness")
        if Kg.shape[0] != self.n:
            raise InputError(f"geometric_stiffness returned {Kg.shape[0]} rows; return one for each of {self.n} DOFs")
        own = _widened(((Kg + Kg.T) / 2).tocsr(), len(d))
        return (own + self.links(d, load)).tocsr()

    def project(self, static: np.ndarray, loads: np.ndarray, Phi: np.ndarray) -> np.ndarray:
        """Return ``Phi^T Kg Phi (k, n, n)`` of the prestress of each static response (n_dof, k) under its load."""
        out = np.zeros((loads.shape[1], Phi.shape[1], Phi.shape[1]))
        for k in np.flatnonzero(np.any(loads, axis=0)):
            out[k] = Phi.T @ (self(static[:, k], loads[:, k]) @ Phi)
        return out


def unit_factors(length_unit: str, mass_unit: str | None) -> tuple[float, float]:
    """Return m and kg per unit; matrices in metres are taken to be in kg, N, s."""
    refuse_units(length_unit, mass_unit)
    if mass_unit is None and length_unit != "m":
        raise InputError(
            f"the matrices are in {length_unit} and seconds: say in which mass_unit ({', '.join(MASS_UNITS)}; "
            "commonly 't' with mm, 'slinch' with in)"
        )
    return LENGTH_UNITS[length_unit], MASS_UNITS[mass_unit or "kg"]


def dof_table(dof: Any, n_nodes: int, n: int, labels: np.ndarray) -> np.ndarray:
    """Return the number of each DOF ``(n_nodes, 6)``, -1 where a node has none.

    Parameters
    ----------
    dof : (n_nodes, 6) int, or (n, 2) int of (row of the node, component 0..5) per DOF, or None
        None: three or six DOFs per node, in the order of the nodes.
    """
    if dof is None:
        if n not in (3 * n_nodes, 6 * n_nodes):
            raise InputError(
                f"the matrices have {n} DOFs, {n_nodes} nodes have {3 * n_nodes} (three each) or {6 * n_nodes} (six "
                "each): some nodes or DOFs are missing; give every node, or say which DOF is which"
            )
        dof = np.pad(np.arange(n).reshape(n_nodes, -1), ((0, 0), (0, 6 - n // n_nodes)), constant_values=-1)
    dof = np.asarray(dof)
    if dof.ndim != 2 or dof.shape not in {(n_nodes, 6), (n, 2)} or dof.dtype.kind not in "iu":
        raise InputError(
            f"dof is a table of {dof.dtype} with shape {dof.shape}; give whole numbers, ({n_nodes}, 6) or ({n}, 2)"
        )
    table = dof.astype(int) if dof.shape == (n_nodes, 6) else _from_pairs(dof, n_nodes)
    found, count = np.unique(table[table >= 0], return_counts=True)
    if not (np.array_equal(found, np.arange(n)) and np.all(count == 1) and table.min(initial=0) >= -1):
        raise InputError(f"dof must number each of the {n} rows of the matrices exactly once")
    partial = np.flatnonzero(np.any(table[:, :3] >= 0, axis=1) ^ np.all(table[:, :3] >= 0, axis=1))
    partial = np.union1d(partial, np.flatnonzero(np.any(table[:, 3:] >= 0, axis=1) & (table[:, 0] < 0)))
    if len(partial):
        raise InputError(
            f"{Places(table, labels).node(partial[0])} lacks some of its translations ({len(partial)} such nodes): "
            "supports were taken out of the matrices; export the unsupported structure"
        )
    return table


def _from_pairs(pairs: np.ndarray, n_nodes: int) -> np.ndarray:
    node, component = pairs.T
    if np.any((node < 0) | (node >= n_nodes)):
        raise InputError(f"dof names node row {node.max()}, but there are {n_nodes} nodes; give every node")
    if np.any((component < 0) | (component > 5)):
        raise InputError("dof names components other than 0 to 5 (ux, uy, uz, rx, ry, rz)")
    table = np.full((n_nodes, 6), -1)
    table[node, component] = np.arange(len(pairs))
    return table


def _scale(dof: np.ndarray, n: int, length: float) -> np.ndarray:
    """Return the factors of rows: those of rotations (moments) have one power of length more than those of forces."""
    scale = np.ones(n)
    scale[dof[:, 3:][dof[:, 3:] >= 0]] = length
    return scale


def _edges(K: csr_array, dof: np.ndarray) -> np.ndarray:
    """Pairs of nodes ``(k, 2)`` that the stiffness couples, the smaller first."""
    node = np.empty(K.shape[0], dtype=int)
    node[dof[dof >= 0]] = np.nonzero(dof >= 0)[0]
    at = K.tocoo()
    pairs = np.stack([node[at.row], node[at.col]], axis=1)
    keys = np.unique(pairs[pairs[:, 0] < pairs[:, 1]] @ [len(dof), 1])
    return np.stack([keys // len(dof), keys % len(dof)], axis=1)


def _widened(A: csr_array, n: int) -> csr_array:
    """Return a copy with empty rows and columns up to n."""
    wide = A.copy()
    wide.resize((n, n))
    return wide


def _refuse_bad_motion(K, M, R, points, at) -> None:
    r = rigid_inertia(M, R)
    size = float(np.ptp(points, axis=0).max())
    refuse_unequal_mass(R.T @ (M @ R), r.m, r.s0, size)
    refuse_strain(K, R, at)


def _drawn(mesh: Mesh, edges: np.ndarray) -> dict[str, np.ndarray]:
    """Return the cells for pictures: those of the mesh, else the pairs that the stiffness couples, if not too many."""
    cells = {kind: conn for kind, conn in mesh.cells.items() if kind != "vertex" and len(conn)}
    if cells or not 0 < len(edges) <= DRAWN:
        return cells or {"vertex": np.arange(len(mesh.points))[:, None]}
    return {"line": edges}
