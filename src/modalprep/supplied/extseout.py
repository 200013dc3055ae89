"""External superelements of Nastran: matrices by EXTSEOUT (op4) with their assembly and punch files."""

from __future__ import annotations

import hashlib
from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.fe.external.model import unit_factors
from modalprep.fe.readers.nastran.external import MASS, STIFFNESS
from modalprep.fe.readers.output4 import read_output4
from modalprep.suggest import refuse_missing
from modalprep.supplied.nastran_cards import Cards, read_boundary
from modalprep.supplied.nastran_rows import recovery_rows
from modalprep.supplied.reduced import body_from_reduced

VISCOUS = ("BXX1", "BXX", "BAA", "BAAX")
STRUCTURAL = ("K4XX1", "K4XX", "K4AA", "K4AAX")


def read_extseout(
    path: str | Path,
    *,
    assembly: str | Path | None = None,
    punch: str | Path | None = None,
    root: str | None = None,
    length_unit: str = "m",
    mass_unit: str | None = None,
    name: str | None = None,
) -> FlexibleBody:
    """Read an external superelement that Nastran wrote by ``EXTSEOUT(ASMBULK, EXTBULK, MATOP4=..)``.

    Parameters
    ----------
    path : path
        The .op4 file with KXX and MXX (or KAA and MAA).
    assembly, punch : path, optional
        The .asm and .pch file; by default those beside the .op4 file with its name. One of them is needed, the .pch
        file says more.
    root : str, optional
        Grid at which the body frame sits, such as ``grid_3``; default the first with six components.
    length_unit, mass_unit : str
        Of the deck, with seconds.
    name : str, optional
        Of the body; default that of the file.

    Returns
    -------
    FlexibleBody
        In SI units; its interfaces are the boundary grids, ``grid_3`` for grid 3. Displacements of scalar points are
        generalised coordinates. ``recovery`` has MUG1, MES1, MEF1 and the like where the .pch file labels their rows.

    Raises
    ------
    InputError
        When a file is missing, damaged or truncated, or the files do not belong together.

    References
    ----------
    Theory 10.
    """
    path = Path(path)
    refuse_missing(path, "external superelement")
    if path.suffix.lower() == ".op2":
        raise InputError(f"{path}: external superelements are read from .op4 files; write it by EXTSEOUT(MATOP4=..)")
    cards = read_boundary(*_beside(path, assembly, punch))
    length, mass = unit_factors(length_unit, mass_unit)
    matrices = {key.upper(): A.toarray() for key, A in read_output4(path).items()}
    K, M = (_one(matrices, keys, what, path) for keys, what in ((STIFFNESS, "stiffness"), (MASS, "mass")))
    dof, size = _rows(cards)
    if len(K) != size:
        raise InputError(
            f"{path}: the stiffness has {len(K)} rows, the boundary (EXTRN) {size}; give the files of one superelement"
        )
    rows, unlabelled = recovery_rows(matrices, cards.tables, size, length, mass)
    try:
        return body_from_reduced(
            name or path.stem,
            K,
            M,
            np.array(list(cards.position.values())),
            dof=dof,
            damping=_optional(matrices, VISCOUS, size),
            structural_damping=_optional(matrices, STRUCTURAL, size),
            axes=np.array(list(cards.axes.values())),
            names=[f"grid_{number}" for number in cards.position],
            root=root,
            length_unit=length_unit,
            mass_unit=mass_unit,
            recovery=rows,
            provenance=_source(path, matrices, unlabelled),
        )
    except InputError as error:
        raise InputError(f"{path}: {error}") from None


def _beside(path: Path, assembly: str | Path | None, punch: str | Path | None) -> tuple[Path | None, Path | None]:
    """Return the .asm and the .pch file: those given, else those beside the matrices."""
    found = []
    for given, suffix in ((assembly, ".asm"), (punch, ".pch")):
        beside = [path.with_suffix(s) for s in (suffix, suffix.upper()) if path.with_suffix(s).is_file()]
        if given is not None:
            refuse_missing(Path(given), f"{suffix} file of {path.name}")
        found.append(Path(given) if given is not None else next(iter(beside), None))
    if found == [None, None]:
        raise InputError(
            f"{path}: neither {path.stem}.asm nor {path.stem}.pch is beside it, which say where its boundary is; put "
            "one of them there"
        )
    return found[0], found[1]


def _one(matrices: dict[str, np.ndarray], keys: tuple[str, ...], what: str, path: Path) -> np.ndarray:
    for key in keys:
        if key in matrices:
            return matrices[key]
    raise InputError(f"{path} has no {what} matrix ({' or '.join(keys)}); it holds {', '.join(matrices)}")


def _optional(matrices: dict[str, np.ndarray], keys: tuple[str, ...], size: int) -> np.ndarray | None:
    """Return a matrix that Nastran replaces by a single zero where there is none."""
    given = (matrices[key] for key in keys if key in matrices)
    return next((A for A in given if A.shape != (1, 1) or (size == 1 and np.any(A))), None)


def _rows(cards: Cards) -> tuple[np.ndarray, int]:
    """Return the row of each component of the grids (k, 6), and the number of rows."""
    table = []
    at = 0
    for components in cards.points.values():
        if components:
            table.append([-1] * 6)
            for component in components:
                table[-1][int(component) - 1] = at
                at += 1
        else:
            at += 1
    if not table:
        raise InputError("the external superelement has no boundary grid, only scalar points; give it one")
    return np.array(table), at


def _source(path: Path, matrices: dict[str, np.ndarray], unlabelled: list[str]) -> dict[str, str]:
    said = {"mesh": path.name, "mesh_sha256": hashlib.sha256(path.read_bytes()).hexdigest(), "format": "EXTSEOUT"}
    loads = [key for key in ("PX", "PA", "PAX") if np.any(matrices.get(key, 0.0))]
    notes = [f"{key}: its loads are left out" for key in loads]
    notes += [f"{key}: no table of the .pch file labels its rows, it is left out" for key in unlabelled]
    return said | ({"notes": "; ".join(notes)} if notes else {})
