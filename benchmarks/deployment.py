"""How does the cost of a step of a deployment grow with the rods that are out, and what does an event cost?

    python benchmarks/deployment.py [--quick]

Prints the CPU time of an evaluation of the equations over that with ten rods, medians of alternating rounds, then one
line of JSON: `deployment_slope`, the exponent of the time over the rods between 100 and 1000, `deployment_1000_vs_10`,
the ratio of both ends, and `event_evaluations`, what one event (a rod more: all arrays packed anew) costs in
evaluations of 100 rods. All beams are cut out of the same 1000 rods: what is stowed costs nothing.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable

import numpy as np
from chains import medians

import modalprep as mp
from modalprep.multibody.deploying.phase import Phase
from modalprep.multibody.deploying.simulate import Run
from modalprep.multibody.evaluation.evaluate import evaluate

RODS = (10, 30, 100, 300, 1000)
TOTAL = 1000


def run(rods: int) -> Run:
    """Return a run that begins with some rods out of a free base, the last of them half out."""
    bus = mp.rigid_body("bus", mass=9.0, centre=np.zeros(3), inertia=np.eye(3), interfaces={"root": np.zeros(3)})
    fly = mp.Joint(name="fly", type="free", parent="ground", child="bus", angular_velocity=np.array([0, 0, 0.1]))
    boom = mp.multibody.Deployment(
        name="boom", parent="bus.root", length=float(TOTAL), segments=TOTAL, mass_per_length=1.0, EI=1.0,
        deployed_length=f"{rods - 0.5} + t/100",
    )  # fmt: skip
    system = mp.multibody.DeployingSystem(bodies={"bus": bus}, joints=(fly,), deployments=(boom,))
    return Run(system, np.array([0.0, 1.0]), {"rtol": 1e-7, "atol": 1e-10}, "explicit")


def evaluation(phase: Phase) -> Callable[[int], None]:
    """Return a call that evaluates the derivative of the state a number of times."""
    model, y = phase.integration.model, phase.steps.y
    ydot = np.zeros_like(y)

    def call(count: int) -> None:
        for _ in range(count):
            evaluate(model, 0.0, y, ydot)

    return call


def event_time(start: Run) -> float:
    """Return the CPU time (microseconds) in which a phase is packed anew."""
    begin = time.process_time()
    Phase(start, start.phase.stages, 0.5, {}, start.phase)
    return (time.process_time() - begin) * 1e6


def main() -> None:
    """Print the curve and the line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    rounds = 7 if parser.parse_args().quick else 31
    runs = [run(rods) for rods in RODS]
    spent = medians([evaluation(start.phase) for start in runs], rounds)
    for rods, cost in zip(RODS, spent, strict=True):
        print(f"{rods:4d} rods out of {TOTAL}: {cost / spent[0]:.2f} times {RODS[0]}")
    events = np.median([event_time(runs[2]) for _ in range(5)]) / spent[2]
    slope = np.log(spent[-1] / spent[2]) / np.log(RODS[-1] / RODS[2])
    figures = {
        "deployment_slope": round(float(slope), 3),
        "deployment_1000_vs_10": round(float(spent[-1] / spent[0]), 1),
        "event_evaluations": round(float(events)),
    }
    print(json.dumps(figures))


if __name__ == "__main__":
    main()
