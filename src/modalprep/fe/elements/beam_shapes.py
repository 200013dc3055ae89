"""Shapes of beams along their line: prismatic, tapered in segments, and with released ends (theory 7.1).

A tapered beam consists of prismatic segments, whose inner ends are eliminated statically; the released DOFs of its ends
are eliminated likewise. Both are exact in statics for the segments.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from skfem import Basis, MeshLine1
from skfem.element import DiscreteField, Element
from skfem.refdom import RefLine

from modalprep.errors import InputError
from modalprep.fe.properties.properties import Beam

QUADRATURE = 6  # degree: cubic shapes squared; 4 Gauss points
GAUSS = 0.5 + np.array([-1, 1]) / np.sqrt(12)  # two points between 0 and 1
SEGMENTS = 8  # of a tapered beam, besides its stations


class ElementBeam(Element):
    """scikit-fem element of the 12 beam shape functions; value, grad, hess of the six section motions."""

    refdom = RefLine
    nodal_dofs = 6
    maxdeg = 3

    def __init__(self, phi_y: np.ndarray, phi_z: np.ndarray) -> None:
        self.phi_y, self.phi_z = phi_y, phi_z

    def gbasis(self, mapping, X, i, tind=None):  # noqa: D102 - scikit-fem's protocol
        length = mapping.detDF(X)
        motion = np.zeros((3, 6, *length.shape))  # derivative order, component, element, point
        node, component = divmod(i, 6)
        if component in (0, 3):  # u, tx: linear
            motion[0, component] = X[0] if node else 1 - X[0]
            motion[1, component] = (2 * node - 1) / length
        else:
            self._bend(motion, X[0], length, node, component)
        return (DiscreteField(value=motion[0], grad=motion[1][:, None], hess=motion[2][:, None, None]),)

    def _bend(self, motion, s, L, node, component):
        in_xy = component in (1, 5)
        phi = (self.phi_y if in_xy else self.phi_z)[:, None]
        rotational = component > 2
        deflection, slope = _bending_shapes(s, L, phi, 2 * node + rotational)
        lateral, angle, sign = (1, 5, 1.0) if in_xy else (2, 4, -1.0)  # in x-z the slope is -ty
        own = sign if rotational else 1.0
        motion[:, lateral] = own * deflection
        motion[:, angle] = own * sign * slope


def _bending_shapes(s, L, phi, k):
    """Return the deflection and slope of shape k (w1, slope1, w2, slope2) and their first two derivatives."""
    m = 1 / (1 + phi)
    zero = 0 * L
    if k % 2 == 0:
        sign = 1 if k == 0 else -1
        w = (1 - 3 * s**2 + 2 * s**3 + phi * (1 - s), -6 * s + 6 * s**2 - phi, -6 + 12 * s)
        deflection = np.array([sign * m * w[0] + (k == 2), sign * m * w[1] / L, sign * m * w[2] / L**2])
        slope = sign * 6 * m / L * np.array([s**2 - s + zero, (2 * s - 1) / L, 2 / L**2])
    elif k == 1:
        w = (
            s - 2 * s**2 + s**3 + phi / 2 * (s - s**2),
            1 - 4 * s + 3 * s**2 + phi / 2 * (1 - 2 * s),
            -4 + 6 * s - phi,
        )
        deflection = m * L * np.array([w[0] + zero, w[1] / L, w[2] / L**2])
        slope = m * np.array([1 - 4 * s + 3 * s**2 + phi * (1 - s), (-4 + 6 * s - phi) / L, 6 / L**2])
    else:
        w = (
            -(s**2) + s**3 + phi / 2 * (s**2 - s),
            -2 * s + 3 * s**2 + phi / 2 * (2 * s - 1),
            -2 + 6 * s + phi,
        )
        deflection = m * L * np.array([w[0] + zero, w[1] / L, w[2] / L**2])
        slope = m * np.array([3 * s**2 - 2 * s + phi * s, (6 * s - 2 + phi) / L, 6 / L**2])
    return deflection, slope


class Along(NamedTuple):
    """Section motions ``(u, v, w, tx, ty, tz)`` along beams per local DOF, and the section, at nq points.

    Attributes
    ----------
    value, grad, hess : (ne, nq, 6, 12)
        And their derivatives along e1.
    at : (nq,)
        0 at the first end, 1 at the second.
    dx : (ne, nq)
        m.
    A, Iy, Iz, J, nsm : (nq,)
        As in `Beam`.
    """

    value: np.ndarray
    grad: np.ndarray
    hess: np.ndarray
    at: np.ndarray
    dx: np.ndarray
    A: np.ndarray
    Iy: np.ndarray
    Iz: np.ndarray
    J: np.ndarray
    nsm: np.ndarray

    def strain(self) -> np.ndarray:
        """(ne, nq, 6, 12) strains (u', v' - tz, w' + ty, tx', ty', tz')."""
        B = self.grad.copy()
        B[:, :, 1] -= self.value[:, :, 5]
        B[:, :, 2] += self.value[:, :, 4]
        return B

    def stiffness(self, section: Beam) -> np.ndarray:
        """``int B^T C B`` (ne, 12, 12), local."""
        B = self.strain()
        return contract(B, B * (self.dx[:, :, None] * self.elasticity(section))[..., None])

    def elasticity(self, section: Beam) -> np.ndarray:
        """(nq, 6) stiffness of the section against its six strains."""
        E, G = section.material.E, section.material.G
        shears = section.theory == "timoshenko"
        shear = [shears * k * G * self.A for k in (section.ky, section.kz)]
        return np.stack([E * self.A, *shear, G * self.J, E * self.Iy, E * self.Iz], axis=1)

    def transformed(self, T: np.ndarray) -> Along:
        """Return the fields per other DOFs, of which the present ones are ``T (ne, 12, n)``."""
        return self._replace(**{name: getattr(self, name) @ T[:, None] for name in ("value", "grad", "hess")})


def along(length: np.ndarray, section: Beam, pins: np.ndarray | None = None) -> tuple[Along, Along]:
    """Return the fields of beams of `length` (ne,) at their quadrature points, and at their two ends.

    `pins` ``(ne, 12)`` is True where a DOF of an end, in the element's axes, is released.

    Raises
    ------
    InputError
        When the released ends let a beam move without strain.
    """
    rules = (None, (np.array([[0.0, 1.0]]), np.full(2, 0.5)))
    inside, ends = (_tapered(length, section, rule) if section.taper else _prismatic(length, section, rule)
                    for rule in rules)  # fmt: skip
    if pins is None or not np.any(pins):
        return inside, ends
    T = released(inside.stiffness(section), pins, length)
    return inside.transformed(T), ends.transformed(T)


def released(K: np.ndarray, pins: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Return the local DOFs ``(ne, 12, 12)`` per those of the nodes, where released ones follow statically."""
    size = 1 / np.sqrt(np.einsum("eii->ei", K))
    scaled = K * size[:, :, None] * size[:, None]
    held = np.where(pins, 0.0, 1.0)
    free = np.linalg.pinv(scaled * (1 - held)[:, :, None] * (1 - held)[:, None], rcond=1e-10, hermitian=True)
    T = size[:, :, None] * (np.eye(12) - free @ scaled) * (held / size)[:, None]
    rigid = np.tile(np.eye(6), (len(K), 2, 1))
    rigid[:, 7, 5], rigid[:, 8, 4] = length, -length
    if np.abs(T @ rigid - rigid).max() > 1e-6 * max(1.0, length.max()):
        raise InputError(
            "the pin flags of a beam let it move without strain; hold what both ends release at one of them"
        )
    return T


def _prismatic(length: np.ndarray, s: Beam, rule=None) -> Along:
    basis = _basis(length, s, rule)
    fields = [_stack(basis, name) for name in ("value", "grad", "hess")]
    nq = basis.dx.shape[1]
    return Along(*fields, basis.X[0], basis.dx, *(np.full(nq, x) for x in (s.A, s.Iy, s.Iz, s.J, s.nsm)))


def _tapered(length: np.ndarray, section: Beam, rule=None) -> Along:
    """Join prismatic segments; with a `rule` only the first and the last count, for the ends."""
    cuts = np.unique(np.r_[np.linspace(0, 1, SEGMENTS + 1), [x for x, *_ in section.taper if 0 < x < 1]])
    pieces = [(a, b, _segment(section, a, b)) for a, b in zip(cuts[:-1], cuts[1:], strict=True)]
    T = _inner_motion(length, pieces)
    parts = []
    for k, (a, b, own) in enumerate(pieces):
        piece = _prismatic((b - a) * length, own, rule).transformed(T[:, 6 * k : 6 * k + 12])
        parts.append(piece._replace(at=a + (b - a) * piece.at))
    if rule is not None:
        first, last = parts[0], parts[-1]
        parts = [_points(first, slice(0, 1)), _points(last, slice(1, 2))]
        values = np.array([section.at(x) for x in (0.0, 1.0)])
        parts = [part._replace(A=v[:1], Iy=v[1:2], Iz=v[2:3], J=v[3:4], nsm=v[4:])
                 for part, v in zip(parts, values, strict=True)]  # fmt: skip
    names = {name: 1 for name in ("value", "grad", "hess", "dx")}
    return Along(
        *(np.concatenate([getattr(p, name) for p in parts], axis=names.get(name, 0)) for name in Along._fields)
    )


def _points(fields: Along, some: slice) -> Along:
    return Along(*(x[:, some] if x.ndim > 1 else x[some] for x in fields))


def _segment(section: Beam, a: float, b: float) -> Beam:
    """Return the prismatic section of a segment: mean mass, and the mean of the flexibilities."""
    there = np.array([section.at(a + (b - a) * x) for x in GAUSS])
    A, Iy, Iz, J, nsm = there.mean(axis=0)
    soft = 1 / (1 / there[:, 1:4]).mean(axis=0)
    return replace(
        section, A=float(A), Iy=float(soft[0]), Iz=float(soft[1]), J=float(soft[2]), nsm=float(nsm), taper=()
    )


def _inner_motion(length: np.ndarray, pieces) -> np.ndarray:
    """Return the motion of all ends of the segments ``(ne, 6 (n + 1), 12)`` per DOF of the two ends of the beam."""
    n = 6 * (len(pieces) + 1)
    K = np.zeros((len(length), n, n))
    for k, (a, b, own) in enumerate(pieces):
        rows = slice(6 * k, 6 * k + 12)
        K[:, rows, rows] += _prismatic((b - a) * length, own).stiffness(own)
    ends = np.r_[:6, n - 6 : n]
    T = np.zeros((len(length), n, 12))
    T[:, ends, np.arange(12)] = 1.0
    T[:, 6 : n - 6] = -np.linalg.solve(K[:, 6 : n - 6, 6 : n - 6], K[:, 6 : n - 6][:, :, ends])
    return T


def _basis(length: np.ndarray, s: Beam, rule: tuple[np.ndarray, np.ndarray] | None = None) -> Basis:
    """Disjoint flat line elements, so that scikit-fem sees one-dimensional geometry; at points and weights `rule`."""
    ne, mat = len(length), s.material
    ratio = 12 * mat.E / (mat.G * s.A * length**2) if s.theory == "timoshenko" else np.zeros(ne)
    mesh = MeshLine1(np.stack([0 * length, length], 1).reshape(1, -1), np.arange(2 * ne).reshape(ne, 2).T)
    element = ElementBeam(ratio * s.Iz / s.ky, ratio * s.Iy / s.kz)
    return Basis(mesh, element, intorder=QUADRATURE, quadrature=rule, disable_doflocs=True)


def _stack(basis: Basis, name: str) -> np.ndarray:
    """Collect one field of all 12 shapes as (ne, nq, 6, 12)."""
    fields = [np.asarray(shape[0] if name == "value" else getattr(shape[0], name)) for shape in basis.basis]
    return np.moveaxis(np.array([f.reshape(6, *basis.dx.shape) for f in fields]), (0, 1), (3, 2))


def contract(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """``sum_q left^T right`` of (ne, nq, k, nl) arrays, as one matrix product per element."""
    ne, nq, k, nl = left.shape
    K = left.reshape(ne, nq * k, nl).transpose(0, 2, 1) @ right.reshape(ne, nq * k, nl)
    return (K + K.transpose(0, 2, 1)) / 2  # symmetric to the last bit
