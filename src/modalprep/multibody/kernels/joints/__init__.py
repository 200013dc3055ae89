"""Joints in the recursions: how each kind moves, and how its speeds are eliminated (theory 5.1 and 5.2).

A kind of `model.joint_types.KINDS` is a file of this folder; here a branch for each is made of them. In all functions
`link` is a record of `Model.links`, `own` its record of `Data.links`. The motion subspace S holds the speeds'
directions in the link's frame. The functions of a file, of which it may leave out those that are as of a weld:

- ``motion(link, prescribed, nx, y, turn)``: what the joint adds to the motion of the frame it stands in;
- ``rates(link, nx, y, ydot)``: writes the time derivatives of its coordinates to ``ydot``;
- ``along(link, speeds, linear, angular)``: (linear, angular) with ``S speeds (nu,)`` added;
- ``project(link, wrench, out)``: writes the generalised forces ``S' wrench`` to ``out (nu,)``;
- ``eliminate(link, own, B, P, tau, added, grounded)``: takes the joint out of the inertia of its link;
- ``response(link, own, P, tau)``: ``S D^-1 (tau - S' P)`` after `eliminate`;
- ``accelerations(link, own, base, linear, angular, tau, udot, biases)``: writes the accelerations of its speeds;
- ``normalise(link, y)``: scales its quaternion to unit length;
- ``move(link, y, d, out)``: moves its coordinates by increments ``d (nu,)`` of its speeds' directions.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.kernels.joints import weld
from modalprep.multibody.kernels.joints.single_axis import along_axis as along_axis
from modalprep.multibody.kernels.joints.single_axis import column as column
from modalprep.multibody.model.joint_types import KINDS, TRANSLATIONAL


def _by_kind(name: str) -> Callable:
    """Return the compiled function that does what `name` of the file of a link's kind does."""
    chosen = getattr(weld, name)
    for file in dict.fromkeys(kind.file for kind in reversed(KINDS)):
        codes = tuple(code for code, kind in enumerate(KINDS) if kind.file == file)
        own = getattr(import_module(f"{__name__}.{file}"), name, None)
        if own is not None and file != "weld":
            chosen = _either(codes, own, chosen)
    return chosen


def _either(codes: tuple[int, ...], own: Callable, others: Callable) -> Callable:
    @compile_inline
    def choose(link, *given):
        if link.joint in codes:
            return own(link, *given)
        return others(link, *given)

    return choose


joint_motion = _by_kind("motion")
joint_rates = _by_kind("rates")
along_joint = _by_kind("along")
joint_force = _by_kind("project")
joint_direction = _by_kind("direction")
eliminate_joint = _by_kind("eliminate")
speeds_from_bias = _by_kind("response")
joint_accelerations = _by_kind("accelerations")
_normalise = _by_kind("normalise")
_move = _by_kind("move")


@compile_inline
def translations(link):
    """Return how many speeds of a link's joint, its first ones, are translations; the others are rotations."""
    return 0 if link.about != 0.0 else TRANSLATIONAL[link.joint]


@compile_inline
def is_turn(link, u):
    """Whether speed u of a link's joint turns it, and does not shift it."""
    return u >= link.u + translations(link)


@compile_kernel
def normalise(model, y):
    """Scale all quaternions of y to unit length."""
    for i in range(len(model.links)):
        _normalise(model.links[i], y)


@compile_kernel
def move(model, y, d, out):
    """Move coordinates y by increments ``d (nu,)``, to `out` or in place: exponentials where a joint turns freely."""
    for i in range(len(model.links)):
        link = model.links[i]
        for a in range(link.modes):
            out[link.xq + a] = y[link.xq + a] + d[link.uq + a]
        _move(link, y, d, out)
