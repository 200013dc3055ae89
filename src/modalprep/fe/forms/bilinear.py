"""scikit-fem's bilinear form, evaluated for all trial functions at once."""

from __future__ import annotations

from typing import Any

import numpy as np
from skfem.assembly import BilinearForm, CellBasis
from skfem.assembly.form.form import FormExtraParams
from skfem.element import DiscreteField


class AllTrials(BilinearForm):
    """A bilinear form that is called once for each test function, with all trial functions in one more axis.

    scikit-fem calls a form for each pair of functions, 2916 times for shells of nine nodes. Fields and parameters have
    the axis of the trial functions before those of cells and points, ``(..., k, ne, nq)``, which ``...`` of einsum and
    the helpers of scikit-fem cover. The result is the same.
    """

    def _assemble(self, ubasis: CellBasis, vbasis: CellBasis | None = None, **kwargs: Any):
        if vbasis is not None:
            return super()._assemble(ubasis, vbasis, **kwargs)
        given = ubasis.default_parameters() | self._normalize_asm_kwargs(kwargs, ubasis)
        w = FormExtraParams({name: _with_axis(value) for name, value in given.items()})
        u = [_stacked([own[k] for own in ubasis.basis]) for k in range(len(ubasis.basis[0]))]
        n, dofs = ubasis.Nbfun, ubasis.element_dofs
        data = np.empty((n, n, ubasis.nelems), dtype=self.dtype)
        for i, functions in enumerate(ubasis.basis):
            v = [_stacked([field]) for field in functions]
            data[:, i] = np.broadcast_to(self.form(*u, *v, w) * ubasis.dx, (n, *ubasis.dx.shape)).sum(axis=2)
        rows = np.broadcast_to(dofs, (n, *dofs.shape))
        indices = np.array([rows.ravel(), rows.swapaxes(0, 1).ravel()])
        return indices, data.ravel(), (ubasis.N, ubasis.N), (n, n)


def _stacked(fields: list[DiscreteField]) -> DiscreteField:
    """Put fields of several functions side by side: values and gradients ``(..., k, ne, nq)``."""
    own = zip(*(field.astuple for field in fields), strict=True)
    return DiscreteField(*(None if parts[0] is None else np.stack(parts, axis=-3) for parts in own))


def _with_axis(value: Any) -> Any:
    """Give a parameter of the points the axis of the trial functions."""
    if not isinstance(value, np.ndarray) or value.ndim < 2:
        return value
    return DiscreteField(np.expand_dims(np.asarray(value), -3))
