"""Section forces of beams and trusses, and forces in springs (theory 4.9)."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.elements.beam import BeamBlock
from modalprep.fe.elements.beam3 import DOFS, ThreeNodeBeamBlock
from modalprep.fe.elements.point import SpringBlock
from modalprep.fe.elements.truss import TrussBlock
from modalprep.fe.recovery.fields import Fields, Piece, Quantity, labels, of_family
from modalprep.vectors import skew

SECTION = ("N", "Vy", "Vz", "T", "My", "Mz")
SECTION_UNITS = ("N",) * 3 + ("N m",) * 3
SPRING = ("Fx", "Fy", "Fz", "Mx", "My", "Mz")


def section_forces(pieces: list[Piece], stations: int) -> Quantity:
    """Return N, Vy, Vz, T, My, Mz at `stations` places along beams and trusses, both ends included.

    They act on the face whose outer normal is e1, in the element's axes e1, e2, e3, at the centroid: N is tension, My
    stretches the side of positive e3, Mz that of negative e2. Trusses have N and T.

    Raises
    ------
    InputError
        When there are no beams and trusses, or fewer than two stations.
    """
    if stations < 2:
        raise InputError(f"stations = {stations} must be at least 2, the ends of the elements")
    own = of_family([half for piece in pieces for half in _halves(piece)], (BeamBlock, TrussBlock), "beams or trusses")
    at = np.linspace(0.0, 1.0, stations)
    return Quantity(
        kind="section_force",
        places=_places(own, at),
        components=SECTION,
        units=SECTION_UNITS,
        values=lambda fields: np.concatenate([_along(p, fields, at) for p in own]),
        position=np.concatenate([_positions(p, at) for p in own]),
        cell=np.repeat(np.concatenate([p.cells for p in own]), stations),
    )


def spring_forces(model: FEModel, pieces: list[Piece]) -> Quantity:
    """Return the force and moment of springs on their first node, at the elastic centre, in their axes.

    Positive where the second node moves in the positive direction of the axes; on the ground where the node does.

    Raises
    ------
    InputError
        When there are no springs.
    """
    own = of_family(pieces, (SpringBlock,), "springs")

    def values(fields: Fields) -> np.ndarray:
        return np.concatenate(
            [np.asarray(p.block.section.k)[:, None] * (p.block.strain @ fields.u[p.dofs]) for p in own]
        )

    return Quantity(
        kind="force",
        places=tuple(name or "spring" for name in labels(own)),
        components=SPRING,
        units=SECTION_UNITS,
        values=values,
        position=np.concatenate([model.points[p.block.nodes[:, 0]] + p.block.arm[:, 0] for p in own]),
        cell=np.concatenate([p.cells for p in own]),
    )


def _halves(piece: Piece) -> list[Piece]:
    """Return the two beams of two nodes that make a beam of three."""
    block = piece.block
    if not isinstance(block, ThreeNodeBeamBlock):
        return [piece]
    found: list[Piece] = []
    for half, dofs in zip(block.halves, DOFS, strict=True):
        inertia, rows = (half, None) if piece.consistent else (piece.inertia, piece.rows)
        found.append(Piece(half, inertia, rows, piece.dofs[:, dofs], piece.numbers, piece.cells))
    return found


def _places(pieces: list[Piece], at: np.ndarray) -> tuple[str, ...]:
    ends = ["start", *(f"{100 * s:.4g}%" for s in at[1:-1]), "end"]
    names = []
    seen = {}
    for name in labels(pieces):
        seen[name] = seen.get(name, 0) + 1
        parts = [part for part in (name, "second" if seen[name] == 2 else "") if part]
        names += [".".join([*parts, end]) for end in ends]
    return tuple(names)


def _positions(piece: Piece[BeamBlock | TrussBlock], at: np.ndarray) -> np.ndarray:
    ends = piece.block.ends
    return (ends[:, None, 0] + at[:, None] * (ends[:, 1] - ends[:, 0])[:, None]).reshape(-1, 3)


def _along(piece: Piece[BeamBlock | TrussBlock], fields: Fields, at: np.ndarray) -> np.ndarray:
    """Return the section forces ``(ne ns, 6, k)``, element by element."""
    block = piece.block
    force = _truss_end(piece, block, fields) if isinstance(block, TrussBlock) else _beam_end(piece, block, fields)
    ne = len(piece.numbers)
    k = fields.u.shape[1]
    found = np.tile(force[:, None], (1, len(at), 1, 1))  # of the first end, on the face of each place
    length = np.linalg.norm(block.ends[:, 1] - block.ends[:, 0], axis=1)
    arm = (at * length[:, None])[..., None]
    found[:, :, 4] += arm * force[:, None, 2]
    found[:, :, 5] -= arm * force[:, None, 1]
    if piece.consistent and (np.any(fields.a) or np.any(fields.drives)):
        if isinstance(block, TrussBlock):
            found += _truss_load(piece, block, fields, at, length)
        else:
            found += _beam_load(piece, block, fields, at, length)
    if isinstance(block, TrussBlock):
        found[:, :, [1, 2, 4, 5]] = 0.0
    return found.reshape(ne * len(at), 6, k)


def _beam_end(piece: Piece, block: BeamBlock, fields: Fields) -> np.ndarray:
    """Return the section forces ``(ne, 6, k)`` at the first end: less the forces of its node on the element."""
    nodal = piece.forces(fields) if piece.consistent else piece.stiffness_forces(fields)
    force = nodal[:, :3]
    moment = nodal[:, 3:6] - np.cross(block.arm[:, 0, :, None], nodal[:, :3], axis=1)
    return -np.concatenate([block.frame @ force, block.frame @ moment], axis=1)


def _truss_end(piece: Piece, block: TrussBlock, fields: Fields) -> np.ndarray:
    """Return N and T ``(ne, 6, k)`` at the first end."""
    nodal = piece.forces(fields) if piece.consistent else piece.stiffness_forces(fields)
    found = np.zeros((len(nodal), 6, nodal.shape[2]))
    found[:, 0] = -np.einsum("ea,eak->ek", block.axis, nodal[:, :3])
    if block.components == 6:
        found[:, 3] = -np.einsum("ea,eak->ek", block.axis, nodal[:, 3:6])
    return found


def _beam_load(piece: Piece, block: BeamBlock, fields: Fields, at: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return what the inertia between the first end and each place adds, ``(ne, ns, 6, k)``."""
    own = block.inside
    share = own.dx / length[:, None]
    first, second = _integrals(own.at, at, [place[0] for place in block.section.taper] or [0.0, 1.0])
    motion = block.at_nodes.value @ fields.a[piece.dofs][:, None]  # (ne, nq, 6, k)
    whole = np.einsum("eab,eqbk->eqak", block.frame, fields.acceleration(block.centre)) + motion[:, :, :3]
    force = (block.line_mass / share)[..., None, None] * whole
    moment = length[:, None, None, None] * _rotary(block, fields, motion)
    found = np.zeros((len(length), len(at), 6, force.shape[3]))
    found[:, :, :3] = np.einsum("sq,eqak->esak", first, force)
    lever = length[:, None, None, None] * np.einsum("sq,eqak->esak", second - at[:, None] * first, force)
    found[:, :, 3:] = np.einsum("sq,eqak->esak", first, moment)
    found[:, :, 4] -= lever[:, :, 2]
    found[:, :, 5] += lever[:, :, 1]
    return found


def _rotary(block: BeamBlock, fields: Fields, motion: np.ndarray) -> np.ndarray:
    """Return the moment ``(ne, nq, 3, k)`` per length that accelerates the sections about their centroids, local."""
    own = block.inside
    rho = block.section.material.rho
    W = np.einsum("eab,bck,edc->eadk", block.frame, fields.drives[3:].reshape(3, 3, -1), block.frame)[:, None]
    tx, ty, tz = np.moveaxis(motion[:, :, 3:], 2, 0)
    moved = {1: (-tz, 0 * tz, tx), 2: (ty, -tx, 0 * tx)}
    total = np.zeros((*motion.shape[:2], 3, motion.shape[3]))
    for axis, size in ((1, own.Iz), (2, own.Iy)):
        push = np.stack(moved[axis], axis=2) + W[:, :, :, axis]
        total += (rho * size)[:, None, None] * (skew(np.eye(3)[axis]) @ push)
    return total


def _truss_load(piece: Piece, block: TrussBlock, fields: Fields, at: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return what the inertia between the first end and each place adds, ``(ne, ns, 6, k)``; of N only."""
    section = block.section
    own = fields.a[piece.dofs].reshape(len(length), 2, block.components, -1)[:, :, :3]
    along = np.einsum("ea,eiak->eik", block.axis, own + fields.acceleration(block.ends))
    mass = ((section.material.rho * section.A + section.nsm) * length)[:, None, None]
    s = at[:, None]
    found = np.zeros((len(length), len(at), 6, along.shape[2]))
    found[:, :, 0] = mass * (s * along[:, None, 0] + s**2 / 2 * (along[:, None, 1] - along[:, None, 0]))
    return found


def _integrals(points: np.ndarray, at: np.ndarray, cuts: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return ``(ns, nq)`` integrals from 0 to each place of f and of x f, f known at as many points of each panel.

    f is a polynomial between each two of the `cuts`, which begin at 0 and end at 1.

    Examples
    --------
    >>> points = (np.polynomial.legendre.leggauss(2)[0] + 1) / 2
    >>> first, second = _integrals(points, np.array([0.0, 0.5, 1.0]), (0.0, 1.0))
    >>> (first @ points).round(12), (second @ points).round(12)  # x^2 / 2, x^3 / 3
    (array([0.   , 0.125, 0.5  ]), array([0.        , 0.04166667, 0.33333333]))
    """
    first, second = np.zeros((2, len(at), len(points)))
    n = len(points) // (len(cuts) - 1)
    power = np.arange(1, n + 1)
    for k, (a, b) in enumerate(pairwise(cuts)):
        own = slice(n * k, n * k + n)
        size = b - a
        x = np.clip((at - a) / size, 0.0, 1.0)[:, None]
        coefficients = np.linalg.inv(np.vander((points[own] - a) / size, increasing=True))
        first[:, own] = size * (x**power / power @ coefficients)
        second[:, own] = a * first[:, own] + size**2 * (x ** (power + 1) / (power + 1) @ coefficients)
    return first, second
