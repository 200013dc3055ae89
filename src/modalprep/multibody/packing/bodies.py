"""Pack the distinct bodies of a system, each once for all the links that carry it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import strain_arms
from modalprep.body.mass import affine_part
from modalprep.multibody.kernels.algebra.lanes import WIDTH
from modalprep.multibody.kernels.data import EPSILON, Integrals, Modal

UPPER = np.triu_indices(3)


def rigid_constants(bodies: Sequence[FlexibleBody], align: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the masses of bodies in their links' frames, whose rotations to the bodies' are ``align (n, 3, 3)``.

    Returns
    -------
    (n,), (n, 3), (n, 6)
        Mass (kg), first moment (kg m) and moment of inertia (kg m^2; xx, xy, xz, yy, yz, zz) of each.
    """
    back = align.swapaxes(1, 2)
    E0 = np.array([body.E0 for body in bodies])
    J = back @ (np.trace(E0, axis1=1, axis2=2)[:, None, None] * np.eye(3) - E0) @ align
    s0 = back @ np.array([body.s0 for body in bodies])[:, :, None]
    return np.array([body.m for body in bodies]), s0[:, :, 0], J[:, UPPER[0], UPPER[1]]


class Bodies:
    """Each distinct pair of body and alignment, once; bodies that lose mass each for itself."""

    def __init__(self) -> None:
        self.found: dict[tuple, tuple[int, int]] = {}
        self.positions: list[np.ndarray] = []
        self.count = 0  # of interfaces
        self.flexible: list[tuple[FlexibleBody, np.ndarray]] = []

    def add(self, body: FlexibleBody, align: np.ndarray, turned: bytes, owner: str) -> tuple[int, int]:
        """Return the body's first interface and its flexible kind, -1 where it has no modes.

        Parameters
        ----------
        align : (3, 3)
            The link's frame in the body's.
        turned : bytes
            The same for equal rotations.
        owner : str
            Name of a body that loses mass, "" of any other.
        """
        key = (id(body), turned, owner)
        if key not in self.found:
            kind = len(self.flexible) if body.n else -1
            self.found[key] = self.count, kind
            self.positions.append(body.interface_position @ align)
            self.count += len(body.interface_name)
            self.flexible += [(body, align)] if body.n else []
        return self.found[key]

    def nodes(self) -> np.ndarray:
        """Return the places of all interfaces in their links' frames (interfaces, 3), m."""
        return np.concatenate(self.positions)

    def modal(self) -> Modal | None:
        """Return the constants of the flexible bodies."""
        if not self.flexible:
            return None
        N = max(body.n for body, _ in self.flexible)
        kinds = len(self.flexible)
        N += -N % WIDTH
        first = {kind: node for node, kind in self.found.values()}
        grows = N if any(body.T is not None for body, _ in self.flexible) else 0
        of_kind = ((25,), (12 * N,), (N, 12 * N), (N, 9 * N), (N, 3 * N), (N, N), (2, N), (grows, grows, grows))
        out = [
            *(np.zeros((kinds, *shape)) for shape in of_kind),
            *(np.zeros((self.count, *shape)) for shape in ((6 * N,), (N, 6 * N), (3,))),
        ]
        for k, (body, align) in enumerate(self.flexible):
            rows = slice(first[k], first[k] + len(body.interface_name))
            for number, (array, value) in enumerate(zip(out, _modes(body, align, N), strict=True)):
                place = k if number < len(of_kind) else rows
                array[place][(..., *(slice(size) for size in value.shape[-(array.ndim - 1) :]))] = value
        integrals = len(Integrals._fields)
        return Modal(Integrals(*out[:integrals]), *out[integrals:])


def _modes(body: FlexibleBody, Q: np.ndarray, N: int) -> tuple[np.ndarray, ...]:
    """Return the arrays of `Integrals` and `Modal` of one body, its axes turned by Q, with rows of N; see there."""
    n = body.n
    part = affine_part(body)
    base, by_q = (np.einsum("ar...,ac->rc...", x, Q).reshape(12, *x.shape[2:]) for x in (part.first, part.second))
    rest = np.einsum("abij,ac,bd->jcdi", part.rest, Q, Q)
    gyro = np.einsum("cab,jbai->jci", EPSILON, rest)
    node = [
        np.concatenate([Q.T @ x, Q.T @ y], axis=-2)
        for x, y in (
            (body.phi, body.psi),
            (body.Kg_F.transpose(0, 3, 1, 2), body.Kg_T.transpose(0, 3, 1, 2)),
        )
    ]
    return (
        np.concatenate([(part.place.T @ Q).ravel(), (part.strain.T @ Q).ravel(), [part.root_mass]]),
        _filled(base, N),
        _filled(by_q.transpose(2, 0, 1), N),
        _filled(rest.reshape(n, 9, n), N),
        _filled(gyro, N),
        part.mass,
        np.stack([body.K, body.D]),
        part.rest_second.swapaxes(0, 1),
        _filled(node[0], N),
        _filled(node[1], N),
        strain_arms(body.interface_position, body.points) @ Q,
    )


def _filled(rows: np.ndarray, N: int) -> np.ndarray:
    """Return rows (..., r, n) one after the other, filled up with zeros: (..., r N)."""
    *outer, count, n = rows.shape
    return np.concatenate([rows, np.zeros((*outer, count, N - n))], axis=-1).reshape(*outer, count * N)
