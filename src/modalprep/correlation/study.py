"""A study with the modes of every case, followed by their shape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from modalprep.correlation.mode_set import ModeSet
from modalprep.correlation.tracking import UNSURE, Indices, Tracks, unseen
from modalprep.notebook import html_table
from modalprep.records import Record

LOW_MAC, PATH_DEPENDENT = "low MAC", "path-dependent"  # why a number is uncertain


@dataclass(frozen=True, eq=False, kw_only=True)
class Study(Record):
    """Modes of the cases of a grid of parameters, and their numbers.

    Attributes
    ----------
    name : str
    parameters : tuple of str
    levels : tuple of tuples
        Values of each parameter, in the order of the places.
    modes : {place: ModeSet}
    tracks : Tracks
        Of `track_modes`.

    Examples
    --------
    >>> from modalprep.correlation import body_modes, track_modes
    >>> from modalprep.examples import uniform_beam
    >>> modes = body_modes(uniform_beam(modes=2))
    >>> cases = {(0,): modes, (1,): modes.select(np.array([1, 0]))}
    >>> study = Study(name="beam", parameters=("E",), levels=((7e10, 8e10),), modes=cases, tracks=track_modes(cases))
    >>> [(row["E"], row["mode"], row["place"]) for row in study.rows()]
    [(70000000000.0, 1, 1), (70000000000.0, 2, 2), (80000000000.0, 2, 1), (80000000000.0, 1, 2)]
    """

    name: str
    parameters: tuple[str, ...]
    levels: tuple[tuple[Any, ...], ...]
    modes: Mapping[Indices, ModeSet]
    tracks: Tracks

    def values(self, place: Indices) -> dict[str, Any]:
        """Return the values of a case by parameter.

        Returns
        -------
        dict
        """
        return {key: self.levels[axis][k] for axis, (key, k) in enumerate(zip(self.parameters, place, strict=True))}

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each mode of each case: values, number from 1, place in the list, Hz, damping, certainty.

        Returns
        -------
        list of dict
            "uncertain" is ``low MAC`` where the MAC with the neighbour is below 0.6, ``path-dependent`` where the
            number depends on the way through the study, else empty.
        """
        found = []
        torn = self._torn()
        for place in sorted(self.modes):
            modes = self.modes[place]
            number = self.tracks.number[place]
            sure = self.tracks.certainty[place]
            for k in range(modes.n):
                why = LOW_MAC if sure[k] < UNSURE else PATH_DEPENDENT if (place, int(number[k])) in torn else ""
                found.append(
                    self.values(place)
                    | {
                        "mode": int(number[k]) + 1,
                        "place": k + 1,
                        "frequency_Hz": float(modes.frequency[k]),
                        "damping_percent": 100 * float(modes.damping[k]),
                        "mac": float(sure[k]),
                        "uncertain": why,
                    }
                )
        return found

    def _torn(self) -> set[tuple[Indices, int]]:
        return {end for p, q, i, j in self.tracks.conflicts for end in ((p, i), (q, j))}

    def uncertainties(self) -> list[str]:
        """Return a sentence for each mode whose number has a low MAC, and for each whose number depends on the way.

        Returns
        -------
        list of str
        """
        blind = {place: unseen(modes) for place, modes in self.modes.items()}
        hidden = sorted({int(self.tracks.number[p][k]) + 1 for p, own in blind.items() for k in np.flatnonzero(own)})
        said = [
            f"mode {self.tracks.number[place][k] + 1} at {self._at(place)} has a low MAC with its neighbour, "
            f"{self.tracks.certainty[place][k]:.2f}; take smaller steps there"
            for place, k in self.tracks.low_mac
            if not blind[place][k]
        ]
        if hidden:
            said.append(
                f"mode{'s' if len(hidden) > 1 else ''} {', '.join(map(str, hidden))}: the nodes turn without "
                "displacement, as in torsion of a straight beam; modes of equal rank among such ones have one number"
            )
        for p, q, i, j in self.tracks.conflicts:
            said.append(
                f"mode {i + 1} at {self._at(p)} is most like mode {j + 1} at {self._at(q)}: which of the two it is "
                "depends on the way through the study"
            )
        return said

    def _at(self, place: Indices) -> str:
        return ", ".join(f"{key} = {value}" for key, value in self.values(place).items())

    def summary(self) -> list[dict[str, Any]]:
        """Return a row for each mode: its number, cases, lowest and highest frequency, first and last place, MAC.

        Returns
        -------
        list of dict
        """
        rows = self.rows()
        found = []
        for mode in range(1, self.tracks.count + 1):
            own = [row for row in rows if row["mode"] == mode]
            frequency, place = ([row[key] for row in own] for key in ("frequency_Hz", "place"))
            found.append(
                {
                    "mode": mode,
                    "cases": len(own),
                    "lowest_Hz": min(frequency),
                    "highest_Hz": max(frequency),
                    "first_place": min(place),
                    "last_place": max(place),
                    "mac": min(row["mac"] for row in own),
                    "uncertain": sum(bool(row["uncertain"]) for row in own),
                }
            )
        return found

    def __repr__(self) -> str:
        """Parameters, cases and modes."""
        uncertain = len(self.tracks.low_mac) + len(self.tracks.conflicts)
        by = ", ".join(self.parameters)
        cases = f"{self.tracks.count} modes in {len(self.modes)} cases"
        return f"Study({self.name!r} by {by}: {cases}, {uncertain} numbers uncertain)"

    def _repr_html_(self) -> str:
        """Return the modes as an HTML table."""
        rows = self.summary()
        return html_table(repr(self), list(rows[0]), [list(row.values()) for row in rows])
