"""scikit-fem's bases of the cells of a model and of their facets, in the model's own DOFs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from skfem.assembly import CellBasis

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.assembly.parts import Part
from modalprep.fe.assembly.structure import Structure
from modalprep.fe.forms.basis import DofMap, cell_basis
from modalprep.fe.forms.families import plain
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.facets import boundary
from modalprep.fe.properties.points import PointMass, Spring
from modalprep.suggest import suggestion


def group_bases(model: FEModel, group: str) -> list[CellBasis]:
    """Return the bases of the cells of a group, by which any form of scikit-fem is a matrix or vector of the model.

    Parameters
    ----------
    model : FEModel
    group : str
        A group with a property; point masses and springs have no basis.

    Returns
    -------
    list of skfem.CellBasis
        One for each kind of cell (two for beams of three nodes). Forms take the displacement u of the family, and beams
        and shells also the rotation vector t: ``form(u, v, w)`` or ``form(u, t, v, s, w)``, components ``(3, ne, nq)``
        along the axes of the mesh, ``u.grad[i, j]`` the derivative ``u_i,j`` along line or surface. ``w.x`` are
        positions in the model's frame, ``w.n`` normals of shells or tangents of lines. ``element_dofs (Nbfun, ne)`` are
        the DOFs of the model that the functions of each cell belong to.

    Raises
    ------
    InputError
        When the model has no such group of elements.

    Examples
    --------
    A bed of 1 MN/m^2 under a beam of 10 m carries 10 MN/m in all:

    >>> import skfem
    >>> from modalprep.examples import cantilever_model
    >>> model = cantilever_model(elements=4)
    >>> bed = skfem.BilinearForm(lambda u, t, v, s, w: 1e6 * u[2] * v[2])
    >>> K = skfem.asm(bed, group_bases(model, "beam"))
    >>> lift = model.rigid_body()[:, 2]
    >>> K.shape == model.K.shape, round(float(lift @ K @ lift), 3)
    (True, 10000000.0)
    """
    return part_bases(parts_of(model, group), dofmap_of(model))


def facet_bases(
    model: FEModel,
    facets: str | Mapping[str, np.ndarray],
    where: Callable[[np.ndarray], np.ndarray] | None = None,
) -> list[CellBasis]:
    """Return the bases of faces of solids or edges of shells, or of any cells on nodes of the model.

    Parameters
    ----------
    model : FEModel
    facets : str or {kind: nodes (k, n)}
        A group with a property, of which the facets on its boundary are taken; or cells, as ``mesh.group("skin")``.
    where : callable
        Of the facets of a group: those with corners' means at ``x (3, k)``, in the model's frame, where it is True.

    Returns
    -------
    list of skfem.CellBasis
        One for each kind of facet. Forms take the displacement u, interpolated by the shape functions of the facet:
        ``form(u, v, w)``, with normals ``w.n`` of faces (outward) or tangents of edges.

    Raises
    ------
    InputError
        When there is no such group or facet.

    Examples
    --------
    >>> import skfem
    >>> from modalprep.examples import cantilever_model
    >>> model = cantilever_model(elements=4)
    >>> load = skfem.LinearForm(lambda v, w: 3.0 * v[1])
    >>> f = skfem.asm(load, facet_bases(model, {"line": np.array([[0, 1], [1, 2]])}))
    >>> round(float(f @ model.rigid_body()[:, 1]), 9)  # 3 N/m over 5 m
    15.0
    """
    dofmap = dofmap_of(model)
    if isinstance(facets, str):
        own = [(part.kind, part.nodes) for part in parts_of(model, facets)]
        cells = boundary(own)
        if where is not None:
            for kind, nodes in cells.items():
                middle = dofmap.points[nodes[:, : len(CELLS[kind].corners)]].mean(axis=1)
                cells[kind] = nodes[where(middle.T)]
        if not any(map(len, cells.values())):
            raise InputError(f"group {facets!r} has no facet where it is asked for; widen the condition")
    else:
        cells = facets
    return [cell_basis(kind, np.asarray(nodes), dofmap) for kind, nodes in cells.items() if len(nodes)]


def part_bases(parts: Sequence[Part], dofmap: DofMap) -> list[CellBasis]:
    """Return the bases of parts of a structure; ``dofmap.points`` are relative to the origin of the model."""
    found: list[CellBasis] = []
    for part in parts:
        block = part.block(slice(None), dofmap.points, np.zeros(3))
        own = plain(block, dofmap)
        found += [] if own is None else own.motions()
    return found


def structure_of(model: FEModel, *groups: str) -> Structure:
    """Return the elements of some groups, by default of all, over which the forms of `forms.FORMS` are assembled.

    Examples
    --------
    >>> import skfem
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.fe.assembly.forms import FORMS
    >>> model = cantilever_model(elements=4)
    >>> compiled, plain = (skfem.asm(FORMS[name].stiffness, structure_of(model)) for name in ("compiled", "plain"))
    >>> bool(abs(compiled - plain).max() < 1e-12 * abs(compiled).max())
    True
    """
    if model.elements is None:
        raise InputError("a model from matrices has no elements; give their mesh to assemble")
    parts = [part for part in model.elements.parts if not groups or part.group in groups]
    return Structure(parts, model.points, model.dof, model.elements.rule, np.zeros(3))


def dofmap_of(model: FEModel) -> DofMap:
    """Return where the cells of a model are."""
    return DofMap(model.points, model.dof, model.n_dof)


def parts_of(model: FEModel, group: str) -> list[Part]:
    """Return the elements of a group.

    Raises
    ------
    InputError
        When the model has no such group of elements with an inside.
    """
    parts = [] if model.elements is None else model.elements.parts
    inside = [part for part in parts if not isinstance(part.section, (PointMass, Spring))]
    found = [part for part in inside if part.group == group]
    if not found:
        names = list(dict.fromkeys(part.group for part in inside))
        raise InputError(f"the model has no elements of a group {group!r}; {suggestion(group, names, 'it has')}")
    return found
