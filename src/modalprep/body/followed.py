"""The modes of a body that was reduced again, as those of the body before: the same order and signs."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.record import refuse_stations
from modalprep.errors import InputError

ALIKE = 0.9  # modal assurance criterion of a mode and the one of the body before


def followed(body: FlexibleBody, before: FlexibleBody) -> FlexibleBody:
    """Return a body whose modes have the signs of those of the body before, of nearly the same model.

    Raises
    ------
    InputError
        When the modes are not the same: others, exchanged or mixed ones.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> turned = with_signs(body, np.array([1.0, -1.0]))
    >>> bool(np.all(followed(turned, body).shape == body.shape))
    True
    """
    refuse_stations(f"a body whose modes are followed ({body.name!r})", body.stations)
    one, other = _motion(before), _motion(body)
    if one.shape != other.shape:
        raise InputError(
            f"body {body.name!r} has {body.n} modes and {len(body.shape)} points, and {before.n} and "
            f"{len(before.shape)} before; reduce it to the same modes of the same mesh"
        )
    products = one.T @ other
    alike = products**2 / np.outer(np.sum(one**2, axis=0), np.sum(other**2, axis=0))
    lost = np.flatnonzero(np.diag(alike) < ALIKE)
    if len(lost):
        raise InputError(
            f"mode {lost[0] + 1} of body {body.name!r} is not the one of before: modes near each other exchange their "
            "places or mix; leave out one of them, or take another value of the parameter"
        )
    return with_signs(body, np.sign(np.diag(products)))


def _motion(body: FlexibleBody) -> np.ndarray:
    """Return what points move and interfaces turn by, of each mode."""
    turns = body.psi * np.ptp(body.points, axis=0).max(initial=0.0)
    return np.concatenate([body.shape.reshape(-1, body.n), turns.reshape(-1, body.n)])


def with_signs(body: FlexibleBody, signs: np.ndarray) -> FlexibleBody:
    """Return a body with some modal coordinates reversed: those of sign -1 among ``signs (n,)``.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = uniform_beam(modes=2)
    >>> bool(np.all(with_signs(body, np.array([-1.0, 1.0])).S == body.S * [-1.0, 1.0]))
    True
    """
    both = np.outer(signs, signs)
    linear = {key: getattr(body, key) * signs for key in ("S", "H", "phi", "psi", "shape")}
    squares = {key: getattr(body, key) * both for key in ("P", "Kg_A", "Kg_W", "Kg_F", "Kg_T", "modal_mass")}
    return body.with_(
        **linear,
        **squares,
        T=None if body.T is None else body.T * both * signs[:, None, None],
        coupled_damping=None if body.coupled_damping is None else body.coupled_damping * both,
        stress={name: at.in_basis(np.diag(signs)) for name, at in body.stress.items()},
        recovery={name: at.in_basis(np.diag(signs)) for name, at in body.recovery.items()},
    )
