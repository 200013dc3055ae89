"""Geometric stiffness of corotational elements: the work of the nodal forces when the element rotates (theory 7.7).

The nodal displacements u and rotation vectors t of an element consist of a rotation w of its axes and a small strain.
To second order, the displacements and rotations that strain the element are

``u~ = u - w x X - w x u + w x (w x X) / 2,   t~ = t - w - w x t / 2``

with X the position of the node in the undeformed element. The nodal forces f and moments m of the linear element do
work on the second-order parts of both. This work is the geometric stiffness of the rotating element, whatever theory
holds inside it: the nodes carry moments across folds, and membrane forces, bending moments, twisting moments and
transverse shears all contribute. The second-order part of w does no work, because the forces of an element are in
equilibrium. The work of the internal stress on the remaining slopes is the element's own part.

References
----------
B. Nour-Omid, C. C. Rankin, Finite rotation analysis and consistent linearization using projectors, Comput. Methods
Appl. Mech. Eng. 93 (1991) 353. C. A. Felippa, B. Haugen, A unified formulation of small-strain corotational finite
elements, ibid. 194 (2005) 2285.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.fe.elements.arms import add_arms, node_transformation
from modalprep.fe.elements.block import Block
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.vectors import rotation_matrix, skew


def corotational_stiffness(
    axes_rotation: np.ndarray,
    position: np.ndarray,
    force: np.ndarray,
    moment: np.ndarray,
    arm: np.ndarray | None = None,
) -> np.ndarray:
    """Return the geometric stiffness ``(ne, 6n, 6n)`` of nodal forces and moments that rotate with their element.

    Parameters
    ----------
    axes_rotation : (ne, 3, 6n)
        Rotation w of the element's axes per nodal DOF ``(ux, uy, uz, tx, ty, tz)``.
    position : (ne, n, 3)
        Ends X where the forces act, m; any origin, because the forces are in balance.
    force, moment : (ne, n, 3)
        N and N m. All in one set of axes.
    arm : (ne, n, 3)
        From the nodes to the ends, m; the second order of arms themselves is that of `add_arms`.

    Examples
    --------
    A bar of length 2 m along x under a tension of 6 N has the transverse stiffness of a string, ``N / L``:

    >>> axes_rotation = np.zeros((1, 3, 12))
    >>> axes_rotation[0, 2, [1, 7]] = -0.5, 0.5
    >>> pull = np.array([[[-6.0, 0, 0], [6.0, 0, 0]]])
    >>> Kg = corotational_stiffness(axes_rotation, np.array([[[0.0, 0, 0], [2.0, 0, 0]]]), pull, 0 * pull)
    >>> Kg[0][np.ix_([1, 7], [1, 7])]
    array([[ 3., -3.],
           [-3.,  3.]])
    """
    ne, n = force.shape[:2]
    turned = skew(moment) / 2 if arm is None else skew(moment) / 2 - skew(force) @ skew(arm)
    work = np.concatenate([skew(force), turned], axis=3)  # (ne, n, 3, 6): w . (f x u + m x t / 2), u of the ends
    work = (
        work.transpose(0, 2, 1, 3).reshape(ne, 3, 6 * n) + link_geometric_stiffness(force, position) @ axes_rotation / 2
    )
    Kg = axes_rotation.transpose(0, 2, 1) @ work
    return Kg + Kg.transpose(0, 2, 1)


def line_rotation(length: np.ndarray) -> np.ndarray:
    """Return the rotation ``(ne, 3, 12)`` of a two-node element of `length` (ne,), m: of its line, and the mean twist.

    Examples
    --------
    >>> line_rotation(np.array([2.0]))[0, 2, [1, 7]]  # about e3, by the displacements along e2
    array([-0.5,  0.5])
    """
    axes_rotation = np.zeros((len(length), 3, 2, 6))
    across = np.array([-1.0, 1.0]) / length[:, None]
    axes_rotation[:, 0, :, 3] = 0.5
    axes_rotation[:, 1, :, 2] = -across
    axes_rotation[:, 2, :, 1] = across
    return axes_rotation.reshape(-1, 3, 12)


class Rotating(Protocol):
    """What a family provides: its axes, and the rotation of the axes per nodal DOF as in `corotational_stiffness`."""

    @property
    def nodes(self) -> np.ndarray:
        """(ne, n) int."""
        ...

    @property
    def components(self) -> int:
        """6, or 3 of elements whose nodes have no rotations."""
        ...

    @property
    def frame(self) -> np.ndarray:
        """(ne, 3, 3) in mesh axes."""
        ...

    @property
    def arm(self) -> np.ndarray:
        """(ne, n, 3) in mesh axes."""
        ...

    @property
    def position(self) -> np.ndarray:
        """(ne, n, 3) in element axes."""
        ...

    @property
    def axes_rotation(self) -> np.ndarray:
        """(ne, 3, 6n) in element axes."""
        ...

    def stiffness(self) -> np.ndarray:
        """(ne, 6n, 6n) in mesh axes."""
        ...

    def inner_fields(self) -> tuple[np.ndarray, np.ndarray]:
        """As of `Corotational`."""
        ...

    def inner_weights(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As of `Corotational`."""
        ...

    def geometric_stiffness(self, d: np.ndarray) -> np.ndarray:
        """As of `Block`."""
        ...

    def straining(self) -> np.ndarray:
        """As of `Corotational`."""
        ...


class Corotational(Block):
    """An element whose axes rotate with it, with six DOFs per node: beams, shells, bars with torque and bushings.

    A family provides what `Rotating` lists; the fields on which the internal stress does work are `inner_fields` and
    `inner_weights`.
    """

    def inner_fields(self: Rotating) -> tuple[np.ndarray, np.ndarray]:
        """Fields ``(ne, nq, r, 6n)`` at quadrature points and ``(ne, s, 6n)`` at sides or ends, per local DOF.

        The default is an element without an inside.
        """
        ne, n, _ = self.position.shape
        return np.zeros((ne, 1, 0, 6 * n)), np.zeros((ne, 0, 6 * n))

    def inner_weights(self, d: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Weights ``(ne, nq, r, r)`` and ``(ne, s, s)`` of the squares of the fields, for displacements ``d (ne, 6n)``.

        Symmetric, linear in the stress that d (mesh axes) means.
        """
        return np.zeros((len(d), 1, 0, 0)), np.zeros((len(d), 0, 0))

    def geometric_stiffness(self: Rotating, d: np.ndarray) -> np.ndarray:
        """Geometric stiffness ``(ne, 6n, 6n)`` of the prestress from the displacements ``d (ne, 6n)``, mesh axes."""
        return next(_geometric_stiffnesses(self, d[..., None]))

    def geometric_stiffnesses(self: Rotating, d: np.ndarray) -> Iterator[np.ndarray]:
        """Yield the geometric stiffness of each of the displacements ``d (ne, nl, k)``."""
        if self.components == 6:
            return _geometric_stiffnesses(self, d)
        return (self.geometric_stiffness(d[..., k]) for k in range(d.shape[2]))

    def straining(self: Rotating) -> np.ndarray:
        """Return the projector ``(ne, 6n, 6n)`` on displacements without the rotation of the element."""
        ne, n, _ = self.position.shape
        rigid = np.zeros((ne, n, 6, 3))
        rigid[:, :, :3] = -skew(self.position)
        rigid[:, :, 3:] = np.eye(3)
        return np.eye(6 * n) - rigid.reshape(ne, 6 * n, 3) @ self.axes_rotation

    def energy(self: Rotating, d: np.ndarray) -> np.ndarray:
        """Return the strain energy ``(ne,)`` at finite displacements ``d (ne, 6n)``, rotation vectors at the nodes.

        The displacements that strain the element, with the axes turned finitely, in the energy of the linear element
        and that of its inside: what `geometric_stiffness` must be the third derivative of.
        """
        ne, n, _ = self.arm.shape
        u, t = np.split(d.reshape(ne, n, 6), 2, axis=2)
        ends = (u + np.einsum("enab,enb->ena", rotation_matrix(t), self.arm) - self.arm) @ self.frame.transpose(0, 2, 1)
        rotations = t @ self.frame.transpose(0, 2, 1)
        local = np.concatenate([ends, rotations], axis=2).reshape(ne, 6 * n, 1)
        back = rotation_matrix(-(self.axes_rotation @ local)[..., 0])
        ends = np.einsum("eab,enb->ena", back, self.position + ends) - self.position
        rotations = _vector(back[:, None] @ rotation_matrix(rotations))
        y = np.concatenate([ends, rotations], axis=2).reshape(ne, 6 * n, 1)
        x = np.linalg.solve(node_transformation(self.frame, self.arm), y)
        fields = [_applied(field, self.straining() @ y) for field in self.inner_fields()]
        weights = self.inner_weights(x[..., 0])
        inner = [np.sum(z * (w @ z), axis=tuple(range(1, z.ndim))) for z, w in zip(fields, weights, strict=True)]
        return ((x.transpose(0, 2, 1) @ self.stiffness() @ x).ravel() + inner[0] + inner[1]) / 2


def _geometric_stiffnesses(element: Rotating, d: np.ndarray) -> Iterator[np.ndarray]:
    """Yield the geometric stiffness of each of the displacements ``d (ne, 6n, k)``."""
    ne, n, _ = element.arm.shape
    K = element.stiffness()
    T = node_transformation(element.frame, element.arm)
    axes_rotation = element.frame.transpose(0, 2, 1) @ element.axes_rotation @ T
    position = element.position @ element.frame
    at_points, at_sides = (_applied(fields, element.straining() @ T) for fields in element.inner_fields())
    for k in range(d.shape[2]):
        force, moment = np.split((K @ d[:, :, k, None]).reshape(ne, n, 6), 2, axis=2)
        Kg = corotational_stiffness(axes_rotation, position, force, moment - np.cross(element.arm, force), element.arm)
        weight, side_weight = element.inner_weights(d[:, :, k])
        rows = at_points.reshape(ne, at_points.shape[1] * at_points.shape[2], 6 * n)
        Kg += rows.transpose(0, 2, 1) @ (weight @ at_points).reshape(rows.shape)
        Kg += at_sides.transpose(0, 2, 1) @ (side_weight @ at_sides)
        if np.any(element.arm):
            add_arms(Kg, force, element.arm)
        yield (Kg + Kg.transpose(0, 2, 1)) / 2


def _applied(fields: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return fields ``(ne, .., 6n)`` of displacements ``(ne, 6n, k)``, ``(ne, .., k)``."""
    rows = int(np.prod(fields.shape[1:-1]))
    matrix = fields.reshape(len(fields), rows, fields.shape[-1])
    return (matrix @ columns).reshape(*fields.shape[:-1], columns.shape[2])


def _vector(matrix: np.ndarray) -> np.ndarray:
    return Rotation.from_matrix(matrix.reshape(-1, 3, 3)).as_rotvec().reshape(matrix.shape[:-1])
