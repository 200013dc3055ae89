"""Does one evaluation of the accelerations cost O(n) in the bodies, and how does it compare with Pinocchio's ABA?

    python benchmarks/order_n.py [--quick]

Chains of hinged links with 0, 3 and 12 modes each; medians, the peers alternating in one run. The last line is
JSON: `slope_bodies` (exponent of the cost between the two longest chains, worst over the mode counts), and
`rigid_vs_pinocchio_python` (Pinocchio's time over ours, both called from Python; null where it is not installed).
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable

import numpy as np

import modalprep as mp
from modalprep.examples import uniform_beam
from modalprep.multibody import kernel
from modalprep.multibody.layout import pack, workspace

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


def arguments(system: mp.System) -> tuple:
    """Return the arguments of `kernel.accelerations` at a random state."""
    packed = pack(system)
    y = 0.1 * np.random.default_rng(0).standard_normal(packed.nx + packed.nu)
    motion, tau, udot = np.zeros((len(packed.links), 3)), np.zeros(packed.nu), np.zeros(packed.nu)
    return packed.tree, packed.flex, *workspace(packed.tree, packed.flex), y, motion, tau, udot


def pinocchio(count: int) -> Callable[[], None] | None:
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
    return lambda: pin.aba(model, data, q, v, tau)


def medians(calls: list[Callable[[], None]], rounds: int) -> list[float]:
    """Median seconds per call, the calls alternating."""
    for call in calls:
        call()
    seconds: list[list[float]] = [[] for _ in calls]
    for _ in range(rounds):
        for call, spent in zip(calls, seconds, strict=True):
            begin = time.perf_counter()
            for _ in range(20):
                call()
            spent.append((time.perf_counter() - begin) / 20)
    return [statistics.median(s) for s in seconds]


def main() -> None:
    """Print the table and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="shorter chains, fewer rounds")
    quick = parser.parse_args().quick
    counts, rounds = ((10, 40, 160) if quick else (10, 100, 1000)), (7 if quick else 25)
    slopes = []
    for modes in (0, 3, 12):
        body = uniform_beam(modes=modes) if modes else LINK
        spent = medians([ours(chain(body, n)) for n in counts], rounds)
        slopes.append(np.log(spent[2] / spent[1]) / np.log(counts[2] / counts[1]))
        relative = ", ".join(f"{n}: {s / spent[0]:.1f}" for n, s in zip(counts, spent, strict=True))
        print(f"{modes:2d} modes: time over that of {counts[0]} bodies {relative}; slope {slopes[-1]:.2f}")
    peer = pinocchio(40)
    ratio = None
    if peer is not None:
        mine, theirs = medians([ours(chain(LINK, 40)), peer], rounds)
        ratio = round(theirs / mine, 2)
        print(f"rigid chain of 40: Pinocchio's ABA takes {ratio} times our time")
    print(json.dumps({"slope_bodies": round(float(max(slopes)), 3), "rigid_vs_pinocchio_python": ratio}))


if __name__ == "__main__":
    main()
