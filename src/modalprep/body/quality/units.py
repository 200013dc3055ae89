"""Whether size, mass and first frequency of a body are those of a structure, or of another unit."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.fe.properties.plausible import implausible_body


def implausible_units(body: FlexibleBody, scale: float) -> list[str]:
    """Return notes on size, mass and first frequency that suggest a wrong unit; `scale` is that of the mesh, m.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> implausible_units(uniform_beam(modes=2), 1.0)
    []
    """
    elastic = body.frequency[body.frequency > 0]
    size = float(np.ptp(np.concatenate([body.points, body.interface_position]), axis=0).max())
    return implausible_body(size, body.m, float(elastic[0]) if len(elastic) else None, scale) if size else []
