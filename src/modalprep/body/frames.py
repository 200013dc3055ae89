"""A modal body in other frames: shifted and rotated, in mean axes, or with another root interface.

Every function returns a body that describes the same motions. Shift and rotation are exact. A frame that moves
relative to the old one (`in_mean_axes`, `reroot`) follows a rigid motion ``-a q`` of it, so that ``phi' = phi + R a``
with ``R = [1, -x~]``. A rotating frame also has displacements of second order (u the first order in the new frame),

``u2' = u2 + (a_r q) x u - (a_r q) x ((a_r q) x x) / 2 - d2 - theta2 x x``,

which is what the geometric stiffness stores: ``int rho u2``, ``int rho x_b u2`` and ``u2`` at the interfaces
(theory 4). d2 and theta2 are the frame's own motion of second order, found as its first order is: the new
root remains at rest, or the mean axes remain mean axes. A load is then reacted there, and no further static response is
needed.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from modalprep.body.flexible_body import AXES, ORIGIN, FlexibleBody
from modalprep.body.mass import cross_moment, rigid_mass_matrix
from modalprep.body.recovery_matrices import recovery_in_frame
from modalprep.body.stations.record import refuse_stations
from modalprep.errors import InputError
from modalprep.linalg.ritz import ritz
from modalprep.linalg.unique import unique_signs
from modalprep.reduction.dampers import damping_in_basis
from modalprep.suggest import refuse_other, suggestion
from modalprep.vectors import skew

SKEW = skew(np.eye(3))  # SKEW[c, a, d] r_c x_d = (r x x)_a


class Moments(NamedTuple):
    """Moments of a displacement field per coordinate, or per pair of coordinates: ``(...)`` is (n,) or (n, n).

    ``int rho u_a (3, ...)``, ``int rho x_b u_a (3, 3, ...)``, translation and rotation of the interfaces
    ``(n_if, 3, ...)``.
    """

    S: np.ndarray
    H: np.ndarray
    phi: np.ndarray
    psi: np.ndarray


Follow = Callable[[Moments], np.ndarray]  # rigid motion (6, ...) of a frame that follows a field


def in_frame(body: FlexibleBody, *, origin: np.ndarray, axes: np.ndarray | None = None, name: str = "") -> FlexibleBody:
    """Describe a body in a frame fixed in its own, with another origin or axes; the coordinates do not change.

    Parameters
    ----------
    origin : (3,)
        m, in the frame of the body.
    axes : (3, 3)
        Columns are the new axes in the old ones; default unrotated.
    name : str
        Description of the new origin for `FlexibleBody.frame`; default its old coordinates.

    Returns
    -------
    FlexibleBody
        Of the same coordinates, vectors and places in the new axes.

    Raises
    ------
    InputError
        When the axes are not those of a rotation.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> in_frame(uniform_beam(modes=1), origin=np.array([10.0, 0, 0])).s0
    array([-60.,   0.,   0.])
    """
    refuse_other("in_frame: the body", FlexibleBody, body)
    refuse_stations("another frame of a body", body.stations)
    c = np.asarray(origin, dtype=float)
    Q = np.eye(3) if axes is None else np.asarray(axes, dtype=float)
    if Q.shape != (3, 3) or np.abs(Q.T @ Q - np.eye(3)).max() > 1e-9 or np.linalg.det(Q) < 0:
        raise InputError("axes are not a rotation: give three orthogonal unit columns, right-handed")
    S, H, Kg_A, Kg_W = _shifted(body, c)
    s0 = body.s0 - body.m * c
    E0 = body.E0 - np.outer(c, body.s0) - np.outer(body.s0, c) + body.m * np.outer(c, c)
    turned = {name: np.einsum("ia,i...->a...", Q, array) for name, array in {"s0": s0, "S": S, "Kg_A": Kg_A}.items()}
    for key, array in {"E0": E0, "H": H, "P": body.P, "Kg_W": Kg_W}.items():
        turned[key] = np.einsum("ia,jb,ij...->ab...", Q, Q, array, optimize=True)
    for key in ("Kg_F", "Kg_T", "phi", "psi", "shape"):
        turned[key] = np.einsum("ia,ki...->ka...", Q, getattr(body, key))
    said = {"origin": name or f"origin at {c.tolist()} m of the former frame"} | (
        {} if axes is None else {"axes": "axes turned"}
    )
    turned["interface_position"] = (body.interface_position - c) @ Q
    turned["points"] = (body.points - c) @ Q
    for key in ("stress", "recovery"):
        turned[key] = {name: at.in_frame(c, Q) for name, at in getattr(body, key).items()}
    return _relabelled(body.with_(**turned), said)


def _shifted(body: FlexibleBody, c: np.ndarray) -> tuple[np.ndarray, ...]:
    """S, H, Kg_A, Kg_W about the new origin c: ``x_b - c_b`` replaces ``x_b``."""
    H = body.H - np.einsum("an,b->abn", body.S, c)
    return body.S, H, body.Kg_A, body.Kg_W - np.einsum("aij,b->abij", body.Kg_A, c)


def at_centre_of_mass(body: FlexibleBody) -> FlexibleBody:
    """Move the origin to the centre of mass of the undeformed body; the frame still moves with the root interface.

    Returns
    -------
    FlexibleBody
        Of the same modal coordinates, axes parallel to the former ones.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = at_centre_of_mass(uniform_beam(modes=1))
    >>> round(float(body.E0[0, 0]), 6), body.interface_position[:, 0]
    (100.0, array([-5.,  5.]))
    """
    refuse_other("at_centre_of_mass: the body", FlexibleBody, body)
    return in_frame(body, origin=body.s0 / body.m, name="origin at the centre of mass")


def in_principal_axes(body: FlexibleBody) -> FlexibleBody:
    """Move the frame to the centre of mass and rotate it to the principal axes, smallest moment first.

    Returns
    -------
    FlexibleBody
        Of the same modal coordinates.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = in_principal_axes(uniform_beam(modes=1))
    >>> body.frame
    'origin at the centre of mass, principal axes'
    """
    refuse_other("in_principal_axes: the body", FlexibleBody, body)
    centred = at_centre_of_mass(body)
    _, axes = np.linalg.eigh(np.trace(centred.E0) * np.eye(3) - centred.E0)
    axes = axes * unique_signs(axes)
    axes[:, 2] = np.cross(axes[:, 0], axes[:, 1])
    turned = in_frame(centred, origin=np.zeros(3), axes=axes)
    return _relabelled(turned, {"origin": "origin at the centre of mass", "axes": "principal axes"})


def in_mean_axes(body: FlexibleBody) -> FlexibleBody:
    """Describe a body in its mean axes at the centre of mass: the frame of a free body (Tisserand, Buckens).

    ``int rho phi = 0`` and ``int rho x cross phi = 0``, so that the mass matrix has no coupling at rest and the
    coordinates are the free-free modes of the reduced body, with their frequencies. No interface is at rest in
    this frame, the former root included: in a multibody system only a free joint can carry such a body.

    The geometric stiffness is that of loads balanced by the body's own inertia: ``Kg_A = 0``. Modal damping keeps the
    diagonal of the transformed damping matrix, with dampers between modes the whole. The reduction's table of modes
    loses its effective masses, which are those of the former root.

    Returns
    -------
    FlexibleBody
        Its frame at the centre of mass, parallel to the former one.

    Raises
    ------
    InputError
        When the body has no rotary inertia about some axis, as a line of points.

    References
    ----------
    J. R. Canavin, P. W. Likins, Floating reference frames for flexible spacecraft, J. Spacecraft 14 (1977) 724.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = in_mean_axes(uniform_beam(modes=8))
    >>> bool(abs(body.S).max() < 1e-9), body.frame
    (True, 'mean axes at the centre of mass, axes of the mesh')
    """
    refuse_other("in_mean_axes: the body", FlexibleBody, body)
    centred = at_centre_of_mass(body)
    rigid = rigid_mass_matrix(centred.m, np.zeros(3), centred.E0)
    moments = np.linalg.eigvalsh(rigid[3:, 3:])
    if not moments[0] > 1e-12 * moments[2]:
        raise InputError(
            f"body {body.name!r} is a line without rotary inertia: it has no mean axes; keep its root frame"
        )

    def rigid_motion(field: Moments) -> np.ndarray:
        momentum = np.concatenate([field.S, cross_moment(field.H)])
        return np.linalg.solve(rigid, momentum.reshape(6, -1)).reshape(momentum.shape)

    return _relabelled(_following(centred, rigid_motion), {"origin": "mean axes at the centre of mass"})


def reroot(body: FlexibleBody, interface: str) -> FlexibleBody:
    """Describe a body in the frame of another of its interfaces, which becomes the root.

    The span of displacements stays; the coordinates become its modes with the new root clamped. It leads back from any
    other frame. Modal damping keeps the diagonal of the transformed matrix, with dampers between modes the whole, and
    the table loses its effective masses.

    A mesh reduced with the other root gives the same body when it spans the same motions, as Craig-Bampton does with
    every interface fixed. For beams and shells Kg_A, Kg_W and T of the former root are kept; they depend on the root
    by the square of the element's length (an arch of 40 elements: 0.13 % in the three lowest modes).

    Returns
    -------
    FlexibleBody
        Its frame at that interface, parallel to the former one.

    Raises
    ------
    InputError
        When the body has no such interface.

    References
    ----------
    Theory 3.5, also on the difference between two frames, which is the square of the deflection.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> body = reroot(uniform_beam(modes=8), "tip")
    >>> body.interface_name, body.interface_position[:, 0].tolist(), float(abs(body.phi[0]).max())
    (('tip', 'root'), [0.0, -10.0], 0.0)
    """
    refuse_other("reroot: the body", FlexibleBody, body)
    if interface not in body.interface_name:
        hint = suggestion(interface, body.interface_name, "it has")
        raise InputError(f"body {body.name!r} has no interface {interface!r}; {hint}")
    at = body.interface_position[k := body.interface_name.index(interface)]

    def rigid_motion(field: Moments) -> np.ndarray:
        turn = field.psi[k]
        return np.concatenate([field.phi[k] - np.einsum("cad,c...,d->a...", SKEW, turn, at), turn])

    moved = in_frame(_following(body, rigid_motion), origin=at, name=ORIGIN)
    order = [k, *(j for j in range(len(body.interface_name)) if j != k)]
    per_interface = {key: getattr(moved, key)[order] for key in ("phi", "psi", "Kg_F", "Kg_T", "interface_position")}
    for array in per_interface.values():
        array[0] = 0.0  # round-off
    return moved.with_(**per_interface, interface_name=tuple(body.interface_name[j] for j in order))


def _following(body: FlexibleBody, rigid_motion: Follow) -> FlexibleBody:
    """Change to a frame that follows the deformation, and to the modes of that frame."""
    refuse_stations("a frame that follows the deformation", body.stations)
    old = Moments(body.S, body.H, body.phi, body.psi)
    a = -rigid_motion(old)
    t = a[:3]
    B = np.einsum("cad,cn->adn", SKEW, a[3:])
    S, H, phi, psi = first = Moments(*(x + y for x, y in zip(old, _rigid(body, a), strict=True)))
    P = body.P + np.einsum("ai,bj->abij", body.S, t) + np.einsum("adi,bdj->abij", body.H, B)
    P = P + np.einsum("ai,bj->abij", t, S) + np.einsum("adi,bdj->abij", B, H)
    Y, w2 = _modes(body.K, P[0, 0] + P[1, 1] + P[2, 2])
    shape = body.shape + t + np.einsum("adn,kd->kan", B, body.points)
    motion = np.concatenate([shape, psi])  # torsion of a line of nodes has rotations only
    Y = Y * unique_signs(motion.reshape(3 * len(motion), body.n) @ Y)
    changed = {"S": S, "H": H, "phi": phi, "psi": psi, "shape": shape}
    changed = {key: array @ Y for key, array in changed.items()} | {"P": Y.T @ P @ Y}
    if body.has_geometric_stiffness:
        seen = _second_order(body, a, first)
        turn = rigid_motion(seen)
        second = Moments(*(x - y for x, y in zip(seen, _rigid(body, turn), strict=True)))
        forms = {"Kg_A": second.S, "Kg_W": second.H, "Kg_F": -second.phi, "Kg_T": -second.psi}
        changed |= {key: Y.T @ form @ Y for key, form in forms.items()}
        if body.T is not None:
            T = _mass_growth(body, a, first, P, turn)
            changed["T"] = np.einsum("ijk,ix,jy,kz->xyz", T, Y, Y, Y, optimize=True)
    changed["stress"] = {name: at.in_basis(Y) for name, at in body.stress.items()}
    changed |= recovery_in_frame(body.recovery, body.provenance, a, Y)
    changed["truncation"] = body.truncation @ Y**2 / np.sum(Y**2, axis=0)
    return body.with_(**changed, K=w2, **damping_in_basis(body, Y), frequency=np.sqrt(w2) / (2 * np.pi))


def _rigid(body: FlexibleBody, a: np.ndarray) -> Moments:
    """Moments of the rigid motions ``a (6, ...)``: translation, then rotation about the origin."""
    t = a[:3]
    B = np.einsum("cad,c...->ad...", SKEW, a[3:])
    H = np.einsum("a...,b->ab...", t, body.s0) + np.einsum("ad...,db->ab...", B, body.E0)
    S = body.m * t + np.einsum("ad...,d->a...", B, body.s0)
    phi = t + np.einsum("ad...,kd->ka...", B, body.interface_position)
    return Moments(S, H, phi, np.broadcast_to(a[3:], phi.shape))


def _second_order(body: FlexibleBody, a: np.ndarray, first: Moments) -> Moments:
    """Twice the moments of u2' without d2 and theta2, as quadratic forms ``(..., n, n)`` of the old coordinates.

    The rotation of an interface after that of the frame is ``psi - theta - theta x psi / 2`` to second order.
    """
    B = np.einsum("cad,cn->adn", SKEW, a[3:])
    turn = _rigid(body, np.concatenate([np.zeros_like(a[:3]), a[3:]]))
    S, H, phi = (u - x / 2 for u, x in zip(first[:3], turn[:3], strict=True))
    return Moments(
        body.Kg_A + _twice(np.einsum("adi,dj->aij", B, S)),
        body.Kg_W + _twice(np.einsum("adi,dbj->abij", B, H)),
        -body.Kg_F + _twice(np.einsum("adi,kdj->kaij", B, phi)),
        -body.Kg_T + _twice(np.einsum("adi,kdj->kaij", B, first.psi)) / 2,
    )


def _mass_growth(body: FlexibleBody, a: np.ndarray, first: Moments, P: np.ndarray, turn: np.ndarray) -> np.ndarray:
    """T in the new frame and the old coordinates: ``int rho phi'_i`` times twice u2'.

    `P (3, 3, n, n)` is that of the new frame, `turn (6, n, n)` twice d2 and theta2.
    """
    B, B2 = (np.einsum("cad,c...->ad...", SKEW, x[3:]) for x in (a, turn))
    T = body.T + np.einsum("ai,ajk->ijk", a[:3], body.Kg_A) + np.einsum("abi,abjk->ijk", B, body.Kg_W)
    swings = np.einsum("abj,abik->ijk", B, P) - np.einsum("abj,bck,aci->ijk", B, B, first.H, optimize=True) / 2
    T = T + _twice(swings)
    return T - np.einsum("ai,ajk->ijk", first.S, turn[:3]) - np.einsum("abi,abjk->ijk", first.H, B2)


def _twice(form: np.ndarray) -> np.ndarray:
    return form + np.swapaxes(form, -1, -2)


def _modes(K: np.ndarray, M: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """M-orthonormal modes ``Y (n, n)`` of ``diag(K) (n,)`` and ``M (n, n)``, and ``w^2 (n,)``; mechanisms first."""
    unit = np.eye(len(K))
    loose = K == 0
    rigid = unit[:, loose] @ np.linalg.inv(np.linalg.cholesky(M[np.ix_(loose, loose)])).T
    w2, Y = ritz(unit[:, ~loose], csr_array(np.diag(K)), csr_array((M + M.T) / 2), rigid)
    return Y, w2


def _relabelled(body: FlexibleBody, said: dict[str, str]) -> FlexibleBody:
    """Set the frame's description; drop effective masses, which belong to the frame of the reduction."""
    said = {key: text for key, text in said.items() if text not in (ORIGIN, AXES)}
    kept = {key: text for key, text in body.provenance.items() if key != "origin"}
    total = rigid_mass_matrix(body.m, body.s0, body.E0).diagonal()
    modes = body.modes.with_(
        total=total, effective_mass=np.full_like(body.modes.effective_mass, np.nan), held_mass=None
    )
    return body.with_(modes=modes, provenance={**kept, **said})
