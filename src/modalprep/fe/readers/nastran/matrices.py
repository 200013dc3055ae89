"""Matrices in a Nastran deck with elements: those that K2GG and M2GG select, and GENEL."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
from scipy.sparse import csr_array

from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.readers.entries import Labelled, in_basic_axes, together
from modalprep.fe.readers.matrix_elements import matrix_element
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.case_control import case_control
from modalprep.fe.readers.nastran.dmig import read_dmig

SELECTED = re.compile(r"(?:([+-]?[\d.]+(?:[ED][+-]?\d+)?)\s*\*\s*)?([A-Z]\w*)", re.IGNORECASE)
FACTORS = {"K2GG": "CK2", "M2GG": "CM2"}  # parameters that multiply them
WHERE = "Matrices of a deck are read by [matrices]"
DETERMINATE = 1e-9  # smallest singular value of the motions of six DOFs, over the largest


def add_matrices(b: Builder, path: Path) -> None:
    """Add the DMIG that the case control selects as stiffness (K2GG) or mass (M2GG) of the whole structure.

    Raises
    ------
    InputError
        When the deck selects a matrix that it does not have, or does not say what its matrices are for.
    """
    cards = list(b.tables.get("DMIG", {}).values())
    if not cards:
        return
    if not b.has_elements:
        raise cards[0].error(f"the deck has matrices and no elements. {WHERE}, instead of [mesh]")
    subcases = case_control(path)
    if subcases is None:
        raise cards[0].error(
            f"the deck has no case control, so that nothing says which matrices are added to its elements. {WHERE}; "
            "write K2GG and M2GG before BEGIN BULK, or leave them out by ignore = ['DMIG']"
        )
    chosen = {
        command: _chosen(cards[0], command, {s.entries.get(command, "") for s in subcases}) for command in FACTORS
    }
    names = {name for found in chosen.values() for name, _ in found}
    for name in sorted(names - {card.text(0) for card in cards}):
        command = next(command for command, found in chosen.items() if name in dict(found))
        raise cards[0].error(f"{command} selects the matrix {name}, which the deck does not have; add its DMIG")
    if names:
        read = read_dmig(path, cards=[card for card in cards if card.text(0) in names])
        sums = {command: _sum(b, cards[0], command, found, read) for command, found in chosen.items()}
        _add(b, cards[0], sums["K2GG"], sums["M2GG"], ", ".join(f"DMIG {name}" for name in sorted(names)))
    others = [("DMIG " + c.text(0), f"{c.file} line {c.line}") for c in cards if c.text(1) == "0"]
    others = [one for one in others if one[0].removeprefix("DMIG ") not in names]
    b.conversion.notes += left_out(others, "neither K2GG nor M2GG of the case control selects them")


def _chosen(card: Card, command: str, given: Iterable[str]) -> list[tuple[str, float]]:
    """Return the names that a command selects, with their factors: ``K2GG = 1.5*K1, K2``."""
    texts = {text for text in given if text}
    if len(texts) > 1:
        raise card.error(f"subcases select different {command} ({', '.join(sorted(texts))}); give one for all of them")
    found = []
    for part in "".join(texts).split(","):
        match = SELECTED.fullmatch(part.strip())
        if match:
            found.append((match[2].upper(), float((match[1] or "1").upper().replace("D", "E"))))
        elif texts:
            raise card.error(f"{command} = {part.strip()!r} names no matrix; write {command} = NAME or 1.5*NAME")
    return found


def _sum(
    b: Builder, card: Card, command: str, chosen: list[tuple[str, float]], read: dict[str, Labelled]
) -> Labelled | None:
    """Return the sum of matrices in basic axes; None without any."""
    total: Labelled | None = None
    factor = _parameter(b, FACTORS[command])
    for name, own in chosen:
        one = read[name]._replace(matrix=csr_array(factor * own * read[name].matrix))
        if total is not None:
            first, second, rows = together(total, one)
            one = Labelled(csr_array(first + second), rows)
        total = one
    return None if total is None else _basic(b, card, total)


def _parameter(b: Builder, name: str) -> float:
    """Return the factor of a parameter such as CK2, one where it is not given."""
    found = [card.real(1, name) for card in b.tables.get("PARAM", {}).values() if card.text(0) == name]
    return found[-1] if found else 1.0


def _basic(b: Builder, card: Card, A: Labelled) -> Labelled:
    """Return a matrix with the components of its grids along the basic axes."""
    assert A.rows is not None  # those of DMIG and GENEL
    axes = {}
    for number in np.unique(A.rows[:, 0]).tolist():
        own = b.grids.displacement(b.grids.of(card, number))
        if not np.array_equal(own, np.eye(3)):
            axes[number] = own.T
    return in_basic_axes(A, axes)


def _add(b: Builder, card: Card, K: Labelled | None, M: Labelled | None, name: str) -> None:
    """Add a matrix element to the mesh."""
    where = f"{name} ({card.file} line {card.line})"
    b.matrices.append(matrix_element(K, M, lambda number: b.grids.of(card, number), b.units, where))


def _genel(b: Builder, card: Card) -> None:
    """GENEL: stiffness K or flexibility Z of the DOFs UI, with the rigid motions S that the DOFs UD give them."""
    parts = _parts(card)
    ui, ud = (_dofs(b, card, parts.get(key, [])) for key in ("UI", "UD"))
    if not ui or ("K" in parts) == ("Z" in parts):
        raise card.error("it needs the DOFs UI and either K or Z; complete the card")
    k = _stiffness(card, parts, len(ui))
    if ud:
        S = _motions(b, card, parts, ui, ud)
        k = np.block([[k, -k @ S], [-S.T @ k, S.T @ k @ S]])
    rows, order = np.unique(np.array(ui + ud), axis=0, return_index=True)
    if len(rows) < len(ui + ud):
        raise card.error("it names a DOF twice in UI and UD; list each once")
    _add(b, card, _basic(b, card, Labelled(csr_array(k[np.ix_(order, order)]), rows)), None, f"GENEL {card.id}")
    for grid in np.unique(rows[:, 0]).tolist():
        b.append("vertex", [b.grids.of(card, grid)], f"genel_{card.id}")


def _parts(card: Card) -> dict[str, list[str]]:
    """Return the fields of UI, UD, K or Z, and S."""
    found: dict[str, list[str]] = {"UI": card.row(0)[2:]}
    key = "UI"
    for k in range(1, card.rows):
        row = card.row(k)
        if row[0] in ("UD", "K", "Z", "S"):
            key = row[0]
            found[key] = row[2:] if key == "UD" else row[1:]
        else:
            found[key] += row
    return found


def _dofs(b: Builder, card: Card, fields: list[str]) -> list[tuple[int, int]]:
    """Return grids and components (0 to 5) of pairs of fields."""
    found = []
    for k in range(0, len(fields), 2):
        if not any(fields[k : k + 2]):
            continue
        own = Card(card.name, [card.text(0), *fields[k : k + 2]], card.file, card.line)
        component = own.integer(2, "a component", 0)
        if not 1 <= component <= 6:
            raise card.error(f"component {component} of {own.text(1)}: scalar points have no place; give grids only")
        b.grids.node(own, 1, "a grid")
        found.append((own.integer(1, "a grid"), component - 1))
    return found


def _values(card: Card, fields: list[str], count: int, what: str) -> np.ndarray:
    """Return `count` numbers, blanks as zero."""
    own = Card(card.name, [card.text(0), *fields], card.file, card.line)
    if any(fields[count:]):
        raise card.error(f"{what} has more than the {count} numbers that its DOFs ask for; correct the card")
    return own.reals(1, count, what)


def _stiffness(card: Card, parts: dict[str, list[str]], n: int) -> np.ndarray:
    """Return the stiffness (n, n): K as given, or the inverse of Z; both by columns of the lower triangle."""
    key = "K" if "K" in parts else "Z"
    A = np.zeros((n, n))
    A.T[np.triu_indices(n)] = _values(card, parts[key], n * (n + 1) // 2, key)
    A = A + np.tril(A, -1).T
    if key == "K":
        return A
    try:
        np.linalg.cholesky(A)
    except np.linalg.LinAlgError:
        raise card.error("its flexibility Z is not positive definite; correct Z, or give K") from None
    k = np.linalg.inv(A)
    return (k + k.T) / 2


def _motions(
    b: Builder, card: Card, parts: dict[str, list[str]], ui: list[tuple[int, int]], ud: list[tuple[int, int]]
) -> np.ndarray:
    """Return S (ui, ud): as given, or from the places of the grids where UD are the six DOFs of a rigid motion."""
    if "S" in parts:
        return _values(card, parts["S"], len(ui) * len(ud), "S").reshape(len(ui), len(ud))
    R = [np.array([_motion(b, card, *dof) for dof in dofs]) for dofs in (ui, ud)]
    size = np.linalg.svd(R[1], compute_uv=False)
    if len(ud) != 6 or size[-1] < DETERMINATE * size[0]:
        raise card.error("it has no S, and its UD are not six DOFs that hold a rigid body; give S, or such UD")
    return R[0] @ np.linalg.inv(R[1])


def _motion(b: Builder, card: Card, grid: int, component: int) -> np.ndarray:
    """Return a component of the displacement in unit translations and rotations about the origin."""
    row = b.grids.of(card, grid)
    e = b.grids.displacement(row)[component % 3]
    if component > 2:
        return np.concatenate([np.zeros(3), e])
    return np.concatenate([e, np.cross(b.grids.points[row], e)])


HANDLERS: dict[str, Callable[[Builder, Card], None]] = {"GENEL": _genel}
