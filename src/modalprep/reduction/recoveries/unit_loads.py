"""Unit loads under which modes are judged by what they give to recoveries, each of about 1 N in total (theory 3.6)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from modalprep.fe.recovery.fields import Fields, Quantity
from modalprep.linalg.blas import inner
from modalprep.reduction.clamped import Clamped, unit_loads
from modalprep.reduction.participation import model_size
from modalprep.reduction.table import DIRECTIONS
from modalprep.vectors import skew

ACCELERATION = "acceleration"  # the kind of recovery that rests in statics
NEGLIGIBLE = 1e-2  # of a recovery's largest value under a load, over that under the load that matters most


class JudgedLoads(NamedTuple):
    """Loads with the complete static responses of a model, and the forces of its modes.

    Attributes
    ----------
    label : tuple of str, length m
    fields : Fields
        Complete static response to each load, over all DOFs (n_dof, m), with the acceleration that balances it.
    moves : (m,) bool
        Whether the load is an acceleration of interfaces.
    force : (n, m)
        Modal forces of the candidates.
    w2 : (n,)
        Squared circular frequencies of the candidates, 1/s^2.
    modes : (n_dof, n)
    """

    label: tuple[str, ...]
    fields: Fields
    moves: np.ndarray
    force: np.ndarray
    w2: np.ndarray
    modes: np.ndarray


def unit_drives() -> np.ndarray:
    """Return ``(12, 6)``: A and W of unit accelerations along x, y, z and angular ones about x, y, z.

    Examples
    --------
    >>> unit_drives()[:, 5].nonzero()[0].tolist()  # W = alpha~
    [4, 6]
    """
    found = np.zeros((12, 6))
    found[:3, :3] = np.eye(3)
    found[3:, 3:] = skew(np.eye(3)).reshape(3, 9).T
    return found


def unit_columns(m: float, size: float, interfaces: int) -> np.ndarray:
    """Return accelerations along and about x, y, z, and loads on the interfaces but the root ``(12 + 6 n_if, k)``.

    Examples
    --------
    >>> unit_columns(2.0, 10.0, 2)[[0, 20], [0, 8]], unit_columns(2.0, 10.0, 2).shape
    (array([0.5, 1. ]), (24, 12))
    """
    n = 6 * (interfaces - 1)
    found = np.zeros((18 + n, 6 + n))
    found[:12, :6] = unit_drives() / (m * np.repeat([1.0, size], 3))
    found[18:, 6:] = np.diag(np.tile(np.repeat([1.0, size], 3), interfaces - 1))
    return found


def body_loads(body: Any) -> np.ndarray:
    """Return the `unit_columns` of a body."""
    size = float(np.ptp(body.points, axis=0).max(initial=0.0)) or 1.0
    return unit_columns(body.m, size, len(body.interface_name))


def fixed_interface_loads(
    clamped: Clamped, w2: np.ndarray, Phi: np.ndarray, loads: Mapping[str, np.ndarray]
) -> JudgedLoads:
    """Return accelerations of the base, and of each other fixed interface, loads on free ones, and those of the user.

    All fixed interfaces are held, as in the modes ``Phi (n_i, n)``; `loads` are ``{name: (n_i, k)}`` on the interior.
    """
    model = clamped.model
    scale = 1 / (model.rigid.m * np.array([1.0] * 3 + [model_size(model)] * 3))
    parts = [
        (_directions("base acceleration"), *_base(clamped, scale)),
        *_interfaces(clamped, scale),
        *_free(clamped),
        *(((name,) * f.shape[1], f, *_still(clamped, f.shape[1])) for name, f in loads.items()),
    ]
    labels, inside, motion, drives = zip(*parts, strict=True)
    f, a, b = np.hstack(inside), np.hstack(motion), np.hstack(drives)
    static = model.C @ clamped.expand(clamped.factor.solve(f))
    return JudgedLoads(
        label=sum(labels, ()),
        fields=Fields(static, model.C @ a, b),
        moves=np.any(a, axis=0) | np.any(b, axis=0),
        force=inner(Phi, f),
        w2=w2,
        modes=model.C @ clamped.expand(Phi),
    )


def floating_loads(clamped: Clamped, w2: np.ndarray, Phi: np.ndarray, F: np.ndarray, x: np.ndarray) -> JudgedLoads:
    """Return unit loads on every interface of the floating body, whose inertia balances them.

    ``F, x (n_free, 6 n_if)``: with inertia relief, and the responses to them; ``Phi (n_free, n)``.
    """
    model = clamped.model
    R = model.rigid_body()[model.free]
    raw = model.C.T @ unit_loads(model, [frame.dofs for frame in model.interfaces])
    raw = raw * np.tile(np.repeat([1.0, model_size(model)], 3), len(model.interfaces))
    rigid = R @ np.linalg.solve(R.T @ (clamped.M @ R), R.T @ raw)
    label = sum((_directions(f"load on {frame.name}") for frame in model.interfaces), ())
    fields = Fields(model.C @ x, model.C @ rigid, np.zeros((12, len(label))))
    return JudgedLoads(label, fields, np.zeros(len(label), dtype=bool), inner(Phi, F), w2, model.C @ Phi)


def _directions(what: str) -> tuple[str, ...]:
    return tuple(f"{what} {direction}" for direction in DIRECTIONS)


def _base(clamped: Clamped, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    drives = unit_drives() * scale
    inside = (clamped.model.C.T @ (clamped.model.inertia_loads @ drives))[clamped.i]
    return inside, np.zeros((clamped.K.shape[0], 6)), drives


def _interfaces(clamped: Clamped, scale: np.ndarray):
    """Yield the accelerations of the fixed interfaces but the root, one at a time, with the constraint modes."""
    others = [frame for frame in clamped.model.interfaces if frame.boundary == "fixed"][1:]
    for k, frame in enumerate(others, start=1):
        moved = np.zeros((clamped.K.shape[0], 6))
        own = slice(6 * k, 6 * k + 6)
        moved[clamped.b[own], np.arange(6)] = 1.0
        moved[clamped.i] = clamped.Psi[:, own]
        moved *= scale
        yield _directions(f"acceleration of {frame.name}"), -(clamped.M @ moved)[clamped.i], moved, np.zeros((12, 6))


def _free(clamped: Clamped):
    """Yield the unit loads on each free interface, moments times the body's size."""
    model = clamped.model
    arms = np.repeat([1.0, model_size(model)], 3)
    for frame in (frame for frame in model.interfaces if frame.boundary == "free"):
        inside = (model.C.T @ unit_loads(model, [frame.dofs]))[clamped.i] * arms
        yield _directions(f"load on {frame.name}"), inside, *_still(clamped, 6)


def _still(clamped: Clamped, m: int) -> tuple[np.ndarray, np.ndarray]:
    return np.zeros((clamped.K.shape[0], m)), np.zeros((12, m))


class Contributions(NamedTuple):
    """What modes give to one recovery of p places with c components, under m loads.

    Attributes
    ----------
    complete : (p, c, m)
        Static values of the full model; of accelerations those of the rigid motion.
    modal : (p, c, n)
        Values of unit modal coordinates, of accelerations of unit modal accelerations.
    factor : (n, m)
        Static modal coordinates under the loads; of accelerations those whose sum is the rigid motion.
    label : tuple of str, length m
    groups : tuple of (str, (c,) bool)
        Components of the same unit.
    """

    complete: np.ndarray
    modal: np.ndarray
    factor: np.ndarray
    label: tuple[str, ...]
    groups: tuple[tuple[str, np.ndarray], ...]

    @classmethod
    def of(cls, quantity: Quantity, loads: JudgedLoads) -> Contributions:
        """Evaluate a quantity under the loads; accelerations under those alone that move interfaces."""
        groups = tuple((u, np.array(quantity.units) == u) for u in dict.fromkeys(quantity.units))
        still = np.zeros_like(loads.modes)
        none = np.zeros((12, loads.modes.shape[1]))
        if quantity.kind != ACCELERATION:
            modal = quantity.values(Fields(loads.modes, still, none))
            complete = quantity.values(loads.fields)
            return cls(complete, modal, loads.force / loads.w2[:, None], loads.label, groups)
        _, a, drives = (x[:, loads.moves] for x in loads.fields)
        complete = quantity.values(Fields(np.zeros_like(a), a, drives))
        label = tuple(name for name, moves in zip(loads.label, loads.moves, strict=True) if moves)
        modal = quantity.values(Fields(still, loads.modes, none))
        return cls(complete, modal, -loads.force[:, loads.moves], label, groups)

    def scales(self) -> np.ndarray:
        """Return the largest value ``(groups, m)`` of each unit under each load; infinite where it is negligible."""
        size = np.array([np.abs(self.complete[:, own]).max(axis=(0, 1), initial=0.0) for _, own in self.groups])
        return np.where(size > NEGLIGIBLE * size.max(axis=1, initial=0.0, keepdims=True), size, np.inf)
