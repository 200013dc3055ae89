"""Colour of a mode picture: nodal displacement or strain energy density."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.report.scene.motion import largest_displacement
from modalprep.report.scene.record import Scene

WORDS = {"displacement": "displacement / largest", "energy": "root of strain energy density"}
SOLID = ("tetra", "pyramid", "wedge", "hexahedron")
FULL = 0.9  # fraction of the strain energy in cells on the scale; the density at notches exceeds it


def node_colour(body: Scene, mode: int, colour: str) -> np.ndarray:
    """Return the value of each node (n_points,) in a picture of `mode` (counted from 1), from 0 to 1.

    The displacement is divided by the largest; the root of the strain energy per volume by that above which a tenth of
    the energy lies. Both are means of the cells around a node. A spring counts as a cell of median volume.

    Raises
    ------
    InputError
        When the colour is unknown, or the body does not hold its strain energy.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.report.scene.record import scene_of
    >>> body = scene_of(uniform_beam(modes=1, elements=4))
    >>> node_colour(body, 1, "displacement").round(2)
    array([0.  , 0.1 , 0.34, 0.66, 1.  ])
    >>> node_colour(body, 1, "energy").round(2)
    array([1.  , 0.83, 0.47, 0.19, 0.05])
    """
    refuse_colour(body, colour)
    if colour == "energy":
        return _strain(body, mode - 1)
    largest = largest_displacement(body.shape)[mode - 1]
    length = np.linalg.norm(body.shape[:, :, mode - 1], axis=1)
    return length / largest if largest else np.zeros_like(length)


def colours(body: Scene) -> dict[str, str]:
    """Return the available colours of a body with the description of their scales."""
    known = body.energy and body.volume
    return WORDS if known else {"displacement": WORDS["displacement"]}


def refuse_colour(body: Scene, colour: str) -> None:
    """Refuse a colour that is unknown or not available for the body."""
    if colour not in WORDS:
        raise InputError(f"colour {colour!r} is not one of {', '.join(WORDS)}")
    if colour not in colours(body):
        raise InputError(
            f"body {body.name!r} has no strain energy of its cells: its modal file is of an older version, or it comes "
            "from bare matrices or was re-rooted; build it again from its mesh, or colour by displacement"
        )


def _strain(body: Scene, k: int) -> np.ndarray:
    """Root of the strain energy density at the nodes, 1 where it is high: it grows with the motion, as strain does."""
    energy = {kind: own[:, k] for kind, own in body.energy.items()}
    springs = {kind: _middling(body) * (own > 0) for kind, own in energy.items()}
    volume = {kind: np.where(own > 0, own, springs[kind]) for kind, own in body.volume.items()}
    density = _at_nodes(body, energy, volume)
    # solids once more over their neighbours: in a bent one, cells at the surface strain more than those inside
    solid = {kind: nodes for kind, nodes in body.cells.items() if cell_dimension(kind) == 3}
    energy |= {kind: volume[kind] * density[nodes].mean(axis=1) for kind, nodes in solid.items()}
    density = _at_nodes(body, energy, volume)
    high = _high(body, density, energy)
    return np.sqrt(np.minimum(density / high, 1.0)) if high > 0 else np.zeros_like(density)


def _at_nodes(body: Scene, energy: Mapping[str, np.ndarray], volume: Mapping[str, np.ndarray]) -> np.ndarray:
    """Energy over volume (n_points,) of the cells around each node; 0 at nodes without cells."""
    above, below = np.zeros(len(body.points)), np.zeros(len(body.points))
    for kind, nodes in body.cells.items():
        for corner in nodes.T:
            above += np.bincount(corner, energy[kind], len(above))
            below += np.bincount(corner, volume[kind], len(below))
    return above / np.where(below > 0, below, 1.0)


def _high(body: Scene, density: np.ndarray, energy: Mapping[str, np.ndarray]) -> float:
    """Density below which the fraction `FULL` of the energy lies."""
    of_cells = np.concatenate([density[nodes].max(axis=1) for nodes in body.cells.values()])
    energies = np.concatenate([energy[kind] for kind in body.cells])
    order = np.argsort(of_cells)
    below = np.cumsum(energies[order])
    return float(of_cells[order][np.searchsorted(below, FULL * below[-1])])


def _middling(body: Scene) -> float:
    real = np.concatenate([values[values > 0] for values in body.volume.values()])
    return float(np.median(real)) if len(real) else 1.0
