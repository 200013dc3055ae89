"""Mass on faces and lines that has no stiffness: coatings, insulation, cables, shallow fluid."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from modalprep.applies import Rule, refuse_idle
from modalprep.errors import InputError
from modalprep.fe.terms.forms import alike, along_normal
from modalprep.fe.terms.quantity import refuse_both, refuse_negative
from modalprep.fe.terms.term import Term


@dataclass(frozen=True, kw_only=True)
class AddedMass:
    """Mass on the faces or lines of a group, or fluid of constant depth on faces.

    The fluid moves with the faces along their normal, and with the frame of the root along them: walls, which are not
    modelled, hold it there. Its pressure waves, its own stiffness by gravity and its flow along the faces are left out.

    Attributes
    ----------
    group : str
        Of shells or beams, or of faces or lines on the nodes of other elements.
    mass_per_area : float
        kg/m^2, of faces.
    mass_per_length : float
        kg/m, of lines.
    fluid_density : float
        kg/m^3, of fluid on faces, with a depth.
    depth : float
        Of the fluid, m.

    Raises
    ------
    InputError
        When not exactly one of mass per area, mass per length and density is given, or a value is negative.

    Examples
    --------
    >>> AddedMass(group="floor", fluid_density=1000.0, depth=0.2).term().on
    'faces'
    """

    group: str
    mass_per_area: float | None = None
    mass_per_length: float | None = None
    fluid_density: float | None = None
    depth: float | None = None
    applies: ClassVar[tuple[Rule, ...]] = (Rule(("depth",), needs=("fluid_density",)),)

    def __post_init__(self) -> None:
        """Refuse other than one kind of mass."""
        refuse_both("added mass", self, ("mass_per_area", "mass_per_length", "fluid_density"))
        refuse_idle(self, "added mass: ")
        if self.fluid_density is not None and self.depth is None:
            raise InputError("added mass: a fluid needs its depth; give 'depth' beside 'fluid_density'")
        for name in ("mass_per_area", "mass_per_length", "fluid_density", "depth"):
            refuse_negative(f"added mass: {name}", getattr(self, name) or 0.0)

    def term(self) -> Term:
        """Return the mass as a term."""
        if self.fluid_density is not None:
            form = along_normal(self.fluid_density * float(self.depth or 0.0))
            return Term(form=form, group=self.group, to="mass", on="faces")
        if self.mass_per_length is not None:
            return Term(form=alike(self.mass_per_length), group=self.group, to="mass", on="lines")
        return Term(form=alike(float(self.mass_per_area or 0.0)), group=self.group, to="mass", on="faces")
