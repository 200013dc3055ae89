"""Momenta of the parts that nothing holds stay: after each step a small rigid motion gives back what the step lost.

The errors of a step of a part that turns go the same way in every turn, so that a run of thousands of turns would lose
momentum in proportion to its length, whatever the balance of its energy. Speeds change by the rigid motion that
restores the linear momentum, which uniform gravity changes, and the angular momentum about the mass centre; places by
the way from where the mass centre belongs. What was given back is added up: it measures what the steps lose.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.registry import prescribe
from modalprep.multibody.kernels.algebra.tuples import axpy3, get3, put3, sub3
from modalprep.multibody.kernels.articulated_body import kinematic, outward_in_world
from modalprep.multibody.kernels.free_parts import move_part, sum_parts


@compile_kernel
def remember_momenta(eq, run, t):
    """Take the momenta of all parts at the state `run.y` as those that stay."""
    _sum(eq, run, t, run.y)
    for k in range(len(run.kept)):
        own, kept = run.sums[k], run.kept[k]
        kept.time = t
        put3(kept.centre, get3(own.centre))
        put3(kept.linear, get3(own.linear))
        put3(kept.angular, get3(own.angular))


@compile_kernel
def keep_momenta(eq, run, t):
    """Give the trial `run.new` of a step to time t the momenta of `remember_momenta`, and its rates in `newdot`.

    The accelerations there would change by the rate of turn times the change of the speeds: less than the step's error.
    """
    restore_momenta(eq, run, t, run.new, 1.0)
    kinematic(eq.model, run.new, run.newdot)


@compile_kernel
def restore_momenta(eq, run, t, y, counted):
    """Give a state at time t the momenta of `remember_momenta`; `counted` (1 or 0) times that is added up."""
    _sum(eq, run, t, y)
    g = get3(eq.model.gravity)
    for k in range(len(run.kept)):
        own = run.sums[k]
        kept = run.kept[k]
        h = t - run.kept[k].time
        linear = sub3(axpy3(get3(kept.linear), own.mass * h, g), get3(own.linear))
        angular = sub3(get3(kept.angular), get3(own.angular))
        centre = axpy3(axpy3(get3(kept.centre), h / own.mass, get3(kept.linear)), 0.5 * h * h, g)
        move_part(eq.model, eq.data, run.part, k, own, sub3(centre, get3(own.centre)), linear, angular, y)
        put3(kept.given_linear, axpy3(get3(kept.given_linear), counted, linear))
        put3(kept.given_angular, axpy3(get3(kept.given_angular), counted, angular))


@compile_kernel
def _sum(eq, run, t, y):
    prescribe(eq.loads, t, eq.motion)
    outward_in_world(eq.model, eq.data, y, eq.motion)
    sum_parts(eq.model, eq.data, run.part, run.sums)
