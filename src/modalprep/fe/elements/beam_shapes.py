"""Motion along beams whose section may vary, from the equilibrium of their section forces (theory 7.1).

The section forces of a beam without load between its ends are known up to the six at its second end. They strain the
section by its flexibility; strains integrated from the first end are the motion. The element is exact in statics for
every taper, and has the interdependent cubic shapes where the section is constant.

References
----------
E. Spacone, F. C. Filippou, F. F. Taucer, Fibre beam-column model for non-linear analysis of R/C frames, Earthquake
Engineering and Structural Dynamics 25 (1996) 711: force-based elements.
"""

from __future__ import annotations

from itertools import pairwise
from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.properties.properties import Beam

POINTS, MORE_POINTS = 4, 6  # of Gauss: cubic shapes squared; between two stations of a taper
TRANSPORT = np.zeros((6, 6))  # of a rigid motion along e1, per length: v += tz, w -= ty
TRANSPORT[1, 5], TRANSPORT[2, 4] = 1.0, -1.0


class Along(NamedTuple):
    """Section motions ``(u, v, w, tx, ty, tz)`` along beams per local DOF, and the section, at nq points.

    Attributes
    ----------
    value, grad : (ne, nq, 6, 12)
        And their derivatives along e1.
    rate : (ne, nq, 2, 12)
        Shear forces along e3 and e2 over E Iy and -E Iz, which are ty'' and tz'' of a prismatic beam.
    at : (nq,)
        0 at the first end, 1 at the second.
    dx : (ne, nq)
        m.
    A, Iy, Iz, J, nsm : (nq,)
        As in `Beam`.
    shear_centre : tuple of 2 floats
        As in `Beam`; the motions are those of the centroid.
    """

    value: np.ndarray
    grad: np.ndarray
    rate: np.ndarray
    at: np.ndarray
    dx: np.ndarray
    A: np.ndarray
    Iy: np.ndarray
    Iz: np.ndarray
    J: np.ndarray
    nsm: np.ndarray
    shear_centre: tuple[float, float] = (0.0, 0.0)

    def strain(self) -> np.ndarray:
        """(ne, nq, 6, 12) strains (u', v' - tz, w' + ty, tx', ty', tz'), v and w of the shear centre."""
        B = _to_shear_centre(self.shear_centre) @ self.grad
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

    def ends(self) -> np.ndarray:
        """(ne, 12, 12) motions of both ends, of fields at the ends: unit matrices but for released DOFs."""
        return self.value.reshape(len(self.value), 12, -1)

    def piece(self, some: slice | np.ndarray) -> Along:
        """Return the fields of `some` of the elements."""
        return self._replace(**{name: getattr(self, name)[some] for name in ("value", "grad", "rate", "dx")})

    def transformed(self, T: np.ndarray) -> Along:
        """Return the fields per other DOFs, of which the present ones are ``T (ne, 12, n)``."""
        return self._replace(**{name: getattr(self, name) @ T[:, None] for name in ("value", "grad", "rate")})


def along(length: np.ndarray, section: Beam, pins: np.ndarray | None = None) -> tuple[Along, Along]:
    """Return the fields of beams of `length` (ne,) at their quadrature points, and at their two ends.

    `pins` ``(ne, 12)`` is True where a DOF of an end, in the element's axes, is released.

    Raises
    ------
    InputError
        When the released ends let a beam move without strain.

    Examples
    --------
    >>> from modalprep.fe.properties.materials import Material
    >>> beam = Beam(material=Material(E=210e9, nu=0.3, rho=7800.0), A=6e-4, Iy=4.5e-8, Iz=2e-8, J=4.7e-8)
    >>> inside, ends = along(np.array([2.0]), beam)
    >>> bool(np.allclose(ends.value[0].reshape(12, 12), np.eye(12)))
    True
    """
    at, weight, integral = _panels(section)
    flexibility, ends = (_flexibility(section, x) for x in (at, np.array([0.0, 1.0])))
    L = length[:, None, None, None]
    rest = np.eye(6) + (1 - at)[:, None, None] * L * TRANSPORT  # (ne, nq, 6, 6) from each point to the second end
    strain = flexibility[:, :, None] * np.swapaxes(rest, 2, 3)  # per force at the second end
    total = np.einsum("q,eqij,eqjk->eik", weight, rest, strain) * length[:, None, None]
    size = 1 / np.sqrt(np.einsum("eii->ei", total))[..., None]
    F = size * np.linalg.solve(size * total * np.swapaxes(size, 1, 2), size * _apart(length))  # (ne, 6, 12)
    first = _integrated(integral, strain) * L
    second = _integrated(integral, at[:, None, None] * strain) * L**2
    moved = first + TRANSPORT @ (at[:, None, None] * L * first - second)
    start = np.concatenate([np.eye(6) + at[:, None, None] * L * TRANSPORT, np.zeros((*moved.shape[:2], 6, 6))], axis=3)
    dx = length[:, None] * weight
    inside = _fields(section, at, dx, start + moved @ F[:, None], strain @ F[:, None], F, flexibility)
    rest = np.stack([np.eye(6) + length[:, None, None] * TRANSPORT, np.broadcast_to(np.eye(6), (len(length), 6, 6))], 1)
    strain = ends[:, :, None] * np.swapaxes(rest, 2, 3) @ F[:, None]
    value = np.tile(np.eye(12).reshape(1, 2, 6, 12), (len(length), 1, 1, 1))
    outside = _fields(section, np.array([0.0, 1.0]), np.tile(length[:, None] / 2, 2), value, strain, F, ends)
    if pins is not None and np.any(pins):
        T = released(inside.stiffness(section), pins, length)
        inside = inside.transformed(T)
        outside = outside.transformed(T)
    if any(section.shear_centre):
        inside, outside = (_at_centroid(fields, section.shear_centre) for fields in (inside, outside))
    return inside, outside


def _to_shear_centre(centre: tuple[float, float]) -> np.ndarray:
    """Return the matrix (6, 6) from motions of the centroid to those with v and w of the shear centre."""
    matrix = np.eye(6)
    matrix[1, 3], matrix[2, 3] = -centre[1], centre[0]
    return matrix


def _at_centroid(fields: Along, centre: tuple[float, float]) -> Along:
    """Return fields of shear centres per motions of shear centres as those of centroids."""
    there = _to_shear_centre(centre)
    back = np.linalg.inv(there)
    moved = fields._replace(value=back @ fields.value, grad=back @ fields.grad, shear_centre=centre)
    return moved.transformed(np.kron(np.eye(2), there)[None])


def _panels(section: Beam) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return Gauss points and weights between 0 and 1, panel by panel, and ``(nq, nq)`` integrals up to each."""
    cuts = [place[0] for place in section.taper] or [0.0, 1.0]
    x, w = np.polynomial.legendre.leggauss(MORE_POINTS if section.taper else POINTS)
    x, w, n = (1 + x) / 2, w / 2, len(x)
    partial = _integrals_to(x, w)
    whole = np.zeros((n * (len(cuts) - 1), n * (len(cuts) - 1)))
    for k, (a, b) in enumerate(pairwise(cuts)):
        own = slice(n * k, n * k + n)
        whole[own, own] = (b - a) * partial
        whole[n * k + n :, own] = (b - a) * w
    at = np.concatenate([a + (b - a) * x for a, b in pairwise(cuts)])
    return at, np.concatenate([(b - a) * w for a, b in pairwise(cuts)]), whole


def _integrals_to(x: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Return ``(n, n)`` integrals from 0 to each of the points x of Lagrange's polynomials on them.

    Examples
    --------
    >>> x = np.array([0.25, 0.75])
    >>> _integrals_to(x, np.array([0.5, 0.5])) @ x  # of x itself
    array([0.03125, 0.28125])
    """
    # (n, n): Gauss points up to each of the points
    y = x[:, None] * x
    others = ~np.eye(len(x), dtype=bool)
    polynomials = [np.prod((y[..., None] - x[some]) / (x[j] - x[some]), axis=2) for j, some in enumerate(others)]
    return x[:, None] * np.stack([p @ w for p in polynomials], axis=1)


def _flexibility(section: Beam, at: np.ndarray) -> np.ndarray:
    """Return the flexibility ``(nq, 6)`` of the section against N, Vy, Vz, T, My, Mz."""
    A, Iy, Iz, J, _ = np.array([section.section_at(float(x)) for x in at]).T
    E, G = section.material.E, section.material.G
    shears = section.theory == "timoshenko"
    shear = [shears / (k * G * A) for k in (section.ky, section.kz)]
    return np.stack([1 / (E * A), *shear, 1 / (G * J), 1 / (E * Iy), 1 / (E * Iz)], axis=1)


def _apart(length: np.ndarray) -> np.ndarray:
    """Return the motion ``(ne, 6, 12)`` of the second end less the rigid motion of the first."""
    rigid = np.eye(6) + length[:, None, None] * TRANSPORT
    return np.concatenate([-rigid, np.broadcast_to(np.eye(6), rigid.shape)], axis=2)


def _integrated(integral: np.ndarray, fields: np.ndarray) -> np.ndarray:
    return np.einsum("pq,eqij->epij", integral, fields)


def _fields(section: Beam, at, dx, value, strain, F, flexibility) -> Along:
    grad = strain.copy()  # of u', v' - tz, w' + ty, tx', ty', tz'
    grad[:, :, 1] += value[:, :, 5]
    grad[:, :, 2] -= value[:, :, 4]
    bend = flexibility[:, 4:, None]
    rate = np.stack([bend[:, 0] * F[:, None, 2], -bend[:, 1] * F[:, None, 1]], axis=2)
    return Along(value, grad, rate, at, dx, *np.array([section.section_at(float(x)) for x in at]).T)


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


def contract(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """``sum_q left^T right`` of (ne, nq, k, nl) arrays, as one matrix product per element."""
    ne, nq, k, nl = left.shape
    K = left.reshape(ne, nq * k, nl).transpose(0, 2, 1) @ right.reshape(ne, nq * k, nl)
    return (K + K.transpose(0, 2, 1)) / 2  # symmetric to the last bit
