"""One body at several fill levels: same modes, different mass. All its integrals are linear in the density."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.stations.record import refuse_stations
from modalprep.errors import InputError

BY_DENSITY = ("m", "s0", "E0", "S", "H", "P", "Kg_A", "Kg_W", "modal_mass")
BY_MODES = ("K", "interface_position", "phi", "psi", "Kg_F", "Kg_T")
SAME = 1e-9  # relative to the largest entry


def with_density_factor(body: FlexibleBody, factor: float) -> FlexibleBody:
    """Return the body with all densities times a factor, in the same modes.

    Returns
    -------
    FlexibleBody
        Of the same stiffness.

    Raises
    ------
    InputError
        When the factor is not positive.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> half = with_density_factor(uniform_beam(modes=2), 0.5)
    >>> round(half.m, 9), half.modal_mass.diagonal()
    (6.0, array([0.5, 0.5]))
    """
    if not 0 < factor < float("inf"):
        raise InputError(f"body {body.name!r}: density factor {factor:g} must be positive")
    refuse_stations("another density", body.stations)
    T = None if body.T is None else factor * body.T
    return body.with_(**{name: factor * getattr(body, name) for name in BY_DENSITY}, T=T)


def interpolate(light: FlexibleBody, heavy: FlexibleBody, m: float) -> FlexibleBody:
    """Return the body of mass m (kg) interpolated between two fill levels; exact if one density changes uniformly.

    T is dropped: a depleting body has no second-order modal mass.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> full = uniform_beam(modes=2)
    >>> interpolate(with_density_factor(full, 0.5), full, 9.0).modal_mass.diagonal().round(12)
    array([0.75, 0.75])
    """
    refuse_stations("a fill level", heavy.stations)
    share = (m - light.m) / (heavy.m - light.m)
    at = {name: (1 - share) * getattr(light, name) + share * getattr(heavy, name) for name in BY_DENSITY}
    return heavy.with_(**at, T=None)


def check_level(body: FlexibleBody, level: FlexibleBody) -> None:
    """Refuse a fill level whose modes or interfaces differ from those of the body.

    Raises
    ------
    InputError
        When they differ, or their masses do not.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> check_level(uniform_beam(modes=2), uniform_beam(modes=3))
    Traceback (most recent call last):
    modalprep.errors.InputError: body 'beam' has 2 modes and its other fill level 3; both must have the same modes
    """
    if body.n != level.n:
        raise InputError(
            f"body {body.name!r} has {body.n} modes and its other fill level {level.n}; both must have the same modes"
        )
    if body.interface_name != level.interface_name:
        raise InputError(f"body {body.name!r} and its other fill level must have the same interfaces")
    for name in BY_MODES:
        one, other = getattr(body, name), getattr(level, name)
        if np.abs(one - other).max(initial=0.0) > SAME * np.abs(one).max(initial=0.0):
            raise InputError(
                f"body {body.name!r} and its other fill level differ in {name}; use its modes with different densities"
            )
    if abs(body.m - level.m) <= SAME * body.m:
        raise InputError(f"body {body.name!r} weighs {body.m:g} kg at two fill levels; they must differ in mass")
