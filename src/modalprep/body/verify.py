"""Checks of a modal body against the finite-element model that it was reduced from."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator, eigsh

from modalprep.body.checks import IDENTITY, RIGID, Check, relative
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.mass import cross_moment, mass_matrix, rigid_mass_matrix
from modalprep.fe.assembly.geometric_stiffness import GeometricStiffness
from modalprep.fe.assembly.model import FEModel
from modalprep.linalg.blas import one_numpy_thread
from modalprep.linalg.congruent import bound
from modalprep.linalg.modes import DENSE
from modalprep.reduction.basis import Reduction
from modalprep.reduction.clamped import Clamped, clamp
from modalprep.reduction.prestress import NO_BUCKLING
from modalprep.suggest import refuse_other
from modalprep.vectors import skew

ENERGY = 1e-10  # sums of positive terms, each to 1e-13
BOUND = 1e-6  # how far round-off may reduce a Ritz value below that of the full model
PRESTRESS = 1e-6  # stiff parts on soft ones: their stress is a small difference of large rotations; 1e-9 was observed
BUCKLING = 0.1  # a basis that buckles within a tenth of the full model's load is adequate for design
SMALL = 1e-5  # of the largest geometric stiffness under comparable loads: below, it may be round-off (1e-12)
TURN = 1e-4  # displacement over the body's size, for finite differences
DIFFERENCE = 1e-5  # 1e-11 to 6e-9 was observed; ten times smaller steps have 1e-6 of round-off
TINY = np.finfo(float).tiny
SAME = 1e-9  # of the body's size: an interface on the root


@one_numpy_thread(beside_mkl=True)
def check_projection(model: FEModel, reduction: Reduction, body: FlexibleBody) -> list[Check]:
    """Check a body in its root frame against its model and reduction.

    Mass, momentum, the energy of a random motion, the static responses and the prestress of a random combination of
    loads, each evaluated with the matrices of the model.

    Returns
    -------
    list of Check
        One for each identity, with its relative residual and the limit.

    References
    ----------
    Theory 6.2.

    Examples
    --------
    >>> from modalprep.body.build import flexible_body
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> reduction = craig_bampton(model, modes=3)
    >>> all(check.within for check in check_projection(model, reduction, flexible_body(model, reduction, name="beam")))
    True
    """
    refuse_other("check_projection: the model", FEModel, model)
    refuse_other("check_projection: the reduction", Reduction, reduction)
    refuse_other("check_projection: the body", FlexibleBody, body)
    R = model.rigid_body()
    rng = np.random.default_rng(0)
    MR = model.M @ R
    mass = relative(rigid_mass_matrix(body.m, body.s0, body.E0), R.T @ MR)
    coupling = np.vstack([body.S, cross_moment(body.H)])
    inertia = np.einsum("ij,ij->j", R, MR)
    inertia[3:] = np.maximum(inertia[3:], 1e-12 * inertia[3:].max())  # that of a line of points about itself is zero
    scale = np.sqrt(inertia)[:, None]  # Cauchy-Schwarz: no entry exceeds it
    return [
        Check("mass matrix of the model", mass, IDENTITY, "m, s0, E0 of the body = R^T M R of the mesh"),
        Check(
            "momentum of the modes",
            relative(coupling / scale, MR.T @ reduction.basis / scale, floor=1.0),
            IDENTITY,
            "S and C of the body = R^T M Phi of the mesh",
        ),
        Check(
            "kinetic energy",
            _energy_error(model, reduction.basis, body, rng),
            ENERGY,
            "of a random motion, by M(q) of the body = by the mesh",
            required=model.M_ab.exact,
        ),
        Check("static responses", _unbalanced(model, reduction), RIGID, "forces of the unit loads balance"),
        Check(
            "prestress",
            _prestress_error(model, reduction, body, rng),
            PRESTRESS,
            "Kg of a random combination of loads, by the body = by the mesh",
        ),
    ]


def _energy_error(model: FEModel, Phi: np.ndarray, body: FlexibleBody, rng: np.random.Generator) -> float:
    """Velocity ``v + w x (x + Phi q) + Phi q'`` of the mesh against the body's M(q), without second order."""
    size = np.ptp(model.points, axis=0).max()
    w = rng.standard_normal(3)
    q, qd = size * np.sqrt(body.m / max(body.n, 1)) * rng.standard_normal((2, body.n))
    V = np.concatenate([size * rng.standard_normal(3), w])
    u = Phi @ q
    y = model.rigid_body() @ V + Phi @ qd
    tensor = model.M_ab.project(np.stack([y, u], axis=1))
    spin = skew(w)
    energy = (
        0.5 * y @ (model.M @ y) + np.sum(spin * tensor[..., 0, 1]) + 0.5 * np.sum((spin.T @ spin) * tensor[..., 1, 1])
    )
    speeds = np.concatenate([V, qd])
    return abs(0.5 * speeds @ mass_matrix(body.conventional(), q) @ speeds / energy - 1)


def _unbalanced(model: FEModel, reduction: Reduction) -> float:
    """Return the residual force at the independent DOFs except the root's, relative to loads and elastic terms."""
    loose = reduction.basis[:, reduction.frequency == 0]  # mechanisms balance their load by inertia
    loads = reduction.loads - model.M @ (loose @ (loose.T @ reduction.loads))
    force = model.C.T @ (model.K @ reduction.static - loads)
    terms = abs(model.C).T @ (bound(model.K, reduction.static) + np.abs(loads))
    force[np.searchsorted(model.free, model.interfaces[0].dofs)] = 0.0
    return float(np.max(np.abs(force).max(axis=0) / np.maximum(terms.max(axis=0), TINY), initial=0.0))


def _prestress_error(model: FEModel, reduction: Reduction, body: FlexibleBody, rng: np.random.Generator) -> float:
    """Kg of one random combination of the unit loads, on random displacements; with equal weight of each load."""
    if not body.has_geometric_stiffness:
        return 0.0
    Kg = _unit_load_matrices(body)
    c = _combination(model, Kg, rng)
    z = rng.standard_normal((body.n, 3))
    x = reduction.basis @ z
    Kg_model = model.geometric_stiffness(reduction.static @ c, reduction.loads @ c) + model.rotating_mass(c[:12])
    full = x.T @ (Kg_model @ x)
    return relative(z.T @ np.tensordot(c, Kg, 1) @ z, (full + full.T) / 2, floor=float(np.sum(c != 0)))


def _unit_load_matrices(body: FlexibleBody) -> np.ndarray:
    """``Kg (12 + 6 n_if, n, n)`` in the order of the reduction's loads."""
    at_interfaces = np.concatenate([body.Kg_F, body.Kg_T], axis=1)
    return np.concatenate([x.reshape(-1, body.n, body.n) for x in (body.Kg_A, body.Kg_W, at_interfaces)])


@one_numpy_thread(beside_mkl=True)
def check_geometric_stiffness(model: FEModel, reduction: Reduction, body: FlexibleBody) -> list[Check]:
    """Compare the body's geometric stiffness with finite differences of the nonlinear strain energy of the mesh.

    For a random combination of the unit loads and a random motion y of the modes: the potential energy at
    ``s d + t y``, with finite rotations of elements, links and arms, has the third derivative
    ``y Kg(d) y + 2 d Kg(y) y`` by s, t, t.
    Solids follow Green's strain, beams and shells the strain against their own axes.

    Examples
    --------
    >>> from modalprep.body.build import flexible_body
    >>> from modalprep.examples import cantilever_model
    >>> from modalprep.reduction.craig_bampton import craig_bampton
    >>> model = cantilever_model()
    >>> reduction = craig_bampton(model, modes=3)
    >>> body = flexible_body(model, reduction, name="beam")
    >>> [check.within for check in check_geometric_stiffness(model, reduction, body)]
    [True]
    """
    prestress = model.geometric_stiffness
    if not (body.has_geometric_stiffness and isinstance(prestress, GeometricStiffness)):
        return []
    Kg = _unit_load_matrices(body)
    c = _combination(model, Kg, np.random.default_rng(0))
    z = np.random.default_rng(1).standard_normal(body.n)
    z /= np.sqrt(np.where(body.K > 0, body.K, np.inf))
    d, y = reduction.static @ c, reduction.basis @ z
    size = np.ptp(model.points, axis=0).max()
    unit = [TURN * size / np.abs(x[model.dof[:, :3]]).max() for x in (d, y)]
    c, d, y, z = unit[0] * c, unit[0] * d, unit[1] * y, unit[1] * z

    def potential(s: float, t: float) -> float:
        moved = prestress.links.constraints.with_dependent(s * d + t * y)
        work = reduction.loads @ c @ (moved - s * d - t * y) + model.rotating_mass.work(s * d + t * y, c[:12])
        return prestress.energy(moved) - s * work

    found = _third(potential)
    own = z @ np.tensordot(c, Kg, 1) @ z
    beside = 2 * d @ (prestress(y, np.zeros_like(y)) @ y)
    error = relative(own + beside, found, floor=abs(own) + abs(beside))
    meaning = "Kg of a random combination of loads = finite difference of the nonlinear strain energy"
    return [Check("energy of second order", error, DIFFERENCE, meaning)]


def _combination(model: FEModel, Kg: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """Return factors ``(k,)`` of random sign that weight all loads equally, those with the least Kg less."""
    length = np.ptp(model.points, axis=0).max()
    m = model.rigid.m
    unit = np.concatenate([[m] * 3, [m * length] * 9, np.tile(np.repeat([1.0, 1 / length], 3), len(Kg[12:]) // 6)])
    size = np.abs(Kg).max(axis=(1, 2), initial=0.0)
    floor = SMALL * unit * np.max(size / unit, initial=0.0)
    return np.where(size > 0, rng.choice([-1.0, 1.0], len(Kg)) / np.maximum(np.maximum(size, floor), TINY), 0.0)


def _third(f: Callable[[float, float], float]) -> float:
    """Return the derivative of f by s, t, t at 0, to the fourth order of the steps."""

    def curvature(s: float) -> float:
        return (16 * (f(s, 1) + f(s, -1)) - f(s, 2) - f(s, -2) - 30 * f(s, 0)) / 12

    return (8 * (curvature(1) - curvature(-1)) - curvature(2) + curvature(-2)) / 12


def check_buckling(model: FEModel, body: FlexibleBody) -> list[Check]:
    """Compare the buckling loads of body and model under compression from each interface to the clamped root.

    By Rayleigh and Ritz the body's load is the higher one; the excess measures the quality of the basis. Bodies that
    their root does not constrain and interfaces whose compression does not buckle the model are skipped.

    Returns
    -------
    list of Check
        One for each interface that can be pushed.

    References
    ----------
    Theory 6.2.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model, uniform_beam
    >>> for check in check_buckling(cantilever_model(elements=40), uniform_beam(modes=3)):
    ...     print(check.meaning)
    the body does not buckle below the mesh when 'tip' is pushed towards the root
    347.4 N on 'tip', of the mesh 345.4 N
    """
    refuse_other("check_buckling: the model", FEModel, model)
    refuse_other("check_buckling: the body", FlexibleBody, body)
    clamped = clamp(model)
    if clamped.mechanisms.shape[1]:
        return []
    found = []
    for k, frame in enumerate(model.interfaces[1:], start=1):
        distance = np.linalg.norm(frame.position)
        if distance <= SAME * np.ptp(model.points, axis=0).max():
            continue
        push = -frame.position / distance
        load = np.zeros(model.n_dof)
        load[frame.dofs[:3]] = push
        full = _buckling(model, clamped, load)
        own = _modal_buckling(body, np.tensordot(push, body.Kg_F[k], 1))
        if full is None:
            continue
        found += [
            Check(
                f"buckling bound {frame.name}",
                max(0.0, 1 - own / full),
                BOUND,
                f"the body does not buckle below the mesh when {frame.name!r} is pushed towards the root",
            ),
            Check(
                f"buckling load {frame.name}",
                own / full - 1,
                BUCKLING,
                f"{own:.4g} N on {frame.name!r}, of the mesh {full:.4g} N",
                required=False,
            ),
        ]
    return found


def _buckling(model: FEModel, clamped: Clamped, load: np.ndarray) -> float | None:
    """Lowest factor on a load that buckles the model with only its root clamped; None where none does."""
    Kg = model.C.T @ model.geometric_stiffness(clamped.static(load[:, None])[:, 0], load) @ model.C
    s = np.delete(np.arange(clamped.K.shape[0]), clamped.b[:6])
    K, A = (csr_array(x.tocsr()[s][:, s]) for x in (clamped.K, -(Kg + Kg.T) / 2))
    if len(s) <= DENSE:
        mu = eigh(A.toarray(), K.toarray(), eigvals_only=True, subset_by_index=(len(s) - 1, len(s) - 1))
    else:

        def solve(f: np.ndarray) -> np.ndarray:
            x = np.zeros((clamped.K.shape[0], 1))
            x[s, 0] = f.ravel()
            return clamped.static_free(x)[s, 0]

        inverse = LinearOperator(K.shape, matvec=solve, dtype=float)
        start = np.random.default_rng(0).standard_normal(len(s))
        mu = eigsh(A, 1, K, Minv=inverse, which="LA", v0=start, return_eigenvectors=False)
    return 1 / mu[0] if mu[0] > NO_BUCKLING else None


def _modal_buckling(body: FlexibleBody, Kg: np.ndarray) -> float:
    """Lowest factor of ``K + factor Kg`` by the flexibility, whose round-off is relative to the softest mode."""
    soft = 1 / np.sqrt(body.K)
    mu = np.linalg.eigvalsh(-Kg * soft * soft[:, None]).max(initial=0.0)
    return 1 / mu if mu > 0 else np.inf
