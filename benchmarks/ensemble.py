"""How much do ensembles gain: threads over one run after another, and what does a case cost beyond its run?

    python benchmarks/ensemble.py [--quick]

Two ensembles: 2 s of a double pendulum, whose set-up in Python takes most of a run, and 0.2 s of a chain of six
flexible links of 12 modes, which spends its time in compiled code. Each is run one by one (`simulate` of every changed
system), by `simulate_many` in one thread and in two, in turn; ratios are of medians. The last line is JSON:
`ensemble_speedup` (two threads over one by one, of the chain), `ensemble_speedup_small` (of the pendulum),
`overhead_small` (one thread of `simulate_many` over one by one, of the pendulum), `us_per_small_case` (in two threads),
and `machine_speedup` (two threads of a plain compiled loop over one after the other), which is 2 on two free
processors, and 1 where other programs take one of them: the first number means nothing then.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from statistics import median

import numpy as np
from integrators import chain, link
from numba import njit

import modalprep as mp
from modalprep.ensemble import draw_cases
from modalprep.ensemble.parameters import Parameters


def pendulum() -> mp.System:
    """Return a double pendulum of rigid rods."""
    ends = {"root": np.zeros(3), "tip": np.array([1.0, 0, 0])}
    rod = mp.rigid_body("rod", mass=1.0, centre=np.array([0.5, 0, 0]), inertia=np.eye(3) / 12, interfaces=ends)
    return chain(rod, 2, angle=-0.5)


def ways(system: mp.System, count: int, t_end: float) -> dict[str, Callable[[], object]]:
    """Return what runs `count` cases of random starts, one by one and as an ensemble."""
    cases = draw_cases({"j0.angle": {"normal": [-0.5, 0.1]}, "j1.rate": {"normal": [0.0, 0.2]}}, count)
    options = {"t_end": t_end, "output_step": 0.01}
    rows = list(zip(*cases.values(), strict=True))

    def one_by_one() -> None:
        parameters = Parameters(system, list(cases))
        for row in rows:
            mp.simulate(parameters.change(row), **options)["j0.angle"].copy()

    def many(workers: int) -> Callable[[], object]:
        return lambda: mp.simulate_many(system, cases, channels=["j0.angle"], workers=workers, **options)

    return {"one by one": one_by_one, "one thread": many(1), "two threads": many(2)}


def medians(called: dict[str, Callable[[], object]], repeats: int) -> dict[str, float]:
    """Return the median wall time (s) of each, called in turn after one call to warm up."""
    spent: dict[str, list[float]] = {name: [] for name in called}
    for number in range(repeats + 1):
        for name, call in called.items():
            begin = time.perf_counter()
            call()
            spent[name] += [time.perf_counter() - begin] * (number > 0)
    return {name: median(times) for name, times in spent.items()}


@njit(nogil=True)
def spin(count: int) -> float:
    """Keep a processor busy."""
    total = 0.0
    for k in range(count):
        total += np.sin(k)
    return total


def loops(pool: ThreadPoolExecutor) -> dict[str, Callable[[], object]]:
    """Return what runs two plain loops, one after the other and at the same time."""
    work = [5_000_000] * 2
    return {"loops in turn": lambda: [spin(n) for n in work], "loops at once": lambda: list(pool.map(spin, work))}


def main() -> None:
    """Print the runs and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer cases, in less than a minute")
    quick = parser.parse_args().quick
    repeats, small, large = (5, 60, 6) if quick else (9, 300, 24)
    links = chain(link(0.5, 12, 0.02), 6, angle=-1.0)
    systems = {"pendulum": (pendulum(), small, 2.0), "chain": (links, large, 0.2)}
    found = {}
    with ThreadPoolExecutor(2) as pool:
        for name, (system, count, t_end) in systems.items():
            found[name] = medians(ways(system, count, t_end) | loops(pool), repeats)
            walls = {way: f"{1e3 * wall / count:.2f} ms" for way, wall in found[name].items() if "loops" not in way}
            print(f"{name}, {count} cases of {t_end:g} s, per case:", walls)
    gained = {name: wall["one by one"] / wall["two threads"] for name, wall in found.items()}
    print(json.dumps({
        "ensemble_speedup": round(gained["chain"], 3), "ensemble_speedup_small": round(gained["pendulum"], 3),
        "overhead_small": round(found["pendulum"]["one thread"] / found["pendulum"]["one by one"], 3),
        "us_per_small_case": round(1e6 * found["pendulum"]["two threads"] / small, 1),
        "machine_speedup": round(found["chain"]["loops in turn"] / found["chain"]["loops at once"], 3),
    }))  # fmt: skip


if __name__ == "__main__":
    main()
