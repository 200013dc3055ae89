"""Participation of modes in static responses and in the motion of the interfaces."""

from __future__ import annotations

import numpy as np

from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.blas import inner
from modalprep.reduction.clamped import Clamped
from modalprep.reduction.truncation import ENERGY


def static_share(F: np.ndarray, X: np.ndarray, w2: np.ndarray, Phi: np.ndarray) -> np.ndarray:
    """Return the largest share (n,) of each mode in the strain energy of static responses.

    Mode k gives ``(phi_k^T f)^2 / w_k^2`` of the ``f^T x`` of a load.

    Parameters
    ----------
    F, X : (n_dof, m)
        Loads of comparable size and the answers to them; loads with negligible energy (`ENERGY`) are ignored.
    w2, Phi : (n,), (n_dof, n)

    Examples
    --------
    >>> share = static_share(np.array([[1.0], [1.0]]), np.array([[0.5], [0.25]]), np.array([2.0, 4.0]), np.eye(2))
    >>> share.round(3)
    array([0.667, 0.333])
    """
    energy = np.einsum("ij,ij->j", F, X)
    real = energy > ENERGY * energy.max(initial=0.0)
    return np.max((Phi.T @ F[:, real]) ** 2 / w2[:, None] / energy[real], axis=1, initial=0.0)


def interface_shares(coupling: np.ndarray, w2: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return controllability and observability (n,) of modes at the interfaces, relative to the strongest mode.

    With equal damping of all modes, of unit modal mass, and one row of `coupling` for each input and its collocated
    output, the diagonals of the gramians are ``|l_k|^2 / (4 zeta w_k)`` for input and ``|l_k|^2 / (4 zeta w_k^3)`` for
    output: the energy that white noise at the interfaces keeps in the mode, and the squared motion of the interfaces
    while the mode rings down from unit energy. The root of their product is half the peak of the mode's transfer
    function. Gawronski, Advanced Structural Dynamics and Active Control of Structures (2004), chapter 4.

    Parameters
    ----------
    coupling : (m, n)
        `fixed_coupling` or `free_coupling`, kg^(-1/2).
    w2 : (n,)

    Examples
    --------
    >>> interface_shares(np.array([[1.0, 1.0, 2.0]]), np.array([1.0, 4.0, 16.0]))[1]
    array([1.    , 0.125 , 0.0625])
    """
    strength = np.sum(coupling**2, axis=0)
    w = np.sqrt(w2)
    return _over_largest(strength / w), _over_largest(strength / w**3)


def _over_largest(values: np.ndarray) -> np.ndarray:
    return values / max(values.max(initial=0.0), np.finfo(float).tiny)


def fixed_coupling(clamped: Clamped, Phi: np.ndarray) -> np.ndarray:
    """Return the coupling ``(6 n_if, n)`` of fixed-interface modes ``Phi (n_i, n)``, kg^(-1/2).

    A free interface has its motion: inputs are forces and moments on it. A fixed one has ``Phi^T (M_ii Psi + M_ib)``
    over the body's mass: its input is the acceleration times that mass, its output the motion whose acceleration times
    that mass is the reaction. Rotations are times the body's size, so that all rows are comparable.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.clamped import clamp
    >>> clamped = clamp(cantilever_model())
    >>> fixed_coupling(clamped, np.zeros((60, 3))).shape
    (12, 3)
    """
    model = clamped.model
    L = inner(clamped.M_ii @ clamped.Psi + clamped.M.coupling.toarray().T, Phi)
    scale = np.tile(np.repeat([1.0, 1 / model_size(model)], 3), len(L) // 6) / model.rigid.m
    free = [frame.dofs for frame in model.interfaces if frame.boundary == "free"]
    return np.vstack([scale[:, None] * L, *(_motion(model, dofs, clamped.expand(Phi)) for dofs in free)])


def free_coupling(model: FEModel, Phi: np.ndarray) -> np.ndarray:
    """Return the coupling ``(6 n_if, n)`` of the floating body's modes ``Phi (n_free, n)``: motion of the interfaces.

    In kg^(-1/2); rotations are times the body's size.
    """
    return np.vstack([_motion(model, frame.dofs, Phi) for frame in model.interfaces])


def _motion(model: FEModel, dofs: np.ndarray, x: np.ndarray) -> np.ndarray:
    return np.repeat([1.0, model_size(model)], 3)[:, None] * x[np.searchsorted(model.free, dofs)]


def model_size(model: FEModel) -> float:
    """Return the longest side (m) of the box around the nodes."""
    return float(np.ptp(model.points, axis=0).max()) or 1.0
