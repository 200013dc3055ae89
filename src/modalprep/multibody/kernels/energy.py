"""Energies and momenta of one body, after `articulated_body.outward` and `interfaces.world`."""

from __future__ import annotations

from typing import NamedTuple

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.algebra.matrices import (
    first_moment,
    inertia_times,
    times,
    transposed_times,
)
from modalprep.multibody.kernels.algebra.tuples import (
    add3,
    axpy3,
    cross,
    dot3,
    get3,
    get9,
)
from modalprep.multibody.kernels.interfaces import seen_spin
from modalprep.multibody.kernels.modal import modal_energies, modal_momenta


class Sums(NamedTuple):
    """Energies (J), `gravity` that of a uniform field, and momenta (3 numbers each) about the inertial origin."""

    kinetic: float
    strain: float
    gravity: float
    linear: tuple[float, float, float]
    angular: tuple[float, float, float]


@compile_inline
def body_momenta(model, data, link, v, w):
    """Return the momenta of a link's body in its axes, the angular one about its origin: ``M V`` after `outward`.

    Parameters
    ----------
    v, w : velocity of the origin and angular velocity of the link, in its axes

    Returns
    -------
    linear, angular : in all
    linear, angular : the share of the modes
    """
    own = data.links[link]
    b = inertia_times(own.M, own.H, own.J, (v[0], v[1], v[2], w[0], w[1], w[2]))
    linear, angular = modal_momenta(data.modal, model, link)
    return add3(linear, (b[0], b[1], b[2])), add3(angular, (b[3], b[4], b[5])), linear, angular


@compile_kernel
def body_sums(model, data, link):
    """Return the `Sums` of a link's body: ``T = V' M V / 2`` with the mass matrix of `outward`."""
    own = data.links[link]
    w = seen_spin(data, link)
    base = get9(own.orientation)
    p = get3(own.position)
    v = transposed_times(base, get3(own.velocity))
    linear, angular, of_modes, about_modes = body_momenta(model, data, link, v, w)
    modal, strain = modal_energies(data.modal, model, link)
    kinetic = 0.5 * (dot3(v, add3(linear, of_modes)) + dot3(w, add3(angular, about_modes)) + modal)
    first = times(base, first_moment(own.H))
    linear, angular = times(base, linear), times(base, angular)
    gravity = -dot3(get3(model.gravity), axpy3(first, own.mass, p))
    return Sums(kinetic, strain, gravity, linear, add3(cross(p, linear), angular))
