"""The mirror image of a mesh, with its sections, links, supports and loads."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array, lil_array

from modalprep.errors import InputError
from modalprep.fe.links.ring import turned_property
from modalprep.fe.mesh.analysis import LoadSet
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.mesh import Equation, Link, MatrixElement, Mesh, SupportSet
from modalprep.fe.properties.materials import Anisotropic
from modalprep.fe.properties.points import Spring
from modalprep.fe.properties.properties import Beam, Property, Shell, Solid

VECTORS = ("up", "axis", "ends")  # data of cells that are vectors in mesh axes
ODD = (4, 5)  # strains 23 and 13 of a material, which change sign with its third axis
SAME = 1e-12  # of a mirror
TOGETHER = 1e-9  # distance of the ends of a spring without length, over the size of the mesh


class Plane(NamedTuple):
    """A plane through a point (3,), m, with a unit normal (3,), mesh axes.

    Examples
    --------
    >>> Plane(np.array([2.0, 0, 0]), np.array([1.0, 0, 0])).image(np.array([[3.0, 5, 0]]))
    array([[1., 5., 0.]])
    """

    point: np.ndarray
    normal: np.ndarray

    @property
    def H(self) -> np.ndarray:
        """``I - 2 n n^T``, which mirrors a vector; rotations and moments are mirrored by ``-H``."""
        return np.eye(3) - 2 * np.outer(self.normal, self.normal)

    def image(self, points: np.ndarray) -> np.ndarray:
        """Return the mirror images of points (n, 3)."""
        return points - 2 * np.outer((points - self.point) @ self.normal, self.normal)


def mirrored_mesh(mesh: Mesh, plane: Plane) -> Mesh:
    """Return the mirror image of a mesh, whose matrices are those of the mesh in mirrored components.

    Solids stay right-handed. The normals of shells are mirrored with them: offsets keep their sign, angles change it.

    Raises
    ------
    InputError
        When a matrix has some components of a node only, and the plane is oblique to them.

    References
    ----------
    Theory 1.11.

    Examples
    --------
    >>> mesh = Mesh(points=np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]]),
    ...             cells={"tetra": np.array([[0, 1, 2, 3]])}, groups={"body": {"tetra": np.array([0])}})
    >>> image = mirrored_mesh(mesh, Plane(np.zeros(3), np.array([1.0, 0, 0])))
    >>> image.points[1], image.cells["tetra"]
    (array([-1.,  0.,  0.]), array([[0, 2, 1, 3]]))
    """
    H = plane.H
    return mesh.with_(
        points=plane.image(mesh.points),
        cells={kind: conn[:, mirrored_nodes(kind)] for kind, conn in mesh.cells.items()},
        properties={name: mirrored_property(section, H) for name, section in mesh.properties.items()},
        links=tuple(_link(link, H) for link in mesh.links),
        equations=tuple(_equation(equation, H) for equation in mesh.equations),
        matrices=tuple(_matrix(own, H) for own in mesh.matrices),
        supports={name: _support(held, H) for name, held in mesh.supports.items()},
        loads={name: _load(load, H) for name, load in mesh.loads.items()},
        data=_data(mesh, H),
    )


def mirrored_nodes(kind: str) -> list[int]:
    """Return the nodes of a cell in the order of its mirror image: its first side is the same, for surfaces backwards.

    Examples
    --------
    >>> mirrored_nodes("tetra"), mirrored_nodes("hexahedron"), mirrored_nodes("quad"), mirrored_nodes("triangle6")
    ([0, 2, 1, 3], [0, 3, 2, 1, 4, 7, 6, 5], [1, 0, 3, 2], [1, 0, 2, 3, 5, 4])
    """
    cell = CELLS[kind]
    if cell.dimension < 2:
        return list(range(cell.count))
    x = cell.node_coordinates()
    image = x[:, [1, 0, 2]] if cell.dimension == 3 else _with_first_side_backwards(cell.shape, x)
    return np.linalg.norm(image[:, None] - x, axis=2).argmin(axis=1).tolist()


def _with_first_side_backwards(shape: str, x: np.ndarray) -> np.ndarray:
    """Return the coordinates (n, 2) of a square or a triangle with its first two corners exchanged."""
    first = 1 - x[:, 0] - (x[:, 1] if shape == "triangle" else 0)
    return np.stack([first, x[:, 1]], axis=1)


def mirrored_property(section: Property, H: np.ndarray) -> Property:
    """Return the property of the mirror image by H (3, 3).

    The second axis of a beam's section, and the third one of a solid's material, keep the frame right-handed: they are
    turned against the image.

    Examples
    --------
    >>> from modalprep.fe.properties.materials import Material
    >>> steel = Material(E=2e11, nu=0.3, rho=7800.0)
    >>> beam = Beam(material=steel, A=1e-4, Iy=1e-9, Iz=1e-9, J=2e-9, offset=(0.01, 0.02))
    >>> mirrored_property(beam, np.diag([1.0, 1.0, -1.0])).offset
    (-0.01, 0.02)
    """
    section = turned_property(section, H)
    if isinstance(section, Beam):
        fibres = tuple((-y, *rest) for y, *rest in section.fibres)
        return replace(
            section, offset=_turned_over(section.offset), fibres=fibres, shear_centre=_turned_over(section.shear_centre)
        )
    if isinstance(section, Shell):
        plies = tuple(replace(ply, angle=-ply.angle) for ply in section.plies)
        return replace(section, angle=-section.angle, plies=plies)
    if isinstance(section, Solid) and isinstance(section.material, Anisotropic):
        sign = np.where(np.isin(np.arange(6), ODD), -1.0, 1.0)
        C = np.outer(sign, sign) * section.material.moduli()
        return replace(section, material=replace(section.material, C=tuple(C[np.triu_indices(6)].tolist())))
    return section


def _turned_over(of: tuple[float, float]) -> tuple[float, float]:
    return -of[0] or 0.0, of[1]


def _axes(axes: np.ndarray, count: int, H: np.ndarray) -> np.ndarray:
    """Return right-handed rows (count, 3, 3) along the images of the axes; without any of those of the mesh."""
    image = (axes if len(axes) else np.tile(np.eye(3), (count, 1, 1))) @ H
    image[..., 2, :] *= -1
    return image


def _link(link: Link, H: np.ndarray) -> Link:
    if np.all(link.components):
        return link
    return link.with_(axes=_axes(link.axes, len(link.nodes) if link.kind == "rbe2" else 1, H))


def _equation(equation: Equation, H: np.ndarray) -> Equation:
    of_u, of_turn = equation.coefficients[:, :3], equation.coefficients[:, 3:]
    return equation.with_(coefficients=np.hstack([of_u @ H, -of_turn @ H]))


def _matrix(own: MatrixElement, H: np.ndarray) -> MatrixElement:
    node, component = own.rows.T
    triple = 2 * node + component // 3
    T = lil_array((len(node), len(node)))
    for which in np.unique(triple):
        at = np.flatnonzero(triple == which)
        part = H[np.ix_(component[at] % 3, component[at] % 3)] * (-1.0 if which % 2 else 1.0)
        if np.abs(part @ part - np.eye(len(at))).max() > SAME:
            raise InputError(f"{own.name}: it has some components of a node only, which an oblique plane cannot mirror")
        T[np.ix_(at, at)] = part
    T = T.tocsr()
    return own.with_(K=csr_array(T @ own.K @ T), M=csr_array(T @ own.M @ T))


def _support(held: SupportSet, H: np.ndarray) -> SupportSet:
    return held.with_(axes=_axes(held.axes, len(held.nodes), H))


def _load(load: LoadSet, H: np.ndarray) -> LoadSet:
    return load.with_(forces=load.forces @ H, moments=-load.moments @ H)


def _data(mesh: Mesh, H: np.ndarray) -> dict[str, dict[str, np.ndarray]]:
    found = {
        name: {kind: _values(name, kind, values, H) for kind, values in of.items()} for name, of in mesh.data.items()
    }
    for group, section in mesh.properties.items():
        if isinstance(section, Spring):
            _put_frames(found, mesh, group, H)
    return found


def _values(name: str, kind: str, values: np.ndarray, H: np.ndarray) -> np.ndarray:
    """Return the values of the mirrored cells of a kind."""
    if name in VECTORS:
        return values @ H
    if name == "frame":
        return _axes(values, len(values), H)
    if name == "angle":
        return -values
    if name == "thickness" and values.ndim == 2:
        return values[:, mirrored_nodes(kind)[: values.shape[1]]]
    return values


def _put_frames(found: dict[str, dict[str, np.ndarray]], mesh: Mesh, group: str, H: np.ndarray) -> None:
    """Give springs without length and without axes of their own, which have those of the mesh, their images."""
    for kind, rows in mesh.groups.get(group, {}).items():
        at = mesh.points[mesh.cells[kind][rows]]
        short = np.linalg.norm(at[:, -1] - at[:, 0], axis=1) <= TOGETHER * max(1.0, float(np.abs(at).max()))
        frames = found.setdefault("frame", {}).setdefault(kind, np.full((len(mesh.cells[kind]), 3, 3), np.nan))
        own = rows[short & ~np.isfinite(frames[rows]).all(axis=(1, 2))]
        frames[own] = _axes(np.zeros((0, 3, 3)), len(own), H)
