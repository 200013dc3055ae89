"""Equations between the DOFs of a model, relative to the frame of its root."""

from __future__ import annotations

import numpy as np

from modalprep.fe.links.constraints import PlacedEquation
from modalprep.fe.mesh.mesh import Equation, Mesh
from modalprep.vectors import skew

ROUNDING = 1e-12
SAID = 1e-6  # of the terms of an equation: what its coefficients lack for a rigid motion, and a note says
MOTIONS = (
    "translation along x",
    "translation along y",
    "translation along z",
    "rotation about x",
    "rotation about y",
    "rotation about z",
)


def place_equations(
    mesh: Mesh, dof: np.ndarray, root: np.ndarray, origin: np.ndarray
) -> tuple[list[PlacedEquation], tuple[str, ...]]:
    """Return the equations of a mesh, and a note on those that a rigid motion of the model breaks.

    These hold the model at the frame of the root, ``root (6,)`` at ``origin (3,)``: their displacements are relative to
    the motion of that frame, so that the whole can still move.
    """
    placed, grounded = [], []
    for equation in mesh.equations:
        rest, largest = _under_rigid_motion(equation, mesh.points[equation.nodes] - origin)
        relative = np.abs(rest) / np.maximum(largest, np.finfo(float).tiny)
        place = dof[equation.nodes]
        order = np.argsort(-np.abs(equation.coefficients), axis=1, kind="stable")
        values = np.take_along_axis(equation.coefficients, order, axis=1).ravel()
        dofs = np.take_along_axis(place, order, axis=1).ravel()
        if relative.max() > ROUNDING:
            values, dofs = np.append(values, -rest), np.append(dofs, root)
        named = values != 0
        placed.append(PlacedEquation(equation.name, dofs[named], values[named]))
        if relative.max() > SAID:
            grounded.append((equation.name, MOTIONS[int(np.argmax(relative))], float(relative.max())))
    return placed, _note(grounded)


def _under_rigid_motion(equation: Equation, arm: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sum (6,) that rigid motions about the origin give, and the sum of its absolute terms."""
    motion = np.zeros((len(arm), 6, 6))
    motion[:] = np.eye(6)
    motion[:, :3, 3:] = -skew(arm)
    c = equation.coefficients
    return np.einsum("ka,kab->b", c, motion), np.einsum("ka,kab->b", np.abs(c), np.abs(motion))


def _note(grounded: list[tuple[str, str, float]]) -> tuple[str, ...]:
    if not grounded:
        return ()
    name, motion, value = grounded[0]
    return (
        f"equations that rigid motions break hold the model at the frame of its root ({len(grounded)}): in the first, "
        f"{name}, a {motion} leaves {value:.2g} of its terms; correct its coefficients, unless it is a support",
    )
