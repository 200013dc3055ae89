"""Names of modes: what moves, how, and in which symmetry."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

MOSTLY = 0.6  # of the kinetic energy: the parts that move; of a motion: its kind and its direction
STRAINED = 0.2  # of the strain energy: a part with less moves as a rigid one
SLENDER = 3.0  # length over width of a part that can stretch
ALIGNED = 0.9  # cosine of a direction that is called by one axis
SAME = 1e-3  # of the size: a node and the mirror image of another
PARITY = 0.9  # of the motion
IN_PLACE = 1e-9  # of the modal mass: nodes that turn and do not move, as in the torsion of a straight shaft
STATIONS = 12  # along a part, whose twist may vary
AXES = "xyz"
ORDINAL = {1: "1st", 2: "2nd", 3: "3rd"}


class Moving(NamedTuple):
    """What names the modes of a body.

    Attributes
    ----------
    points : (n_points, 3)
        m.
    shape : (n_points, 3, n)
    mass : (n_points,)
        kg, of the nodes.
    parts : {name: (n_points,) bool}
        The nodes of each group.
    strain : {name: (n,)}
        Share of each group in the strain energy of each mode; empty where it is not known.
    """

    points: np.ndarray
    shape: np.ndarray
    mass: np.ndarray
    parts: Mapping[str, np.ndarray]
    strain: Mapping[str, np.ndarray]


def mode_names(body: Moving) -> tuple[str, ...]:
    """Return the name of each mode; modes with one name are numbered.

    Examples
    --------
    >>> x = np.linspace(0, 1, 11)
    >>> points = np.stack([x, 0 * x, 0 * x], axis=1)
    >>> shape = np.stack([0 * x, x**2, 0 * x], axis=1)[:, :, None]
    >>> mode_names(Moving(points, shape, np.ones(11), {}, {}))
    ('1st bending in y',)
    """
    mirrors = _mirrors(body.points)
    seen: Counter[tuple[str, str, str]] = Counter()
    found = []
    for k in range(body.shape.shape[2]):
        parts, how, symmetry = named = _name(body, k, mirrors)
        seen[named] += 1
        found.append(f"{parts}{ORDINAL.get(seen[named], f'{seen[named]}th')} {how}{symmetry}")
    return tuple(found)


def _name(body: Moving, k: int, mirrors: Mapping[str, np.ndarray]) -> tuple[str, str, str]:
    """Return the parts that move in a mode, how, and in which symmetry."""
    u = body.shape[:, :, k]
    energy = body.mass * np.einsum("pi,pi->p", u, u)
    if not energy.sum() > IN_PLACE:
        return "", "rotation in place", ""
    movers = _movers(body, energy)
    region = np.logical_or.reduce([body.parts[name] for name in movers]) if movers else np.ones(len(u), dtype=bool)
    strained = not body.strain or sum(body.strain[name][k] for name in movers) >= STRAINED or not movers
    how = _motion(body.points[region], u[region], body.mass[region], strained)
    parts = f"{' and '.join(movers)}: " if movers and len(body.parts) > 1 else ""
    return parts, how, _symmetry(u, body.mass, mirrors)


def _movers(body: Moving, energy: np.ndarray) -> list[str]:
    """Return the groups with most of the kinetic energy, at most two; none where it is spread over more."""
    shared = np.maximum(sum((nodes.astype(int) for nodes in body.parts.values()), np.zeros(len(energy), int)), 1)
    share = {name: float((energy / shared)[nodes].sum() / energy.sum()) for name, nodes in body.parts.items()}
    first = sorted(share, key=lambda name: -share[name])
    for count in (1, 2):
        if sum(share[name] for name in first[:count]) >= MOSTLY:
            return first[:count]
    return []


def _motion(x: np.ndarray, u: np.ndarray, m: np.ndarray, strained: bool) -> str:
    """Return the kind and the direction of the motion of a region."""
    total = float((m * np.einsum("pi,pi->p", u, u)).sum())
    size, axes = _principal(x, m)
    long = axes[:, 0]
    if not strained:
        return _rigid(x, u, m, total)
    if _twist(x, u, m, long) > MOSTLY * total:
        return f"torsion about {_axis(long)}"
    if (m * (u @ long) ** 2).sum() > MOSTLY * total and size[0] > SLENDER * size[1]:
        return f"stretching along {_axis(long)}"
    direction, share = _direction(u, m)
    return f"bending in {_axis(direction)}" if share > MOSTLY else "bending"


def _rigid(x: np.ndarray, u: np.ndarray, m: np.ndarray, total: float) -> str:
    """Return the name of a motion without strain: a translation, or a rotation."""
    mean = (m[:, None] * u).sum(axis=0) / m.sum()
    if m.sum() * mean @ mean > MOSTLY * total:
        return f"sway in {_axis(mean / np.linalg.norm(mean))}"
    r = x - (m[:, None] * x).sum(axis=0) / m.sum()
    inertia = np.einsum("p,pi,pi->", m, r, r) * np.eye(3) - np.einsum("p,pi,pj->ij", m, r, r)
    spin = np.linalg.pinv(inertia) @ (m[:, None] * np.cross(r, u)).sum(axis=0)
    size = np.linalg.norm(spin)
    return f"rotation about {_axis(spin / size)}" if size > 0 else "motion"


def _principal(x: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the radii and the axes (columns) of a set of nodes, the longest first."""
    r = x - (m[:, None] * x).sum(axis=0) / m.sum()
    square, axes = np.linalg.eigh(np.einsum("p,pi,pj->ij", m / m.sum(), r, r))
    return np.sqrt(np.maximum(square[::-1], 0.0)), axes[:, ::-1]


def _twist(x: np.ndarray, u: np.ndarray, m: np.ndarray, axis: np.ndarray) -> float:
    """Return twice the kinetic energy of the rotation about an axis that varies along it."""
    r = x - (m[:, None] * x).sum(axis=0) / m.sum()
    s = r @ axis
    tangent = np.cross(axis, r - np.outer(s, axis))
    station = np.minimum((STATIONS * (s - s.min()) / (np.ptp(s) or 1.0)).astype(int), STATIONS - 1)
    along, moment = (
        np.bincount(station, m * np.einsum("pi,pi->p", a, tangent), minlength=STATIONS) for a in (u, tangent)
    )
    return float(np.sum(np.divide(along**2, moment, out=np.zeros(STATIONS), where=moment > 0)))


def _direction(u: np.ndarray, m: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the direction with most of the kinetic energy, and its share."""
    energy, axes = np.linalg.eigh(np.einsum("p,pi,pj->ij", m, u, u))
    return axes[:, -1], float(energy[-1] / energy.sum())


def _axis(direction: np.ndarray) -> str:
    """Return the axis that a direction has, or the two between which it lies.

    Examples
    --------
    >>> _axis(np.array([0.0, -1.0, 0.0])), _axis(np.array([0.6, 0.8, 0.0]))
    ('y', 'xy')
    """
    size = np.abs(direction)
    if size.max() >= ALIGNED:
        return AXES[int(size.argmax())]
    return "".join(AXES[k] for k in sorted(np.argsort(-size)[:2]))


def _mirrors(points: np.ndarray) -> dict[str, np.ndarray]:
    """Return, for each plane through the middle about which the nodes are symmetric, the image of each node."""
    low = points.min(axis=0)
    high = points.max(axis=0)
    size = float((high - low).max())
    found = {}
    tree = cKDTree(points)
    for axis in range(3):
        if high[axis] - low[axis] <= SAME * size:
            continue
        image = points.copy()
        image[:, axis] = low[axis] + high[axis] - image[:, axis]
        node = tree.query(image, distance_upper_bound=SAME * size)[1]  # without a bound, those far from all are slow
        alone = node == len(points)
        if np.mean(alone) < 0.01:
            node[alone] = tree.query(image[alone])[1]
            found["".join(AXES[k] for k in range(3) if k != axis)] = node
    return found


def _symmetry(u: np.ndarray, m: np.ndarray, mirrors: Mapping[str, np.ndarray]) -> str:
    total = float((m * np.einsum("pi,pi->p", u, u)).sum())
    said = []
    for plane, node in mirrors.items():
        sign = np.array([1.0 if axis in plane else -1.0 for axis in AXES])
        parity = float((m * np.einsum("pi,pi->p", u[node] * sign, u)).sum() / total)
        if abs(parity) > PARITY:
            said.append(f"{'symmetric' if parity > 0 else 'antisymmetric'} about {plane}")
    return f", {', '.join(said)}" if said else ""
