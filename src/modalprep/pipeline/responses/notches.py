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
from modalprep.pipeline.schema.time import Curve, spectrum_of
from modalprep.response.inputs import Spectrum
from modalprep.response.limits import NotchedInput, force_limit, notch, quasi_static_limit
from modalprep.response.result import Response
from modalprep.suggest import matching, suggestion

BESIDE = 1e-9  # relative distance of the extra points on both sides of each corner of a table
TOO_MUCH = 0.01  # relative excess over a limit, between the points of the notched table, above which there is a note


def with_limited(channels: list[str], limits: list[NotchTable]) -> list[str]:
    """Return the channels to compute: those named and those that have limits; empty, which means all, if none is."""
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
    """Return the inputs of a table, lowered together until the response is within its limits.

    Raises
    ------
    InputError
        When a limit names no channel, or one that it cannot limit.
    """
    density = response.kind == "random"
    limits = limit_curves(table, response, body, folder, response.input_values)
    given = np.abs(response.input_values)
    given = given.sum(axis=1) if density else np.linalg.norm(given, axis=1)
    magnitudes = {name: np.abs(response[name.partition(" ")[0]]) for name in limits}
    divisor = np.where(given > 0, given, 1.0)
    transfers = {name: np.sqrt(x / divisor) if density else x / divisor for name, x in magnitudes.items()}
    return notch(response.axis, given, transfers, limits, density=density, max_depth=_depths(table, response))


def limit_curves(
    table: Limited, response: Response, body: FlexibleBody, folder: Path, inputs: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the limits (nf,) over the axis of a response, by channel and kind of limit.

    `inputs` (nf, m) are those before any notch.
    """
    limits: dict[str, np.ndarray] = {}
    for row in table.notch:
        for name in _limited_channels(row, response):
            values = _limit(row, name, response, body, folder, inputs)
            key = f"{name} ({_kind(row)})"
            limits[key] = np.minimum(limits.get(key, np.inf), values)
    return limits


def _depths(table: Limited, response: Response) -> dict[str, float]:
    """Return the largest permitted depth (dB) of the notches, by channel and kind of limit."""
    depths: dict[str, float] = {}
    for row in table.notch:
        for name in _limited_channels(row, response):
            key = f"{name} ({_kind(row)})"
            depths[key] = max(depths.get(key, 0.0), row.max_depth)
    return depths


def _kind(row: NotchTable) -> str:
    if row.limit is not None:
        return "limit"
    return "quasi-static" if row.design_acceleration is not None else "semi-empirical"


def _limited_channels(row: NotchTable, response: Response) -> list[str]:
    names = matching(response.names, row.channel)
    if not names:
        known = response.names[:60]
        raise InputError(f"notch: there is no curve {row.channel!r}; {suggestion(row.channel, known, 'there are')}")
    return names


def _limit(
    row: NotchTable, name: str, response: Response, body: FlexibleBody, folder: Path, inputs: np.ndarray
) -> np.ndarray:
    if row.limit is not None:
        return _given_limit(row.limit, name, response, folder)
    density = response.kind == "random"
    mass = row.mass or body.m
    if row.design_acceleration is not None:
        acceleration = level(row.design_acceleration, "m/s^2", None)
        force = np.abs(response[name])
        return quasi_static_limit(
            response.axis, force, mass=mass, acceleration=acceleration, density=density, weight=response.weight
        )
    assert row.factor is not None  # by the check of the table
    assert row.break_frequency is not None
    driven = name.replace("force.", "")  # base.force.x follows base.x
    acceleration = np.abs(inputs[:, response.inputs.index(driven)])
    limit = force_limit(
        response.axis,
        acceleration,
        mass=mass,
        factor=row.factor,
        break_frequency=row.break_frequency,
        rolloff=row.rolloff,
        density=density,
    )
    return np.where(acceleration > 0, limit, np.inf)


def _given_limit(limit: Curve, name: str, response: Response, folder: Path) -> np.ndarray:
    """Return a limit (nf,) that is given as a number or a curve; infinite outside the band of the curve."""
    f = response.axis
    unit = response.units[response.names.index(name)]
    try:
        spectrum = spectrum_of(limit, squared(unit) if response.kind == "random" else unit, folder)
    except ValueError as error:
        raise InputError(f"notch of {name}: {error}") from None
    outside = (f < spectrum.band[0]) | (f > spectrum.band[1])
    return np.where(outside, np.inf, spectrum.values_at(f))


def squared(unit: str) -> str:
    """Return the unit of a spectral density.

    Examples
    --------
    >>> squared("m/s^2"), squared("N m")
    ('m^2/s^4/Hz', 'N^2 m^2/Hz')
    """
    return re.sub(r"([A-Za-z]+)(?:\^(\d))?", lambda x: f"{x[1]}^{2 * int(x[2] or 1)}", unit) + "/Hz"


def lowered(inputs: Mapping[str, Spectrum], notched: NotchedInput) -> dict[str, Spectrum]:
    """Return the inputs times the factor of the notches, as tables; those of densities have fewer points."""
    given = notched.given
    factor = np.divide(notched.notched, given, out=np.ones_like(given), where=given > 0)
    f = _points(inputs, notched.frequency, factor) if notched.density else notched.frequency
    scale = np.interp(f, notched.frequency, factor)
    return {
        name: Spectrum(
            frequency=f,
            value=x.with_(phase=None).values_at(f) * scale,
            phase=None if x.phase is None else np.angle(x.values_at(f)),
        )
        for name, x in inputs.items()
    }


def _points(inputs: Mapping[str, Spectrum], f: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """Return the ends of the band, the points in notches with their neighbours, and the corners of all tables."""
    low = factor < 1
    near = low | np.roll(low, 1) | np.roll(low, -1)
    near[[0, -1]] = True
    corners = np.concatenate([x.frequency for x in inputs.values() if x.frequency is not None] or [np.zeros(0)])
    corners = np.concatenate([corners * (1 - BESIDE), corners, corners * (1 + BESIDE)])
    return np.unique(np.concatenate([f[near], corners[(corners > f[0]) & (corners < f[-1])]]))


def too_shallow(notched: NotchedInput) -> list[str]:
    """Return a warning for each limit that is exceeded because its notch would be deeper than `max_depth`."""
    return [
        f"{key} is exceeded by {over:.1f} dB at {f:.4g} Hz, as its notch may not be deeper than max_depth: agree a "
        "deeper one, or another limit"
        for key, (over, f) in notched.exceeded.items()
    ]


def excess(
    table: Limited,
    response: Response,
    body: FlexibleBody,
    folder: Path,
    inputs: Mapping[str, Spectrum],
    notched: NotchedInput,
) -> list[str]:
    """Return a note where a response to notched inputs exceeds its limit; `inputs` are those before the notches."""
    given = np.stack([x.values_at(response.axis) for x in inputs.values()], axis=1)
    notes = []
    for key, values in limit_curves(table, response, body, folder, given).items():
        power = 2 if response.kind == "random" else 1
        largest = np.max(np.abs(response[key.partition(" ")[0]]) / values) ** (1 / power) - 1
        if largest > TOO_MUCH and "quasi-static" not in key and key not in notched.exceeded:
            notes.append(f"{key} is exceeded by {100 * largest:.1f} % between the points of the notched input")
    return notes
