"""A response in plain sentences."""

from __future__ import annotations

import numpy as np

from modalprep.report.explain.body import distrust
from modalprep.report.numbers import quantity
from modalprep.response.result import Response
from modalprep.verdicts.notes import warnings_of

KINDS = {
    "harmonic": "The harmonic response",
    "sweep": "The response to a swept sine",
    "random": "The random response",
    "transient": "The transient response",
}
SHOWN = 4  # channels


def explain_response(response: Response) -> list[str]:
    """Return what was driven, which peaks are largest and where, the margins, and what not to trust.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.response import harmonic_response
    >>> beam = uniform_beam(modes=2)
    >>> found = harmonic_response(beam, {"base.y": 1.0}, [0.5, 0.6, 1.0], damping=0.02, channels=["base.force"])
    >>> explain_response(found)[0]
    'The harmonic response to base.y has 69 points from 0.5 to 1 Hz and 24 channels.'
    """
    unit = "s" if response.kind == "transient" else "Hz"
    span = f"{len(response.axis)} points from {response.axis[0]:.4g} to {response.axis[-1]:.4g} {unit}"
    start = f"{KINDS[response.kind]} to {', '.join(response.inputs)} has {span} and {len(response.peaks)} channels."
    return [start, *_largest(response), _margins(response), *distrust(warnings_of(response.notes))]


def _largest(response: Response) -> list[str]:
    """Return the largest peak of each unit."""
    most: dict[str, tuple[str, float, str]] = {}
    for peak in response.worst():
        at = next(
            (
                f" at {peak.figures[key]:.4g} {unit}"
                for key, unit in (("at_hz", "Hz"), ("at_s", "s"))
                if key in peak.figures
            ),
            "",
        )
        if peak.unit not in most or peak.largest > most[peak.unit][1]:
            most[peak.unit] = (peak.channel, peak.largest, at)
    listed = [f"{name} reaches {quantity(value, unit)}{at}" for unit, (name, value, at) in list(most.items())[:SHOWN]]
    return [f"Of each unit the largest: {'; '.join(listed)}."] if listed else []


def _margins(response: Response) -> str:
    known = [peak for peak in response.worst() if not np.isnan(peak.margin)]
    if not known:
        return "Nothing has an allowable, so that no margin is known; [recovery] tables take one."
    least = min(known, key=lambda peak: peak.margin)
    how = "is exceeded: strengthen it, or lower the input" if least.margin < 0 else "is kept"
    return f"The least margin is {least.margin:+.2f}, of {least.channel}: its allowable {how}."
