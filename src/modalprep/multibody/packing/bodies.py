"""Pack the distinct bodies of a system, each once for all the links that carry it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.line import strain_arms
from modalprep.body.mass import affine_part
from modalprep.body.stations.second_order import station_body
from modalprep.compiler.lanes import WIDTH
from modalprep.multibody.kernels.data import EPSILON, Integrals, Modal
from modalprep.multibody.kernels.stations.data import Parts
from modalprep.multibody.packing.stations import packed_parts

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
        self.damped: list[int] = []  # flexible kinds whose dampers couple modes

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
            self.damped += [kind] if body.coupled_damping is not None else []
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
        N += -N % WIDTH
        first = {kind: node for node, kind in self.found.values()}
        parts = packed_parts(self.flexible, first, self.count, N)
        kinds = len(self.flexible), len(self.damped)
        found = _empty(*kinds, self.count, N, any(body.T is not None for body, _ in self.flexible), parts)
        for k, (body, align) in enumerate(self.flexible):
            integrals, constants, of_interfaces = _modes(body, align)
            nodes = slice(first[k], first[k] + len(body.interface_name))
            _fill(found.integrals, k, integrals)
            _fill(found, k, constants)
            _fill(found, nodes, of_interfaces)
        for row, k in enumerate(self.damped):
            _fill(found, row, {"dampers": between_modes(self.flexible[k][0])})
        return found


def between_modes(body: FlexibleBody) -> np.ndarray:
    """Return the damping (n, n) of a body off the diagonal.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> between_modes(uniform_beam(modes=2)).tolist()
    [[0.0, 0.0], [0.0, 0.0]]
    """
    return body.damping_matrix - np.diag(body.D)


def _empty(kinds: int, damped: int, interfaces: int, N: int, with_T: bool, parts: Parts) -> Modal:
    """Return zeros in place of all constants."""
    shapes = {
        "p0": (12,),
        "strain": (12,),
        "root_mass": (),
        "B": (12, N),
        "Kg_p": (N, 12, N),
        "P_rest": (N, 9, N),
        "gyro": (N, 3, N),
        "M_rest": (N, N),
    }
    integrals = Integrals(**{name: np.zeros((kinds, *shape)) for name, shape in shapes.items()})
    c = np.zeros((kinds, *(3 * (N * with_T,))))
    of_interfaces = {"Phi": (6, N), "Kg_FT": (N, 6, N), "arm": (3,)}
    nodes = {name: np.zeros((interfaces, *shape)) for name, shape in of_interfaces.items()}
    K = np.zeros((kinds, N))
    dampers = np.zeros((damped, N, N))
    return Modal(integrals, K, np.zeros_like(K), dampers, c, **nodes, parts=parts)


def _fill(record: Integrals | Modal, row: int | slice, values: dict[str, np.ndarray]) -> None:
    """Write arrays of n modes to rows of the arrays of N modes of a record."""
    for name, value in values.items():
        array = getattr(record, name)
        array[(row, *(slice(size) for size in np.shape(value)[-array.ndim + 1 :]))] = value


def _modes(body: FlexibleBody, Q: np.ndarray) -> tuple[dict, dict, dict]:
    """Return the fields of `Integrals`, of `Modal` by body and by interface of one body, its axes turned by Q."""
    n = body.n
    rest = station_body(body) if body.stations else None
    part = rest.affine if rest else affine_part(body)
    B, Kg_p = (np.einsum("ar...,ac->rc...", x, Q).reshape(12, *x.shape[2:]) for x in (part.B, part.Kg_p))
    P_rest = np.einsum("abij,ac,bd->jcdi", part.P_rest, Q, Q)
    Kg_F, Kg_T = (Q.T @ x.transpose(0, 3, 1, 2) for x in ((rest.Kg_F, rest.Kg_T) if rest else (body.Kg_F, body.Kg_T)))
    integrals = {
        "p0": (part.p0.T @ Q).ravel(),
        "strain": (part.strain.T @ Q).ravel(),
        "root_mass": part.root_mass,
        "B": B,
        "Kg_p": Kg_p.transpose(2, 0, 1),
        "P_rest": P_rest.reshape(n, 9, n),
        "gyro": np.einsum("cab,jbai->jci", EPSILON, P_rest),
        "M_rest": part.M_rest,
    }
    constants = {"K": body.K, "D": body.D, "c": part.c.swapaxes(0, 1)}
    of_interfaces = {
        "Phi": np.concatenate([Q.T @ body.phi, Q.T @ body.psi], axis=1),
        "Kg_FT": np.concatenate([Kg_F, Kg_T], axis=2),
        "arm": strain_arms(body.interface_position, body.points) @ Q,
    }
    return integrals, constants, of_interfaces
