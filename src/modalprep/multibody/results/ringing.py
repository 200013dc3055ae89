"""Bodies that ring because a run starts without their deflection."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from modalprep.body.flexible_body import FlexibleBody

SHOWS = 2.0  # times the strain energy of the deflection that is missing: vibrations about it reach four times
MATTERS = 0.25  # of the largest strain energy of the run
LEAST = 1e-9  # of the body's size: deflections that are round-off


def ringing(
    bodies: Mapping[str, FlexibleBody],
    time: np.ndarray,
    modal: Mapping[str, np.ndarray],
    first: Mapping[str, np.ndarray],
) -> tuple[str, ...]:
    """Return a note on the bodies that vibrate about a deflection which loads cause from the start on.

    Parameters
    ----------
    bodies : {name: FlexibleBody}
    time : (nt,)
        s.
    modal : {name: (nt, n)}
        Modal coordinates of the bodies, zero at the start.
    first : {name: (n,)}
        Modal accelerations at the start.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> arm = uniform_beam(modes=1)
    >>> w = 2 * np.pi * arm.frequency[0]
    >>> t = np.linspace(0, 4, 400)
    >>> q = (1 - np.cos(w * t))[:, None]
    >>> ringing({"arm": arm}, t, {"arm": q}, {"arm": np.array([w**2])})[0][:44]
    "body 'arm' starts without the deflection tha"
    """
    found = [name for name, q in modal.items() if _rings(bodies[name], time, q, first[name])]
    if not found:
        return ()
    names = ", ".join(map(repr, found))
    text = f"body {names} starts" if len(found) == 1 else f"bodies {names} start"
    return (
        f"{text} without the deflection that loads cause at once: there are vibrations about it; where they are not "
        "meant, start = 'quasi_static' (what is released), 'equilibrium', 'steady' or 'periodic' begins with it",
    )


def _rings(body: FlexibleBody, time: np.ndarray, q: np.ndarray, first: np.ndarray) -> bool:
    """Whether the strain energy of the first period is that of a vibration about the deflection of the start."""
    soft = body.K > 0
    missing = np.where(soft, first / np.where(soft, body.K, 1.0), 0.0)
    size = np.ptp(body.points, axis=0).max(initial=0.0)
    reach = np.abs(body.shape).max(axis=(0, 1), initial=0.0) @ np.abs(missing)
    if not np.any(soft) or not reach > LEAST * size > 0:
        return False
    energy = np.nan_to_num(q**2) @ body.K
    period = 2 * np.pi / np.sqrt(body.K[soft].min())
    early = energy[time - time[0] <= period].max(initial=0.0)
    return bool(early > SHOWS * (missing**2 @ body.K) and early > MATTERS * energy.max(initial=0.0))
