"""Whether the modes of a body carry its mass, so that its inertia loads reach the root."""

from __future__ import annotations

import numpy as np

from modalprep.body.flexible_body import FlexibleBody

CARRIED = 0.9  # of the mass that can move: the usual least sum of effective masses


def missing_mass(body: FlexibleBody) -> tuple[str, ...]:
    """Return a note where the modes have too little of the mass that can move along an axis.

    What sits on the held root cannot move; without its mass in the mode table nothing is said.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2)
    >>> missing_mass(beam.with_(modes=beam.modes.with_(held_mass=np.zeros(6))))[0][:57]
    'the modes have 0 % of the mass that can move in x, 61 % i'
    """
    held = body.modes.held_mass
    if held is None or not (body.at_root and body.normalised and body.n):
        return ()
    moving = np.maximum(body.m - held[:3], 0.0)
    share = np.divide((body.S**2).sum(axis=1), moving, out=np.ones(3), where=moving > 0)
    short = [f"{100 * part:.0f} % {{}}in {axis}" for axis, part in zip("xyz", share, strict=True) if part < CARRIED]
    if not short:
        return ()
    listed = ", ".join(text.format("of the mass that can move " if k == 0 else "") for k, text in enumerate(short))
    return (
        f"the modes have {listed}: the rest moves as if it were rigid; keep more modes, or 'inertia' among the "
        "truncation_vectors",
    )
