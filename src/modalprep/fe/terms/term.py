"""A weak form of scikit-fem that a user adds to a model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Literal, get_args

import numpy as np
from skfem.assembly import BilinearForm, LinearForm

from modalprep.applies import Rule, refuse_idle
from modalprep.suggest import refuse_other, refuse_unknown

To = Literal["stiffness", "mass", "geometric_stiffness", "load"]
On = Literal["cells", "faces", "lines", "facets"]


@dataclass(frozen=True, kw_only=True)
class Term:
    """A form of scikit-fem on a group, added to a matrix of a model or one of its loads.

    Fields and parameters of the form are those of `group_bases` and `facet_bases`: the displacement u, on beams and
    shells with a property also the rotation vector t, in mesh axes; ``w.x`` in the frame of the model, whose origin is
    the root interface, and normals or tangents ``w.n``.

    A stiffness acts on the displacement relative to the frame of the root interface, so that its other end moves with
    the body; what strains with the body alone, such as one more layer, does not notice. A mass must be ``int rho u.v``,
    or of some directions only, such as ``int rho (u.n) (v.n)``: along the others it moves with the frame of the root. A
    geometric stiffness has the displacement of the prestress as ``w.d``, in which it must be linear.

    Attributes
    ----------
    form : skfem.BilinearForm or skfem.LinearForm
        Of a matrix, symmetric; or of a load, N.
    group : str
    to : {"stiffness", "mass", "geometric_stiffness", "load"}
        What it is added to; a load gets the name of the term (``FEModel.loads``).
    on : {"cells", "faces", "lines", "facets"}
        The cells of the group; only the triangles and quads, or only the lines among them; or the faces of its solids
        and the edges of its shells that no other cell of the group shares.
    where : callable
        Of facets: those with corners' means at ``x (3, k)``, in the frame of the model, where it is True.

    Raises
    ------
    InputError
        When form, `to` and `on` do not fit each other.

    Examples
    --------
    >>> import skfem
    >>> bed = skfem.BilinearForm(lambda u, t, v, s, w: 1e6 * u[2] * v[2])
    >>> Term(form=bed, group="plate", to="stiffness").on
    'cells'
    """

    form: BilinearForm | LinearForm
    group: str
    to: To
    on: On = "cells"
    where: Callable[[np.ndarray], np.ndarray] | None = None
    applies: ClassVar[tuple[Rule, ...]] = (Rule(("where",), needs=("on",), among=("facets",)),)

    def __post_init__(self) -> None:
        """Refuse a form of another kind."""
        refuse_unknown(str(self.to), get_args(To), "term: to")
        refuse_unknown(str(self.on), get_args(On), "term: on")
        refuse_other(f"term to {self.to!r}: the form", LinearForm if self.to == "load" else BilinearForm, self.form)
        refuse_idle(self, "term: ")
