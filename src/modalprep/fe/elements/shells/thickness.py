"""Thickness that a mesh prescribes at the corners of single shells."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.reference_cells import NODES, quadrature, shapes_at
from modalprep.fe.properties.properties import Shell


def thickness_ratio(kind: str, section: Shell, data: dict, ne: int) -> np.ndarray | None:
    """Return the thickness at the nodes over that of the section, ``(ne, n)``; None where the mesh prescribes none.

    ``data["thickness"]`` has one value for each element ``(ne,)``, for each corner ``(ne, corners)`` or for each node
    ``(ne, n)``, m, and NaN for that of the section. Between corners alone the thickness is linear along the sides.

    Raises
    ------
    InputError
        When a thickness is not positive, the section is a laminate, or the data have another shape.

    Examples
    --------
    >>> from modalprep.fe.properties.materials import Material
    >>> section = Shell(material=Material(E=1.0, nu=0.3, rho=1.0), thickness=2.0)
    >>> thickness_ratio("triangle6", section, {"thickness": np.array([[2.0, 4.0, 6.0]])}, 1)
    array([[1. , 2. , 3. , 1.5, 2.5, 2. ]])
    """
    cell = CELLS[kind]
    given = np.asarray(data.get("thickness", np.nan), dtype=float)
    given = given[:, None] if given.ndim == 1 else given
    count = cell.count if given.shape[-1:] == (cell.count,) else len(cell.corners)
    if given.ndim > 2 or given.shape[-1:] not in ((), (1,), (count,)):
        raise InputError(
            f"thickness of {kind} cells has the shape {given.shape}; give one value, or one for each corner"
        )
    given = np.broadcast_to(given, (ne, count))
    if not np.any(np.isfinite(given)):
        return None
    if section.plies:
        raise InputError("shells have a thickness of their own, but their section is a laminate; give it to the plies")
    if np.any(given <= 0):
        raise InputError(f"{np.any(given <= 0, axis=1).sum()} shells have a thickness that is not positive; correct it")
    ratio = np.where(np.isfinite(given), given / section.thickness, 1.0)
    return ratio if count == cell.count else ratio @ shapes_at(cell.shape, quadrature(kind, NODES)[0])[0].T
