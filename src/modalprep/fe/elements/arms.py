"""Rigid arms from nodes to eccentric mass, and the second-order motion of mass on arms that rotate.

A mass at the end of the arm r of a node that rotates by the vector t moves by ``t x r + t x (t x r) / 2``. An inertia
force does work on the second term, for the sections of beams, the thickness of shells, eccentric elements, and offsets
and inertia tensors of point masses alike (theory 7.7). With ``L(f, r)`` of
`interface.link_geometric_stiffness`, a force f on the mass has the work ``t L(f, r) t / 2``.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.fe.elements.mass import MassObjects
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.vectors import skew


class RotatingArms(NamedTuple):
    """Arms of the elements of one block with the inertia of their ends, mesh axes.

    Attributes
    ----------
    arm : (ne, ns, 3)
        m, or without unit where the weight is a second moment.
    rotation : (ne, ns, 3, nl)
        Rotation of the arm per nodal DOF.
    unit : (ne, ns, 3, 12)
        Mass times acceleration of the end for the unit fields ``A_a`` and ``W_ab x_b`` (row by row).
    inertia : (ne, ns, 3, nl)
        Mass times acceleration of the end per acceleration of each nodal DOF.
    """

    arm: np.ndarray
    rotation: np.ndarray
    unit: np.ndarray
    inertia: np.ndarray

    @classmethod
    def joined(cls, parts: list[RotatingArms]) -> RotatingArms:
        """Put the arms of the same elements side by side."""
        return cls(*(np.concatenate(field, axis=1) for field in zip(*parts, strict=True)))


def section_arms(weight: np.ndarray, axis: np.ndarray, rotation: np.ndarray) -> RotatingArms:
    """Return the arms of second moments of mass ``weight (ne, ns)`` along `axis` ``(ne, ns or 1, 3)``.

    Their ends stand on both sides of the node, so that only fields which change along the axis load them.
    """
    axis = np.broadcast_to(axis, (*weight.shape, 3))
    unit = np.zeros((*weight.shape, 3, 4, 3))  # of A, then of each row a of W
    for a in range(3):
        unit[:, :, a, 1 + a] = weight[..., None] * axis
    inertia = -weight[..., None, None] * (skew(axis) @ rotation)
    return RotatingArms(axis, rotation, unit.reshape(*weight.shape, 3, 12), inertia)


def mass_arms(weight, position, shape, arm, rotation) -> RotatingArms:
    """Return the arms of masses ``weight (ne, ns)`` at `position` ``(ne, ns, 3)``, m, of displacement `shape`.

    ``shape (ne, ns, 3, nl)`` per nodal DOF; ``arm (ne, ns or 1, 3)``, m.
    """
    unit = np.zeros((*weight.shape, 3, 12))
    for a in range(3):
        unit[:, :, a, a] = weight
        unit[:, :, a, 3 + 3 * a : 6 + 3 * a] = weight[..., None] * position
    arm = np.broadcast_to(arm, (*weight.shape, 3))
    return RotatingArms(arm, rotation, unit, weight[..., None, None] * shape)


def nodal_arms(mass: MassObjects, arm: np.ndarray) -> RotatingArms:
    """Return the arms ``(ne, nn, 3)`` from the nodes of eccentric elements, which carry the elements' nodal inertia."""
    ne, nn, _ = arm.shape
    unit = np.concatenate([mass.g, mass.h.reshape(*mass.g.shape[:2], 9)], axis=2).reshape(ne, nn, 6, 12)[:, :, :3]
    rotation = np.zeros((ne, nn, 3, nn, 6))
    for k in range(nn):
        rotation[:, k, :, k, 3:] = np.eye(3)
    return RotatingArms(arm, rotation.reshape(ne, nn, 3, 6 * nn), unit, mass.of_translations())


def node_transformation(frame: np.ndarray, arm: np.ndarray) -> np.ndarray:
    """Return ``(ne, 6 nn, 6 nn)``: motions of eccentric points in the element frame per nodal DOF in mesh axes.

    ``u_loc = R (u + th x arm)``, ``th_loc = R th`` with `frame (ne, 3, 3)` and `arm (ne, nn, 3)`, mesh axes, m.
    """
    ne, nn = arm.shape[:2]
    T = np.zeros((ne, nn, 6, nn, 6))
    for i in range(nn):
        T[:, i, :3, i, :3] = T[:, i, 3:, i, 3:] = frame
        T[:, i, :3, i, 3:] = -frame @ skew(arm[:, i])
    return T.reshape(ne, 6 * nn, 6 * nn)


def add_arms(Kg: np.ndarray, force: np.ndarray, arm: np.ndarray) -> None:
    """Add to ``Kg (ne, 6 nn, 6 nn)`` the work of `force (ne, nn, 3)` on the second-order motion of rigid arms."""
    nn = arm.shape[1]
    for i in range(nn):
        if np.any(arm[:, i]):
            rows = slice(6 * i + 3, 6 * i + 6)
            Kg[:, rows, rows] += link_geometric_stiffness(force[:, i, None], arm[:, i, None])
