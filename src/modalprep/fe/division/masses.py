"""Mass, moments and modal integrals of each part of a divided mesh."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel

MISSING = 1e-9  # of the mass: what elements do not have


class PartMasses(NamedTuple):
    """Integrals over each of N parts, about the frame's origin.

    Attributes
    ----------
    m, s, E : (N,), (N, 3), (N, 3, 3)
        ``int rho``, ``int rho x_a``, ``int rho x_a x_b``.
    S, H : (N, 3, n), (N, 3, 3, n)
        ``int rho phi_a``, ``int rho x_b phi_a``.
    """

    m: np.ndarray
    s: np.ndarray
    E: np.ndarray
    S: np.ndarray
    H: np.ndarray


def part_masses(model: FEModel, of_element: np.ndarray, Phi: np.ndarray) -> PartMasses:
    """Integrate over the parts of a model; ``of_element (n_elements,)`` as in `Division`, ``Phi (n_dof, n)``.

    Raises
    ------
    InputError
        When the body has mass that belongs to no element.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> model = cantilever_model(elements=4)
    >>> found = part_masses(model, np.array([0, 0, 1, 1]), np.zeros((model.n_dof, 0)))
    >>> found.m.round(9), found.s[:, 0].round(9)
    (array([6., 6.]), array([15., 45.]))
    """
    assert model.groups is not None
    rigid = model.rigid_body()
    fields = np.concatenate([rigid, Phi], axis=1)
    N = int(of_element.max()) + 1
    g, h = np.zeros((N, 3, fields.shape[1])), np.zeros((N, 3, 3, fields.shape[1]))
    start = 0
    for inertia in model.groups.inertias:
        own = of_element[start : start + len(inertia.nodes)]
        start += len(inertia.nodes)
        mass = inertia.mass()
        if mass is None:
            continue
        u = fields[model.dof[inertia.nodes, : inertia.components]].reshape(len(own), -1, fields.shape[1])
        np.add.at(g, own, np.einsum("ela,eln->ean", mass.g, u, optimize=True))
        np.add.at(h, own, np.einsum("elab,eln->eabn", mass.h, u, optimize=True))
    found = _sorted(g, h)
    if abs(found.m.sum() - model.rigid.m) > MISSING * model.rigid.m:
        raise InputError(
            f"large_deflection: {model.rigid.m - found.m.sum():.4g} kg of the body belong to no element (matrices of "
            "the mesh, or an added mass), so that no part can have them; set large_deflection = false"
        )
    return found


def _sorted(g: np.ndarray, h: np.ndarray) -> PartMasses:
    """Take the moments from the integrals of rigid motions, which come first: ``u = e_c`` and ``u = e_c x x``."""
    m = g[:, 0, 0]
    s = np.einsum("paba->pb", h[..., :3]) / 3
    E = np.empty((len(m), 3, 3))
    for d in range(3):
        a, c = (d + 1) % 3, (d + 2) % 3  # (e_c x x)_a = x_d
        E[:, d] = h[:, a, :, 3 + c]
    return PartMasses(m, s, (E + E.swapaxes(1, 2)) / 2, g[:, :, 6:], h[..., 6:])
