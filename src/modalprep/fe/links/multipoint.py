"""Rigid (RBE2) and averaging (RBE3) links as one linear map from the independent DOFs to all."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csr_array, eye_array
from scipy.spatial.transform import Rotation

from modalprep.errors import InputError
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.vectors import rotation_matrix, skew

SETTLED = 4  # corrections of the nodes that follow the frame of an rbe3, each to the next power of the rotation
DEPTH = 50  # links that hang on links: more is a loop


@dataclass(frozen=True, eq=False)
class PlacedLink:
    """A link between a frame (a node with six DOFs) and nodes.

    Attributes
    ----------
    kind : {"rbe2", "rbe3"}
    name : str
        For messages.
    frame : (6,) int
        DOFs of the frame.
    dofs : (k, 6) int
        DOFs of the nodes, -1 where a node has none.
    arm : (k, 3)
        From the frame to the nodes, m.
    components : (6,) bool
        rbe2: which DOFs of the nodes follow; rbe3: which DOFs of the frame follow.
    weights : (k,)
        rbe3.
    keeps_frame : bool
        rbe3: the frame's DOFs are independent and some of the nodes' follow from them (an interface), instead of
        the frame following the nodes.
    """

    kind: str
    name: str
    frame: np.ndarray
    dofs: np.ndarray
    arm: np.ndarray
    components: np.ndarray
    weights: np.ndarray
    keeps_frame: bool

    def rows(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return ``(dependent, sources, coefficients (d, s))``: dependent DOFs from their sources."""
        if self.kind == "rbe2":
            return self._rigid()
        G, nodal = self.average()
        if not self.keeps_frame:
            held = np.flatnonzero(self.components)
            return self.frame[held], nodal, G[held]
        chosen = _independent_columns(G)
        rest = np.setdiff1d(np.arange(len(nodal)), chosen)
        solved = np.linalg.solve(G[:, chosen], np.hstack([np.eye(6), -G[:, rest]]))
        return nodal[chosen], np.concatenate([self.frame, nodal[rest]]), solved

    def _rigid(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        motion = np.zeros((len(self.dofs), 6, 6))
        motion[:] = np.eye(6)
        motion[:, :3, 3:] = -skew(self.arm)
        present = (self.dofs >= 0) & self.components
        return self.dofs[present], self.frame, motion[present]

    def average(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ``G (6, 3k)``, mean motion of the frame per nodal translation, and those translations' DOFs.

        Weighted least squares: ``G = (S^T W S)^-1 S^T W`` with ``S_i = [1, -arm_i~]``.
        """
        S = np.concatenate([np.broadcast_to(np.eye(3), (len(self.arm), 3, 3)), -skew(self.arm)], axis=2)
        w = self.weights / self.weights.sum()
        size = np.sqrt(w @ np.sum((self.arm - w @ self.arm) ** 2, axis=1)) or 1.0
        scale = np.array([1.0, 1.0, 1.0, 1 / size, 1 / size, 1 / size])
        scaled = (S * scale).reshape(-1, 6)
        weighted = np.repeat(w, 3)[:, None] * scaled
        normal = scaled.T @ weighted
        wanted = self.components | self.keeps_frame
        if np.linalg.eigvalsh(normal)[0] < 1e-10 and np.any(wanted[3:]):
            raise InputError(
                f"{self.name}: its {len(self.arm)} nodes lie on one line and cannot carry a rotation; "
                "add nodes off that line, or use an rbe2 where the nodes have rotations"
            )
        return scale[:, None] * (np.linalg.pinv(normal) @ weighted.T), self.dofs[:, :3].ravel()

    def geometric_stiffness(self, held: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Work of the link's forces on its second-order motion.

        Returns ``(3, 3)`` on the rotations of the frame, ``(3, m)`` between these and other DOFs, and those DOFs
        ``(m,)``, none of an rbe2.

        `held (n_dof,)` is the force that holds each DOF, with the forces that it transfers to others. The force of an
        rbe3 acts on an arm, because the mean of a rotated node set rotates about its centroid; the moment does work on
        the second order of the mean rotation (`_mean_rotation`).
        """
        turn = self.frame[3:]
        if self.kind == "rbe2":
            return link_geometric_stiffness(held[self.dofs[:, :3]], self.arm), np.zeros((3, 0)), turn[:0]
        wrench = self._wrench(held)
        centroid = self.weights @ self.arm / self.weights.sum()
        K, between = self._mean_rotation(self.arm - centroid, wrench[3:] - np.cross(centroid, wrench[:3]))
        K += link_geometric_stiffness(wrench[None, :3], centroid[None])
        return K, between, self.dofs[:, :3].ravel()

    def _wrench(self, held: np.ndarray) -> np.ndarray:
        """Force and moment (6,) of an rbe3's frame on its nodes, about the frame, by what holds the dependent DOFs."""
        if not self.keeps_frame:
            return -held[self.frame] * self.components
        G, nodal = self.average()
        chosen = _independent_columns(G)
        return np.linalg.solve(G[:, chosen].T, held[nodal[chosen]])

    def follow(self, d: np.ndarray) -> None:
        """Set the dependent ones of the finite displacements ``d (n_dof,)``, rotation vectors at nodes."""
        if self.kind == "rbe2":
            turn = rotation_matrix(d[self.frame[3:]])
            moved = np.tile(d[self.frame], (len(self.arm), 1))
            moved[:, :3] += self.arm @ turn.T - self.arm
            present = (self.dofs >= 0) & self.components
            d[self.dofs[present]] = moved[present]
        elif not self.keeps_frame:
            d[self.frame[self.components]] = self._fitted(d)[self.components]
        else:
            G, nodal = self.average()
            chosen = _independent_columns(G)
            for _ in range(SETTLED):
                d[nodal[chosen]] += np.linalg.solve(G[:, chosen], d[self.frame] - self._fitted(d))

    def _fitted(self, d: np.ndarray) -> np.ndarray:
        """Translation and rotation vector (6,) of the rigid motion that fits the nodes best (Kabsch)."""
        place, w = self.arm + d[self.dofs[:, :3]], self.weights / self.weights.sum()
        before, after = self.arm - w @ self.arm, place - w @ place
        turn = Rotation.align_vectors(after, before, weights=w)[0]
        return np.concatenate([w @ place - turn.apply(w @ self.arm), turn.as_rotvec()])

    def _mean_rotation(self, r: np.ndarray, moment: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Work of a moment on the second order of the rotation that fits nodes at r about their centroid best.

        The rotation R of least squares has ``sum w (R r) x (r + u) = 0``, so that its vector is t with
        ``S t = sum w [r x u + (t x r) x u] - (E t) x t / 2`` to second order, ``E = sum w r r^T``, ``S = tr(E) - E``.
        """
        E = np.einsum("k,ka,kb->ab", self.weights, r, r)
        mu = skew(np.linalg.pinv(np.trace(E) * np.eye(3) - E, rcond=1e-10, hermitian=True) @ moment)
        between = (self.weights[:, None, None] * skew(r) @ mu).transpose(1, 0, 2).reshape(3, -1)
        return (mu @ E - E @ mu) / 2, between


def followed(links: list[PlacedLink], d: np.ndarray) -> np.ndarray:
    """Return finite displacements ``(n_dof,)`` whose dependent DOFs follow the independent ones of `d` exactly."""
    d = d.copy()
    for _ in range(DEPTH):
        before = d.copy()
        for link in links:
            link.follow(d)
        if np.array_equal(before, d):
            break
    return d


def constraint_matrix(links: list[PlacedLink], n: int) -> tuple[csr_array, np.ndarray, csr_array]:
    """Return ``C (n, n_free)`` from the independent DOFs to all, these DOFs ``(n_free,)``, and one step ``D (n, n)``.

    Raises
    ------
    InputError
        When two links drive the same DOF, or links drive each other in a loop.
    """
    owner = np.full(n, -1)
    rows, cols, values = [np.zeros(0, dtype=int)], [np.zeros(0, dtype=int)], [np.zeros(0)]
    for k, link in enumerate(links):
        dependent, source, coefficient = link.rows()
        taken = dependent[owner[dependent] >= 0]
        if len(taken):
            raise InputError(
                f"{links[owner[taken[0]]].name} and {link.name} drive the same node; "
                "let one of them hold it, or tie the two frames to each other"
            )
        owner[dependent] = k
        rows.append(np.repeat(dependent, len(source)))
        cols.append(np.tile(source, len(dependent)))
        values.append(coefficient.ravel())
    place = (np.concatenate(rows), np.concatenate(cols))
    D = coo_array((np.concatenate(values), place), shape=(n, n)).tocsr()
    free = np.flatnonzero(owner < 0)
    return _resolve(D, eye_array(n, format="csr")[:, free], links), free, D


def _resolve(D: csr_array, E: csr_array, links: list[PlacedLink]) -> csr_array:
    """``C = (1 + D + D^2 + ...) E``, finite because links depend on each other without a loop."""
    power = total = D
    for _ in range(DEPTH):
        if power.nnz == 0:
            return (E + total @ E).tocsr()
        power = D @ power
        total = total + power
    names = ", ".join(link.name for link in links[:4])
    raise InputError(f"rigid links drive each other in a loop ({names}...); let one frame be independent")


def transferred(D: csr_array, force: np.ndarray) -> np.ndarray:
    """Return the forces at every DOF with those of the links that depend on it: ``(1 + D^T + D^T D^T + ...) force``."""
    total, step = force, force
    for _ in range(DEPTH):
        step = D.T @ step
        if not np.any(step):
            break
        total = total + step
    return total


def _independent_columns(G: np.ndarray) -> np.ndarray:
    """Six columns that determine the others best: QR with pivoting."""
    from scipy.linalg import qr

    scaled = G / np.linalg.norm(G, axis=1, keepdims=True)
    return np.sort(qr(scaled, mode="r", pivoting=True)[1][:6])
