"""Resultants of shells and stress over the mesh (theory 4.9)."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import ThreeNodeBeamBlock
from modalprep.fe.elements.shells.curved import CurvedShellBlock
from modalprep.fe.elements.shells.laminate import strain_rotation
from modalprep.fe.elements.shells.shell import ShellBlock
from modalprep.fe.elements.solid import SolidBlock
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.recovery.fields import Fields, Piece, Quantity, labels, of_family

RESULTANTS = ("Nx", "Ny", "Nxy", "Mx", "My", "Mxy", "Qx", "Qy")
RESULTANT_UNITS = ("N/m",) * 3 + ("N",) * 3 + ("N/m",) * 2
PLANE = ("xx", "yy", "xy")
SPATIAL = ("xx", "yy", "zz", "xy", "yz", "xz")
SHELLS = (ShellBlock, CurvedShellBlock)
BEAMS = (BeamBlock, ThreeNodeBeamBlock)
Vector = tuple[float, float, float]
ACROSS = 0.99  # a direction whose cosine with a shell's normal is larger has no projection to speak of


def resultants(pieces: list[Piece], axis: Vector | None) -> Quantity:
    """Return the mean membrane forces, moments and transverse shears of shells, per length.

    x is the projection of `axis` on the element, by default of the x axis of the mesh, or of y where the shell is
    normal to it; z is the normal. A moment Mx stretches the side of the normal along x.

    Raises
    ------
    InputError
        When there are no shells, or the axis is normal to one.
    """
    own = of_family(pieces, SHELLS, "shells")

    def values(fields: Fields) -> np.ndarray:
        return np.concatenate([_resultants(piece, fields, axis) for piece in own])

    return Quantity(
        kind="resultant",
        places=tuple(name or "shell" for name in labels(own)),
        components=RESULTANTS,
        units=RESULTANT_UNITS,
        values=values,
        position=_centres(own),
        cell=np.concatenate([piece.cells for piece in own]),
    )


def face_stress(pieces: list[Piece], axis: Vector | None) -> Quantity:
    """Return the mean stress of shells in their two faces, ``top`` towards the normal; axes as of `resultants`.

    Raises
    ------
    InputError
        When there are no shells, or the axis is normal to one.
    """
    own = of_family(pieces, SHELLS, "shells")

    def values(fields: Fields) -> np.ndarray:
        return np.concatenate([_faces(piece, fields, axis) for piece in own])

    return Quantity(
        kind="stress",
        places=tuple(".".join(filter(None, (name, face))) for name in labels(own) for face in ("top", "bottom")),
        components=PLANE,
        units=("Pa",) * 3,
        values=values,
        position=np.repeat(_centres(own), 2, axis=0),
        cell=np.repeat(np.concatenate([piece.cells for piece in own]), 2),
    )


def node_stress(model: FEModel, mesh: Mesh, pieces: list[Piece]) -> Quantity:
    """Return the stress of solids at their nodes, the mean over the elements that share one, in axes of the mesh.

    Raises
    ------
    InputError
        When there are no solids.
    """
    own = of_family(pieces, (SolidBlock,), "solids or shells")
    nodes, count = np.unique(np.concatenate([piece.block.nodes.ravel() for piece in own]), return_counts=True)

    def values(fields: Fields) -> np.ndarray:
        total = np.zeros((len(nodes), 6, fields.u.shape[1]))
        for piece in own:
            (found,) = (stress for _, stress in piece.block.nodal_stress(fields.u[piece.dofs]).values())
            np.add.at(total, np.searchsorted(nodes, piece.block.nodes), found)
        return total / count[:, None, None]

    names = mesh.labels[nodes] if len(mesh.labels) else nodes + 1
    places = tuple(str(name) for name in names.tolist())
    return Quantity("stress", places, SPATIAL, ("Pa",) * 6, values, model.points[nodes], nodes)


def stress(model: FEModel, mesh: Mesh, pieces: list[Piece], axis: Vector | None) -> Quantity:
    """Return the stress of solids at their nodes, or that of shells in their two faces.

    Raises
    ------
    InputError
        When there are neither, or both.
    """
    blocks = [piece.block for piece in pieces]
    shells, solids, beams = (any(isinstance(b, family) for b in blocks) for family in (SHELLS, SolidBlock, BEAMS))
    if shells and solids:
        raise InputError("there are shells and solids among these elements; give each a table of its own")
    if beams and not (shells or solids):
        raise InputError("stress of beams is known in fibres: use [stress], or section forces")
    if axis is not None and not shells:
        raise InputError("'axis' has no effect on solids: their stress is along the axes of the mesh; leave it out")
    return face_stress(pieces, axis) if shells else node_stress(model, mesh, pieces)


def _centres(pieces: list[Piece[ShellBlock | CurvedShellBlock]]) -> np.ndarray:
    """Return the means of the nodes, m."""
    blocks = [piece.block for piece in pieces]
    return np.concatenate([b.centre if isinstance(b, ShellBlock) else b.x.mean(axis=1) for b in blocks])


def _resultants(piece: Piece[ShellBlock | CurvedShellBlock], fields: Fields, axis: Vector | None) -> np.ndarray:
    """Return the resultants ``(ne, 8, k)``, mean over the area."""
    B, C, dx = piece.block.strain
    weight = dx / dx.sum(axis=1, keepdims=True)
    own = C[:, :8, :8] @ np.einsum("eq,eqsj->esj", weight, B[:, :, :8]) @ fields.u[piece.dofs]
    angle = _angle(piece.block.frame, axis)
    T = _stress_rotation(angle)
    c = np.cos(angle)[:, None]
    s = np.sin(angle)[:, None]
    shear = np.stack([c * own[:, 6] + s * own[:, 7], c * own[:, 7] - s * own[:, 6]], axis=1)
    return np.concatenate([T @ own[:, :3], T @ own[:, 3:6], shear], axis=1)


def _faces(piece: Piece[ShellBlock | CurvedShellBlock], fields: Fields, axis: Vector | None) -> np.ndarray:
    """Return the stress ``(2 ne, 3, k)`` of the top and the bottom of each element, mean over its nodes."""
    T = _stress_rotation(_angle(piece.block.frame, axis))
    found = piece.block.nodal_stress(fields.u[piece.dofs])
    faces = np.stack([T @ found[face][1].mean(axis=1) for face in ("top", "bottom")], axis=1)
    return faces.reshape(2 * len(faces), 3, -1)


def _angle(frame: np.ndarray, axis: Vector | None) -> np.ndarray:
    """Return the angle (ne,) from e1 to the projection of the axis, rad."""
    normal = frame[:, 2]
    if axis is None:
        wanted = np.where(np.abs(normal[:, :1]) < ACROSS, [1.0, 0, 0], [0, 1.0, 0])
    else:
        size = np.linalg.norm(axis)
        wanted = np.tile(np.asarray(axis, dtype=float) / max(size, np.finfo(float).tiny), (len(frame), 1))
        if not size > 0 or np.any(np.abs(np.einsum("ea,ea->e", normal, wanted)) > ACROSS):
            raise InputError(f"axis {list(axis)} is zero or normal to some of the shells; choose another")
    x, y = (np.einsum("ea,ea->e", frame[:, i], wanted) for i in (0, 1))
    return np.arctan2(y, x)


def _stress_rotation(angle: np.ndarray) -> np.ndarray:
    """Return ``(ne, 3, 3)``: plane stress ``xx, yy, xy`` in axes rotated by `angle`, ``T(-a)^T`` of strains."""
    return strain_rotation(-angle).transpose(0, 2, 1)
