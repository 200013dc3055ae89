"""What does the gradient of a run cost, over the run, and how far is it from differences of runs?

    python benchmarks/adjoint.py [--quick]

Chains of hinged bodies fall from rest for half a second, by the explicit method, and by the Rosenbrock method with the
same fixed steps, with springs, dampers and a bushing between the bodies, and with the tip on a rail; the gradient is
that of the last angle by eight numbers. Runs and gradients alternate in one process; ratios are of medians. Then the
systems of `tests/differentiated.py`, whose derivatives are compared with differences of runs. Prints tables, then one
line of JSON:

- `reverse_over_run`: the way back through the steps over the run alone, of ten bodies of ten modes (two of two modes
  with --quick);
- `gradient_over_run`: the whole call of `gradient`, its own run and all preparations too, over the run;
- `gradient_over_differences`: the same over differences of sixteen runs;
- `rosenbrock_gradient_over_run`: the call of `gradient` over the run by the Rosenbrock method, of the same chain;
- `alpha_gradient_over_run`: the same by generalised-alpha, for a fifth of the time;
- `sprung_gradient_over_run`: the same of the chain with force elements, by the explicit method, by their numbers;
- `closed_gradient_over_run`: the same of a chain whose tip slides on a rail, by the numbers of its hinges;
- `worst`: the largest relative error of any derivative of the systems, by the name of each.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from statistics import median

import numpy as np
from chains import chain, closed_chain, sprung_chain

import modalprep as mp
from modalprep.sensitivity import last
from modalprep.sensitivity.parameters import find

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from differentiated import CASES, Case

DURATION, STEP, COUNT = 0.5, 2e-3, 8
OF_SPRINGS = [
    *(f"{name}.{what}" for name in ("stay", "s0") for what in ("stiffness", "damping", "free_length")),
    "bush.stiffness.1",
    "bush.damping.4",
]


def timed(call: Callable[[], object]) -> float:
    """Return the time of a call, s."""
    begin = time.perf_counter()
    call()
    return time.perf_counter() - begin


def of_hinges(count: int) -> list[str]:
    """Return eight parameters of the joints of a chain."""
    return [f"j{k}.{what}" for k in range(count) for what in ("angle", "rate", "stiffness", "damping")][:COUNT]


def cost(
    system: mp.System, names: list[str], rounds: int, method: str = "explicit", until: float = DURATION
) -> dict[str, float]:
    """Return the costs of a chain, and print them."""
    count, modes = len(system.bodies), next(iter(system.bodies.values())).n
    given = {"step": STEP, "rtol": 1e-6, "method": method, "output_step": until}
    goal = last(f"j{count - 1}.angle")
    back = []

    def gradient() -> None:
        back.append(float(mp.gradient(system, goal, names, until, **given).stats["reverse_seconds"]))

    calls = {"run": lambda: mp.simulate(system, until, **given), "gradient": gradient}
    spent: dict[str, list[float]] = {name: [] for name in calls}
    for _ in range(rounds + 1):  # the first one compiles
        for name, call in calls.items():
            spent[name].append(timed(call))
    run, whole, reverse = (median(times[1:]) for times in (spent["run"], spent["gradient"], back))
    found = {
        "reverse_over_run": reverse / run,
        "gradient_over_run": whole / run,
        "gradient_over_differences": whole / (2 * len(names) * run),
    }
    text = ", ".join(f"{name} {value:.3g}" for name, value in found.items())
    what = " with springs" * bool(system.loads) + " on a rail" * bool(system.closures)
    print(f"{count:3d} bodies of {modes:2d} modes{what}, {method}: {run * 1e3:9.1f} ms a run, {text}")
    return found


def worst(case: Case) -> float:
    """Return the largest error of the derivatives, relative to that of the channel or a thousandth of its size."""
    found, expected = case.forward(), case.differences()
    sizes = np.array([each.step for each in find(case.system, case.parameters)])
    least = 1e-3 * np.abs(found.values).max(axis=0) / sizes[:, None]
    error = np.abs(found.derivatives - expected).max(axis=1)
    return float((error / np.maximum(np.abs(expected).max(axis=1), least)).max())


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="short chains, few systems, few repetitions")
    quick = parser.parse_args().quick
    warnings.simplefilter("ignore")
    sizes = [(2, 2)] if quick else [(1, 0), (10, 0), (2, 2), (10, 10)]
    rounds = 3 if quick else 9
    costs = [cost(chain(*size), of_hinges(size[0]), rounds) for size in sizes]
    stiff = cost(chain(*sizes[-1]), of_hinges(sizes[-1][0]), rounds, "rosenbrock")
    costs[-1]["rosenbrock_gradient_over_run"] = stiff["gradient_over_run"]
    alpha = cost(chain(*sizes[-1]), of_hinges(sizes[-1][0]), rounds, "generalised_alpha", DURATION / 5)
    costs[-1]["alpha_gradient_over_run"] = alpha["gradient_over_run"]
    springs = [cost(sprung_chain(*size), OF_SPRINGS, rounds) for size in sizes if size[0] > 1]
    costs[-1]["sprung_gradient_over_run"] = springs[-1]["gradient_over_run"]
    closed = [cost(closed_chain(*size), of_hinges(size[0]), rounds) for size in sizes if size[0] > 1]
    costs[-1]["closed_gradient_over_run"] = closed[-1]["gradient_over_run"]
    names = ["four bar", "bouncing rod"] if quick else list(CASES)
    errors = {}
    for name in names:
        errors[name] = worst(CASES[name]())
        print(f"{name:32s} {errors[name]:.1e}")
    print(json.dumps(costs[-1] | {"worst": errors}))


if __name__ == "__main__":
    main()
