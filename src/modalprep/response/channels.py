"""Output channels of a body: linear in modal coordinates, modal accelerations and inputs (theory 11.1)."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.recovery import DRIVES, STRESS, Recovery
from modalprep.body.stress import VON_MISES, von_mises
from modalprep.errors import InputError
from modalprep.response.modal import BASE, ModalEquations
from modalprep.vectors import UNIT, skew

AXES = ("x", "y", "z")
MOST = 1000  # channels of a recovery with a curve each; larger ones have their extremes only
AT_ONCE = 4_000_000  # numbers in memory
LEVI_CIVITA = np.stack([-skew(e) for e in UNIT])  # [i, a, b] of (x cross y)_i = e_iab x_a y_b


class Block(NamedTuple):
    """Channels of p places with c components: ``q Q^T + q'' R^T + u U^T``.

    Attributes
    ----------
    name : str
    places, components, units : tuple of str
        Units of the components, or of each place's components.
    q, qdd : (p, c, n)
    u : (p, c, k)
    mises : (c, c) or None
        A of ``von Mises^2 = s^T A s``, for stress.
    allowable : float or None
    """

    name: str
    places: tuple[str, ...]
    components: tuple[str, ...]
    units: tuple[str, ...]
    q: np.ndarray
    qdd: np.ndarray
    u: np.ndarray
    mises: np.ndarray | None = None
    allowable: float | None = None

    def values(self, q: np.ndarray, qdd: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Return the values (nt, p, c, r) at coordinates and accelerations (nt, n, r) and inputs (nt, k, r)."""
        return sum(
            (np.moveaxis(np.tensordot(x, matrix, (1, 2)), 1, 3) for x, matrix in ((qdd, self.qdd), (u, self.u))),
            np.moveaxis(np.tensordot(q, self.q, (1, 2)), 1, 3),
        )

    def parts(self, count: int) -> Iterator[Block]:
        """Yield the block in parts of which `count` values each fit into memory."""
        step = max(1, AT_ONCE // max(1, count * len(self.components)))
        per = len(self.units) // len(self.places) if len(self.units) > len(self.components) else 0
        for start in range(0, len(self.places), step):
            part = slice(start, start + step)
            units = self.units[start * per : (start + step) * per] if per else self.units
            q, qdd, u = (x[part] for x in (self.q, self.qdd, self.u))
            yield Block(self.name, self.places[part], self.components, units, q, qdd, u, self.mises, self.allowable)

    @property
    def full_components(self) -> tuple[str, ...]:
        """The components, of stress with von Mises stress."""
        return self.components if self.mises is None else (*self.components, VON_MISES)

    @property
    def is_large(self) -> bool:
        """Whether it has too many channels for a curve each."""
        return len(self.places) * len(self.components) > MOST

    def labels(self) -> list[tuple[str, str, str]]:
        """Return place, component and unit of each channel, place by place; of stress with von Mises stress."""
        c = len(self.components)
        own = len(self.units) > c
        return [
            (place, name, self.units[i * c + j] if own else self.units[min(j, c - 1)])
            for i, place in enumerate(self.places)
            for j, name in enumerate(self.full_components)
        ]


def channel_name(block: str, place: str, component: str) -> str:
    """Return the name of a channel.

    Examples
    --------
    >>> channel_name("tip", "acceleration", "x"), channel_name("MEF1", "7.axial", "")
    ('tip.acceleration.x', 'MEF1.7.axial')
    """
    return f"{block}.{place}.{component}".rstrip(".")


def body_blocks(body: FlexibleBody, equations: ModalEquations) -> list[Block]:
    """Return the channels of the base, of the interfaces and of the recoveries.

    Raises
    ------
    InputError
        When two channels have one name.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.response.modal import modal_equations
    >>> beam = uniform_beam(modes=2)
    >>> [block.name for block in body_blocks(beam, modal_equations(beam, ["base.y"]))]
    ['base', 'root', 'tip']
    """
    blocks = [_base(body), *_interfaces(body), *(_recovered(*x, body) for x in body.recovery.items())]
    seen: set[str] = set()
    for block in blocks:
        names = {channel_name(block.name, place, name) for place, name, _ in block.labels()}
        if twice := names & seen:
            raise InputError(f"two channels of the response are called {min(twice)!r}; rename the recovery")
        seen |= names
    Y, E = equations.basis, equations.drives
    moved = Y * equations.M
    return [block._replace(q=block.q @ Y, qdd=block.qdd @ moved, u=block.u @ E) for block in blocks]


def _base(body: FlexibleBody) -> Block:
    """Force and moment on the root: the momentum's rate less the forces on the other interfaces."""
    e = LEVI_CIVITA
    n = body.n
    k = len(body.interface_name)
    u = np.zeros((2, 3, DRIVES + 6 * k))
    u[0, :, :3] = body.m * UNIT
    u[0, :, 3:DRIVES] = np.einsum("ia,b->iab", UNIT, body.s0).reshape(3, 9)
    u[1, :, :3] = skew(body.s0)
    u[1, :, 3:DRIVES] = np.einsum("iab,ac->ibc", e, body.E0).reshape(3, 9)
    for number, arm in enumerate(body.interface_position):
        at = DRIVES + 6 * number
        u[0, :, at : at + 3] = -UNIT
        u[1, :, at : at + 3] = -skew(arm)
        u[1, :, at + 3 : at + 6] = -UNIT
    qdd = np.stack([body.S, np.einsum("iab,ban->in", e, body.H)])
    return Block(BASE, ("force", "moment"), AXES, ("N",) * 3 + ("N m",) * 3, np.zeros((2, 3, n)), qdd, u)


def _interfaces(body: FlexibleBody) -> Iterator[Block]:
    n = body.n
    width = DRIVES + 6 * len(body.interface_name)
    for k, (name, arm) in enumerate(zip(body.interface_name, body.interface_position, strict=True)):
        shapes = np.stack([body.phi[k], body.psi[k]])
        none = np.zeros((2, 3, n))
        u = np.zeros((4, 3, width))
        u[0, :, :3] = UNIT
        u[0, :, 3:DRIVES] = np.einsum("ia,b->iab", UNIT, arm).reshape(3, 9)
        u[1, :, 3:DRIVES] = np.einsum("iab->iba", LEVI_CIVITA).reshape(3, 9) / 2
        places = ("acceleration", "angular_acceleration", "displacement", "rotation")[: 2 if k == 0 else 4]
        units = [unit for unit in ("m/s^2", "rad/s^2", "m", "rad")[: len(places)] for _ in AXES]
        q, qdd = np.concatenate([none, shapes]), np.concatenate([shapes, none])
        yield Block(name, places, AXES, tuple(units), q[: len(places)], qdd[: len(places)], u[: len(places)])


def _recovered(name: str, x: Recovery, body: FlexibleBody) -> Block:
    p, c, n = x.q.shape
    width = DRIVES + 6 * len(body.interface_name)
    qdd = np.zeros((p, c, n)) if x.qdd is None else x.qdd
    u = np.zeros((p, c, width)) if x.loads is None else x.loads
    mises = mises_form(x.components) if x.kind == STRESS else None
    return Block(name, x.places, x.components, x.units, x.q, qdd, u, mises, x.allowable)


def mises_form(components: tuple[str, ...]) -> np.ndarray:
    """Return A (c, c) of ``von Mises^2 = s^T A s`` by polarisation.

    Examples
    --------
    >>> mises_form(("xx", "yy", "xy"))
    array([[ 1. , -0.5,  0. ],
           [-0.5,  1. ,  0. ],
           [ 0. ,  0. ,  3. ]])
    """

    def square(s: np.ndarray) -> np.ndarray:
        return von_mises(dict(zip(components, np.moveaxis(s, -1, 0), strict=True))) ** 2

    e = np.eye(len(components))
    one = square(e)
    return np.round((square(e[:, None] + e) - one[:, None] - one) / 2, 12) + 0.0
