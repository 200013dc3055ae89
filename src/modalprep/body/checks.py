"""Physics checks of a model and its modal body: identities that a wrong sign or unit cannot satisfy."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.fe.model import FEModel
from modalprep.vectors import skew

IDENTITY = 1e-9  # relative; sums over 1e5..1e6 entries lose up to six of sixteen digits
ORTHOGONAL = 1e-7  # the modes are orthonormal to 1e-8
NOISE = 1e-6  # of the largest row: rows that are nothing but round-off, such as a rod's rotation across its axis
RIGID = 1e-8  # strain force of a rigid motion over that of its absolute terms


@dataclass(frozen=True)
class Check:
    """One check: a relative error `value` that must stay below `limit`."""

    name: str
    value: float
    limit: float
    meaning: str

    @property
    def passed(self) -> bool:
        """Whether the value is a number within the limit."""
        return bool(self.value <= self.limit)


def check_model(model: FEModel) -> list[Check]:
    """Check an assembled model against the identities of FORMULATION section 1.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> all(check.passed for check in check_model(cantilever_model()))
    True
    """
    R, r = model.rigid_body(), model.rigid
    T = R[:, :3]
    terms = abs(model.K) @ np.abs(R)
    moved = np.abs(model.K @ R) / np.maximum(terms, max(NOISE * terms.max(), np.finfo(float).tiny))
    mass = _relative(R.T @ model.M @ R, rigid_mass_matrix(r.m, r.s0, r.E0))
    g_T = _relative(model.g.T @ T, r.m * np.eye(3))
    size = float(np.ptp(model.points, axis=0).max())
    h_T = _relative(np.einsum("dab,dc->abc", model.h, T), np.einsum("ac,b->abc", np.eye(3), r.s0), floor=r.m * size)
    return [
        Check("rigid motions are free of strain", float(moved.max()), RIGID, "K times a rigid motion is zero"),
        Check("mass of the mesh", mass, IDENTITY, "rigid mass matrix from M = from m, s0, E0"),
        Check("translation vectors", g_T, IDENTITY, "g . unit translation = mass"),
        Check("position vectors", h_T, IDENTITY, "h . unit translation = s0"),
    ]


def check_body(body: FlexibleBody) -> list[Check]:
    """Check a modal body, also one read from a file.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> [check.name for check in check_body(uniform_beam(modes=2)) if not check.passed]
    []
    """
    rigid = rigid_mass_matrix(body.m, body.s0, body.E0)
    Kg = [body.Kg_A, body.Kg_W, body.Kg_F, body.Kg_T]
    asymmetry = max((_relative(k, np.swapaxes(k, -1, -2)) for k in Kg if k.size), default=0.0)
    trace = body.P[0, 0] + body.P[1, 1] + body.P[2, 2]
    modal_mass = float(np.abs(trace - np.eye(body.n)).max(initial=0.0))
    tensor = _relative(body.P, body.P.transpose(1, 0, 3, 2))
    stiffness = _relative(body.K, (2 * np.pi * body.frequency) ** 2) if np.all(body.K >= 0) else float("inf")
    mass = _relative(np.diag(rigid), body.modes.total)
    return [
        Check("mass and inertia", mass, IDENTITY, "of the modal body = of the mesh"),
        Check(
            "inertia is physical", _inertia_defect(rigid[3:, 3:]), IDENTITY, "no moment exceeds the sum of the others"
        ),
        Check("modal mass", modal_mass, ORTHOGONAL, "P_11 + P_22 + P_33 = 1"),
        Check("mass tensor", tensor, IDENTITY, "P_ab = P_ba^T"),
        Check("modal stiffness", stiffness, IDENTITY, "K = (2 pi f)^2, not negative"),
        Check("geometric stiffness", asymmetry, IDENTITY, "Kg is symmetric"),
        Check("mass matrix", _indefinite(body, rigid), IDENTITY, "rigid and modal mass matrix is positive definite"),
    ]


def rigid_mass_matrix(m: float, s0: np.ndarray, E0: np.ndarray) -> np.ndarray:
    """Return ``[[m, -s0~], [s0~, J]]``, ``J = tr(E0) - E0`` (6, 6).

    Examples
    --------
    >>> rigid_mass_matrix(2.0, np.zeros(3), np.diag([1.0, 2, 3])).diagonal()
    array([2., 2., 2., 5., 4., 3.])
    """
    s = skew(s0)
    return np.block([[m * np.eye(3), -s], [s, np.trace(E0) * np.eye(3) - E0]])


def _relative(a: np.ndarray, b: np.ndarray, floor: float = 0.0) -> float:
    scale = max(np.abs(b).max(initial=0.0), floor, np.finfo(float).tiny)
    return float(np.abs(a - b).max(initial=0.0) / scale)


def _inertia_defect(J: np.ndarray) -> float:
    moments = np.linalg.eigvalsh(J)
    return float(max(0.0, moments[2] - moments[0] - moments[1]) / max(moments[2], np.finfo(float).tiny))


def _indefinite(body: FlexibleBody, mass: np.ndarray) -> float:
    """How far the smallest eigenvalue of the scaled (6 + n) mass matrix lies below zero; a line may turn for free."""
    C = np.array([body.H[2, 1] - body.H[1, 2], body.H[0, 2] - body.H[2, 0], body.H[1, 0] - body.H[0, 1]])
    cross = np.vstack([body.S, C])
    full = np.block([[mass, cross], [cross.T, np.eye(body.n)]])
    scale = 1 / np.sqrt(np.maximum(np.diag(full), 1e-12 * np.abs(full).max()))
    lowest = np.linalg.eigvalsh(full * scale * scale[:, None])[0]
    return float(max(0.0, -lowest))
