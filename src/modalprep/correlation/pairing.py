"""Two sets of modes side by side: pairs, MAC, COMAC, cross-orthogonality, differences of frequency and damping."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

from modalprep.correlation.criteria import comac, cross_orthogonality, mac
from modalprep.correlation.mode_set import ModeSet
from modalprep.correlation.places import in_frame, nearest, said_of_places
from modalprep.errors import InputError
from modalprep.notebook import html_table
from modalprep.records import Record
from modalprep.verdicts.notes import told

PAIRED = 0.5  # smallest MAC of a pair


@dataclass(frozen=True, eq=False, kw_only=True)
class Correlation(Record):
    """Test modes against analysis modes at the sensors.

    Attributes
    ----------
    test, analysis : ModeSet
        Real modes in the frame of the analysis; the analysis at the sensors, with the components that the test has.
    node : (p,) int
        Row of the analysis point that stands for each test point.
    distance : (p,)
        m, between the two.
    mac : (n, m)
        Of test mode i and analysis mode j.
    pairs : (k, 2) int
        Paired modes, test and analysis, counted from 0.
    cross_orthogonality : (n, m) or None
        In the mass of the analysis reduced to the sensors by its paired modes, NaN for the others; None where the
        modes have no unit mass, or the sensors do not suffice.
    comac : (p, 3)
        Over the pairs; NaN for components that are not measured, or without pairs.
    notes : tuple of str

    Examples
    --------
    >>> from modalprep.correlation import body_modes
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=4))
    >>> correlate(modes, modes)
    Correlation('beam' against 'beam', 4 pairs of 4 and 4 modes, MAC 1.000 to 1.000)
    """

    test: ModeSet
    analysis: ModeSet
    node: np.ndarray
    distance: np.ndarray
    mac: np.ndarray
    pairs: np.ndarray
    cross_orthogonality: np.ndarray | None
    comac: np.ndarray
    notes: tuple[str, ...] = ()

    @property
    def frequency_difference(self) -> np.ndarray:
        """Relative difference (k,) of the analysis from the test, for each pair; NaN for rigid-body modes."""
        a = self.test.frequency[self.pairs[:, 0]]
        b = self.analysis.frequency[self.pairs[:, 1]]
        return np.divide(b - a, a, out=np.full(len(a), np.nan), where=a > 0)

    @property
    def pair_mac(self) -> np.ndarray:
        """MAC (k,) of each pair."""
        return self.mac[self.pairs[:, 0], self.pairs[:, 1]]

    def __repr__(self) -> str:
        """The two names, the number of pairs and their MAC."""
        found = f", MAC {self.pair_mac.min():.3f} to {self.pair_mac.max():.3f}" if len(self.pairs) else ""
        counts = f"{len(self.pairs)} pairs of {self.test.n} and {self.analysis.n} modes"
        return f"Correlation({self.test.name!r} against {self.analysis.name!r}, {counts}{found})"

    def rows(self) -> list[dict[str, float]]:
        """Return the pairs: numbers from 1, frequencies (Hz), difference (%), MAC, orthogonality, damping (%).

        Returns
        -------
        list of dict
        """
        cross = self.cross_orthogonality
        return [
            {
                "test": int(i) + 1,
                "analysis": int(j) + 1,
                "test_frequency_Hz": float(self.test.frequency[i]),
                "analysis_frequency_Hz": float(self.analysis.frequency[j]),
                "difference_percent": float(100 * off),
                "mac": float(self.mac[i, j]),
                "cross_orthogonality": float("nan") if cross is None else float(abs(cross[i, j])),
                "test_damping_percent": float(100 * self.test.damping[i]),
                "analysis_damping_percent": float(100 * self.analysis.damping[j]),
            }
            for (i, j), off in zip(self.pairs.tolist(), self.frequency_difference, strict=True)
        ]

    def _repr_html_(self) -> str:
        """Return the pairs as an HTML table."""
        rows = self.rows()
        return html_table(repr(self), list(rows[0]) if rows else [], [list(row.values()) for row in rows])


@told
def correlate(
    test: ModeSet,
    analysis: ModeSet,
    *,
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    rotation: np.ndarray | None = None,
    tolerance: float | None = None,
    smallest_mac: float = PAIRED,
) -> Correlation:
    """Compare test modes with analysis modes at the sensors of the test.

    Each sensor takes the nearest point of the analysis, whatever the numbers of the nodes. Modes are paired so that the
    sum of the MAC is largest.

    Parameters
    ----------
    test, analysis : ModeSet
        Complex test modes are compared in their real part, after a rotation of phase.
    origin : (3,)
        Of the analysis frame in the axes of the test, m.
    rotation : (3, 3), optional
        Axes x, y, z of the analysis frame in those of the test, by rows; default: they are parallel.
    tolerance : float, optional
        m, largest distance of a sensor from its point; default: 5 % of the size of the analysis.
    smallest_mac : float
        Pairs below it are dropped.

    Returns
    -------
    Correlation

    Raises
    ------
    InputError
        When `smallest_mac` is not between 0 and 1, a sensor is far from all points of the analysis, or no component is
        measured; where another unit of length or other axes would fit, the message says so.

    References
    ----------
    D. J. Ewins, Modal Testing, 2nd ed., Research Studies Press 2000, chapter 5.
    """
    if not 0 <= smallest_mac <= 1:
        raise InputError(f"smallest_mac = {smallest_mac:g} must lie between 0 and 1, as every MAC does")
    test = in_frame(test, origin, rotation)
    node, distance = nearest(test, analysis, tolerance)
    notes = said_of_places(test, node, distance)
    if np.iscomplexobj(test.shape):
        notes.append("complex test modes are compared by their real part, each turned to its main phase")
    test = test.real()
    known = test.measured
    if not known.any():
        raise InputError(f"{test.name}: no component is measured in all modes")
    at_sensors = np.where(known[:, :, None], test.sees(analysis.shape[node]), np.nan)
    places = {"points": analysis.points[node], "labels": analysis.labels[node]}
    analysis = analysis.with_(**places, shape=at_sensors, axes=test.axes)
    a, b = test.shape[known], analysis.shape[known]
    table = mac(a, b)
    pairs = _paired(table, smallest_mac)
    cross = _orthogonality(a, b, analysis.unit_mass, pairs[:, 1], notes)
    by_component = np.full(known.shape, np.nan)
    if len(pairs):
        by_component[known] = comac(a[:, pairs[:, 0]], b[:, pairs[:, 1]])
    return Correlation(
        test=test,
        analysis=analysis,
        node=node,
        distance=distance,
        mac=table,
        pairs=pairs,
        cross_orthogonality=cross,
        comac=by_component,
        notes=tuple(notes),
    )


def _paired(table: np.ndarray, smallest: float) -> np.ndarray:
    i, j = linear_sum_assignment(-table)
    keep = table[i, j] >= smallest
    return np.stack([i[keep], j[keep]], axis=1)


def _orthogonality(
    a: np.ndarray, b: np.ndarray, unit_mass: bool, paired: np.ndarray, notes: list[str]
) -> np.ndarray | None:
    if not unit_mass:
        notes.append("no cross-orthogonality: the modal mass of the analysis modes is not known")
        return None
    found = np.full((a.shape[1], b.shape[1]), np.nan)
    try:
        found[:, paired] = cross_orthogonality(a, b[:, paired])
    except InputError as error:
        notes.append(f"no cross-orthogonality: {error}")
        return None
    return found
