"""The integration of the solids of a deck: what its elements say, or what the user asks for."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.elements.solid import INTEGRATIONS, REDUCED
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.properties import SolidIntegration

POINTS = {
    "full": "3 x 3 x 3 points",
    "reduced_stiffness": "2 x 2 x 2 points, their mass with 3 x 3 x 3",
    "reduced": "2 x 2 x 2 points, and their mass too",
}


def with_integration(mesh: Mesh, asked: SolidIntegration | None) -> Mesh:
    """Return the mesh of a deck with the integration that is asked for in place of its own, and a note on either.

    Raises
    ------
    InputError
        When it is asked for and no element has a choice.

    Examples
    --------
    >>> cells = {"hexahedron20": np.arange(20)[None]}
    >>> own = {"integration": {"hexahedron20": np.array([2.0])}}
    >>> mesh = Mesh(points=np.zeros((20, 3)), cells=cells, groups={}, data=own)
    >>> with_integration(mesh, None).notes
    ('1 hexahedra of 20 nodes are integrated with 2 x 2 x 2 points, and their mass too, as the deck says',)
    """
    if asked is not None:
        if not REDUCED.keys() & mesh.cells.keys():
            raise InputError(
                f"mesh {mesh.source} has {', '.join(mesh.cells)} cells, and 'integration' is of "
                f"{' and '.join(REDUCED)} cells; leave it out"
            )
        table = {kind: np.full(len(rows), INTEGRATIONS.index(asked)) for kind, rows in mesh.cells.items()}
        own = {kind: rows.astype(float) for kind, rows in table.items() if kind in REDUCED}
        mesh = mesh.with_(data={**mesh.data, "integration": own})
    return mesh.with_(notes=(*mesh.notes, *_notes(mesh, asked)))


def _notes(mesh: Mesh, asked: SolidIntegration | None) -> list[str]:
    given = mesh.data.get("integration", {}).get("hexahedron20", np.zeros(0))
    numbers, counts = np.unique(given, return_counts=True)
    why = "the deck says" if asked is None else f"integration = {asked!r} asks"
    return [
        f"{count} hexahedra of 20 nodes are integrated with {POINTS[INTEGRATIONS[int(number)]]}, as {why}"
        for number, count in zip(numbers, counts, strict=True)
        if number or asked
    ]
