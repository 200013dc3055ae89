"""How explicit steps bring their ends onto closed loops, from the end to the begin: theory 5.4, 5.9.

The change of a state z = (x, u) is that of the least kinetic energy, ``dx - B (G dx + Phi_p dp)`` with
``B = M^-1 G' (G M^-1 G')^-1``, speeds likewise with their rates, as projection.py has it. ``-B' v`` are the multipliers
of the accelerations that forces v make, so that two solutions and two products go back.
"""

from __future__ import annotations

from modalprep.compiler.jit import compile_inline, compile_kernel
from modalprep.multibody.evaluation.evaluate import GOOD, load, respond
from modalprep.multibody.kernels.algebra.tuples import copy
from modalprep.multibody.kernels.tangents.outward import outward_tangents
from modalprep.multibody.kernels.tangents.pulled_back import pull_inward, pull_outward
from modalprep.multibody.kernels.tangents.pulled_rates import pull_rates
from modalprep.sensitivity.loops_back import add_couplers, conditions_back
from modalprep.sensitivity.solutions import accelerate_closed


@compile_inline
def closing_back(loops, eq, steps, k, back, bar):
    """Replace the gradient by the closed end of step k by that before it was closed; returns a status."""
    if loops is not None:
        return _go_back(loops, eq, steps.t[k] + steps.h[k], k, back, bar)
    return GOOD


@compile_kernel
def _go_back(loops, eq, t, k, back, bar):
    nx, nu, y = eq.model.nx, len(eq.tau), loops.ends[k]
    eq.work.closed_rank[0] = len(eq.work.order)
    load(eq, t, y)
    status = respond(eq, t, y, back.rates[0])
    if status != GOOD:
        return status
    outward_tangents(eq.model, eq.data, back.work)
    places, rates = loops.places[k], loops.rates[k]
    move, moved = loops.moved, loops.change
    accelerate_closed(loops, eq, bar[nx : nx + nu], moved[0])
    copy(eq.work.multiplier, rates)
    _pull(loops, eq, back, loops.none, rates, back.by_x, back.by_u)
    pull_rates(eq.model, y, bar[:nx], loops.still[:nu], loops.still[:nu], back.own)
    for u in range(nu):
        move[u] = back.own[nx + u] - back.by_x[u]
    accelerate_closed(loops, eq, move, moved[0])
    copy(eq.work.multiplier, places)
    _pull(loops, eq, back, places, loops.none, moved[0], moved[1])
    for u in range(nu):
        back.by_x[u] += moved[0, u]
    pull_rates(eq.model, y, loops.still[:nx], back.by_x, back.by_u, back.own)
    for c in range(nx + nu):
        bar[c] += back.own[c]
    return GOOD


@compile_kernel
def _pull(loops, eq, back, places, rates, by_x, by_u):
    """Write what conditions times `places` and rates times `rates`, both (m,), change by, with a minus."""
    pull_outward(eq.model, eq.data, back.work, back.pulled, loops.still)
    conditions_back(loops, eq, back.work, back.pulled, places, rates)
    pull_inward(eq.model, eq.data, back.work, back.pulled, by_x, by_u)
    add_couplers(eq.cons, by_x, by_u, places, rates)
