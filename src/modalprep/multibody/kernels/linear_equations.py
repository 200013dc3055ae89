"""From mass matrix, damping and stiffness of a tree to its accelerations by coordinates, speeds and inputs.

One call, with the estimated error. Systems with closures do the same with a factor of their reduced mass matrix.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.kernels.responses import mean_response, prepare, respond
from modalprep.multibody.kernels.rounding import rounding_forces


@compile_kernel
def linear_equations(model, data, K, D, M, size, force, scale, signs, numbers, state, by_input, work):
    """Write the last n rows of ``z' = state z + by_input i``, after `inward`; returns the estimated error.

    Parameters
    ----------
    K, D, M : (n, n)
    size : (n,)
        Sum of the absolute values that make each force.
    force : (n, ni)
        Generalised forces of unit inputs.
    scale : (n,)
        Size of each coordinate.
    signs : (n, 4)
        Random.
    numbers : (5, n)
        Written: the largest accelerations by coordinates and by speeds in the scales, the coordinates and speeds whose
        columns are one, and what rounding errors make as forces.
    """
    n = len(scale)
    sizes, weights, worst = numbers[:2], numbers[2:4], numbers[4]
    prepare(model, data, work)
    respond(model, data, -1.0, K, state, n, 0, scale, sizes[0], work)
    respond(model, data, -1.0, D, state, n, n, scale, sizes[1], work)
    respond(model, data, 1.0, force, by_input, n, 0, scale, sizes[0, :0], work)
    cancelling = mean_response(model, data, size, signs, scale, work)
    rounding_forces(K, D, M, size, scale, sizes, cancelling, weights, worst)
    return mean_response(model, data, worst, signs, scale, work)
