"""Rigid (RBE2) and averaging (RBE3) links between placed nodes: which DOFs follow from which."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.errors import InputError
from modalprep.fe.links.components import Followed, Rows, followed_components, oblique
from modalprep.fe.links.interface import link_geometric_stiffness
from modalprep.fe.links.mean_points import MeanPoints
from modalprep.vectors import rotation_matrix, skew

STRAIGHT = 1e-10  # of the squared radius of gyration: what lies off a line by less does not determine a rotation
SETTLED = 4  # corrections of the nodes that follow the frame of an rbe3, each to the next power of the rotation


class Turning(NamedTuple):
    """Geometric stiffness of k states: ``K (k, 3, 3)`` on three rotations, ``between (k, 3, m)`` these and `others`."""

    rotations: np.ndarray
    K: np.ndarray
    between: np.ndarray
    others: np.ndarray


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
        rbe3, of the nodes; idle where it has `mean_points`.
    keeps_frame : bool
        rbe3: the frame's DOFs are independent and some of the nodes' follow from them (an interface), instead of
        the frame following the nodes.
    axes : (k, 3, 3) or (0, 3, 3)
        Rows: the axes of the components at each node, of an rbe3 (1, 3, 3) at its frame; empty: those of the mesh.
    mean_points : MeanPoints or None
        rbe3: whose mean motion it is; None takes the nodes.
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
    mean_points: MeanPoints | None = None

    def follower(self, node: np.ndarray) -> int:
        """Return which of the nodes has the DOFs ``node (6,)`` and follows an rbe2 in all of them; -1 if none."""
        every = np.broadcast_to(self.components, self.dofs.shape).all(axis=1)
        same = np.flatnonzero(every & np.all(self.dofs == node, axis=1)) if self.kind == "rbe2" else []
        return int(same[0]) if len(same) else -1

    def rooted_at(self, k: int) -> PlacedLink:
        """Return the same rigid link with its node `k`, which follows in all DOFs, as the frame, which follows it."""
        others = np.arange(len(self.dofs)) != k
        components = np.broadcast_to(self.components, self.dofs.shape)[others]
        axes = np.concatenate([self.axes[others], np.eye(3)[None]]) if len(self.axes) else self.axes
        return replace(
            self,
            frame=self.dofs[k],
            dofs=np.concatenate([self.dofs[others], self.frame[None]]),
            arm=np.concatenate([self.arm[others], np.zeros((1, 3))]) - self.arm[k],
            components=np.concatenate([components, np.ones((1, 6), dtype=bool)]),
            weights=np.ones(len(self.dofs)),
            axes=axes,
        )

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
    def _following(self) -> np.ndarray:
        """Which DOFs ``(k, 6)`` of the nodes follow an rbe2, along the axes of each node."""
        return (self.dofs >= 0) & self.components

    @cached_property
    def _straight(self) -> np.ndarray:
        """Those ``(k, 6)`` whose components are those of the mesh."""
        return self._following & ~oblique(self._following, self.axes)[:, None]

    @cached_property
    def _oblique(self) -> dict[int, Followed]:
        """How the other nodes follow."""
        others = np.flatnonzero(oblique(self._following, self.axes))
        return {int(k): followed_components(self._following[k], self.axes[k]) for k in others}

    @cached_property
    def _frame(self) -> Followed:
        """How the frame of an rbe3 follows."""
        return followed_components(self.components, self.axes[0] if len(self.axes) else np.eye(3))

    @cached_property
    def mean(self) -> MeanPoints:
        """The points whose mean motion an rbe3 has.

        About a straight line translations say nothing: there the rotations of the nodes count, if they have any.

        Raises
        ------
        InputError
            When neither determines a rotation that it has.
        """
        mean = self.mean_points or MeanPoints.at_nodes(self.weights)
        if not np.any((self.components | self.keeps_frame)[3:]) or not _on_a_line(mean, self.arm):
            return mean
        if not np.ptp(self.arm, axis=0).any() or np.any(self.dofs[:, 3:] < 0):
            raise InputError(
                f"{self.name}: its {len(self.arm)} nodes lie on one line and cannot carry a rotation; "
                "add nodes off that line, or use an rbe2 where they have rotations"
            )
        return mean.crossed(self.arm)

    def average(self) -> tuple[np.ndarray, np.ndarray]:
        """Return ``G (6, m)``, mean motion of the frame per nodal DOF, and those DOFs.

        Weighted least squares over the points: ``G = (S^T W S)^-1 S^T W`` with ``S_i = [1, -arm_i~]``.
        """
        mean = self.mean
        arm = mean.places(self.arm)
        w = mean.weight
        S = np.concatenate([np.broadcast_to(np.eye(3), (len(arm), 3, 3)), -skew(arm)], axis=2)
        size = np.sqrt(w @ np.sum((arm - w @ arm) ** 2, axis=1)) or 1.0
        scale = np.array([1.0, 1.0, 1.0, 1 / size, 1 / size, 1 / size])
        scaled = (S * scale).reshape(-1, 6)
        weighted = np.repeat(w, 3)[:, None] * scaled
        at_points = scale[:, None] * (np.linalg.pinv(scaled.T @ weighted) @ weighted.T)
        return self._of_nodes(at_points.reshape(6, -1, 3))

    def _of_nodes(self, at_points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return what is given per translation ``(..., q, 3)`` of the points per nodal DOF ``(..., m)``; the DOFs."""
        share, arm = self.mean.share.T, self.mean.arm
        parts = [at_points] if not np.any(arm) else [at_points, np.cross(arm, at_points)]
        first = [np.moveaxis(x, -2, 0).reshape(len(arm), -1) for x in parts]
        shape = (-1, *at_points.shape[:-2], 3)
        own = [np.moveaxis((share @ x).reshape(shape), 0, -2) for x in first]
        flat = [x.reshape(*x.shape[:-2], -1) for x in own]
        return np.concatenate(flat, axis=-1), np.concatenate(
            [self.dofs[:, 3 * i : 3 * i + 3].ravel() for i in range(len(own))]
        )

    def geometric_stiffness(self, reaction: np.ndarray) -> Iterator[Turning]:
        """Yield the work of the link's forces on its second-order motion, of each of k states.

        `reaction (n_dof, k)` is the force that holds each DOF, with those that it transfers to others. The force of an
        rbe3 acts on an arm, because the mean of a rotated node set rotates about its centroid; the moment does work on
        the second order of the mean rotation (`_mean_rotation`).
        """
        if self.kind == "rbe2":
            force = self._forces(reaction)
            K = link_geometric_stiffness(force, self.arm)
            yield Turning(self.frame[3:], K, np.zeros((len(force), 3, 0)), self.frame[:0])
            return
        force, moment = np.split(self._wrench(reaction), 2, axis=1)
        place = self.mean.places(self.arm)
        w = self.mean.weight
        centroid = w @ place
        yield from self._mean_rotation(place - centroid, force, moment - np.cross(centroid, force), centroid)

    def _forces(self, reaction: np.ndarray) -> np.ndarray:
        """Forces (k, m, 3) that hold the nodes of an rbe2, along the components that follow."""
        force = np.where(self._straight[:, :3], np.moveaxis(reaction[self.dofs[:, :3]], 2, 0), 0.0)
        for node, follows in self._oblique.items():
            force[:, node] = reaction[self.dofs[node, follows.place]].T @ follows.W[:, :3]
        return force

    def _wrench(self, reaction: np.ndarray) -> np.ndarray:
        """Force and moment (k, 6) of an rbe3 frame on its nodes, about the frame, by what holds the dependent DOFs."""
        if not self.keeps_frame:
            return -reaction[self.frame[self._frame.place]].T @ self._frame.W
        G, nodal = self.average()
        chosen = _independent_columns(G)
        return np.linalg.solve(G[:, chosen].T, reaction[nodal[chosen]]).T

    def move_dependent(self, d: np.ndarray) -> None:
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
        """Translation and rotation vector (6,) of the rigid motion that fits the points best (Kabsch)."""
        start = self.mean.places(self.arm)
        w = self.mean.weight
        moved = self.mean.share @ d[self.dofs[:, :3]]
        if np.any(self.mean.arm):
            turned = Rotation.from_rotvec(self.mean.share @ d[self.dofs[:, 3:]]).apply(self.mean.arm)
            moved = moved + turned - self.mean.arm
        place = start + moved
        before, after = start - w @ start, place - w @ place
        turn = Rotation.align_vectors(after, before, weights=w)[0]
        return np.concatenate([w @ place - turn.apply(w @ start), turn.as_rotvec()])

    def _mean_rotation(
        self, r: np.ndarray, force: np.ndarray, moment: np.ndarray, centroid: np.ndarray
    ) -> Iterator[Turning]:
        """Yield the work of forces and moments (k, 3) on the second order of the motion that fits points best.

        The points are at r about their centroid. The rotation R of least squares has ``sum w (R r) x (r + u) = 0``, so
        that its vector is t with ``S t = sum w [r x u + (t x r) x u] - (E t) x t / 2`` to second order,
        ``E = sum w r r^T``, ``S = tr(E) - E``. On arms that turn with a node, u has a second order of its own.
        """
        w = self.mean.weight
        E = np.einsum("k,ka,kb->ab", w, r, r)
        mu = moment @ np.linalg.pinv(np.trace(E) * np.eye(3) - E, rcond=1e-10, hermitian=True).T
        turn = skew(mu)
        K = (turn @ E - E @ turn) / 2 + link_geometric_stiffness(force[:, None], centroid[None])
        at_points = w[:, None, None] * skew(r) @ turn[:, None]  # (k, q, 3, 3)
        between, others = self._of_nodes(at_points.transpose(0, 2, 1, 3))
        yield Turning(self.frame[3:], K, between, others)
        if np.any(self.mean.arm):
            pull = -w[:, None] * np.cross(mu[:, None], r)
            for node in range(len(self.arm)):
                own = self.mean.share[:, [node]].tocoo().row
                K = link_geometric_stiffness(pull[:, own], self.mean.arm[own])
                yield Turning(self.dofs[node, 3:], K, np.zeros((len(K), 3, 0)), self.frame[:0])


def _on_a_line(mean: MeanPoints, nodes: np.ndarray) -> bool:
    place = mean.places(nodes)
    spread = mean.weight[:, None] * (place - mean.weight @ place)
    second = np.linalg.eigvalsh(spread.T @ (place - mean.weight @ place))
    return bool(second[1] <= STRAIGHT * second[2])


def _independent_columns(G: np.ndarray) -> np.ndarray:
    """Six columns that determine the others best: QR with pivoting."""
    from scipy.linalg import qr

    scaled = G / np.linalg.norm(G, axis=1, keepdims=True)
    return np.sort(qr(scaled, mode="r", pivoting=True)[1][:6])
