"""The outward half of the derivatives from a state in one call: kinematics, inverse dynamics, and their derivatives."""

from __future__ import annotations

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.articulated_body import outward
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.multibody.kernels.tangents.outward import outward_tangents


@compile_kernel
def tangents_from_state(model, data, work, y, motion, udot, force):
    """Write the motion of all links and its derivatives to the work, what accelerations ``udot`` need to ``force``.

    Loads are none; what else acts may be added to the wrenches of the work before `inward_tangents`.
    """
    outward(model, data, y, motion)
    required_forces(model, data, udot, force)
    outward_tangents(model, data, work)
