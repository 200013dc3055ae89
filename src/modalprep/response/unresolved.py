"""What the inertia of truncation vectors would change in a history: an estimate of what dropped modes do to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.response.channels import body_blocks, channel_name
from modalprep.response.integrate import Integrator
from modalprep.response.modal import Damping, ModalEquations, modal_equations
from modalprep.response.result import Peak, is_chosen

TELLING = 0.02  # of the largest value of the channels of one block and unit


def unresolved(
    body: FlexibleBody, equations: ModalEquations, damping: Damping, step: float, u: np.ndarray,
    peaks: Sequence[Peak], chosen: tuple[str, ...],
) -> list[str]:  # fmt: skip
    """Return a warning where a history changes if truncation vectors, which act statically in it, move.

    They have the static response of the dropped modes, and some of their inertia. Where this does not matter, the
    inputs are slow for the dropped modes.

    Parameters
    ----------
    step : float
        s.
    u : (nt, k)
        Samples of the inputs.
    peaks, chosen
        Of the response, and the channels that were asked for.

    References
    ----------
    Theory 11.5.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2)
    >>> unresolved(beam, modal_equations(beam, ["base.y"]), None, 0.01, np.zeros((2, 1)), (), ())
    []
    """
    still = equations.M == 0
    if not still.any():
        return []
    moved = modal_equations(body, equations.inputs, damping).with_(M=still.astype(float)).moving
    q, _, qdd = Integrator(moved).run(step, u)
    q = q - u @ moved.B.T / moved.K
    size: dict[tuple[str, str], float] = {}
    for peak in peaks:
        size[peak.block, peak.unit] = max(size.get((peak.block, peak.unit), 0.0), peak.largest)
    worst: dict[str, float] = {}
    for block in (block for block in body_blocks(body, moved) if not block.is_large):
        for part in block._replace(u=0 * block.u, mises=None).parts(2 * len(u)):
            change = np.abs(part.values(q[..., None], qdd[..., None], u[..., None])).max(axis=(0, 3)).ravel()
            for value, (place, component, unit) in zip(change, part.labels(), strict=True):
                if is_chosen(name := channel_name(block.name, place, component), chosen) and size[block.name, unit]:
                    worst[name] = value / size[block.name, unit]
    name, most = max(worst.items(), key=lambda item: item[1], default=("", 0.0))
    return [SAYS.format(len(q[0]), name, 100 * most)] if most > TELLING else []


SAYS = (
    "the inputs reach modes that the body drops: were its {0} truncation vectors, which act statically, to vibrate, "
    "{1} would change by up to {2:.0f} % of the largest value there; keep more modes, or smooth the input"
)
