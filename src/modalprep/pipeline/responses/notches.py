"""Notches of a response: from the limits in its table to the inputs that respect them."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.pipeline.schema.quantities import level
from modalprep.pipeline.schema.responses.response import Limited
from modalprep.pipeline.schema.responses.strength import NotchTable
from modalprep.pipeline.schema.time import spectrum_of
from modalprep.response.inputs import Spectrum
from modalprep.response.limits import NotchedInput, force_limit, notch, quasi_static_limit
from modalprep.response.result import Response
from modalprep.suggest import matching, suggestion

BESIDE = 1e-9  # relative distance of the points that keep the corners of a table beside a notch
TOO_MUCH = 0.01  # excess over a limit, between the points of the notched table, that a note says


def with_limited(channels: list[str], limits: list[NotchTable]) -> list[str]:
    """Return the channels with curves, those included that limits need; all when none is named."""
    return [*channels, *(before_pattern(each.channel) for each in limits)] if channels else []


def before_pattern(channel: str) -> str:
    """Return the beginning of a channel's name before its first ``*``.

    Examples
    --------
    >>> before_pattern("struts.*.N"), before_pattern("tip")
    ('struts', 'tip')
    """
    return channel.partition("*")[0].rstrip(".")


def notched_input(table: Limited, response: Response, body: FlexibleBody, folder: Path) -> NotchedInput:
    """Return what the limits of a table leave of its inputs; several are lowered together.

    Raises
    ------
    InputError
        When a limit names no channel, or one that it cannot limit.
    """
    density = response.kind == "random"
    limits = limit_curves(table, response, body, folder, response.input_values)
    given = np.abs(response.input_values)
    given = given.sum(axis=1) if density else np.linalg.norm(given, axis=1)
    curves = {name: _sizes(response, name.partition(" ")[0]) for name in limits}
    safe = np.where(given > 0, given, 1.0)
    transfers = {name: np.sqrt(x / safe) if density else x / safe for name, x in curves.items()}
    return notch(response.axis, given, transfers, limits, density=density, max_depth=_depths(table, response))


def limit_curves(
    table: Limited, response: Response, body: FlexibleBody, folder: Path, inputs: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the limits (nf,) over the axis of a response, by channel and kind of limit; `inputs` are those given."""
    found: dict[str, np.ndarray] = {}
    for row in table.notch:
        for name in _limited(row, response):
            values = _limit(row, name, response, body, folder, inputs)
            key = f"{name} ({_word(row)})"
            found[key] = np.minimum(found[key], values) if key in found else values
    return found


def _depths(table: Limited, response: Response) -> dict[str, float]:
    """Return the largest depths (dB) of the notches of each limit, by its channel and kind; of several the largest."""
    found: dict[str, float] = {}
    for row in table.notch:
        for name in _limited(row, response):
            key = f"{name} ({_word(row)})"
            found[key] = max(found.get(key, 0.0), row.max_depth)
    return found


def _word(row: NotchTable) -> str:
    if row.limit is not None:
        return "limit"
    return "quasi-static" if row.design_acceleration is not None else "semi-empirical"


def _limited(row: NotchTable, response: Response) -> list[str]:
    names = matching(response.names, row.channel)
    if not names:
        known = response.names[:60]
        raise InputError(f"notch: there is no curve {row.channel!r}; {suggestion(row.channel, known, 'there are')}")
    return names


def _limit(
    row: NotchTable, name: str, response: Response, body: FlexibleBody, folder: Path, inputs: np.ndarray
) -> np.ndarray:
    density = response.kind == "random"
    f = response.axis
    mass = row.mass or body.m
    if row.limit is not None:
        unit = response.units[response.names.index(name)]
        try:
            found = spectrum_of(row.limit, squared(unit) if density else unit, folder)
        except ValueError as error:
            raise InputError(f"notch of {name}: {error}") from None
        outside = (f < found.band[0]) | (f > found.band[1])
        return np.where(outside, np.inf, found.at(f))
    if row.design_acceleration is not None:
        acceleration = level(row.design_acceleration, "m/s^2", None)
        force = _sizes(response, name)
        return quasi_static_limit(
            f, force, mass=mass, acceleration=acceleration, density=density, weight=response.weight
        )
    driven = name.replace("force.", "")  # base.force.x follows base.x
    acceleration = np.abs(inputs[:, response.inputs.index(driven)])
    found = force_limit(
        f,
        acceleration,
        mass=mass,
        factor=row.factor,
        break_frequency=row.break_frequency,
        rolloff=row.rolloff,
        density=density,
    )
    return np.where(acceleration > 0, found, np.inf)


def squared(unit: str) -> str:
    """Return the unit of a spectral density.

    Examples
    --------
    >>> squared("m/s^2"), squared("N m")
    ('m^2/s^4/Hz', 'N^2 m^2/Hz')
    """
    return re.sub(r"([A-Za-z]+)(?:\^(\d))?", lambda x: f"{x[1]}^{2 * int(x[2] or 1)}", unit) + "/Hz"


def _sizes(response: Response, name: str) -> np.ndarray:
    return np.abs(response[name])


def lowered(inputs: Mapping[str, Spectrum], cut: NotchedInput) -> dict[str, Spectrum]:
    """Return the inputs times what the notches leave, as tables; those of densities have fewer points."""
    share = np.divide(cut.notched, cut.given, out=np.ones_like(cut.given), where=cut.given > 0)
    f = _points(inputs, cut, share) if cut.density else cut.frequency
    scale = np.interp(f, cut.frequency, share)
    return {
        name: Spectrum(
            frequency=f, value=x.with_(phase=None).at(f) * scale, phase=None if x.phase is None else np.angle(x.at(f))
        )
        for name, x in inputs.items()
    }


def _points(inputs: Mapping[str, Spectrum], cut: NotchedInput, share: np.ndarray) -> np.ndarray:
    """Return the ends of the band, the points in notches with those beside them, and the corners of all tables."""
    f = cut.frequency
    low = share < 1
    near = low | np.roll(low, 1) | np.roll(low, -1)
    near[[0, -1]] = True
    corners = np.concatenate([x.frequency for x in inputs.values() if x.frequency is not None] or [np.zeros(0)])
    corners = np.concatenate([corners * (1 - BESIDE), corners, corners * (1 + BESIDE)])
    return np.unique(np.concatenate([f[near], corners[(corners > f[0]) & (corners < f[-1])]]))


def too_shallow(cut: NotchedInput) -> list[str]:
    """Return a warning of each limit that is exceeded because its notch would be deeper than `max_depth`."""
    return [
        f"{key} is exceeded by {over:.1f} dB at {at:.4g} Hz, as its notch may not be deeper than max_depth: agree a "
        "deeper one, or another limit"
        for key, (over, at) in cut.exceeded.items()
    ]


def excess(
    table: Limited,
    response: Response,
    body: FlexibleBody,
    folder: Path,
    inputs: Mapping[str, Spectrum],
    cut: NotchedInput,
) -> list[str]:
    """Return a note where a response to notched inputs exceeds its limit; `inputs` are those before."""
    given = np.stack([x.at(response.axis) for x in inputs.values()], axis=1)
    notes = []
    for key, values in limit_curves(table, response, body, folder, given).items():
        power = 2 if response.kind == "random" else 1
        most = np.max(_sizes(response, key.partition(" ")[0]) / values) ** (1 / power) - 1
        if most > TOO_MUCH and "quasi-static" not in key and key not in cut.exceeded:
            notes.append(f"{key} is exceeded by {100 * most:.1f} % between the points of the notched input")
    return notes
