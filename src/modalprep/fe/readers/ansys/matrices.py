"""MATRIX27 of Ansys: stiffness or mass between two nodes, as numbers."""

from __future__ import annotations

import numpy as np

from modalprep.fe.readers.ansys.builder import Builder
from modalprep.fe.readers.ansys.constraints import axes_at_node
from modalprep.fe.readers.ansys.deck import Element
from modalprep.fe.readers.entries import Labelled, in_basic_axes, labelled
from modalprep.fe.readers.matrix_elements import matrix_element

MASS, STIFFNESS, DAMPING = 2, 4, 5  # KEYOPT(3)
ROWS = 12  # six DOFs of each node
ENTRIES = ROWS * (ROWS + 1) // 2


def add_matrix(b: Builder, element: Element) -> None:
    """Add MATRIX27, whose real constants are the upper triangle row by row, in the axes of the nodes."""
    options = b.deck.types[element.type].options
    form, kind = options.get(2, 0), options.get(3, 0)
    if kind == DAMPING:
        b.deck.skipped.append(("MATRIX27 of damping", f"line {element.line}"))
        return
    if form != 0 or kind not in (MASS, STIFFNESS):
        raise b.deck.error(
            element, f"MATRIX27 with KEYOPT(2) = {form} and KEYOPT(3) = {kind} is not read; give 0, and 2 or 4"
        )
    A = _labelled(b, element)
    K, M = (A, None) if kind == STIFFNESS else (None, A)
    name = f"MATRIX27 element {element.label} (line {element.line})"
    assert A.rows is not None  # named by the nodes
    nodes = {label: b.row[label] for label in np.unique(A.rows[:, 0]).tolist()}
    b.turning |= {nodes[label] for label, component in A.rows.tolist() if component > 2}
    b.matrices.append(matrix_element(K, M, nodes.__getitem__, b.units, name))
    for node in nodes.values():
        b.append("vertex", [node], f"matrix27_{element.label}")


def _labelled(b: Builder, element: Element) -> Labelled:
    """Return the matrix in global axes, by numbers of nodes and components."""
    values = np.array(b.deck.reals.get(element.real, []))
    if len(values) > ENTRIES and np.any(values[ENTRIES:]):
        raise b.deck.error(element, f"its real constants beyond C{ENTRIES} are those of an unsymmetric matrix")
    A = np.zeros((ROWS, ROWS))
    A[np.triu_indices(ROWS)] = np.pad(values[:ENTRIES], (0, max(0, ENTRIES - len(values))))
    A = A + np.triu(A, 1).T
    at = np.argwhere(A)
    if not len(at):
        raise b.deck.error(element, "its real constants are missing or zero; add its R and RMORE")
    b.nodes(element, np.unique(at[:, 0] // 6))
    place = np.array([(element.nodes[k // 6] if k // 6 < len(element.nodes) else 0, k % 6) for k in range(ROWS)])
    found = labelled(place[at[:, 0]], place[at[:, 1]], A[A != 0])
    axes = {label: axes_at_node(b, b.row[label]).T for label in set(element.nodes) & set(b.deck.angles)}
    return in_basic_axes(found, axes)
