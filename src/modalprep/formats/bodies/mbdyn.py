"""Reading MBDyn's file of modal data: the body that its joint ``modal`` represents."""

from __future__ import annotations

import re
from pathlib import Path
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.bodies.described import MESH, at_rest, body_of, even, with_notes
from modalprep.formats.contractions import from_centrifugal, from_inertia, from_moment, moment
from modalprep.suggest import refuse_missing

GROUP = re.compile(r"\*\*\s*RECORD GROUP\s+(\d+)")
CARD = re.compile(r'\*\*\s+"([^"]+)", NODE_\d+, null[,;]')  # of the joint, as modalprep writes it
HEAD = re.compile(r"\*\* (.*) by modalprep, SI units")
INVARIANTS = (14, 15, 16, 17, 18)
AGREES = 1e-6  # relative: two groups that hold the same numbers
STIFFENING = 12  # matrices before those of the interfaces


class Integrals(NamedTuple):
    """Mass integrals of a file, as of `FlexibleBody`."""

    m: float
    s0: np.ndarray
    E0: np.ndarray
    S: np.ndarray
    H: np.ndarray
    P: np.ndarray


class Groups:
    """The words of every record group, the comments of the head, the number of nodes and of modes."""

    def __init__(self, path: Path) -> None:
        refuse_missing(path, "MBDyn file")
        self.head: list[str] = []
        self.words: dict[int, list[str]] = {}
        into: list[str] = []
        for line in path.read_text(encoding="ascii", errors="replace").splitlines():
            if match := GROUP.match(line):
                if int(match[1]) in self.words:
                    raise InputError(f"it has record group {match[1]} twice")
                into = self.words.setdefault(int(match[1]), [])
            elif line.startswith("**"):
                self.head += [] if self.words else [line]
            else:
                into += line.split()
        size = [int(word) for word in self.words.get(1, [])[1:6]]
        if len(size) != 5 or not size[0] > 0 or not sum(size[1:4]) - size[4] > 0:
            raise InputError("it has no record group 1 with its numbers of nodes and modes")
        self.nodes = size[0]
        self.modes = sum(size[1:4]) - size[4]

    def array(self, group: int, *shape: int) -> np.ndarray:
        """Return the numbers of a group, which must be as many as the shape has."""
        words = self.words.get(group, [])
        if len(words) != np.prod(shape):
            raise InputError(f"record group {group} has {len(words)} numbers instead of {np.prod(shape)}")
        values = np.array([float(word.replace("D", "E").replace("d", "e")) for word in words])
        if not np.all(np.isfinite(values)):
            raise InputError(f"record group {group} has numbers that are not finite")
        return values.reshape(shape)


def mbdyn_body(path: Path) -> FlexibleBody:
    """Return the body of a file for MBDyn's joint ``modal``, in the units of its numbers.

    The nodes that the joint's card names, in a comment that modalprep writes, are the interfaces, in other files all
    nodes. The mass integrals are those of groups 12 and 14 to 18, or of the lumped masses of group 11.

    References
    ----------
    P. Masarati and others, MBDyn input manual: joint ``modal``, and its file of modal data.
    """
    file = Groups(path)
    n = file.modes
    labels = file.words.get(2, [])
    if len(labels) != file.nodes or len(set(labels)) < len(labels):
        raise InputError(f"record group 2 has {len(set(labels))} different labels for {file.nodes} nodes")
    points = np.concatenate([file.array(group, file.nodes, 1) for group in (5, 6, 7)], axis=1)
    shapes = file.array(8, n, file.nodes, 6).transpose(1, 2, 0)
    integrals, notes = _integrals(file, points, shapes)
    ends, carried = _interfaces(file, labels, points, shapes)
    Kg = _stiffening(file, len(carried))
    forces = np.zeros((len(ends), 6, n, n))
    forces[[ends.index(k) for k in carried]] = Kg[STIFFENING:].reshape(-1, 6, n, n)
    body = body_of(
        name=next((match[1] for line in file.head if (match := HEAD.match(line))), path.stem),
        **integrals._asdict(),
        M=file.array(9, n, n),
        K=file.array(10, n, n),
        D=file.array(13, n, n) if 13 in file.words else np.zeros((n, n)),
        Kg_A=Kg[9:12],
        Kg_W=even(from_centrifugal(Kg[:6]) + from_moment(Kg[6:9])),
        Kg_F=forces[:, :3],
        Kg_T=forces[:, 3:],
        phi=shapes[ends, :3],
        psi=shapes[ends, 3:],
        interface_name=tuple(_name(labels[k]) for k in ends),
        interface_position=points[ends],
        points=points,
        shape=shapes[:, :3],
    )
    if not np.any(Kg):
        notes.append("geometric stiffness: there is none, so that spins well below the first frequency are in order")
    elif not np.any(forces):
        notes.append("geometric stiffness of forces on the interfaces")
    return with_notes(body, "MBDyn", [MESH, *notes])


def _name(label: str) -> str:
    return f"node_{label}" if label.isdigit() else label


def _integrals(file: Groups, points: np.ndarray, shapes: np.ndarray) -> tuple[Integrals, list[str]]:
    """Return the mass integrals, those of the invariants if the file has them, and what was rebuilt."""
    lumped, notes = _lumped(file)
    if 12 not in file.words and lumped is None:
        raise InputError("it has neither the inertia of the rigid body (group 12) nor lumped masses (group 11)")
    m, s0, E0 = _rigid(file.array(12, 13)) if lumped is None or 12 in file.words else _rigid_sums(lumped, points)
    if not m > 0:
        raise InputError("its mass is not positive")
    if set(INVARIANTS) <= set(file.words):
        return Integrals(m, s0, E0, *_invariants(file)), notes
    if lumped is None:
        raise InputError(
            "it has no invariants (groups 14 to 18) and no lumped masses (group 11), so that it is not known how "
            "rigid motion excites the modes; write it with all groups (modalprep: --version full)"
        )
    S, H, P = _sums(lumped, shapes, points)
    M = file.array(9, file.modes, file.modes)
    P = P + np.multiply.outer(np.eye(3) / 3, even(M) - np.einsum("aaij->ij", P))
    summed = "invariants: the mass integrals are sums over the lumped masses of group 11"
    return Integrals(m, s0, E0, S, H, P), [*notes, summed]


def _lumped(file: Groups) -> tuple[np.ndarray | None, list[str]]:
    """Return the masses (nodes, 6) of group 11, of which MBDyn reads as many rows as there are nodes, and a note."""
    words = file.words.get(11)
    if words is None:
        return None, []
    surplus = len(words) - 6 * file.nodes
    if surplus <= 0 or surplus % 6:
        return file.array(11, file.nodes, 6), []
    file.words[11] = words[: 6 * file.nodes]
    rows = f"{surplus // 6} further row{'s' * (surplus > 6)}"
    said = f"nodes for {rows} of lumped masses (group 11), left out as by MBDyn"
    return file.array(11, file.nodes, 6), [said]


def _rigid(group: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    m = float(group[0])
    centre = group[1:4]
    J = group[4:].reshape(3, 3)
    return m, m * centre, from_inertia((J + J.T) / 2) + m * np.outer(centre, centre)


def _rigid_sums(lumped: np.ndarray, points: np.ndarray) -> tuple[float, np.ndarray, np.ndarray]:
    m = lumped[:, 0]
    rotary = from_inertia(np.diag(lumped[:, 3:].sum(axis=0)))
    return float(m.sum()), m @ points, np.einsum("i,ia,ib->ab", m, points, points) + rotary


def _sums(lumped: np.ndarray, shapes: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return S, H, P of the nodes; rotary inertia adds to the angular momentum of the modes."""
    m = lumped[:, 0]
    phi = shapes[:, :3]
    spin = np.einsum("ia,iak->ak", lumped[:, 3:], shapes[:, 3:])
    H = np.einsum("i,ib,iak->abk", m, points, phi) + from_moment(spin)
    return np.einsum("i,iak->ak", m, phi), H, np.einsum("i,iaj,ibk->abjk", m, phi, phi)


def _invariants(file: Groups) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return S, H, P, which the groups 14, 16 and 18 hold whole."""
    n = file.modes
    S = file.array(14, 3, n)
    H = from_inertia(file.array(16, 3, n, 3).transpose(0, 2, 1))
    P = from_inertia(-file.array(18, 3, n, n, 3).transpose(0, 3, 1, 2)).swapaxes(2, 3)
    for group, own, size in ((15, file.array(15, 3, n), H), (17, file.array(17, 3, n, n), P.swapaxes(2, 3))):
        if np.abs(own - moment(size)).max() > AGREES * np.abs(size).max():
            raise InputError(f"record groups {group} and {group + 1} hold the same integrals but do not agree")
    return S, H, P


def _interfaces(file: Groups, labels: list[str], points: np.ndarray, shapes: np.ndarray) -> tuple[list[int], list[int]]:
    """Return the nodes that are interfaces, and those to which group 19 refers."""
    resting = np.flatnonzero(at_rest(points, shapes[:, :3], shapes[:, 3:]))[:1].tolist()
    card = [match[1] for line in file.head if (match := CARD.match(line))]
    others = [k for k, label in enumerate(labels) if (label in card if card else k not in resting)]
    return [*(k for k in resting if k not in others), *others], others


def _stiffening(file: Groups, carried: int) -> np.ndarray:
    """Return the matrices (12 + 6 carried, n, n) of group 19; zeros where it has none."""
    found = np.zeros((STIFFENING + 6 * carried, file.modes, file.modes))
    words = file.words.get(19, [])
    if not words:
        return found
    count = int(words[0])
    size = 1 + file.modes**2
    if count not in (STIFFENING, len(found)) or len(words) != 1 + count * size:
        raise InputError(
            f"record group 19 has {len(words)} numbers for {count} matrices, and {carried} nodes can be its interfaces"
        )
    table = file.array(19, len(words))[1:].reshape(count, size)
    if not np.array_equal(np.sort(table[:, 0]), np.arange(1, count + 1)):
        raise InputError(f"record group 19 does not number its matrices from 1 to {count}")
    found[table[:, 0].astype(int) - 1] = table[:, 1:].reshape(count, file.modes, file.modes)
    return found
