"""What does it cost to prepare a run, against an evaluation of the accelerations?

    python benchmarks/setup.py [--quick]

Prints three tables, CPU time of one thread but for the last, then one line of JSON. Times that come to nothing against
the machine are ratios to one evaluation of the same system:

- chains of 1000 and 10,000 rigid links, from the list of joints to the first step and its channels: what each part
  costs for each body; `prepare_10000_s_per_body`, the whole over one evaluation, and `prepare_slope`, the exponent of
  the whole over the number of bodies;
- a double pendulum, simulated for 0.01 s: `double_pendulum_new` with a system that is new each time,
  `double_pendulum_same` with the same system again, both over one evaluation;
- the same in two processes one after the other, which begin with an empty cache of compiled code:
  `first_result_over_second`, wall time of the first, which compiles where the package brings no compiled code, over
  that of the second. It takes about as long as the first tests after a change of the kernels.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable

import numpy as np
from chains import arguments, chain, compiled, medians

import modalprep as mp
from modalprep.multibody.packing.tree import pack
from modalprep.multibody.preparation import prepare
from modalprep.multibody.results.record import Recorder

OPTIONS = {"method": "auto", "rtol": 1e-5, "atol": 1e-10}


def laps(count: int) -> dict[str, float]:
    """Return the seconds of each part of preparing a chain."""
    spent = {}

    def lap(name: str, part: Callable) -> object:
        begin = time.process_time()
        found = part()
        spent[name] = time.process_time() - begin
        return found

    system = lap("system", lambda: chain(count))
    lap("pack", lambda: pack(system))
    integration = lap("integration", lambda: prepare(system, np.array([0.0, 0.01]), **OPTIONS))
    recorder = lap("channels", lambda: Recorder(integration, 1))
    lap("first step", lambda: recorder.add(np.zeros(1), integration.steps.y[None]))
    lap("result", lambda: recorder.result("done", "", {}))
    return spent


def evaluation(system: mp.System, rounds: int) -> float:
    """Return the seconds of an evaluation of the accelerations."""
    return 1e-6 * medians([compiled(arguments(system))], rounds)[0]


def long_chains(quick: bool) -> dict[str, float]:
    """Print what the parts cost for each body."""
    whole, rounds = {}, 3 if quick else 9
    laps(10)  # compile
    for count in (1000, 10_000):
        rows = [laps(count) for _ in range(rounds)]
        each = {name: min(row[name] for row in rows) / count for name in rows[0]}
        whole[count] = sum(each.values())
        print(
            f"{count} bodies, us for each: {', '.join(f'{name} {1e6 * t:.1f}' for name, t in each.items())}", flush=True
        )
    own = evaluation(chain(10_000), rounds) / 10_000
    print(f"10,000 bodies: {whole[10_000] * 1e4:.2f} s in all, {whole[10_000] / own:.0f} evaluations")
    return {
        "prepare_10000_s_per_body": round(whole[10_000] / own, 1),
        "prepare_slope": round(1 + float(np.log10(whole[10_000] / whole[1000])), 3),
    }


def double_pendulum(quick: bool) -> dict[str, float]:
    """Print what short runs of a double pendulum cost."""
    system, rounds, found = chain(2), 100 if quick else 400, {}
    own = evaluation(system, 11)
    for name, make in (("new", system.with_), ("same", lambda: system)):
        spent = []
        for _ in range(rounds):
            given, begin = make(), time.process_time()
            mp.simulate(given, t_end=0.01)
            spent.append(time.process_time() - begin)
        found[name] = statistics.median(spent)
        print(f"double pendulum, {name} system: {1e6 * found[name]:.0f} us, {found[name] / own:.0f} evaluations")
    return {f"double_pendulum_{name}": round(value / own) for name, value in found.items()}


def first_results(quick: bool) -> dict[str, float]:
    """Print how long a process takes from its start to its first result, without and with compiled code in its cache.

    The first takes about fifteen seconds on two cores, and is measured once, `quick` or not.
    """
    code = "from chains import chain; import modalprep as mp; mp.simulate(chain(2), t_end=0.01)"
    with tempfile.TemporaryDirectory() as cache:
        spent = []
        for _ in range(2):
            begin = time.perf_counter()
            subprocess.run(
                [sys.executable, "-c", code],
                check=True,
                cwd=os.path.dirname(os.path.abspath(__file__)),
                env=os.environ | {"NUMBA_CACHE_DIR": cache},
            )
            spent.append(time.perf_counter() - begin)
    print(f"first result of a new process: {spent[0]:.1f} s with an empty cache, {spent[1]:.2f} s after that")
    return {"first_result_over_second": round(spent[0] / spent[1], 1)}


def main() -> None:
    """Print the tables and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    quick, found = parser.parse_args().quick, {}
    for table in (long_chains, double_pendulum, first_results):
        found |= table(quick)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
