"""Comparison of two bodies as physical systems, independent of their modal bases."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.linalg import subspace_angles

from modalprep.body.checks import Check
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import Recovery
from modalprep.reduction.dropped import complete_response

SAME_POINT = 1e-9  # of the body's size


def compare_bodies(a: FlexibleBody, b: FlexibleBody, tolerance: float = 1e-6) -> list[Check]:
    """Return the relative difference of every property that does not depend on the choice of modal coordinates.

    Signs and order of modes and rotations within a repeated root do not matter. Quadratic forms of the modes (modal
    integrals, geometric stiffness, damping) are compared in the static responses of the body to forces and moments on
    its interfaces, ``X = K^-1 [phi; psi]^T``; where both bodies have the same points, the largest angle between the
    spaces of their mode shapes is compared too.

    Parameters
    ----------
    tolerance : float
        Limit of each difference.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> flipped = body.with_(phi=-body.phi, psi=-body.psi, S=-body.S, H=-body.H, shape=-body.shape)
    >>> all(check.passed for check in compare_bodies(body, flipped))
    True
    >>> [check.name for check in compare_bodies(body, body.with_(m=1.1 * body.m)) if not check.passed]
    ['mass']
    """
    differences = list(_rigid(a, b))
    if a.interface_name == b.interface_name:
        differences += _elastic(a, b)
    return [Check(name, value, tolerance, meaning) for name, value, meaning in differences]


def _rigid(a: FlexibleBody, b: FlexibleBody) -> Iterator[tuple[str, float, str]]:
    size = max(_size(a), _size(b))
    yield "mass", _relative(a.m, b.m), "mass"
    yield "first moment", _relative(a.s0, b.s0, a.m * size), "mass times centre of mass, in the body frame"
    yield "inertia", _relative(a.E0, b.E0), "second moments about the body frame"
    same = a.interface_name == b.interface_name
    yield "interfaces", 0.0 if same else np.inf, "names of the interfaces" if same else _names(a, b)
    if same:
        yield "places", _relative(a.interface_position, b.interface_position, size), "of the interfaces"
    yield "frequencies", _frequencies(a, b), f"of {a.n} and {b.n} modal coordinates"


def _names(a: FlexibleBody, b: FlexibleBody) -> str:
    return f"{', '.join(a.interface_name)} against {', '.join(b.interface_name)}; the modes are not compared"


def _frequencies(a: FlexibleBody, b: FlexibleBody) -> float:
    if a.n != b.n:
        return np.inf
    size = np.maximum(a.frequency, b.frequency)
    return float(np.max(np.abs(a.frequency - b.frequency) / np.where(size > 0, size, 1.0), initial=0.0))


def _elastic(a: FlexibleBody, b: FlexibleBody) -> list[tuple[str, float, str]]:
    forms = {
        "flexibility": "static responses of the interfaces to forces and moments on them",
        "inertia coupling": "momentum of these answers, S and H",
        "damping": "of these answers",
        "mass integrals": "P in these answers",
        "geometric stiffness of accelerations": "Kg_A and Kg_W in these answers",
        "geometric stiffness of interface loads": "Kg_F and Kg_T in these answers",
        "second order of the modal mass": "T in these answers",
    }
    found = [(name, _relative(x, y), forms[name]) for name, x, y in zip(forms, _answers(a), _answers(b), strict=True)]
    if _same_points(a, b) and a.n and b.n:
        angle = subspace_angles(*(body.shape.reshape(-1, body.n) for body in (a, b)))[0]
        found.append(("space of mode shapes", float(np.sin(angle)), "sine of the largest angle between the two spaces"))
    if points := [name for name in a.stress if name in b.stress]:
        found.append(("stress", _stress(a, b, points), "of these answers, at the points that both bodies have"))
    if names := [name for name in a.recovery if name in b.recovery]:
        lacking = sorted(a.recovery.keys() ^ b.recovery.keys())
        alone = f"; only one has {', '.join(lacking)}" if lacking else ""
        found.append(("recovery", _recovery(a, b, names), f"static response and inertia of {', '.join(names)}{alone}"))
    return found


def _recovery(a: FlexibleBody, b: FlexibleBody, names: list[str]) -> float:
    """Largest difference over the size of the recovery; infinite where places, components or axes differ."""
    found = []
    for one, other in ((a.recovery[name], b.recovery[name]) for name in names):
        if (one.places, one.components) != (other.places, other.components):
            return np.inf
        turned = np.abs(one.axes - other.axes).max()
        found += [turned, *map(_relative, _recovered(a, one), _recovered(b, other))]
    return float(max(found))


def _recovered(body: FlexibleBody, block: Recovery) -> Iterator[np.ndarray]:
    """Yield the complete static response (p, c, 12 + 6 n_if) to loads of about 1 N, and R in the answers X."""
    m = body.m
    size = _size(body) or 1.0
    arms = np.tile(np.repeat([1.0, 1 / size], 3), len(body.interface_name))
    scale = np.concatenate([np.repeat([1 / m, 1 / (m * size)], [3, 9]), arms])
    yield scale * complete_response(body, block)
    yield np.zeros((*block.q.shape[:2], len(arms))) if block.qdd is None else block.qdd @ _static(body)


def _stress(a: FlexibleBody, b: FlexibleBody, points: list[str]) -> float:
    """Largest difference over that of the point's largest stress; infinite where the components differ."""
    found = []
    for one, other in ((a.stress[name], b.stress[name]) for name in points):
        if one.components != other.components:
            return np.inf
        turned = np.abs(one.axes - other.axes).max()
        found.append(max(turned, _relative(one.modes @ _static(a), other.modes @ _static(b))))
    return float(max(found))


def _answers(body: FlexibleBody) -> Iterator[np.ndarray]:
    """Yield every elastic property, in the answers X (n, 6 n_if) to unit forces and moments on the interfaces."""
    U = _motions(body)
    X = _static(body)
    yield U @ X
    yield np.concatenate([body.S, body.H.reshape(9, -1)]) @ X
    yield X.T @ body.damping_matrix @ X
    yield _in_answers(body.P.reshape(9, body.n, body.n), X)
    yield _in_answers(np.concatenate([body.Kg_A, body.Kg_W.reshape(9, body.n, body.n)]), X)
    yield _in_answers(np.concatenate([body.Kg_F, body.Kg_T]).reshape(-1, body.n, body.n), X)
    T = np.zeros((body.n, body.n, body.n)) if body.T is None else body.T
    yield _in_answers(np.tensordot(X.T, T, 1), X)


def _motions(body: FlexibleBody) -> np.ndarray:
    """Translations and rotations of the interfaces ``(6 n_if, n)``."""
    return np.concatenate([body.phi, body.psi], axis=1).reshape(-1, body.n)


def _static(body: FlexibleBody) -> np.ndarray:
    """Return the answers X (n, 6 n_if)."""
    U = _motions(body)
    return np.divide(U, body.K, out=np.zeros_like(U), where=body.K > 0).T


def _in_answers(forms: np.ndarray, X: np.ndarray) -> np.ndarray:
    return np.einsum("ix,kij,jy->kxy", X, forms, X, optimize=True)


def _same_points(a: FlexibleBody, b: FlexibleBody) -> bool:
    return a.points.shape == b.points.shape and np.allclose(a.points, b.points, rtol=0, atol=SAME_POINT * _size(a))


def _size(body: FlexibleBody) -> float:
    return float(np.ptp(body.points, axis=0).max(initial=0.0))


def _relative(a: np.ndarray | float, b: np.ndarray | float, scale: float = 0.0) -> float:
    """Norm of the difference over the larger of both, and of `scale`."""
    largest = max(np.linalg.norm(a), np.linalg.norm(b), scale)
    return float(np.linalg.norm(np.subtract(a, b)) / largest) if largest > 0 else 0.0
