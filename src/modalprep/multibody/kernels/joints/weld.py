"""A weld: no speeds; of a joint with speeds, what is left when they are eliminated."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.inertia_blocks import blocks, parts, rotated
from modalprep.multibody.kernels.algebra.matrices import inertia_times, times
from modalprep.multibody.kernels.algebra.tuples import ZERO3, ZERO6, add6, get6, get9


@compile_inline
def motion(link, prescribed, nx, y, turn):
    """Return the motion that a joint adds to the frame it stands in; `turn` rotates that to the parent link's axes.

    Returns
    -------
    turn : rotation of the link to the parent link's axes
    offset : translation, parent link's axes
    rate : of the translation, link's axes
    spin : angular velocity, link's axes
    extra : acceleration that prescribed motions and turning axes add, link's axes
    """
    return turn, ZERO3, ZERO3, ZERO3, ZERO6


@compile_inline
def rates(link, nx, y, ydot):
    """Write nothing: there is no coordinate."""


@compile_inline
def along(link, speeds, linear, angular):
    """Return (linear, angular) with ``S speeds (nu,)`` added."""
    return linear, angular


@compile_inline
def direction(link, s):
    """Return the velocity (linear, angular) that a unit of speed s of a joint gives, link's axes."""
    return ZERO3, ZERO3


@compile_inline
def project(link, wrench, out):
    """Write nothing: there is no speed."""


@compile_inline
def eliminate(link, own, B, P, tau, added, grounded):
    """Return inertia and bias force of a link with its joint eliminated, in the parent link's axes.

    ``I - I S D^-1 S' I`` and ``P + I b + I S D^-1 (tau - S' (P + I b))`` with ``D = S' I S + added``.

    Parameters
    ----------
    B : inertia I by axes, as the result
    P : bias force
    added : (nu,) or None, to the diagonal of the joint's inertia
    grounded : whether the link is on the ground, so that only what its accelerations need is found

    Returns
    -------
    positive : bool
        Whether D is; without it nothing else counts.
    B, force, torque
    """
    if grounded:
        return True, B, ZERO3, ZERO3
    M, H, J = parts(B)
    return to_parent(own, M, H, J, P)


@compile_inline
def to_parent(own, M, H, J, P):
    """Return True, and inertia and bias force of a link without speeds in the parent link's axes, ``I b`` added."""
    turn = get9(own.rotation)
    P = add6(P, inertia_times(M, H, J, get6(own.bias)))
    force, torque = times(turn, (P[0], P[1], P[2])), times(turn, (P[3], P[4], P[5]))
    return True, rotated(turn, blocks(M, H, J)), force, torque


@compile_inline
def response(link, own, P, tau):
    """Return ``S D^-1 (tau - S' P)``: the acceleration of the joint by its bias force, after `eliminate`."""
    return ZERO6


@compile_inline
def accelerations(link, own, base, linear, angular, tau, udot, biases):
    """Write ``udot = D^-1 (tau - S' (P + I A))`` of a joint for the acceleration A that its link has without.

    Returns the acceleration (linear, angular) with the joint's own. A joint of one axis takes A from the acceleration
    `base` of its frame on the parent, parent link's axes, which need not wait; `biases` is 0 where they do not count.
    """
    return linear, angular


@compile_inline
def normalise(link, y):
    """Leave y: there is no quaternion."""


@compile_inline
def move(link, y, d, out):
    """Move nothing: there is no coordinate."""
