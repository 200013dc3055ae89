"""How does one evaluation of the accelerations of a scissor mast grow with its bays, each a closed loop?

    python benchmarks/scissor.py [--quick]

Prints the CPU time of an evaluation over that of the shortest mast, medians of alternating rounds, then one line of
JSON: `scissor_32_vs_4`, the ratio of masts of 32 and 4 bays, and `scissor_slope`, the exponent of the time over the
bays between them, redundant conditions included. The loops are not independent of each other: one more is one more
row and column of a full matrix.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable

import numpy as np
from chains import medians

import modalprep as mp
from modalprep.multibody.closures import Closure
from modalprep.multibody.plant import Plant

ANGLE = np.radians(40)  # of the bars from the base
BAYS = (4, 8, 16, 32)


def bar(name: str, root: float) -> mp.FlexibleBody:
    """Return a uniform bar of 1 m and 1 kg, its frame at a distance from its lower end."""
    ends = {"root": 0.0, "foot": -root, "middle": 0.5 - root, "top": 1 - root}
    interfaces = {key: np.array([x, 0, 0]) for key, x in ends.items()}
    return mp.rigid_body(
        name, mass=1.0, centre=interfaces["middle"], inertia=np.diag([0, 1, 1]) / 12, interfaces=interfaces
    )


def mast(bays: int) -> mp.System:
    """Return a scissor mast, its foot on a line."""
    rising, crossing = bar("a", 0.0), bar("b", 0.5)
    bodies, joints = {}, []
    closures = [Closure(name="foot", type="point_on_plane", a="ground", b="b0.foot", axis=np.array([0, 1.0, 0]))]
    for k in range(bays):
        bodies |= {f"a{k}": rising, f"b{k}": crossing}
        parent, angle = (f"b{k - 1}.top", 2 * ANGLE - np.pi) if k else ("ground", ANGLE)
        joints.append(mp.Joint(name=f"left{k}", type="revolute", parent=parent, child=f"a{k}", angle=angle))
        cross = mp.Joint(name=f"cross{k}", type="revolute", parent=f"a{k}.middle", child=f"b{k}")
        joints.append(cross.with_(angle=np.pi - 2 * ANGLE))
        if k:
            closures.append(Closure(name=f"right{k}", type="revolute", a=f"a{k - 1}.top", b=f"b{k}.foot"))
    return mp.System(bodies=bodies, joints=tuple(joints), closures=tuple(closures), gravity=np.array([0, -9.81, 0]))


def evaluation(system: mp.System) -> Callable[[int], None]:
    """Return a call that evaluates the accelerations a number of times at the start."""
    plant = Plant(system)
    y, tau = plant.start, np.zeros(plant.nu)

    def call(count: int) -> None:
        for _ in range(count):
            plant.load(y)
            plant.accelerations(y, tau)

    return call


def main() -> None:
    """Print the curve and the line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    rounds = 7 if parser.parse_args().quick else 31
    spent = medians([evaluation(mast(bays)) for bays in BAYS], rounds)
    for bays, time in zip(BAYS, spent, strict=True):
        print(f"{bays:2d} bays: {time / spent[0]:.2f} times the mast of {BAYS[0]}")
    ratio = spent[-1] / spent[0]
    slope = np.log(ratio) / np.log(BAYS[-1] / BAYS[0])
    print(json.dumps({"scissor_32_vs_4": round(ratio, 1), "scissor_slope": round(float(slope), 3)}))


if __name__ == "__main__":
    main()
