"""Whether the elements are small enough for the modes: rotations that change much within one beam or shell."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.quality.effective_mass import participation, totals
from modalprep.fe.assembly.model import FEModel
from modalprep.reduction.table import FIXED, FREE

# Of the change of slope along an element times its length, over the largest displacement: (k h)^2 of a wave of number
# k. At the limits frequencies were found to be 2 to 5 % off.
SHELLS, QUADRATIC, BEAMS = 2.0, 6.0, 4.0
TWISTED = 0.01  # displacement over twist times size, as of a shaft that turns about itself
SAME = 1e-6  # relative difference of equal frequencies
MOVES = 0.01  # of the mass in a direction: a mode that matters


def coarse_mesh(model: FEModel, basis: np.ndarray, body: FlexibleBody) -> tuple[str, ...]:
    """Return a note where a mode that moves the body is too wavy for its beams or shells; solids are not looked at.

    Parameters
    ----------
    basis : (n_dof, n)
        The modes of the body.

    Examples
    --------
    >>> from modalprep.body.build import flexible_body
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model(elements=2)
    >>> reduction = craig_bampton(model, modes=6, truncation=())
    >>> coarse_mesh(model, reduction.basis, flexible_body(model, reduction, name="beam"))[0][:67]
    'the mesh is too coarse for 2 of its modes, the lowest at 12.92 Hz: '
    """
    parts = [part for part in model.elements.parts if part.components(model.points) == 6] if model.elements else []
    if not (parts and body.n):
        return ()
    modes = _that_matter(body)
    wavy = np.zeros(len(modes), dtype=bool)
    u = basis[:, modes]
    spin = np.abs(u[model.dof[:, 3:]]).max(axis=(0, 1), initial=0.0) * np.ptp(model.points, axis=0).max()
    most = np.maximum(np.linalg.norm(body.shape[:, :, modes], axis=1).max(axis=0), TWISTED * spin)
    for part in parts:
        corners, limit = _edges(part.kind)
        wavy |= _turning(model, part.nodes[:, :corners], u) > limit * most
    if not wavy.any():
        return ()
    count = "one of its modes, that" if wavy.sum() == 1 else f"{wavy.sum()} of its modes, the lowest"
    return (
        f"the mesh is too coarse for {count} at {body.frequency[modes[wavy]].min():.4g} Hz: its beams or "
        "shells are long for such waves, and the frequency may be 5 % off and more; refine the mesh",
    )


def _edges(kind: str) -> tuple[int, float]:
    """Return the number of corners of a type of cell, and the limit of its beams or shells."""
    if kind.startswith("line"):
        return 2, BEAMS
    return (4 if kind.startswith("quad") else 3), QUADRATIC if kind[-1] in "689" else SHELLS


def _that_matter(body: FlexibleBody) -> np.ndarray:
    """Return the elastic modes with a share of the mass or of an inertia, up to the highest normal one."""
    whole = totals(body)
    share = participation(body).T ** 2 / np.where(whole > 0, whole, np.inf)[:, None]
    table = body.modes
    normal = [kept and kind in (FIXED, FREE) for kept, kind in zip(table.kept, table.kind, strict=True)]
    top = table.frequency[np.array(normal, dtype=bool)].max(initial=0.0)
    return np.flatnonzero((share.max(axis=0) > MOVES) & (body.K > 0) & (body.frequency <= top * (1 + SAME)))


def _turning(model: FEModel, corners: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Return the largest change of slope along an edge of the elements times its length ``(n,)``."""
    found = np.zeros(u.shape[1])
    for a, b in zip(corners.T, np.roll(corners, -1, axis=1).T, strict=True):
        edge = model.points[b] - model.points[a]
        turn = u[model.dof[b, 3:]] - u[model.dof[a, 3:]]
        bend = np.cross(edge[:, None], turn.transpose(0, 2, 1))  # times the length; without the twist
        found = np.maximum(found, np.linalg.norm(bend, axis=2).max(axis=0))
    return found
