"""What do the exact derivatives of the equations of motion cost, over one evaluation and against differences?

    python benchmarks/tangent.py [--quick]

Chains of hinged bodies in motion, rigid and with ten modes each; all calls alternate in one run, medians are taken.
Prints a table, then one line of JSON:

- `tangent_over_evaluation`: M, K and D of ten bodies of ten modes over one evaluation of the accelerations;
- `per_body`: A and B of `linearise` (an input at every hinge) over one evaluation and the number of bodies, the same
  chain;
- `differences_over_tangent`: the same K and D by differences with extrapolation over the exact ones;
- `pinocchio_over_tangent`: Pinocchio's derivatives of the inverse dynamics, called from Python as ours are, over ours,
  of the longest rigid chain (null where it is missing).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable

import numpy as np
from chains import SMALL, arguments, chain, compiled, medians
from peers_rigid import pinocchio_derivatives

import modalprep as mp
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.tangent import PLACE_STEP, SPEED_STEP, GivenAccelerations, SystemTangent
from modalprep.multibody.evaluation.evaluator import Evaluator


def in_motion(system: mp.System) -> tuple[Evaluator, np.ndarray]:
    """Return a random state with small deflections."""
    evaluator, rng = Evaluator(system), np.random.default_rng(0)
    size = np.array([SMALL if kind == "body" else 0.1 for kind, _ in evaluator.owner])
    y = evaluator.moved(evaluator.start, size * rng.standard_normal(evaluator.nu))
    y[evaluator.nx :] = size * rng.standard_normal(evaluator.nu)
    return evaluator, y


def differences(chart: Chart, udot: np.ndarray) -> Callable[[], object]:
    """Return a call for K and D by differences."""
    given, scale, n = GivenAccelerations(chart, udot), chart.evaluator.scale, chart.evaluator.nu
    steps = np.concatenate([PLACE_STEP * scale, SPEED_STEP * scale])
    return lambda: jacobian(lambda z: given.force(chart.moved(z[:n], z[n:]), given.own), steps)


def repeated(call: Callable[[], object]) -> Callable[[int], None]:
    """Return the call a number of times."""

    def calls(count: int) -> None:
        for _ in range(count):
            call()

    return calls


def measured(count: int, modes: int, rounds: int) -> dict[str, float]:
    """Return the costs of a chain, and print them."""
    system = chain(count, modes)
    evaluator, y = in_motion(system)
    chart = Chart(evaluator, y)
    evaluator.load(y)
    udot = evaluator.accelerations(np.zeros(evaluator.nu)).copy()
    hinges = [joint.name for joint in system.joints]
    exact = repeated(lambda: SystemTangent(chart, udot))
    linearised = repeated(lambda: mp.linearise(system, y, inputs=hinges))
    one, tangent, linear = medians([compiled(arguments(system)), exact, linearised], rounds)
    slow = medians([repeated(differences(chart, udot))], 1)[0]
    print(
        f"{count} bodies of {modes} modes: evaluation {one:.1f} us, M K D {tangent / one:.1f} evaluations, "
        f"A B {linear / one / count:.1f} per body, differences {slow / tangent:.0f} times as long",
        flush=True,
    )
    return {"tangent": tangent, "over": tangent / one, "linear": linear / one / count, "slow": slow / tangent}


def main() -> None:
    """Print the table and the line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds and chains")
    quick = parser.parse_args().quick
    rounds = 5 if quick else 25
    rigid = [measured(count, 0, rounds) for count in ((10,) if quick else (1, 10, 30))]
    flexible = [measured(count, 10, rounds) for count in ((10,) if quick else (1, 3, 30, 10))]
    peer = pinocchio_derivatives(10 if quick else 30)
    theirs = None if peer is None else medians([repeated(peer)], 101)[0]
    print(
        json.dumps(
            {
                "tangent_over_evaluation": round(flexible[-1]["over"], 2),
                "per_body": round(flexible[-1]["linear"], 2),
                "differences_over_tangent": round(flexible[-1]["slow"], 1),
                "pinocchio_over_tangent": None if theirs is None else round(theirs / rigid[-1]["tangent"], 3),
            }
        )
    )


if __name__ == "__main__":
    main()
