"""Elastic foundations: springs distributed over faces and lines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.properties.properties import Vector
from modalprep.fe.terms.forms import across, along_axes, along_normal
from modalprep.fe.terms.quantity import refuse_both, refuse_negative
from modalprep.fe.terms.term import Term


@dataclass(frozen=True, kw_only=True)
class Foundation:
    """Springs under the faces or along the lines of a group, whose other ends move with the frame of the root.

    Attributes
    ----------
    group : str
        Of shells or beams, or of faces or lines on the nodes of other elements.
    stiffness_per_area : float or (3,)
        N/m^3, of faces: along their normal, or along x, y, z of the mesh.
    stiffness_per_length : float or (3,)
        N/m^2, of lines: across them, alike in both directions, or along x, y, z of the mesh.

    Raises
    ------
    InputError
        When not exactly one of the two is given, or it is negative.

    Examples
    --------
    >>> Foundation(group="plate", stiffness_per_area=50e6).term().on
    'faces'
    """

    group: str
    stiffness_per_area: float | Vector | None = None
    stiffness_per_length: float | Vector | None = None

    def __post_init__(self) -> None:
        """Refuse other than one stiffness."""
        refuse_both("foundation", self, ("stiffness_per_area", "stiffness_per_length"))
        refuse_negative("foundation: stiffness", self._stiffness)

    @property
    def _stiffness(self) -> np.ndarray:
        given = self.stiffness_per_length if self.stiffness_per_area is None else self.stiffness_per_area
        k = np.array(given, dtype=float)
        if k.shape not in ((), (3,)):
            raise InputError(f"foundation: the stiffness has {k.size} numbers; give one, or those along x, y and z")
        return k

    def term(self) -> Term:
        """Return the foundation as a term of the stiffness."""
        k = self._stiffness
        lines = self.stiffness_per_area is None
        form = along_axes(k) if k.ndim else across(float(k)) if lines else along_normal(float(k))
        return Term(form=form, group=self.group, to="stiffness", on="lines" if lines else "faces")
