"""Draws what one evaluation of the accelerations costs over the number of bodies: order n, dense, closed loops.

    python benchmarks/cost_curve.py FILE.png [--quick]

Chains of rigid bodies and of bodies with six modes by the order-n recursion, the latter also the dense way
(dense_chain.py), and scissor masts, whose loops depend on each other (scissor.py), two bodies in a bay. CPU time of one
thread, medians of alternating rounds, over that of one rigid body; LAPACK and the loops are called from Python, which
shows in the shortest.
"""

from __future__ import annotations

import argparse

import numpy as np
from chains import arguments, chain, compiled, medians
from dense_chain import dense
from matplotlib.figure import Figure
from order_n import DENSE_MODES, LONGEST_DENSE
from scissor import evaluation, mast

from modalprep.report.charts.plots import CURVES

COUNTS = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
BAYS = (1, 2, 4, 8, 16, 32)
DENSE = f"{DENSE_MODES} modes a body, dense"


def curves(rounds: int) -> dict[str, tuple[list[int], list[float]]]:
    """Return the number of bodies and the microseconds of every way."""
    calls = {"rigid bodies, order n": {n: compiled(arguments(chain(n))) for n in COUNTS}}
    flexible = {n: arguments(chain(n, DENSE_MODES)) for n in COUNTS}
    calls[f"{DENSE_MODES} modes a body, order n"] = {n: compiled(given) for n, given in flexible.items()}
    short = [n for n in COUNTS if n * (1 + DENSE_MODES) <= LONGEST_DENSE]
    calls[DENSE] = {n: dense(flexible[n])[0] for n in short}
    calls["rigid bodies in closed loops"] = {2 * b: evaluation(mast(b)) for b in BAYS}
    return {name: (list(row), medians(list(row.values()), rounds)) for name, row in calls.items()}


def draw(found: dict[str, tuple[list[int], list[float]]], file: str) -> None:
    """Draw the curves, both axes logarithmic, with the slopes of their last parts."""
    figure = Figure(figsize=(9.0, 5.4), layout="constrained")
    axes = figure.add_subplot()
    one = found["rigid bodies, order n"][1][0]
    for (name, (bodies, spent)), colour, mark in zip(found.items(), CURVES, "osD^", strict=False):
        slope = np.log(spent[-1] / spent[-2]) / np.log(bodies[-1] / bodies[-2])
        axes.loglog(bodies, np.divide(spent, one), color=colour, marker=mark, label=f"{name} (last slope {slope:.1f})")
    axes.set_xlabel("bodies")
    axes.set_ylabel("cost of an evaluation, one rigid body = 1")
    axes.set_title("What the accelerations of a chain cost", loc="left", fontweight="bold")
    axes.grid(which="major", color="#dfe3e6")
    axes.legend(loc="lower right", frameon=False)
    axes.spines[["top", "right"]].set_visible(False)
    figure.savefig(file, dpi=150)


def main() -> None:
    """Measure and draw."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("file", help="picture to write")
    parser.add_argument("--quick", action="store_true", help="fewer rounds")
    given = parser.parse_args()
    draw(curves(7 if given.quick else 31), given.file)


if __name__ == "__main__":
    main()
