"""A form on a basis with its parameters: what the plain forms of a family consist of."""

from __future__ import annotations

from typing import Any, NamedTuple

from skfem.assembly import Form
from skfem.assembly.form.coo_data import COOData

from modalprep.fe.forms.basis import ModelBasis


class Term(NamedTuple):
    """A term of a matrix of the model.

    Attributes
    ----------
    form : skfem.Form
    basis : ModelBasis
    given : dict
        Parameters of the form.
    """

    form: Form
    basis: ModelBasis
    given: dict[str, Any]

    def coo(self) -> COOData:
        """Return the matrices of the cells with their DOFs of the model."""
        return self.form.coo_data(self.basis, **self.given)
