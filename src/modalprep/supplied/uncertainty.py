"""The error that the rebuilt terms of a supplied body make when it turns (theory 10.3)."""

from __future__ import annotations

import numpy as np

from modalprep.body.checks import Check
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import cross_moment
from modalprep.errors import InputError
from modalprep.supplied.integrals import Affine, Rigid
from modalprep.supplied.reduced import EXACT, MISSING, REBUILT

TOLERATED = 0.1  # change of a stiffness that is adequate for design
SOUTHWELL = 1.2  # geometric stiffness of an arm's first bending, in w^2: 1.19 of a uniform one, 6/5 with a tip mass


def knowledge(body: FlexibleBody) -> tuple[str, ...]:
    """Return what is known exactly of a supplied body, what is rebuilt and what is missing; none of other bodies.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> knowledge(uniform_beam(modes=2).with_(provenance={REBUILT: "P"}))
    ('rebuilt: P',)
    """
    return tuple(f"{key}: {body.provenance[key]}" for key in (EXACT, REBUILT, MISSING) if key in body.provenance)


def check_spin(body: FlexibleBody, speed: float) -> list[Check]:
    """Return the estimate of `spin_error` as a check for information, empty for a body of which nothing is rebuilt.

    Raises
    ------
    InputError
        When the speed is negative or not finite.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> supplied = uniform_beam(modes=2).with_(provenance={REBUILT: "P"})
    >>> check_spin(supplied, 0.1)[0].meaning
    'largest change of a stiffness at 0.1 rad/s by what is not known; 10 % at 1.02 rad/s'
    """
    if not 0 <= speed < np.inf:
        raise InputError(f"the speed {speed:g} must be a finite number of rad/s, not negative")
    if REBUILT not in body.provenance:
        return []
    error, unit = spin_error(body, speed), spin_error(body, 1.0)
    at = np.sqrt(TOLERATED / unit) if unit > 0 else np.inf
    meaning = f"largest change of a stiffness at {speed:g} rad/s by what is not known; 10 % at {at:.3g} rad/s"
    return [Check("rebuilt terms", error, TOLERATED, meaning, required=False)]


def spin_error(body: FlexibleBody, speed: float) -> float:
    """Estimate the largest relative change of any stiffness by what is not known of a body that turns at a speed.

    Of a mode with the frequency ``w_i`` is unknown, per ``speed^2``: how much of its mass moves across the axis,
    within the bounds that its known rigid part leaves, for the worst of the axes x, y and z; and the stress stiffness,
    that of a slender arm, ``1.2 w_i / w_1`` (Southwell). Their sum over ``w_i^2`` is largest in the lowest mode as a
    rule.

    Parameters
    ----------
    body : FlexibleBody
        Its frame at the root, about which it turns.
    speed : float
        rad/s.

    Returns
    -------
    float
        0 for a body without elastic modes.

    References
    ----------
    R. V. Southwell, B. S. Gough, The free transverse vibration of airscrew blades, ARC R&M 766 (1921); theory 10.3.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> beam = uniform_beam(modes=2)
    >>> round(spin_error(beam, 0.1 * 2 * np.pi * beam.frequency[0]), 3)
    0.014
    """
    elastic = body.K > 0
    if not np.any(elastic):
        return 0.0
    w = np.sqrt(body.K[elastic])
    unknown = _mass_across(body)[elastic] + SOUTHWELL * w / w.min()
    return float(np.max(speed**2 * unknown / w**2))


def _mass_across(body: FlexibleBody) -> np.ndarray:
    """Return how much more or less modal mass (n,) may move across an axis than P has, for the worst axis.

    With the known rigid part w of the displacement and the rest r, of which the modal mass alone is known, the mass
    across an axis lies between ``(|w_a| - |r|)^2`` and ``(|w_a| + |r|)^2``.
    """
    affine = Affine(Rigid(body.m, body.s0, body.E0))
    whole = affine.rigid_coordinates(body.S, affine.turn(body.S, cross_moment(body.H)))
    mass = np.einsum("ari,ari->ai", whole, whole)
    total = np.diag(body.modal_mass)
    rest = np.sqrt(np.maximum(total - mass.sum(axis=0), 0.0))
    across = np.sqrt(mass.sum(axis=0) - mass)  # (3, n)
    taken = total - np.einsum("aaii->ai", body.P)
    most = np.minimum((across + rest) ** 2, total)
    least = np.maximum(across - rest, 0.0) ** 2
    return np.maximum(most - taken, taken - least).max(axis=0)
