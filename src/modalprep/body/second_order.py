"""T, the second-order modal mass: its effect on a body deflected by a steady load, in addition to that of Kg.

With ``u = phi q + Gamma_jk q_j q_k / 2``, where Gamma removes the cubic terms from the strain energy, ``T_ijk = phi_i M
Gamma_jk`` (theory 4.7). Gamma itself is not needed: the load ``M phi_i`` works on it as every load does, so that T_i
is, up to its sign, the geometric stiffness of the static response to ``M phi_i``, and of the arms that carry mass.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import affine_part
from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.sparse import times
from modalprep.reduction.basis import Reduction

SECOND_ORDER = "second_order_mass"  # key of the provenance
SHARE = 0.05  # of the shift by geometric stiffness
LOWEST = 8  # number of lowest modes compared


def with_second_order_mass(
    body: FlexibleBody, model: FEModel, reduction: Reduction, choice: bool | Literal["auto"], low: np.ndarray
) -> FlexibleBody:
    """Return the body of a reduction with T if requested or significant; its provenance says how significant.

    `low (k, n, n)` are the first rows of T, from `stiffness_and_growth`.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.body.build import flexible_body
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> reduction = craig_bampton(model, modes=2)
    >>> body = flexible_body(model, reduction, name="beam", second_order_mass=False)
    >>> low = modal_mass_growth(model, reduction, slice(2))
    >>> body = with_second_order_mass(body, model, reduction, True, low)
    >>> body.T.shape == (body.n,) * 3, SECOND_ORDER in body.provenance
    (True, True)
    """
    if choice is False or not body.n or not (body.has_geometric_stiffness or choice is True):
        return body
    share = mass_share(body, low)
    if choice == "auto" and share <= SHARE:
        return body
    T = np.concatenate([low, modal_mass_growth(model, reduction, slice(len(low), body.n))])
    much = f"{100 * share:.0f} % of what geometric stiffness does" if share < 10 else f"{share:.0f} times that of Kg"
    said = (
        "the second-order modal mass (T) is included: under unit acceleration or spin it shifts squared "
        f"frequencies of the lowest modes by up to {much}"
    )
    return body.with_(T=T, provenance={SECOND_ORDER: said, **body.provenance})


def stiffness_and_growth(
    model: FEModel, reduction: Reduction, choice: bool | Literal["auto"]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the geometric stiffness ``(12 + 6 n_if, n, n)`` of the unit loads and the first rows of T ``(k, n, n)``.

    Both come from one projection; k is at most `LOWEST`, and 0 where `choice` is False.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> Kg, low = stiffness_and_growth(model, craig_bampton(model, modes=2, truncation=()), "auto")
    >>> Kg.shape, low.shape
    ((24, 2, 2), (2, 2, 2))
    """
    Phi = reduction.basis
    some = slice(0 if choice is False else LOWEST)
    static = np.concatenate([reduction.static, reduction.inertial[:, some]], axis=1)
    loads = np.concatenate([reduction.loads, times(model.M, Phi[:, some])], axis=1)
    Kg, low = np.split(model.geometric_stiffness.project(static, loads, Phi), [reduction.loads.shape[1]])
    Kg[:12] += model.rotating_mass.project(Phi)
    return Kg, model.rotating_mass.project_modes(Phi, some) - low


def modal_mass_growth(model: FEModel, reduction: Reduction, some: slice) -> np.ndarray:
    """Return `some` of the rows of T ``(k, n, n)``, symmetric in their last two axes.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> T = modal_mass_growth(model, craig_bampton(model, modes=2, truncation=()), slice(2))
    >>> bool(abs(T).max() < 1e-9)  # bending makes it shorter, not bent
    True
    """
    Phi = reduction.basis
    Kg = model.geometric_stiffness.project(reduction.inertial[:, some], times(model.M, Phi[:, some]), Phi)
    return model.rotating_mass.project_modes(Phi, some) - Kg


def mass_share(body: FlexibleBody, T: np.ndarray, included: np.ndarray | None = None) -> float:
    """Return by how much T shifts squared frequencies of the lowest modes, over the shift by Kg and P.

    In each of the twelve unit fields the static deflection q0 changes the modal mass by ``2 q0_j T_iji``, of the rows
    ``T (k, n, n)``; what is `included` in the body (k, n, n), the affine part (mass.py) by default, does not count.
    Fields of acceleration and of rotation are compared with the largest shift of their kind.
    """
    part = affine_part(body)
    m = len(T)
    load = np.concatenate([body.S, body.H.reshape(9, body.n)]).T
    q0 = np.divide(-load, body.K[:, None], out=np.zeros_like(load), where=body.K[:, None] > 0)
    if included is None:
        included = np.einsum("ari,arjk->ijk", part.B[..., :m], part.Kg_p)
    rest = T - included
    shift = np.abs(2 * body.K[:m] * np.einsum("jk,iji->ki", q0, rest[:, :, :m]))
    Kg = np.concatenate([body.Kg_A, body.Kg_W.reshape(9, body.n, body.n)])
    own = np.abs(np.einsum("kii->ki", Kg[:, :m, :m]))
    share = [np.max(shift[k]) / max(np.max(own[k]), least) for k, least in ((slice(3), 1e-300), (slice(3, 12), 1.0))]
    return float(max(share))
