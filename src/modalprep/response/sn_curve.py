"""S-N curves with one or two slopes, an endurance limit and Goodman's mean stress."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError
from modalprep.records import Record


@dataclass(frozen=True, eq=False, kw_only=True)
class SNCurve(Record):
    """Cycles that a material bears at an amplitude: ``N = cycles (stress / amplitude)^slope`` (Basquin).

    Attributes
    ----------
    stress : float
        Amplitude (half of the range) of a known point, Pa or the unit of the history.
    cycles : float
        That it bears at this amplitude.
    slope : float
        ``k = -d log N / d log S``, such as 5.
    second_slope : float or None
        Beyond `knee` cycles, below the amplitude there; None: the same slope.
    knee : float or None
        Cycles where the second slope starts; default: `cycles`.
    limit : float
        Endurance limit: amplitudes up to it do no damage. 0: there is none.
    ultimate : float or None
        Tensile strength, with which Goodman's rule takes account of the mean stress; None: the mean is ignored.

    Raises
    ------
    InputError
        When a number is not positive.

    References
    ----------
    O. H. Basquin, The exponential law of endurance tests, Proceedings of ASTM 10 (1910). Theory 12.2.

    Examples
    --------
    >>> curve = SNCurve(stress=100e6, cycles=1e6, slope=5, second_slope=9)
    >>> curve.life(np.array([200e6, 100e6, 50e6]))
    array([3.12e+04, 1.00e+06, 5.12e+08])
    """

    stress: float
    cycles: float
    slope: float
    second_slope: float | None = None
    knee: float | None = None
    limit: float = 0.0
    ultimate: float | None = None

    def __post_init__(self) -> None:
        """Refuse numbers that are no curve."""
        super().__post_init__()
        optional = {name: getattr(self, name) for name in ("second_slope", "knee", "ultimate")}
        wanted = {"stress": self.stress, "cycles": self.cycles, "slope": self.slope}
        for name, value in (wanted | {k: v for k, v in optional.items() if v is not None}).items():
            if not (np.isfinite(value) and value > 0):
                raise InputError(f"{name} of an S-N curve must be a positive number, not {value}")
        if not self.limit >= 0:
            raise InputError(f"limit of an S-N curve is {self.limit}, but an endurance limit is zero or more")

    @property
    def knee_stress(self) -> float:
        """The amplitude where the second slope starts.

        Returns
        -------
        float
            In the unit of `stress`.
        """
        return self.stress * (self.cycles / (self.knee or self.cycles)) ** (1 / self.slope)

    def life(self, amplitude: np.ndarray | float) -> np.ndarray:
        """Return the cycles to failure, infinite up to the endurance limit.

        Parameters
        ----------
        amplitude : (n,)
            In the unit of `stress`.

        Returns
        -------
        (n,) float
            Cycles.
        """
        S = np.asarray(amplitude, dtype=float)
        knee = self.knee_stress
        k = np.where(knee > S, self.second_slope or self.slope, self.slope)
        with np.errstate(divide="ignore"):
            N = (self.knee or self.cycles) * (knee / S) ** k
        return np.where(self.limit < S, N, np.inf)

    def amplitude(self, ranges: np.ndarray, means: np.ndarray) -> np.ndarray:
        """Return the amplitudes of cycles, by Goodman's rule those that do the same damage around zero.

        A compressive mean counts as none, which is on the safe side.

        Parameters
        ----------
        ranges, means : (n,)

        Returns
        -------
        (n,) float

        Raises
        ------
        InputError
            When a mean stress reaches the tensile strength.

        References
        ----------
        J. Goodman, Mechanics Applied to Engineering, 1899: ``S / (1 - mean / ultimate)``.
        """
        if self.ultimate is None:
            return ranges / 2
        share = np.maximum(means, 0.0) / self.ultimate
        if share.max(initial=0.0) >= 1:
            raise InputError(
                f"a mean stress of {means.max():.4g} reaches the tensile strength {self.ultimate:.4g}: the part breaks "
                f"without fatigue; check the unit and the factor of the history"
            )
        return ranges / 2 / (1 - share)
