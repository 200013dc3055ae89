"""Rigid (RBE2) and averaging (RBE3) links between placed nodes: which DOFs follow from which."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.errors import InputError
from modalprep.fe.links.components import Followed, Rows, followed_components, oblique
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.vectors import rotation_matrix, skew

SETTLED = 4  # corrections of the nodes that follow the frame of an rbe3, each to the next power of the rotation


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
    components : (6,) or (k, 6) bool
        rbe2: which DOFs of the nodes follow, of all or of each; rbe3: which DOFs (6,) of the frame follow.
    weights : (k,)
        rbe3.
    keeps_frame : bool
        rbe3: the frame's DOFs are independent and some of the nodes' follow from them (an interface), instead of
        the frame following the nodes.
    axes : (k, 3, 3) or (0, 3, 3)
        Rows: the axes of the components at each node, of an rbe3 (1, 3, 3) at its frame; empty: those of the mesh.
    """

    kind: str
    name: str
    frame: np.ndarray
    dofs: np.ndarray
    arm: np.ndarray
    components: np.ndarray
    weights: np.ndarray
    keeps_frame: bool
    axes: np.ndarray = field(default_factory=lambda: np.zeros((0, 3, 3)))

    @cached_property
    def rows(self) -> Rows:
        """The rows of the dependent DOFs."""
        if self.kind == "rbe2":
            return self._rigid()
        G, nodal = self.average()
        if not self.keeps_frame:
            follows = self._frame
            own = np.broadcast_to(self.frame, (len(follows.place), 6))
            means = Rows.dense(self.frame[follows.place], nodal, follows.W @ G)
            return means.with_more(Rows.dense(means.dependent, own, follows.V))
        chosen = _independent_columns(G)
        rest = np.setdiff1d(np.arange(len(nodal)), chosen)
        solved = np.linalg.solve(G[:, chosen], np.hstack([np.eye(6), -G[:, rest]]))
        return Rows.dense(nodal[chosen], np.concatenate([self.frame, nodal[rest]]), solved)

    def _rigid(self) -> Rows:
        motion = np.zeros((len(self.dofs), 6, 6))
        motion[:] = np.eye(6)
        motion[:, :3, 3:] = -skew(self.arm)
        straight = self._straight
        parts = [Rows.dense(self.dofs[straight], self.frame, motion[straight])]
        for k, follows in self._oblique.items():
            sources = np.concatenate([self.frame, np.maximum(self.dofs[k], 0)])
            values = np.concatenate([follows.W @ motion[k], follows.V], axis=1)
            parts.append(Rows.dense(self.dofs[k, follows.place], sources, values))
        return Rows.joined(parts)

    @cached_property
    def _held(self) -> np.ndarray:
        """Which DOFs ``(k, 6)`` of the nodes follow an rbe2, along the axes of each node."""
        return (self.dofs >= 0) & self.components

    @cached_property
    def _straight(self) -> np.ndarray:
        """Those ``(k, 6)`` whose components are those of the mesh."""
        return self._held & ~oblique(self._held, self.axes)[:, None]

    @cached_property
    def _oblique(self) -> dict[int, Followed]:
        """How the other nodes follow."""
        others = np.flatnonzero(oblique(self._held, self.axes))
        return {int(k): followed_components(self._held[k], self.axes[k]) for k in others}

    @cached_property
    def _frame(self) -> Followed:
        """How the frame of an rbe3 follows."""
        return followed_components(self.components, self.axes[0] if len(self.axes) else np.eye(3))

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
        """Work of the link's forces on its second-order motion, of each of k states.

        Returns ``(k, 3, 3)`` on the rotations of the frame, ``(k, 3, m)`` between these and other DOFs, and those DOFs
        ``(m,)``, none of an rbe2.

        `held (n_dof, k)` is the force that holds each DOF, with the forces that it transfers to others. The force of an
        rbe3 acts on an arm, because the mean of a rotated node set rotates about its centroid; the moment does work on
        the second order of the mean rotation (`_mean_rotation`).
        """
        if self.kind == "rbe2":
            force = self._forces(held)
            return link_geometric_stiffness(force, self.arm), np.zeros((len(force), 3, 0)), self.frame[:0]
        force, moment = np.split(self._wrench(held), 2, axis=1)
        centroid = self.weights @ self.arm / self.weights.sum()
        K, between = self._mean_rotation(self.arm - centroid, moment - np.cross(centroid, force))
        K += link_geometric_stiffness(force[:, None], centroid[None])
        return K, between, self.dofs[:, :3].ravel()

    def _forces(self, held: np.ndarray) -> np.ndarray:
        """Forces (k, m, 3) that hold the nodes of an rbe2, along the components that follow."""
        force = np.where(self._straight[:, :3], np.moveaxis(held[self.dofs[:, :3]], 2, 0), 0.0)
        for node, follows in self._oblique.items():
            force[:, node] = held[self.dofs[node, follows.place]].T @ follows.W[:, :3]
        return force

    def _wrench(self, held: np.ndarray) -> np.ndarray:
        """Force and moment (k, 6) of an rbe3 frame on its nodes, about the frame, by what holds the dependent DOFs."""
        if not self.keeps_frame:
            return -held[self.frame[self._frame.place]].T @ self._frame.W
        G, nodal = self.average()
        chosen = _independent_columns(G)
        return np.linalg.solve(G[:, chosen].T, held[nodal[chosen]]).T

    def follow(self, d: np.ndarray) -> None:
        """Set the dependent ones of the finite displacements ``d (n_dof,)``, rotation vectors at nodes."""
        if self.kind == "rbe2":
            turn = rotation_matrix(d[self.frame[3:]])
            moved = np.tile(d[self.frame], (len(self.arm), 1))
            moved[:, :3] += self.arm @ turn.T - self.arm
            d[self.dofs[self._straight]] = moved[self._straight]
            for k, follows in self._oblique.items():
                d[self.dofs[k, follows.place]] = follows.of(moved[k], d[self.dofs[k]])
        elif not self.keeps_frame:
            d[self.frame[self._frame.place]] = self._frame.of(self._fitted(d), d[self.frame])
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
        """Work of moments (k, 3) on the second order of the rotation that fits nodes at r about their centroid best.

        The rotation R of least squares has ``sum w (R r) x (r + u) = 0``, so that its vector is t with
        ``S t = sum w [r x u + (t x r) x u] - (E t) x t / 2`` to second order, ``E = sum w r r^T``, ``S = tr(E) - E``.
        """
        E = np.einsum("k,ka,kb->ab", self.weights, r, r)
        mu = skew(moment @ np.linalg.pinv(np.trace(E) * np.eye(3) - E, rcond=1e-10, hermitian=True).T)
        between = self.weights[:, None, None] * skew(r) @ mu[:, None]
        return (mu @ E - E @ mu) / 2, between.transpose(0, 2, 1, 3).reshape(len(mu), 3, -1)


def _independent_columns(G: np.ndarray) -> np.ndarray:
    """Six columns that determine the others best: QR with pivoting."""
    from scipy.linalg import qr

    scaled = G / np.linalg.norm(G, axis=1, keepdims=True)
    return np.sort(qr(scaled, mode="r", pivoting=True)[1][:6])
