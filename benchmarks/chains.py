"""Chains of hinged links for the benchmarks of the multibody engine, and how calls are timed against each other."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

import numpy as np

import modalprep as mp
from modalprep.compiler.jit import compile_kernel
from modalprep.examples import uniform_beam
from modalprep.multibody.kernels import articulated_body as kernel
from modalprep.multibody.model.constraints import Closure
from modalprep.multibody.model.loads import AxialSpring, Bushing
from modalprep.multibody.packing.tree import pack

ROUND = 2e-3  # s, of one call in a round: short against what disturbs a machine, long against a clock
SMALL = 1e-5  # modal coordinates: 24 modes of a body carry nearly all its inertia, and bear small deflections only
LINK = mp.rigid_body(
    "link",
    mass=1.0,
    centre=np.array([0.5, 0, 0]),
    inertia=np.diag([0.00125, 0.084, 0.084]),
    interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])},
)


def chain(count: int, modes: int = 0) -> mp.System:
    """Return equal links, hinge axes alternating z, y."""
    body, axes = uniform_beam(modes=modes) if modes else LINK, np.eye(3)[[2, 1]]
    parents = ["ground", *(f"l{i}.tip" for i in range(count - 1))]
    joints = tuple(
        mp.Joint(name=f"j{i}", type="revolute", parent=parent, child=f"l{i}", axis=axes[i % 2])
        for i, parent in enumerate(parents)
    )
    return mp.System(bodies={f"l{i}": body for i in range(count)}, joints=joints, gravity=np.array([0, 0, -9.81]))


@compile_kernel
def repeat(count, model, data, y, motion, tau, udot):
    """Evaluate the accelerations `count` times without returning to Python."""
    status = -1
    for _ in range(count):
        status = max(status, kernel.accelerations(model, data, y, motion, tau, udot))
    return status


def sprung_chain(count: int, modes: int = 0) -> mp.System:
    """Return such a chain with a spring and damper along each two links, one to the ground, and a bushing."""
    springs = [
        AxialSpring(name=f"s{k}", between=(f"l{k}.root", f"l{k + 1}.tip"), stiffness=1e3, damping=5.0, free_length=1.9)
        for k in range(count - 1)
    ]
    stay = AxialSpring(
        name="stay", between=("ground", f"l{count - 1}.tip"), stiffness=1e2, damping=1.0, free_length=5.0,
        position=(1.0, 0, 0),
    )  # fmt: skip
    ends = f"l{count - 2}.tip", f"l{count - 1}.tip"
    stiffness, damping = (2e2, 1e2, 3e2, 0, 0, 0), (2.0, 1.0, 3.0, 1.0, 2.0, 3.0)
    bush = Bushing(name="bush", between=ends, stiffness=stiffness, damping=damping)
    return chain(count, modes).with_(loads=(*springs, stay, bush))


def closed_chain(count: int, modes: int = 0) -> mp.System:
    """Return such a chain whose tip slides on a rail: two conditions of a loop."""
    rail = Closure(name="rail", type="point_on_line", a="ground", b=f"l{count - 1}.tip", axis=np.array([1.0, 0, 0]))
    return chain(count, modes).with_(closures=(rail,))


def arguments(system: mp.System) -> tuple:
    """Return the arguments of `kernel.accelerations` at a random state with small deflections."""
    packed = pack(system)
    y = 0.1 * np.random.default_rng(0).standard_normal(packed.nx + packed.nu)
    for row in packed.model.links:
        y[row["xq"] : row["xq"] + row["modes"]] *= SMALL
        y[packed.nx + row["uq"] : packed.nx + row["uq"] + row["modes"]] *= SMALL
    motion, tau, udot = np.zeros((len(packed.links), 3)), np.zeros(packed.nu), np.zeros(packed.nu)
    given = packed.model, packed.data(), y, motion, tau, udot
    if kernel.accelerations(*given) >= 0:
        raise RuntimeError("the state of the benchmark has no positive mass matrix")
    return given


def compiled(given: tuple) -> Callable[[int], None]:
    """Return a call that evaluates the accelerations a number of times in compiled code."""
    return lambda count: repeat(count, *given)


def from_python(system: mp.System) -> Callable[[int], None]:
    """Return a call that evaluates the accelerations at that state a number of times from Python."""
    equations = mp.multibody.EquationsOfMotion(system)
    equations.y[:] = arguments(system)[2]
    update = equations.update

    def call(count: int) -> None:
        for _ in range(count):
            update()

    return call


def medians(calls: list[Callable[[int], None]], rounds: int) -> list[float]:
    """Median CPU microseconds per evaluation of each call, the calls alternating."""
    return [statistics.median(times) for times in alternating(calls, rounds)]


def alternating(calls: list[Callable[[int], None]], rounds: int) -> list[list[float]]:
    """CPU microseconds per evaluation of each call in each round, the calls alternating."""
    counts = [_count(call) for call in calls]
    spent: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, count, times in zip(calls, counts, spent, strict=True):
            begin = time.process_time()
            call(count)
            times.append((time.process_time() - begin) / count * 1e6)
    return spent


def _count(call: Callable[[int], None]) -> int:
    """Return how many evaluations fill a round."""
    call(1)
    count = 1
    while True:
        begin = time.process_time()
        call(count)
        spent = time.process_time() - begin
        if spent > 0.25 * ROUND:
            return max(1, round(count * ROUND / spent))
        count *= 4
