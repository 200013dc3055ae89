"""The one description of what is drawn of a mesh, a model, a body, or the modes of a comparison."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.report.scene.skin import Skin, outer_skin


@dataclass(frozen=True, eq=False, kw_only=True)
class Scene:
    """Points, cells and modes that pyvista and the viewer of pages draw.

    Attributes
    ----------
    name : str
    points : (p, 3)
        The nodes, m.
    cells : {type: (n_cells, n_nodes) int}
        meshio's types; those that are points are not drawn.
    interface_name : tuple of str
        Of the marked points.
    interface_position : (k, 3)
        m.
    shape : (p, 3, n)
        The modes at the nodes; without modes the scene stands still.
    phi : (k, 3, n)
        The modes at the marked points.
    frequency : (n,)
        Hz.
    energy, volume : {type: array}
        Strain energy (n_cells, n) and volume (n_cells,) of the cells; empty where not known.
    titles : tuple of str
        Of each mode, where it has one.
    notes : tuple of str

    Examples
    --------
    >>> corners = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    >>> scene = Scene(name="plate", points=corners, cells={"triangle": np.array([[0, 1, 2]])})
    >>> scene.n, scene.skin.edges.shape, round(scene.size, 3)
    (0, (3, 2), 1.414)
    """

    name: str
    points: np.ndarray
    cells: Mapping[str, np.ndarray]
    interface_name: tuple[str, ...] = ()
    interface_position: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    shape: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 0)))
    phi: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 0)))
    frequency: np.ndarray = field(default_factory=lambda: np.zeros(0))
    energy: Mapping[str, np.ndarray] = field(default_factory=dict)
    volume: Mapping[str, np.ndarray] = field(default_factory=dict)
    titles: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """Number of modes."""
        return len(self.frequency)

    @cached_property
    def skin(self) -> Skin:
        """The outer surface and the beams."""
        return outer_skin(self.points, self.cells)

    @cached_property
    def corner_skin(self) -> Skin:
        """The outer surface by the corner nodes of the cells alone."""
        return outer_skin(self.points, self.cells, curved=False)

    @property
    def size(self) -> float:
        """Diagonal of the box around the nodes, m; 1 for a point."""
        return float(np.linalg.norm(np.ptp(self.points, axis=0))) or 1.0


def scene_of(body: FlexibleBody | Scene) -> Scene:
    """Return the scene of a body.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> scene_of(uniform_beam(modes=2, elements=4)).shape.shape
    (5, 3, 2)
    """
    if isinstance(body, Scene):
        return body
    return Scene(
        name=body.name,
        points=body.points,
        cells=body.cells,
        interface_name=body.interface_name,
        interface_position=body.interface_position,
        shape=body.shape,
        phi=body.phi,
        frequency=body.frequency,
        energy=body.energy,
        volume=body.volume,
    )
