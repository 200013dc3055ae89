"""Stiffness and mass that a deck gives as numbers, to matrix elements of a mesh in SI units."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import csr_array, diags_array

from modalprep.fe.mesh.mesh import MatrixElement
from modalprep.fe.readers.entries import Labelled, together
from modalprep.fe.readers.units import Units


def matrix_element(
    K: Labelled | None, M: Labelled | None, find: Callable[[int], int], units: Units, name: str
) -> MatrixElement:
    """Return the element of a stiffness and a mass, one of which may be missing.

    Parameters
    ----------
    K, M : Labelled
        In units of the deck and basic axes; rows by the node numbers of the file.
    find : callable
        The row of a node of the mesh by its number.
    units : Units
        PARAM,WTMASS does not act on matrices.
    name : str
        For messages: what it is and where it stands.

    Examples
    --------
    >>> from modalprep.fe.readers.entries import labelled
    >>> k = labelled(np.array([[7, 0], [7, 3]]), np.array([[7, 0], [7, 3]]), np.array([2.0, 3.0]))
    >>> made = matrix_element(k, None, lambda number: number - 7, Units(length=1e-3, mass=1e3), "K")  # mm, t, N
    >>> made.rows.tolist(), made.K.diagonal().tolist()  # N/m, N m
    ([[0, 0], [0, 3]], [2000.0, 0.003])
    """
    given = K or M
    assert given is not None  # an element has one of them
    empty = Labelled(csr_array(given.matrix.shape), given.rows)
    stiffness, mass, rows = together(K or empty, M or empty)
    assert rows is not None  # matrices of decks say which row is which
    scale = diags_array(np.where(rows[:, 1] < 3, 1.0, units.length))
    nodes = {number: find(number) for number in np.unique(rows[:, 0]).tolist()}
    return MatrixElement(
        rows=np.array([[nodes[number], component] for number, component in rows.tolist()]),
        K=csr_array(units.mass * (scale @ stiffness @ scale)),
        M=csr_array(units.mass * (scale @ mass @ scale)),
        name=name,
    )
