"""What do the exact derivatives of the equations of motion cost, over one evaluation and against differences?

    python benchmarks/tangent.py [--quick]

Chains of hinged bodies in motion, rigid and with ten modes each; all calls alternate in one run, medians are taken.
Prints a table, then one line of JSON:

- `tangent_over_evaluation`: M, K and D of ten bodies of ten modes over one evaluation of the accelerations, both in
  compiled code, kinematics and inverse dynamics included, into arrays that are there;
- `record_over_evaluation`: the same as `SystemTangent` of Python finds it;
- `per_body`: A and B of `linearise` (an input at every hinge) over one evaluation and the number of bodies, the same
  chain;
- `differences_over_tangent`: the same K and D by differences with extrapolation over the exact ones;
- `tangent_over_pinocchio`: those of the longest rigid chain in compiled code over Pinocchio's derivatives of inverse
  dynamics, one call from Python each (null where it is missing).
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable
from functools import partial

import numpy as np
from chains import SMALL, arguments, chain, compiled, medians
from peers_rigid import pinocchio_derivatives

import modalprep as mp
from modalprep.compiler.jit import bound, compile_kernel
from modalprep.multibody.analysis.differences import jacobian
from modalprep.multibody.analysis.independent_coordinates import Chart
from modalprep.multibody.analysis.tangent import PLACE_STEP, SPEED_STEP, GivenAccelerations, SystemTangent
from modalprep.multibody.evaluation.evaluator import Evaluator
from modalprep.multibody.kernels.articulated_body import outward
from modalprep.multibody.kernels.newton_euler import required_forces
from modalprep.multibody.kernels.tangents.inward import inward_tangents
from modalprep.multibody.kernels.tangents.outward import outward_tangents
from modalprep.multibody.packing.tree import pack


def in_motion(system: mp.System) -> tuple[Evaluator, np.ndarray]:
    """Return a random state with small deflections."""
    evaluator, rng = Evaluator(system), np.random.default_rng(0)
    size = np.array([SMALL if kind == "body" else 0.1 for kind, _ in evaluator.owner])
    y = evaluator.moved(evaluator.start, size * rng.standard_normal(evaluator.nu))
    y[evaluator.nx :] = size * rng.standard_normal(evaluator.nu)
    return evaluator, y


@compile_kernel
def sweeps(model, data, work, y, motion, udot, K, D, M, force, size, count):
    """Find the derivatives a number of times without returning to Python."""
    for _ in range(count):
        outward(model, data, y, motion)
        required_forces(model, data, udot, force)
        outward_tangents(model, data, work)
        inward_tangents(model, data, work, K, D, M, force, size)


def in_compiled_code(system: mp.System, udot: np.ndarray) -> Callable[[int], None]:
    """Return a call that finds the derivatives a number of times, at the state where evaluations are timed."""
    model, data, y, motion, *_ = arguments(system)
    n = len(udot)
    K, D, M = (np.zeros((n, n)) for _ in range(3))
    given = model, data, pack(system).sweep(), y, motion, udot, K, D, M, np.zeros(n), np.zeros(n)
    return bound(sweeps, *given, rest=(int,))


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
    calls = [compiled(arguments(system)), in_compiled_code(system, udot), exact, linearised]
    calls.append(repeated(partial(calls[1], 1)))
    one, tangent, record, linear, call = medians(calls, rounds)
    slow = medians([repeated(differences(chart, udot))], 1)[0]
    print(
        f"{count} bodies of {modes} modes: evaluation {one:.1f} us, M K D {tangent / one:.1f} evaluations "
        f"({record / one:.1f} as a record), A B {linear / one / count:.1f} per body, "
        f"differences {slow / record:.0f} times as long",
        flush=True,
    )
    return {
        "call": call,
        "over": tangent / one,
        "record": record / one,
        "linear": linear / one / count,
        "slow": slow / record,
    }


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
                "record_over_evaluation": round(flexible[-1]["record"], 2),
                "per_body": round(flexible[-1]["linear"], 2),
                "differences_over_tangent": round(flexible[-1]["slow"], 1),
                "tangent_over_pinocchio": None if theirs is None else round(rigid[-1]["call"] / theirs, 3),
            }
        )
    )


if __name__ == "__main__":
    main()
