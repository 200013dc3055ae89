"""Squeeze-film damper whose film is short against its diameter, in closed form."""

from __future__ import annotations

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.rotors.bearings import BearingCoefficients, refuse_not_positive
from modalprep.vectors import VectorLike
from modalprep.verdicts.notes import warn

SHORT = 0.5  # length over diameter, above which the flow round the film is no longer small


def squeeze_film_damper(
    speed: VectorLike,
    *,
    length: float,
    diameter: float,
    clearance: float,
    viscosity: float,
    eccentricity: float = 0.0,
    cavitated: bool = True,
) -> BearingCoefficients:
    """Return the coefficients of a squeeze-film damper on a circular orbit about its centre, run through at the speed.

    Its journal does not turn, its film is open at both ends and short, its flow laminar and without inertia. On the
    orbit the force is exact: ``-C velocity`` against the motion and, of a film that is void over half of its
    circumference, ``-K shift`` to the centre, which grows with the speed. Without eccentricity they are those of small
    motions about the centre. K is for the frequency of the speed alone: modes of other frequencies have another one.

    Parameters
    ----------
    speed : (ns,)
        rad/s, of the orbit, above zero: under unbalance that of the rotor.
    length, diameter, clearance : float
        m; the length is that of a land, the clearance that of the radius.
    viscosity : float
        Pa s.
    eccentricity : float
        Radius of the orbit over the clearance, from 0 to below 1.
    cavitated : bool
        Whether half of the film is void (pi film); without, the film is whole (2 pi film), as for small motions or
        under a high pressure of supply: twice the damping, no stiffness.

    Returns
    -------
    BearingCoefficients

    Raises
    ------
    InputError
        When a value is not positive, or the eccentricity out of range.

    Warns
    -----
    ModalprepWarning
        When the land is longer than half its diameter.

    References
    ----------
    J. M. Vance, F. Zeidan, B. Murphy, Machinery Vibration and Rotordynamics, Wiley 2010, chapter 6. Theory 5.10.

    Examples
    --------
    >>> film = squeeze_film_damper(
    ...     [500.0], length=0.02, diameter=0.1, clearance=1e-4, viscosity=0.01, eccentricity=0.5
    ... )
    >>> K, C = film.at(500.0)
    >>> bool(np.isclose(C[0, 0], 0.5 * np.pi * 0.01 * 0.05 * (0.02 / 1e-4) ** 3 / 0.75**1.5))
    True
    >>> bool(np.isclose(K[0, 0], 500 * 0.01 * 0.05 * (0.02 / 1e-4) ** 3 / 0.75**2))
    True
    """
    speeds = np.atleast_1d(np.asarray(speed, dtype=float))
    sizes = {"length": length, "diameter": diameter, "clearance": clearance, "viscosity": viscosity}
    refuse_not_positive("a squeeze-film damper", {"speed": float(speeds.min()), **sizes})
    if not 0 <= eccentricity < 1:
        raise InputError(f"a squeeze-film damper needs an eccentricity from 0 to below 1, not {eccentricity:g}")
    if length > SHORT * diameter:
        ratio = f"{length / diameter:.2g} of its diameter"
        warn([f"a squeeze-film damper of a length of {ratio} is inaccurate: short films end at {SHORT:g} of it"])
    gap = 1 - eccentricity**2
    unit = viscosity * diameter / 2 * (length / clearance) ** 3
    damping = unit * np.pi * gap**-1.5 * (0.5 if cavitated else 1.0)
    stiffness = unit * 2 * eccentricity * gap**-2 * speeds if cavitated else 0 * speeds
    return BearingCoefficients(
        speed=speeds,
        stiffness=stiffness[:, None, None] * np.eye(2),
        damping=np.full(len(speeds), damping)[:, None, None] * np.eye(2),
    )
