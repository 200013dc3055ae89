"""Does one evaluation of the accelerations cost O(n) in the bodies, and how does it compare with Pinocchio's ABA?

    python benchmarks/order_n.py [--quick]

Chains of hinged links. Rigid ones against Pinocchio (a general joint library, which keeps more of its results than
the accelerations): in a compiled loop, and with both called from Python; medians, the two alternating. Flexible ones
with 3, 6 and 12 modes each in a compiled loop; the quickest round, as on an idle core. The last line is JSON:
`slope_bodies` (exponent of the cost between the two longest chains, worst over the mode counts), `us_per_body` by mode
count, `rigid_vs_pinocchio` and `rigid_vs_pinocchio_python` (Pinocchio's time over ours, the smallest over the chains;
null where it is not installed).
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable

import numpy as np
from numba import njit

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import kernel
from modalprep.multibody.layout import MODES, UQ, XQ, pack, workspace

LINK = mp.rigid_body(
    "link",
    mass=1.0,
    centre=np.array([0.5, 0, 0]),
    inertia=np.diag([0.00125, 0.084, 0.084]),
    interfaces={"root": np.zeros(3), "tip": np.array([1.0, 0, 0])},
)


def chain(body: mp.FlexibleBody, count: int) -> mp.System:
    """Return `count` equal links, hinge axes alternating z, y."""
    axes = np.eye(3)[[2, 1]]
    joints = tuple(
        mp.Joint(
            name=f"j{i}",
            type="revolute",
            parent="ground" if i == 0 else f"l{i - 1}.tip",
            child=f"l{i}",
            axis=axes[i % 2],
        )
        for i in range(count)
    )
    return mp.System(bodies={f"l{i}": body for i in range(count)}, joints=joints, gravity=np.array([0, 0, -9.81]))


@njit
def repeat(count, tree, flex, W, F, y, motion, tau, udot):
    """Evaluate `count` times without returning to Python."""
    status = -1
    for _ in range(count):
        status = max(status, kernel.accelerations(tree, flex, W, F, y, motion, tau, udot))
    return status


def arguments(system: mp.System) -> tuple:
    """Return the arguments of `kernel.accelerations` at a random state with small deflections."""
    packed = pack(system)
    y = 0.1 * np.random.default_rng(0).standard_normal(packed.nx + packed.nu)
    for row in packed.tree.ints:
        y[row[XQ] : row[XQ] + row[MODES]] *= 1e-3
        y[packed.nx + row[UQ] : packed.nx + row[UQ] + row[MODES]] *= 1e-3
    motion, tau, udot = np.zeros((len(packed.links), 3)), np.zeros(packed.nu), np.zeros(packed.nu)
    return packed.tree, packed.flex, *workspace(packed.tree, packed.flex), y, motion, tau, udot


def compiled(system: mp.System) -> Callable[[int], None]:
    """Return a call that evaluates the accelerations a number of times in compiled code."""
    given = arguments(system)
    if kernel.accelerations(*given) >= 0:
        raise RuntimeError("the state of the benchmark has no positive mass matrix")
    return lambda count: repeat(count, *given)


def from_python(system: mp.System) -> Callable[[int], None]:
    """Return a call that evaluates the accelerations of rigid bodies a number of times from Python."""
    tree, _, W, _, y, _, tau, udot = arguments(system)
    ints, fixed, forces, evaluate = tree.ints, tree.fixed, np.stack([tau, udot]), kernel.rigid_accelerations

    def call(count: int) -> None:
        for _ in range(count):
            evaluate(ints, fixed, W, y, forces)

    return call


def pinocchio(count: int) -> Callable[[int], None] | None:
    """Return the same for Pinocchio's articulated-body algorithm on the rigid chain."""
    try:
        import pinocchio as pin
    except ImportError:
        return None
    model = pin.Model()
    inertia = pin.Inertia(LINK.m, np.array([0.5, 0, 0]), np.diag([0.00125, 0.084, 0.084]))
    parent = 0
    for i in range(count):
        place = pin.SE3(np.eye(3), np.array([0.0 if i == 0 else 1.0, 0, 0]))
        joint = pin.JointModelRZ() if i % 2 == 0 else pin.JointModelRY()
        parent = model.addJoint(parent, joint, place, f"j{i}")
        model.appendBodyToJoint(parent, inertia, pin.SE3.Identity())
    data, rng = model.createData(), np.random.default_rng(0)
    q, v, tau = 0.1 * rng.standard_normal(count), 0.1 * rng.standard_normal(count), np.zeros(count)

    def call(count: int) -> None:
        for _ in range(count):
            pin.aba(model, data, q, v, tau)

    return call


def timed(calls: list[Callable[[int], None]], rounds: int, count: int) -> list[list[float]]:
    """Microseconds per evaluation in every round, the calls alternating, `count` evaluations at a time."""
    for call in calls:
        call(1)
    spent: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, times in zip(calls, spent, strict=True):
            begin = time.perf_counter()
            call(count)
            times.append((time.perf_counter() - begin) / count * 1e6)
    return spent


def flexible(counts: tuple[int, ...], rounds: int) -> tuple[float, dict[str, float]]:
    """Print the cost per body of flexible and rigid chains; return the worst slope, and the cost of the middle one."""
    slopes, costs = [], {}
    for modes in (0, 3, 6, 12):
        body = uniform_beam(modes=modes) if modes else LINK
        chains = [compiled(chain(body, n)) for n in counts]
        # the quickest round: a neighbour on the same core doubles the rest
        spent = [min(timed([call], rounds, max(1, 200 // n))[0]) for call, n in zip(chains, counts, strict=True)]
        slopes.append(np.log(spent[-1] / spent[-2]) / np.log(counts[-1] / counts[-2]))
        costs[str(modes)] = round(spent[-2] / counts[-2], 3)
        each = ", ".join(f"{n}: {t / n:.3f}" for n, t in zip(counts, spent, strict=True))
        print(f"{modes:2d} modes: microseconds per body of chains {each}; slope {slopes[-1]:.2f}")
    return round(float(max(slopes)), 3), costs


def rigid(counts: tuple[int, ...], rounds: int) -> tuple[float | None, float | None]:
    """Print Pinocchio's time over ours; return the smallest ratios, compiled and from Python."""
    ratios = []
    for n in counts:
        peer = pinocchio(n)
        if peer is None:
            return None, None
        calls = [compiled(chain(LINK, n)), from_python(chain(LINK, n)), peer]
        loop, python, theirs = map(statistics.median, timed(calls, rounds, max(1, 4000 // n)))
        ratios.append((theirs / loop, theirs / python))
        print(f"rigid chain of {n}: Pinocchio takes {ratios[-1][0]:.2f} times our compiled loop, {ratios[-1][1]:.2f} "
              "times our call from Python")  # fmt: skip
    return tuple(round(min(column), 2) for column in zip(*ratios, strict=True))


def main() -> None:
    """Print the tables and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorter chains, fewer rounds")
    quick = parser.parse_args().quick
    rounds = 7 if quick else 25
    slope, costs = flexible((10, 40, 160) if quick else (10, 100, 1000), rounds)
    # the peer's data grow with the cube of n: 4 GB at 400
    loop, python = rigid((5, 40) if quick else (5, 10, 50, 200), rounds)
    print(json.dumps({
        "slope_bodies": slope, "us_per_body": costs, "rigid_vs_pinocchio": loop, "rigid_vs_pinocchio_python": python,
    }))  # fmt: skip


if __name__ == "__main__":
    main()
