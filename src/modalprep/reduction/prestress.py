"""Static prestress of a full model: linear buckling and modes under load."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from modalprep.errors import AccuracyError, InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.blas import one_numpy_thread
from modalprep.linalg.congruent import stored
from modalprep.linalg.factor import Factor, factorise
from modalprep.linalg.modes import DENSE, lowest_modes
from modalprep.linalg.unique import unique_signs
from modalprep.records import Record
from modalprep.reduction.clamped import Clamped, clamp
from modalprep.suggest import refuse_other, refuse_unknown

MORE = 20  # further modes that span the second-order motion of the mass
QUOTIENT = 1e-3  # largest deviation of a Rayleigh quotient from its eigenvalue; at most 1e-5 with an accurate factor
NO_BUCKLING = 1e-12  # of the elastic stiffness: a geometric stiffness below it is round-off


@dataclass(frozen=True, eq=False, kw_only=True)
class LoadedModes(Record):
    """Mode shapes of a full model with their values.

    Attributes
    ----------
    value : (n,)
        Buckling: factors on the load, ascending. Vibration: frequencies, Hz.
    shape : (n_dof, n)
    """

    value: np.ndarray
    shape: np.ndarray


def interface_load(model: FEModel, name: str, force=(0.0, 0.0, 0.0), moment=(0.0, 0.0, 0.0)) -> np.ndarray:
    """Return the nodal load ``(n_dof,)`` of a force (N) and a moment (N m), mesh axes, on an interface.

    Returns
    -------
    (n_dof,) float
        Forces (N) and moments (N m) in the axes of the mesh.

    Raises
    ------
    InputError
        When the model has no such interface.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> interface_load(cantilever_model(), "tip", force=(0, -5.0, 0)).sum()
    np.float64(-5.0)
    """
    refuse_other("interface_load: the model", FEModel, model)
    frames = {frame.name: frame for frame in model.interfaces}
    refuse_unknown(name, frames, "interface")
    load = np.zeros(model.n_dof)
    load[frames[name].dofs] = np.concatenate([force, moment])
    return load


def acceleration_load(model: FEModel, acceleration) -> np.ndarray:
    """Return the nodal load ``(n_dof,)`` of a body in a field of acceleration (3,), m/s^2, such as gravity.

    For `buckling` and `prestressed_modes` use their `gravity` instead: nodal forces do not include the motion of
    eccentric mass, such as an offset, when its node rotates.

    Returns
    -------
    (n_dof,) float
        Forces (N) and moments (N m) in the axes of the mesh.

    References
    ----------
    Theory 2.2.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> model = cantilever_model()
    >>> bool(np.isclose(acceleration_load(model, (0, 0, -9.81))[2::6].sum(), -9.81 * model.rigid.m))
    True
    """
    refuse_other("acceleration_load: the model", FEModel, model)
    return model.g @ np.asarray(acceleration, dtype=float)


@one_numpy_thread(beside_mkl=True)
def buckling(
    model: FEModel,
    load: np.ndarray | None,
    modes: int = 1,
    *,
    gravity=(0.0, 0.0, 0.0),
    load_stiffness: csr_array | None = None,
) -> LoadedModes:
    """Return the lowest positive factors at which a load buckles the model with its fixed interfaces clamped.

    Linear: ``(K + factor Kg) x = 0`` with Kg of the static response to `load`.

    Parameters
    ----------
    model : FEModel
    load : (n_dof,) or None
        Nodal load, N and N m.
    modes : int
    gravity : (3,)
        Field of acceleration that loads all mass beside `load`, m/s^2, mesh axes.
    load_stiffness : (n_dof, n_dof) csr
        Of a load that turns with the structure (`follower_stiffness`); default none, loads keep their directions.

    Returns
    -------
    LoadedModes
        Factors on the load, ascending, and the shapes (n_dof, modes).

    Raises
    ------
    InputError
        When no multiple of the load makes the structure buckle.
    MechanismError
        When the clamped structure can move without strain.

    References
    ----------
    Theory 1.3.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> model = cantilever_model()
    >>> P = buckling(model, interface_load(model, "tip", force=(-1.0, 0, 0))).value[0]
    >>> round(float(P / (np.pi**2 * 1.4e4 / 400)), 3)  # Euler: pi^2 EI / (4 L^2)
    1.0
    """
    refuse_other("buckling: the model", FEModel, model)
    clamped, Kg, _ = _prestress(model, load, gravity, load_stiffness)
    mu, x = _largest(-Kg, clamped, modes)
    positive = mu > NO_BUCKLING
    if not np.any(positive):
        raise InputError("no multiple of this load buckles the structure, it only stiffens it; reverse the load")
    x = x[:, positive] * unique_signs(x[:, positive])
    return LoadedModes(value=1 / mu[positive], shape=model.C @ clamped.expand(x))


@one_numpy_thread(beside_mkl=True)
def prestressed_modes(
    model: FEModel,
    load: np.ndarray | None,
    modes: int = 10,
    *,
    gravity=(0.0, 0.0, 0.0),
    load_stiffness: csr_array | None = None,
) -> LoadedModes:
    """Return the lowest frequencies (Hz) and modes under a static load, fixed interfaces clamped.

    Besides the geometric stiffness they include the second-order terms of the mass: the mass of a structure deformed by
    its load moves differently in vibration (theory 4.7), computed in the span of the modes and `MORE` others. The
    shapes are orthonormal in that mass.

    Parameters
    ----------
    model : FEModel
    load : (n_dof,) or None
        Nodal load, N and N m.
    modes : int
    gravity : (3,)
        Field of acceleration that loads all mass beside `load`, m/s^2, mesh axes.
    load_stiffness : (n_dof, n_dof) csr
        Of a load that turns with the structure (`follower_stiffness`); default none, loads keep their directions.

    Returns
    -------
    LoadedModes
        Frequencies (Hz), ascending, and the shapes (n_dof, modes).

    Raises
    ------
    InputError
        When the load is beyond the buckling load.
    MechanismError
        When the clamped structure can move without strain.

    References
    ----------
    Theory 1.3 and 4.7.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> model = cantilever_model()
    >>> pulled = prestressed_modes(model, interface_load(model, "tip", force=(5.0, 0, 0)), 1)
    >>> free = prestressed_modes(model, np.zeros(model.n_dof), 1)
    >>> bool(pulled.value[0] > free.value[0])
    True
    """
    refuse_other("prestressed_modes: the model", FEModel, model)
    clamped, Kg, x = _prestress(model, load, gravity, load_stiffness)
    # of a structure that has buckled
    w2 = np.array([-1.0])
    phi = np.zeros((0, 1))
    try:
        count = min(modes + MORE, clamped.K_ii.shape[0])
        w2, phi, _ = lowest_modes((stored(clamped.K_ii) + Kg).tocsr(), clamped.M_ii, count)
    except AccuracyError:
        pass
    if np.any(w2 <= 0) or _largest(-Kg, clamped, 1)[0][0] >= 1:
        raise InputError("the structure buckles under this load: it has no frequencies; reduce the load")
    w2, turn = eigh(np.diag(w2), _moved_mass(clamped, x, phi))
    return LoadedModes(value=np.sqrt(w2[:modes]) / (2 * np.pi), shape=model.C @ clamped.expand(phi @ turn[:, :modes]))


def _moved_mass(clamped: Clamped, x: np.ndarray, phi: np.ndarray) -> np.ndarray:
    """Return the mass ``(n, n)`` of M-orthonormal interior modes about the static displacement ``x (n_dof,)``.

    Their motion is ``phi_k + Gamma(x, phi_k)``; ``phi_i M Gamma(x, phi_k)`` as in body/second_order.py.
    """
    model = clamped.model
    n = phi.shape[1]
    Phi = model.C @ clamped.expand(phi)
    y = model.C @ clamped.expand(clamped.factor.solve(clamped.M_ii @ phi))
    both = np.column_stack([x, Phi])
    work = -model.geometric_stiffness.project(y, model.M @ Phi, both)[:, 0, 1:]
    work += model.rotating_mass.project_modes(both, slice(1, None))[:, 0, 1:]
    motion = np.eye(n) + work
    return motion.T @ motion


def _prestress(
    model: FEModel, load: np.ndarray | None, gravity, follower: csr_array | None
) -> tuple[Clamped, csr_array, np.ndarray]:
    """Clamp every fixed interface; return the geometric stiffness of the interior DOFs, and the static displacement."""
    load = np.zeros(model.n_dof) if load is None else np.asarray(load, dtype=float)
    if load.shape != (model.n_dof,) or not np.all(np.isfinite(load)):
        raise InputError(f"a load needs {model.n_dof} finite numbers, one per DOF; this one has shape {load.shape}")
    field = np.concatenate([-np.asarray(gravity, dtype=float), np.zeros(9)])
    load = load + model.inertia_loads @ field
    clamped = clamp(model)
    x = np.zeros(clamped.K.shape[0])
    x[clamped.i] = clamped.factor.solve((model.C.T @ load)[clamped.i])
    d = model.C @ x
    Kg = model.geometric_stiffness(d, load) + model.rotating_mass(field)
    if follower is not None:
        Kg = Kg + _refused_size(follower, model.n_dof)
    return clamped, (model.C.T @ Kg @ model.C).tocsr()[clamped.i][:, clamped.i].tocsr(), d


def _refused_size(follower: csr_array, n: int) -> csr_array:
    """Return a load stiffness, or refuse one of another model."""
    if follower.shape != (n, n):
        raise InputError(f"load_stiffness has the shape {follower.shape}, the model {n} DOFs; make it of this model")
    return follower


def _largest(A: csr_array, clamped: Clamped, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Largest eigenvalues of ``A x = mu K x``, descending; zero A gives zeros.

    Where the factor of a long thin model is inaccurate `factorise` uses SuperLU.
    """
    size = A.shape[0]
    n = min(n, size)
    if size <= DENSE:
        mu, x = eigh(A.toarray(), clamped.K_ii.tocsr().toarray(), subset_by_index=(size - n, size - 1))
    elif A.nnz == 0 or not np.any(A.data):
        return np.zeros(n), np.zeros((size, n))
    else:
        mu, x = _by_factor(A, clamped.K_ii, clamped.factor, n)
        if not _are_rayleigh_quotients(A, clamped.K_ii, mu, x):
            mu, x = _by_factor(A, clamped.K_ii, factorise(clamped.K_ii, "superlu"), n)
        if not _are_rayleigh_quotients(A, clamped.K_ii, mu, x):
            raise AccuracyError(
                "buckling factors cannot be computed to three digits: the stiffness is too ill-conditioned for this "
                "long, thin structure; use beams or shells instead of solids, or fewer elements"
            )
    order = np.argsort(-mu)
    return mu[order], x[:, order]


def _by_factor(A: csr_array, K: csr_array, factor: Factor, n: int) -> tuple[np.ndarray, np.ndarray]:
    size = A.shape[0]
    inverse = LinearOperator((size, size), matvec=factor.solve, matmat=factor.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(size)
    return eigsh(A, n, K, Minv=inverse, which="LA", v0=start, ncv=min(size, 2 * n + 20))


def _are_rayleigh_quotients(A: csr_array, K: csr_array, mu: np.ndarray, x: np.ndarray) -> bool:
    """Whether the eigenvalues are the Rayleigh quotients of their vectors."""
    quotient = np.einsum("in,in->n", x, A @ x) / np.einsum("in,in->n", x, K @ x)
    return bool(np.all(np.abs(quotient - mu) <= QUOTIENT * np.abs(mu).max()))
