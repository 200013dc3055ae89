"""T, the second order of the modal mass: what a body that bends under its steady load shifts beside its Kg.

With ``u = phi q + Gamma_jk q_j q_k / 2``, where Gamma takes the cubic terms out of the strain energy, ``T_ijk = phi_i M
Gamma_jk`` (FORMULATION 4). Gamma itself is not needed: the load ``M phi_i`` works on it as every load does, so that T_i
is, up to its sign, the geometric stiffness of the static answer to ``M phi_i``, and of the arms that carry mass.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from modalprep.fe.model import FEModel
from modalprep.reduction.basis import Reduction

SECOND_ORDER = "second_order_mass"  # key of the provenance
SHARE = 0.05  # of the shift by geometric stiffness
LOWEST = 8  # modes that are judged


def second_order_mass_of(
    model: FEModel, reduction: Reduction, Kg: np.ndarray, choice: bool | Literal["auto"]
) -> tuple[np.ndarray | None, dict[str, str]]:
    """Return T ``(n, n, n)`` or None, and what the provenance says of it; `Kg (12 + 6 n_if, n, n)` of the unit loads.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> reduction = craig_bampton(model, modes=2)
    >>> T, said = second_order_mass_of(model, reduction, np.zeros((24, 15, 15)), True)
    >>> T.shape, list(said)
    ((15, 15, 15), ['second_order_mass'])
    """
    n = reduction.basis.shape[1]
    if choice is False or not n or not (np.any(Kg) or choice is True):
        return None, {}
    low = modal_mass_growth(model, reduction, slice(min(LOWEST, n)))
    share = mass_share(model, reduction, Kg, low)
    if choice == "auto" and share <= SHARE:
        return None, {}
    T = np.concatenate([low, modal_mass_growth(model, reduction, slice(len(low), n))])
    much = f"{100 * share:.2g} % of what geometric stiffness does" if share < 10 else f"{share:.2g} times that of Kg"
    return T, {
        SECOND_ORDER: "the second order of the modal mass (T) is taken: under unit acceleration or spin it shifts "
        f"squared frequencies of the lowest modes by up to {much}"
    }


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
    Kg = model.geometric_stiffness.project(reduction.inertial[:, some], model.M @ Phi[:, some], Phi)
    return model.rotating_mass.project_modes(Phi, some) - Kg


def mass_share(model: FEModel, reduction: Reduction, Kg: np.ndarray, T: np.ndarray) -> float:
    """Return by how much T shifts squared frequencies of the lowest modes, over the shift by Kg and P.

    In each of the twelve unit fields the static answer q0 changes the modal mass by ``2 q0_j T_iji``, of the rows
    ``T (k, n, n)``; fields of acceleration and of rotation are compared with the largest shift of their kind.
    """
    w2, m = (2 * np.pi * reduction.frequency) ** 2, len(T)
    load = reduction.basis.T @ reduction.loads[:, :12]
    q0 = np.divide(load, w2[:, None], out=np.zeros_like(load), where=w2[:, None] > 0)
    shift = np.abs(2 * w2[:m] * np.einsum("jk,iji->ki", q0, T[:, :, :m]))
    own = np.abs(np.einsum("kii->ki", Kg[:12, :m, :m]))
    share = [np.max(shift[k]) / max(np.max(own[k]), least) for k, least in ((slice(3), 1e-300), (slice(3, 12), 1.0))]
    return float(max(share))
