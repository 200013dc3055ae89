"""MBDyn's modal element: the record groups of a .fem file."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.contractions import centrifugal, inertia, moment
from modalprep.formats.nodes import Node, export_nodes
from modalprep.suggest import refuse_unknown

VERSIONS = ("full", "classic")


def write_mbdyn(body: FlexibleBody, path: str | Path, version: str = "full", mesh_nodes: Sequence[int] = ()) -> Path:
    """Write a body for MBDyn's modal joint; the file is written completely or not at all.

    A comment at its head has the card of the joint: its interfaces, in the order to which group 19 refers. The
    modal node is frame B: the root interface, which then is not in the card, unless `FlexibleBody.frame` is another.

    Parameters
    ----------
    version : {"full", "classic"}
        Groups 1 to 19, or 1 to 13 for versions of MBDyn without the others (without them the element has no inertial
        coupling between rigid motion and modes).
    mesh_nodes : sequence of int
        Further nodes, rows of ``body.points`` from 0; they have no rotation.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the version is unknown, a node does not exist, two interfaces get one label, the body has no modes
        or the folder cannot be written.

    References
    ----------
    P. Masarati and others, MBDyn input manual: joint ``modal``, and its file of modal data.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_mbdyn(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.fem")
    >>> for line in file.read_text().splitlines()[2:4]:
    ...     print(line)
    **   joint: LABEL, modal, NODE, 2, from file, damping from file, "beam.fem", 1,
    **      "tip", NODE_1, null;
    """
    refuse_unknown(version, VERSIONS, "MBDyn version")
    nodes = export_nodes(body, mesh_nodes)
    labels = _labels(nodes)
    head = _head(body, [labels[k] for k in carried_interfaces(body)], Path(path).name, version)
    groups = _basic(body, nodes, labels) | (invariants(body) if version == "full" else {})
    with atomic_path(path) as temporary, open(temporary, "w", encoding="ascii", errors="replace") as file:
        file.writelines(f"{line}\n" for line in [*head, *_records(groups), "** END OF FILE"])
    return Path(path)


def carried_interfaces(body: FlexibleBody) -> list[int]:
    """Return the interfaces of the joint's card: all except a root that is the modal node itself.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> carried_interfaces(uniform_beam(modes=2))
    [1]
    """
    return list(range(1 if body.at_root else 0, len(body.interface_name)))


def invariants(body: FlexibleBody) -> dict[str, list]:
    """Return groups 14 to 19: the rows of each, in reading order.

    With ``f`` the position and a sum for ``int rho``: Inv3 ``phi_k``, Inv4 ``f x phi_k``, Inv8 ``-f~ phi_j~``,
    Inv5 ``phi_j x phi_k``, Inv9 ``phi_j~ phi_k~``; the matrices of group 19 times their loads add to the stiffness.
    """
    inv9 = -inertia(body.P.swapaxes(2, 3))  # phi_j~ phi_k~ = phi_k phi_j^T - phi_j.phi_k I
    return {
        "14, INVARIANT 3": _rows(body.S),
        "15, INVARIANT 4": _rows(moment(body.H)),
        "16, INVARIANT 8": _rows(inertia(body.H).transpose(0, 2, 1)),
        "17, INVARIANT 5": _rows(moment(body.P.swapaxes(2, 3))),
        "18, INVARIANT 9": _rows(inv9.transpose(0, 2, 3, 1)),
        "19, MODAL STRESS STIFFENING MATRIX": _stiffening(body),
    }


def _stiffening(body: FlexibleBody) -> list[str]:
    """Return all matrices, zero ones too: 6 of w w, 3 of w', 3 of a - g, 6 of each interface of the card."""
    at_interfaces = np.concatenate([body.Kg_F, body.Kg_T], axis=1)[carried_interfaces(body)].reshape(-1, body.n, body.n)
    matrices = np.concatenate([centrifugal(body.Kg_W), moment(body.Kg_W), body.Kg_A, at_interfaces])
    rows = [str(len(matrices))]
    for index, matrix in enumerate(matrices, start=1):
        rows += [str(index), *_rows(matrix)]
    return rows


def _basic(body: FlexibleBody, nodes: list[Node], labels: list[str]) -> dict[str, list[str]]:
    """Return groups 1 to 13."""
    position = np.array([node.position for node in nodes])
    size = f"REV0 {len(nodes)} {body.n} 0 0 0"
    centre = body.s0 / body.m
    central = inertia(body.E0 - body.m * np.outer(centre, centre))
    return {
        "1, HEADER": ["** REVISION, NODES, NORMAL, ATTACHMENT, CONSTRAINT, REJECTED MODES", size],
        "2, FINITE ELEMENT NODE LIST": labels,
        "5, NODAL X COORDINATES": _rows(position[:, :1]),
        "6, NODAL Y COORDINATES": _rows(position[:, 1:2]),
        "7, NODAL Z COORDINATES": _rows(position[:, 2:]),
        "8, MODE SHAPES": list(_shapes(body, nodes)),
        "9, MODAL MASS MATRIX": _rows(np.eye(body.n)),
        "10, MODAL STIFFNESS MATRIX": _rows(np.diag(body.K)),
        "12, RIGID BODY INERTIA ABOUT THE CENTRE OF MASS": [_row([body.m]), _row(centre), *_rows(central)],
        "13, MODAL DAMPING MATRIX": _rows(body.damping_matrix),
    }


def _shapes(body: FlexibleBody, nodes: list[Node]) -> Iterator[str]:
    shapes = np.array([np.vstack([node.phi, node.psi]) for node in nodes])
    for mode, frequency in enumerate(body.frequency):
        yield f"** NORMAL MODE SHAPE # {mode + 1}, {frequency:.6g} Hz"
        yield from _rows(shapes[:, :, mode])


def _head(body: FlexibleBody, interfaces: list[str], file: str, version: str) -> Iterator[str]:
    card = f'joint: LABEL, modal, NODE, {body.n}, from file, damping from file, "{file}", {len(interfaces)}'
    places = [f'   "{name}", NODE_{number}, null' for number, name in enumerate(interfaces, start=1)]
    yield f"** {' '.join(body.name.split())} by modalprep, SI units; the modal node has its {body.frame}"
    yield "** group 19 counts the interfaces as this card does, and needs them all:"
    yield from (f"**   {line}," for line in [card, *places][:-1])
    yield f"**   {[card, *places][-1]};"
    if version == "full":
        yield "** MBDyn applies group 19 (geometric stiffness) only with: use automatic differentiation;"


def _labels(nodes: list[Node]) -> list[str]:
    """Names without blanks or quotes, which separate labels in the file and in the card."""
    labels = [re.sub(r"[^\w.+-]", "_", node.name, flags=re.ASCII) for node in nodes]
    twice = next((label for label in labels if labels.count(label) > 1), None)
    if twice is not None:
        raise InputError(f"two nodes would have the label {twice!r} in the MBDyn file; rename an interface")
    return labels


def _records(groups: dict[str, list[str]]) -> Iterator[str]:
    for title, rows in groups.items():
        yield "**"
        yield f"** RECORD GROUP {title}"
        yield from rows


def _rows(values: np.ndarray) -> list[str]:
    """One line for each first index, the others run in their order."""
    return [_row(row) for row in values.reshape(len(values), -1)]


def _row(values: Iterable[float]) -> str:
    return " ".join(f"{value:.16e}" for value in values)
