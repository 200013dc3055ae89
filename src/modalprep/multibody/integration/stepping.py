"""What all step methods share: state of a run, error norms, dense output, groups of coordinates."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from modalprep.compiler.by_address import Pattern, by_address
from modalprep.compiler.jit import compile_inline, compile_kernel, compile_once
from modalprep.multibody.kernels.free_parts import PART
from modalprep.multibody.kernels.joints import normalise, translations
from modalprep.multibody.packing.step_bounds import StepBounds
from modalprep.multibody.packing.tree import blank

CLOCK = np.dtype(
    [
        ("time", np.float64),  # s
        ("next_step", np.float64),
        ("error", np.float64),  # of the last step; negative after one that was rejected
        ("last_step", np.float64),  # its length
        ("begin", np.float64),  # its begin
        ("power_before", np.float64),  # W, there
        ("fixed_step", np.float64),  # 0: adaptive
        ("longest", np.float64),  # that the user allows
        ("kink", np.float64),  # where the last step ended that a kink of a function of time has ended
        ("rtol", np.float64),
        ("atol", np.float64),
        ("rho_inf", np.float64),
        ("span", np.float64),  # of the whole run
        ("output", np.float64),  # between outputs
        ("slow_share", np.float64),  # of the error of the speeds that is not of vibrations, when it was last filtered
        ("share_step", np.float64),  # the step then; 0: never
        ("energy", np.float64),  # J, of the whole system less the work, at the time
        ("energy_size", np.float64),  # J, the largest so far
        ("least_deflection", np.float64),  # in sizes of the body: a smaller one is not resolved relative to itself
    ]
)
COUNT = np.dtype(
    [
        ("steps", np.int64),
        ("evaluations", np.int64),  # of the equations
        ("rejected", np.int64),  # steps
        ("halved", np.int64),  # steps that failed
        ("buffered", np.int64),  # samples
        ("sampled", np.int64),  # in all
        ("shared", np.int64),  # steps since the error of the speeds was filtered
        ("cause", np.int64),  # why the last step failed
    ]
)
NONE = StepBounds(np.zeros((0, 2)), np.zeros(0))

# Momenta of a part that nothing holds, and what was given back to it
KEPT = np.dtype(
    [
        ("time", np.float64),  # s, of the following; NaN before
        ("centre", np.float64, 3),  # m
        ("linear", np.float64, 3),  # kg m/s
        ("angular", np.float64, 3),  # kg m^2/s, about the mass centre
        ("given_linear", np.float64, 3),  # in all, since the run began
        ("given_angular", np.float64, 3),
    ]
)

NOT_FINITE, NOT_CONVERGED, OPEN, HALF_TURN = -3, -4, -5, -6  # beside the status of `evaluate`
SIZE = np.dtype(
    [("angle", np.float64), ("spin", np.float64), ("travel", np.float64), ("speed", np.float64), ("work", np.float64)]
)


@by_address
class Run(NamedTuple):
    """State and scratch of an integration; `y` and `ydot` are those at ``clock.time``."""

    y: np.ndarray  # (ny,) coordinates, speeds, work
    ydot: np.ndarray  # (ny,)
    old: np.ndarray  # (ny,) y at the begin of the last step
    new: np.ndarray  # (ny,) trial of a step
    newdot: np.ndarray  # (ny,)
    K: np.ndarray  # (16, ny) stages
    rows: np.ndarray  # (7, ny) dense output of the last step
    weight: np.ndarray  # (ny,) 1 / tolerance of each number
    size: np.ndarray  # (1,) SIZE, the largest so far of all joints, and of the work
    modal_size: np.ndarray  # (nl, 3) the same of each body's modes and their rates; what deflects by the body's size
    clock: np.ndarray  # (1,) CLOCK
    counters: np.ndarray  # (1,) COUNT
    cells: np.ndarray  # (n, 2) begin of a stretch of time, s, and longest step there
    ends: np.ndarray  # (m,) times at which a step ends, s
    part: np.ndarray  # (nl,) int, the part of each link whose momenta stay, -1 of all others
    sums: np.ndarray  # (parts,) PART
    kept: np.ndarray  # (parts,) KEPT
    turns: np.ndarray  # (2, springs of rotations, 6) their turns at `y`, and scratch; none where none has stiffness


def new_run(
    y: np.ndarray,
    part: np.ndarray,
    turning: int,
    rtol: float,
    atol: float,
    rho: float,
    fixed: float,
    span: float,
    output: float,
    longest: float = np.inf,
    bounds: StepBounds = NONE,
) -> Run:
    """Return the state of a run that begins at y; `part (nl,)` as in `Run`, `turning` springs of rotations."""
    run = _pattern(len(y), len(part), 1 + int(part.max(initial=-1)), turning)
    run = run.copy(cells=bounds.cells, ends=bounds.ends)
    run.y[:], run.part[:], run.kept["time"] = y, part, np.nan
    settings = {"fixed_step": fixed, "rtol": rtol, "atol": atol, "rho_inf": rho, "span": span, "output": output}
    settings["longest"] = longest
    for name, value in settings.items():
        run.clock[name] = value
    return run


@lru_cache(16)
def _pattern(ny: int, links: int, parts: int, turning: int) -> Pattern[Run]:
    run = Run(
        **{name: np.zeros(ny) for name in ("y", "ydot", "old", "new", "newdot")},
        K=np.zeros((16, ny)),
        rows=np.zeros((7, ny)),
        weight=np.ones(ny),
        size=blank(SIZE, 1),
        modal_size=np.zeros((links, 3)),
        clock=blank(CLOCK, 1),
        counters=blank(COUNT, 1),
        **NONE._asdict(),
        part=np.full(links, -1),
        sums=blank(PART, parts),
        kept=blank(KEPT, parts),
        turns=np.zeros((2, turning, 6)),
    )
    return Pattern(run, StepBounds._fields)


@compile_once
def set_weights(model, linear, run, z, keep):
    """Fill `run.weight` by ``1 / (atol + rtol size)``, sizes by `run.size` and the state z; keep them if `keep`.

    Sizes are the largest so far: of the modes of a body, of all rates of turn, of all travels and their rates; a turn
    is measured by one radian at least, the rate of a mode by its deflection times its frequency. So what matters
    little, a mode of no effect or a hinge that happens to rest, does not hold the step.
    """
    size = run.size[0]
    modal = run.modal_size
    nx = model.nx
    angle = max(1.0, size.angle)
    spin = size.spin
    place = size.travel
    speed = size.speed
    for i in range(len(model.links)):
        x = model.links[i].x
        u = nx + model.links[i].u
        speeds = model.links[i].uq - model.links[i].u
        travels = translations(model.links[i])
        place = max(place, _largest(z, x, travels))
        speed = max(speed, _largest(z, u, travels))
        spin = max(spin, _largest(z, u + travels, speeds - travels))
        if model.links[i].xq - x == speeds:  # no quaternion
            angle = max(angle, _largest(z, x + travels, speeds - travels))
    work = max(size.work, abs(z[len(z) - 1]))
    if keep:
        size.angle = angle
        size.spin = spin
        size.travel = place
        size.speed = speed
        size.work = work
    for i in range(len(model.links)):
        x = model.links[i].x
        u = nx + model.links[i].u
        travels = translations(model.links[i])
        _weigh(run.weight, run.clock[0], x, travels, place)
        _weigh(run.weight, run.clock[0], u, travels, speed)
        _weigh(run.weight, run.clock[0], x + travels, model.links[i].xq - x - travels, angle)
        _weigh(run.weight, run.clock[0], u + travels, model.links[i].uq - model.links[i].u - travels, spin)
        n = model.links[i].modes
        xq = model.links[i].xq
        uq = nx + model.links[i].uq
        moved = max(modal[i, 0], _largest(z, xq, n))
        rate = max(modal[i, 1], _largest(z, uq, n))
        moved = max(moved, run.clock[0].least_deflection * modal[i, 2])
        if keep:
            modal[i, 0], modal[i, 1] = moved, rate
        _weigh(run.weight, run.clock[0], xq, n, moved)
        for a in range(n):
            fast = moved * np.sqrt(max(0.0, linear[0, uq - nx + a]))
            _weigh(run.weight, run.clock[0], uq + a, 1, max(rate, fast))
    _weigh(run.weight, run.clock[0], len(z) - 1, 1, work)


@compile_inline
def _largest(z, first, count):
    found = 0.0
    for k in range(first, first + count):
        found = max(found, abs(z[k]))
    return found


@compile_inline
def _weigh(weight, clock, first, count, size):
    for k in range(first, first + count):
        weight[k] = 1.0 / (clock.atol + clock.rtol * size)


@compile_once
def largest_error(model, run, e, modes):
    """Largest weighted error ``e (nu,)`` of the coordinates, as increments of the speeds' directions.

    modes: whether those of modal coordinates count.
    """
    worst = 0.0
    for i in range(len(model.links)):
        x = model.links[i].x
        u = model.links[i].u
        for c in range(model.links[i].uq - u):  # the numbers of a quaternion have one weight
            worst = larger(worst, e[u + c] * run.weight[x + c])
        if modes:
            for c in range(model.links[i].modes):
                worst = larger(worst, e[model.links[i].uq + c] * run.weight[model.links[i].xq + c])
    return worst


@compile_inline
def larger(worst, value):
    """Return the larger of a size and ``|value|``; NaN is larger than all."""
    return worst if abs(value) <= worst or worst != worst else abs(value)


@compile_kernel
def norm(run, e):
    """Root mean square of a weighted error ``e (ny,)``."""
    total = 0.0
    for k in range(len(e)):
        total += (e[k] * run.weight[k]) ** 2
    return np.sqrt(total / len(e))


@compile_kernel
def hermite_rows(run, h):
    """Write the cubic Hermite interpolation of a step from `y`, `ydot` to `new`, `newdot` to `run.rows`."""
    for k in range(len(run.y)):
        step = run.new[k] - run.y[k]
        run.rows[0, k] = step
        run.rows[1, k] = h * run.ydot[k] - step
        run.rows[2, k] = 2.0 * step - h * (run.newdot[k] + run.ydot[k])
    run.rows[3:] = 0.0


@compile_kernel
def interpolate(model, run, t, out):
    """State at t within the last step: ``y + s (r0 + (1 - s) (r1 + s (r2 + (1 - s) (...))))``."""
    h = run.clock[0].last_step
    s = (t - run.clock[0].begin) / h if h > 0.0 else 1.0
    for k in range(len(out)):
        v = 0.0
        for j in range(6, -1, -1):
            v = (v + run.rows[j, k]) * (s if j % 2 == 0 else 1.0 - s)
        out[k] = run.old[k] + v
    normalise(model, out)
