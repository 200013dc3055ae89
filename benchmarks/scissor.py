"""How does one evaluation of the accelerations grow with closed loops, and what do loops add to that of their tree?

    python benchmarks/scissor.py [--quick]

Prints the CPU time of an evaluation over that of the shortest scissor mast and chain, medians of alternating rounds,
then one line of JSON: `scissor_32_vs_4`, the ratio of masts of 32 and 4 bays, and `scissor_slope`, the exponent of the
time over the bays between them, redundant conditions included; `pinned_chain_slope`, the exponent over the bodies of a
chain whose end is pinned, from 60 to 540. The loops of the mast are not independent of each other: one more is one more
row and column of a full matrix. `loop_over_tree` is the time of closed systems over that of the same bodies without
their closures, in compiled code, rigid and flexible: of each system, their median and the largest.
Trees are evaluated in space, and so are the closed systems of spatial.py and chains of links on alternating axes; the
other rigid ones within their plane.
"""

from __future__ import annotations

import argparse
import json
import statistics
from collections.abc import Callable

import numpy as np
import spatial
from chains import chain, medians

import modalprep as mp
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.evaluation.evaluate import build_equations, evaluate
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.model.constraints import Closure

ANGLE = np.radians(40)  # of the bars from the base
BAYS = (4, 8, 16, 32)
LENGTHS = (60, 180, 540)


def bar(name: str, root: float) -> mp.body.FlexibleBody:
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


def pinned(n: int) -> mp.System:
    """Return a chain of bars between two pins on the ground."""
    rod, names = bar("rod", 0.0), [f"l{k}" for k in range(n)]
    joints = tuple(
        mp.Joint(name=f"j{k}", type="revolute", parent=f"l{k - 1}.top" if k else "ground", child=name)
        for k, name in enumerate(names)
    )
    pin = Closure(name="pin", type="spherical", a="ground", b=f"{names[-1]}.top", position=np.array([n, 0, 0]))
    return mp.System(bodies=dict.fromkeys(names, rod), joints=joints, closures=(pin,), gravity=np.array([0, -9.81, 0]))


def four_bar(kind: str) -> mp.System:
    """Return three bars on the ground, the last pinned there by a closure of a type."""
    rod, names, angles = bar("rod", 0.0), "abc", (1.2, -1.0, -1.4)
    joints = tuple(
        mp.Joint(name=f"j{k}", type="revolute", parent=parent, child=names[k], angle=angles[k])
        for k, parent in enumerate(("ground", "a.top", "b.top"))
    )
    pin = Closure(name="pin", type=kind, a="ground", b="c.top", position=np.array([1.3, 0, 0]))
    return mp.System(bodies=dict.fromkeys(names, rod), joints=joints, closures=(pin,), gravity=np.array([0, -9.81, 0]))


def held(count: int, modes: int, kind: str) -> mp.System:
    """Return a chain of hinged links whose tip a closure holds: `spherical`, or at a `distance` from a point."""
    open_chain, length = chain(count, modes), 10.0 if modes else 1.0
    place = np.array([count * length, 0, length if kind == "distance" else 0.0])
    hold = Closure(name="hold", type=kind, a="ground", b=f"l{count - 1}.tip", position=place)
    return open_chain.with_(closures=(hold,))


CLOSED = {
    "four bars, pinned": four_bar("spherical"),
    "four bars, hinged": four_bar("revolute"),
    "four bars in space, pinned": spatial.four_bar(),
    "slider crank in space": spatial.slider_crank(),
    "Bennett's linkage, hinged": spatial.bennett(),
    "hexapod": spatial.hexapod(),
    "chain of 10 on a rod": held(10, 0, "distance"),
    "chain of 10, pinned": held(10, 0, "spherical"),
    "chain of 60, pinned": pinned(60),
    "mast of 4 bays": mast(4),
    "3 flexible links on a rod": held(3, 6, "distance"),
    "3 flexible links, pinned": held(3, 6, "spherical"),
    "10 flexible links, pinned": held(10, 12, "spherical"),
}


@compile_kernel
def repeat(count, equations, y, ydot):
    """Evaluate the equations `count` times without returning to Python."""
    status = -1
    for _ in range(count):
        status = max(status, evaluate(equations, 0.0, y, ydot))
    return status


def compiled(system: mp.System, state: np.ndarray | None = None) -> Callable[[int], None]:
    """Return a call that evaluates the equations of a run a number of times, in compiled code; without state: start."""
    evaluator = Evaluator(system)
    equations = build_equations(evaluator.packed, evaluator.loading)
    y = np.append(evaluator.start if state is None else state, 0.0)
    ydot = np.zeros(evaluator.nx + evaluator.nu + 1)
    return lambda count: repeat(count, equations, y, ydot)


def over_trees(rounds: int) -> dict[str, float]:
    """Return, and print, the time of closed systems over that of the same bodies without closures."""
    calls = [compiled(each) for system in CLOSED.values() for each in (system, system.with_(closures=()))]
    spent = medians(calls, rounds)
    found = {name: round(spent[2 * k] / spent[2 * k + 1], 2) for k, name in enumerate(CLOSED)}
    for name, ratio in found.items():
        print(f"{name}: {ratio:.2f} times the open tree")
    return {**found, "median": round(statistics.median(found.values()), 2), "worst": max(found.values())}


def evaluation(system: mp.System) -> Callable[[int], None]:
    """Return a call that evaluates the accelerations a number of times at the start."""
    evaluator = Evaluator(system)
    y, tau = evaluator.start, np.zeros(evaluator.nu)

    def call(count: int) -> None:
        for _ in range(count):
            evaluator.load(y)
            evaluator.accelerations(tau)

    return call


def growth(systems: dict[str, mp.System], rounds: int) -> list[float]:
    """Return, and print, the time of an evaluation of each system over that of the first."""
    spent = medians([evaluation(system) for system in systems.values()], rounds)
    for name, time in zip(systems, spent, strict=True):
        print(f"{name}: {time / spent[0]:.2f} times the first")
    return spent


def slope(spent: list[float], sizes: tuple[int, ...]) -> float:
    """Return the exponent of the time over the size, from the first to the last."""
    return round(float(np.log(spent[-1] / spent[0]) / np.log(sizes[-1] / sizes[0])), 3)


def main() -> None:
    """Print the curve and the line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    rounds = 7 if parser.parse_args().quick else 31
    figures: dict[str, object] = {}
    masts = growth({f"mast of {bays} bays": mast(bays) for bays in BAYS}, rounds)
    figures["scissor_32_vs_4"] = round(masts[-1] / masts[0], 1)
    figures["scissor_slope"] = slope(masts, BAYS)
    figures["pinned_chain_slope"] = slope(growth({f"chain of {n}": pinned(n) for n in LENGTHS}, rounds), LENGTHS)
    figures["loop_over_tree"] = over_trees(rounds)
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
