"""Component mode synthesis: modal bodies welded at their interfaces, and the modes of the system."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.linalg.ritz import ritz
from modalprep.linalg.unique import unique_modes
from modalprep.records import Record
from modalprep.reduction.projected import body_matrices, interface_motion
from modalprep.reduction.table import DIRECTIONS, ModalBody
from modalprep.suggest import find_interface, refuse_unknown
from modalprep.vectors import as_rotation, skew

DEPENDENT = 1e-8  # independent part of a condition: round-off of modes is 1e-10, axial stiffness 1e-4
RANK = 1e-10  # singular values of the rigid columns, all lengths over that of the system: geometry, round-off 1e-15
MASSLESS = 1e-14  # inertia of a rigid motion over the largest, as of a line rotating about itself
MEET = 1e-6  # gap of a weld over the longest body

Placement = tuple[np.ndarray, np.ndarray]


@dataclass(frozen=True, eq=False, kw_only=True)
class SynthesisedModes(Record):
    """Modes of welded bodies at rest.

    Attributes
    ----------
    bodies : dict of ModalBody
    frequency : (s,)
        Hz, ascending; rigid-body motions come first, with exactly 0.
    shapes : (N, s)
        M-orthonormal; the coordinates of all bodies, one after the other.
    coordinates : {name: (6 + n, s)}
        The rows of each body: translation (m) and rotation (rad) of its root in its own axes, then its q.
    position, rotation : {name: (3,)}, {name: (3, 3)}
        Place of each body's frame (m, system axes) and its axes to the system's.
    redundant : tuple of str
        Conditions of welds that follow from the others, or that the modes of the bodies cannot break.
    """

    bodies: Mapping[str, ModalBody]
    frequency: np.ndarray
    shapes: np.ndarray
    coordinates: dict[str, np.ndarray]
    position: dict[str, np.ndarray]
    rotation: dict[str, np.ndarray]
    redundant: tuple[str, ...] = ()

    @property
    def rigid(self) -> int:
        """Number of rigid-body motions: 6 of a free system, one more for every released hinge."""
        return int(np.count_nonzero(self.frequency == 0))

    def points(self, name: str) -> np.ndarray:
        """Mesh nodes ``(n_points, 3)`` of a body, m in system axes.

        Returns
        -------
        (n_points, 3) float
            m, system axes.
        """
        return self.position[name] + self.bodies[name].points @ self.rotation[name].T

    def nodal_shape(self, name: str) -> np.ndarray:
        """Displacement ``(n_points, 3, s)`` of a body's mesh nodes in each mode, system axes.

        Returns
        -------
        (n_points, 3, s) float
            1/sqrt(kg), system axes.
        """
        body, x = self.bodies[name], self.coordinates[name]
        moved = x[:3] - skew(body.points) @ x[3:6] + body.shape @ x[6:]
        return self.rotation[name] @ moved

    def __repr__(self) -> str:
        """Bodies, size and frequency range."""
        elastic = self.frequency[self.rigid :]
        band = f", {elastic[0]:.4g}..{elastic[-1]:.4g} Hz" if len(elastic) else ""
        names = ", ".join(self.bodies) if len(self.bodies) < 5 else f"{len(self.bodies)} bodies"
        return f"SynthesisedModes({names}; {self.rigid} rigid, {len(elastic)} elastic modes{band})"


class _Weld(NamedTuple):
    """Ends (body, interface number), the second None for the ground, and the constrained directions (6,) bool."""

    label: str
    ends: tuple[tuple[str, int], tuple[str, int] | None]
    constrained: np.ndarray


def synthesise(
    bodies: Mapping[str, ModalBody],
    welds: Sequence[tuple] = (),
    placement: dict[str, Placement] | None = None,
    ground: Sequence[str | tuple] = (),
    *,
    modes: int | None = None,
) -> SynthesisedModes:
    """Weld modal bodies at their interfaces and return the modes of the system at rest.

    Each body moves by ``x = (d, theta, q)``, its root and its modal coordinates, with the mass matrix of
    theory 4 at q = 0 and the stiffness ``diag(0, K)``. An interface moves by
    ``(d + theta x r + phi q, theta + psi q)``; a weld makes two of them equal: ``G x = 0``. With G split into columns
    without strain (z) and elastic ones in units of strain energy (y), the singular value decomposition of ``G_z`` gives
    the rigid motions (its null space) and the conditions left for y (its left null space), whose orthonormal null
    space has unit strain energy: `linalg.ritz` diagonalises its flexibility, accurate for soft modes beside stiff ones.

    Parameters
    ----------
    bodies : {name: ModalBody}
        For motion relative to its root, an interface that is welded should be ``fixed`` in the body's reduction.
    welds : of ("a.tip", "b.root") or ("a.tip", "b.root", directions)
        Directions (x, y, z, rx, ry, rz, in the axes of the first body) are left free: ``("rz",)`` is a hinge.
    placement : {name: ((3,), (3, 3))}
        Position (m) of a body's frame and rotation of its axes to the system's. Bodies that are not named follow from
        the welds, their axes parallel to their neighbour's; with none named, the first body stands at the origin.
    ground : of "a.root" or ("a.root", directions)
        Interfaces that do not move, with directions left free.
    modes : int or None
        How many modes to return; None returns all.

    Returns
    -------
    SynthesisedModes
        Frequencies (Hz) and, for each body, motion of its root and modal coordinates in each mode.

    Raises
    ------
    InputError
        When a name is unknown, a weld does not meet, or a rotation is none.

    References
    ----------
    R. R. Craig, A. J. Kurdila, Fundamentals of Structural Dynamics, 2nd ed., Wiley 2006, chapter 17.
    A. K. Banerjee, Flexible Multibody Dynamics, Wiley 2016, chapter 7; theory 3.7.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> half = uniform_beam(modes=6)
    >>> synthesise({"a": half, "b": half}, [("a.tip", "b.root")], ground=["a.root"], modes=2)
    SynthesisedModes(a, b; 0 rigid, 2 elastic modes, 0.1531..0.3115 Hz)
    """
    if not bodies:
        raise InputError("there are no bodies to weld; give at least one")
    if modes is not None and modes < 0:
        raise InputError(f"modes = {modes} must not be negative")
    joints = [_weld(bodies, spec, 2) for spec in welds] + [_weld(bodies, _pair(spec), 1) for spec in ground]
    size = _size(bodies)
    places = _placed(bodies, joints, placement or {})
    _refuse_gaps(bodies, joints, places, size)
    M, K = zip(*map(body_matrices, bodies.values()), strict=True)
    K = np.concatenate(K)
    G, redundant, scale = _conditions(bodies, joints, places, K, size)
    rigid, W = _admissible(G, K, scale)
    M = csr_array(block_diag(*M))
    w2, X = ritz(W, csr_array(np.diag(K)), M, _orthonormal(rigid / scale[:, None], M))
    return _system(bodies, places, w2[:modes], unique_modes(w2, X, np.diag(K))[:, :modes], redundant)


def _pair(spec: str | tuple) -> tuple:
    return (spec,) if isinstance(spec, str) else tuple(spec)


def _weld(bodies: Mapping[str, ModalBody], spec: tuple, count: int) -> _Weld:
    """Read ``(end, end, directions)`` of a weld (count 2) or ``(end, directions)`` of the ground (count 1)."""
    if not count <= len(spec) <= count + 1:
        raise InputError(f"weld {spec!r} must name {count} interfaces and, if any, the directions left free")
    label = ("weld " if count == 2 else "ground ") + " - ".join(map(str, spec[:count]))
    ends = [find_interface(bodies, end, label) for end in spec[:count]]
    if len(set(ends)) < count:
        raise InputError(f"{label}: joins an interface with itself; name two")
    free = [name for part in spec[count:] for name in _pair(part)]
    for name in free:
        refuse_unknown(name, DIRECTIONS, f"{label}: direction")
    constrained = np.array([name not in free for name in DIRECTIONS])
    return _Weld(label, (ends[0], ends[1] if count == 2 else None), constrained)


def _size(bodies: Mapping[str, ModalBody]) -> float:
    """Length (m) of the longest body, by its interfaces or its mesh; 1 for points."""
    return max(float(np.abs(np.vstack([b.interface_position, b.points])).max()) for b in bodies.values()) or 1.0


def _placed(bodies: Mapping[str, ModalBody], welds: list[_Weld], given: dict[str, Placement]) -> dict[str, Placement]:
    """Return position and rotation of every body: given, from a neighbour, or at the origin."""
    places = {name: _read_place(bodies, name, at) for name, at in given.items()}
    while len(places) < len(bodies):
        before = len(places)
        for (known, k), (name, j) in (two for weld in welds for two in _both_ways(weld)):
            if known in places and name not in places:
                p, R = places[known]
                places[name] = (p + R @ (bodies[known].interface_position[k] - bodies[name].interface_position[j]), R)
        if len(places) == before:
            places[next(name for name in bodies if name not in places)] = (np.zeros(3), np.eye(3))
    return places


def _both_ways(weld: _Weld) -> list[tuple[tuple[str, int], tuple[str, int]]]:
    """Return the ends of a weld of two bodies, in both orders; none of a weld to the ground."""
    one, other = weld.ends
    return [] if other is None else [(one, other), (other, one)]


def _refuse_gaps(
    bodies: Mapping[str, ModalBody], welds: list[_Weld], places: dict[str, Placement], size: float
) -> None:
    for label, ends in ((weld.label, two) for weld in welds for two in _both_ways(weld)[:1]):
        a, b = (places[name][0] + places[name][1] @ bodies[name].interface_position[k] for name, k in ends)
        if not np.linalg.norm(a - b) <= MEET * size:
            raise InputError(
                f"{label}: the interfaces are {np.linalg.norm(a - b):.4g} m apart; correct the placement of the bodies"
            )


def _read_place(bodies: Mapping[str, ModalBody], name: str, at: Placement) -> Placement:
    refuse_unknown(name, bodies, "placement: body")
    p = np.asarray(at[0], dtype=float)
    R = as_rotation(at[1], f"placement of {name!r}: the rotation")
    if p.shape != (3,):
        raise InputError(f"placement of {name!r}: give a position of 3 numbers")
    return p, R


def _conditions(bodies: Mapping[str, ModalBody], welds: list[_Weld], places: dict, K: np.ndarray, size: float):
    """Return independent conditions G (m, N), notes on redundant ones, and the scale (N,) of the columns.

    The coordinates are the scaled ones over `scale`. Of dependent conditions the first ones are kept.
    """
    start = dict(zip(bodies, np.cumsum([0, *(6 + body.n for body in bodies.values())]), strict=False))
    G = np.zeros((0, len(K)))
    for weld in welds:
        rows = np.zeros((6, len(K)))
        turn = places[weld.ends[0][0]][1]
        for (name, k), sign in zip(filter(None, weld.ends), (1.0, -1.0), strict=False):
            toward = np.kron(np.eye(2), turn.T @ places[name][1])  # axes of the first body
            columns = slice(start[name], start[name] + 6 + bodies[name].n)
            rows[:, columns] += sign * toward @ interface_motion(bodies[name], k)
        G = np.vstack([G, (rows * np.repeat([1.0, size], 3)[:, None])[weld.constrained]])
    scale = _column_scale(bodies, G, K, size)
    names = [(weld.label, d) for weld in welds for d, fixed in zip(DIRECTIONS, weld.constrained, strict=True) if fixed]
    independent = _independent_rows(G / scale)
    lost = {
        label: [n[1] for n, new in zip(names, independent, strict=True) if n[0] == label and not new]
        for label, _ in names
    }
    redundant = tuple(f"{label}: {', '.join(d)} cannot open anyway" for label, d in lost.items() if d)
    return (G / scale)[independent], redundant, scale


def _column_scale(bodies: Mapping[str, ModalBody], G: np.ndarray, K: np.ndarray, size: float) -> np.ndarray:
    """Sizes (N,): 1 and `size` for rigid motions, ``sqrt(K)`` with the softest column of G at 1, or a free column's."""
    scale = np.concatenate([np.concatenate([np.repeat([1.0, size], 3), np.zeros(b.n)]) for b in bodies.values()])
    elastic = K > 0
    norm = np.linalg.norm(G, axis=0)
    scale[elastic] = np.sqrt(K[elastic])
    scale[elastic] *= (norm[elastic] / scale[elastic]).max(initial=0.0) or 1.0
    loose = scale == 0
    scale[loose] = np.where(norm[loose] > 0, norm[loose], 1.0)
    return scale


def _independent_rows(G: np.ndarray) -> np.ndarray:
    """Return which rows (m,) bool are independent of earlier ones (Gram-Schmidt, twice)."""
    Q = np.zeros((0, G.shape[1]))
    found = np.zeros(len(G), dtype=bool)
    for k, row in enumerate(G):
        rest = row
        for _ in range(2):
            rest = rest - (Q @ rest) @ Q
        found[k] = np.linalg.norm(rest) > DEPENDENT * max(np.linalg.norm(row), 1.0)
        if found[k]:
            Q = np.vstack([Q, rest / np.linalg.norm(rest)])
    return found


def _admissible(G: np.ndarray, K: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the rigid motions (N, r), scaled, and a basis (N, k) of unit strain energy of all other motions."""
    elastic = K > 0
    U, s, Vt = np.linalg.svd(G[:, ~elastic])
    rank = int(np.count_nonzero(s > RANK * s.max(initial=1.0)))
    rigid = np.zeros((len(K), Vt.shape[0] - rank))
    rigid[~elastic] = Vt[rank:].T
    left = U[:, rank:].T @ G[:, elastic]  # conditions that no rigid motion satisfies
    Y = np.linalg.qr(left.T, mode="complete")[0][:, len(left) :]
    W = np.zeros((len(K), Y.shape[1]))
    W[elastic] = Y
    W[~elastic] = -Vt[:rank].T @ ((U[:, :rank].T @ (G[:, elastic] @ Y)) / s[:rank, None])
    return rigid, W / scale[:, None]


def _orthonormal(R: np.ndarray, M: csr_array) -> np.ndarray:
    """Return an M-orthonormal basis of rigid motions (N, r) without those of no mass."""
    mass, V = np.linalg.eigh(R.T @ (M @ R))
    heavy = mass > MASSLESS * mass.max(initial=0.0)
    return R @ (V[:, heavy] / np.sqrt(mass[heavy]))


def _system(
    bodies: Mapping[str, ModalBody], places: dict, w2: np.ndarray, X: np.ndarray, redundant: tuple
) -> SynthesisedModes:
    ends = np.cumsum([6 + body.n for body in bodies.values()])
    return SynthesisedModes(
        bodies=dict(bodies),
        frequency=np.sqrt(w2) / (2 * np.pi),
        shapes=X,
        coordinates=dict(zip(bodies, np.split(X, ends[:-1]), strict=True)),
        position={name: places[name][0] for name in bodies},
        rotation={name: places[name][1] for name in bodies},
        redundant=redundant,
    )
