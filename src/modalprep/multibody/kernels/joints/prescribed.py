"""A joint of one axis whose motion is given: it moves along or about the axis, and has no speed of its own."""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline
from modalprep.multibody.kernels.algebra.tuples import get3
from modalprep.multibody.kernels.joints.single_axis import moved_along_axis


@compile_inline
def motion(link, prescribed, nx, y, turn):
    """See `weld.motion`; `prescribed` has position, rate and acceleration."""
    return moved_along_axis(link, turn, get3(prescribed))
