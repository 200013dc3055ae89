"""How many evaluations does a given accuracy take: adaptive steps against the best fixed one, and all methods?

    python benchmarks/work_precision.py [--quick] [--long] [FILE.png]

Each of the twelve motions of motions.py runs at tolerances from 1e-2 to 1e-7 (--quick: two of them; --long: three more
motions, whose fine runs take minutes). The error is the largest distance from a fine run at twenty times, over the
largest distance of two of its places; the fine run is that of the explicit method of order 8. Printed are evaluations,
those over the evaluations of fixed steps of the same method that are as accurate, with all finer ones too, and error
over tolerance. The last line is JSON: `adaptive_over_fixed` and `error_over_tolerance`, the worst, and by motion.

With a FILE a picture is drawn of error against time: our methods, SciPy's Radau on our equations where there are no
closed loops, and Exudyn, if it is installed, on the mechanisms of peers_flexible.py. All is CPU time of the step loop.
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Iterator
from typing import NamedTuple

import matplotlib as mpl
import matplotlib.ticker
import numpy as np
import peers_flexible
from motions import LONG, MOTIONS, Motion
from peers_flexible import Counted
from scipy.integrate import Radau

import modalprep as mp
from modalprep.multibody import simulate
from modalprep.multibody.evaluation.evaluate import evaluate

OUTPUTS = 20
TOLERANCES, FEW = (1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7), (1e-3, 1e-5)
DEAR = 3e5  # evaluations of a run
ENOUGH = 3.0  # times the evaluations of adaptive steps are counted of fixed ones
FINER = 1.5  # steps of a series, each over the one before
LATEST = 3.0  # s, of a peer's run
PEERS = {
    "chain of 5, 6 modes": lambda: peers_flexible.swing(6),
    "chain of 5, 12 modes": lambda: peers_flexible.swing(12),
    "slider crank, 6 modes": lambda: peers_flexible.slider_crank(6),
    "slider crank, 12 modes": lambda: peers_flexible.slider_crank(12),
}
STYLES = {
    "Rosenbrock, adaptive": ("C0", "o-"),
    "Rosenbrock, fixed steps": ("C0", "--"),
    "generalised-alpha": ("C1", "s-"),
    "explicit, DOP853": ("C2", "^-"),
    "SciPy's Radau": ("C3", "x-"),
    "Exudyn": ("C4", "d-"),
}


class Point(NamedTuple):
    """One run: its setting, evaluations, CPU time (s) and error."""

    setting: float
    evaluations: float
    spent: float
    error: float


class Measured:
    """A motion with its fine run."""

    def __init__(self, motion: Motion) -> None:
        self.motion, self.times = motion, motion.t_end * np.arange(1, OUTPUTS + 1) / OUTPUTS
        self.fine = self.places(method="explicit", rtol=1e-9, atol=1e-12)[0]
        self.travel = np.linalg.norm(self.fine[:, None] - self.fine, axis=2).max()

    def places(self, **options) -> tuple[np.ndarray, mp.Result]:
        """Return the places (OUTPUTS, 3) of a run, and the run."""
        motion = self.motion
        run = mp.simulate(
            motion.system, motion.t_end, output_step=motion.t_end / OUTPUTS, events=motion.events, **options
        )
        rows = [np.abs(run.time - t).argmin() for t in self.times]
        return run[motion.followed][rows], run

    def error(self, places: np.ndarray) -> float:
        """Return the largest distance from the fine run, relative to the way."""
        return float(np.linalg.norm(places - self.fine, axis=1).max() / self.travel)

    def point(self, setting: float, **options) -> Point:
        """Return what a run took, and its error; infinite where it does not come to its end."""
        try:
            places, run = self.places(**options)
        except mp.SimulationError:  # a step too long
            return Point(setting, np.nan, np.nan, np.inf)
        return Point(setting, run.stats["evaluations"], Counted.last.spent, self.error(places))

    def adaptive(self, method: str, tolerances: tuple[float, ...]) -> list[Point]:
        """Return runs at these tolerances, as long as none is dear."""
        found: list[Point] = []
        for rtol in tolerances:
            found.append(self.point(rtol, method=method, rtol=rtol))
            if found[-1].evaluations > DEAR:
                break
        return found

    def fixed(self, finest: float, most: float) -> list[Point]:
        """Return runs of fixed steps, from ten on, to an error below `finest` or evaluations above `most`."""
        found, steps = [], 10.0
        while not found or not (found[-1].error < finest or found[-1].evaluations > most):
            step = self.motion.t_end / int(steps)
            found.append(self.point(step, method="rosenbrock", step=step))
            steps *= FINER
        return found

    def radau(self) -> Iterator[Point]:
        """Yield runs of SciPy's Radau, Jacobians by differences, as long as they are quick."""
        motion = self.motion
        start = simulate.prepare(motion.system, np.array([0.0, *self.times]), method="explicit", rtol=1.0, atol=1.0)
        if len(start.loading.stretches) > 1:  # it would have to begin again where a function of time changes its piece
            return
        for rtol in TOLERANCES:
            found = self._radau(rtol, start)
            if found is None:
                return
            yield found

    def _radau(self, rtol: float, start) -> Point | None:
        eq, begin, rate, states = start.equations, time.process_time(), np.zeros_like(start.steps.y), []

        def rates(t: float, y: np.ndarray) -> np.ndarray:
            evaluate(eq, t, y, rate)
            return rate.copy()

        solver = Radau(rates, 0.0, start.steps.y.copy(), self.motion.t_end, rtol=rtol, atol=1e-3 * rtol)
        while solver.status == "running":
            solver.step()
            between = solver.dense_output()
            states += [between(t) for t in self.times[len(states) :] if t <= solver.t]
            if time.process_time() - begin > LATEST or solver.status == "failed":
                return None
        spent = time.process_time() - begin
        places = [simulate.channels_at(self.motion.system, y[:-1], 0.0)[self.motion.followed][0] for y in states]
        return Point(rtol, solver.nfev, spent, self.error(np.array(places)))


def needed(fixed: list[Point], error: float) -> float:
    """Return the evaluations from which on all fixed steps are as accurate, between two by the power law."""
    count = np.array([point.evaluations for point in fixed])
    worst = np.maximum.accumulate([point.error for point in fixed][::-1])[::-1]
    if error >= worst[0]:
        return float(count[0])
    if error < worst[-1]:  # round-off, or too many: of order 3
        return float(count[-1] * (worst[-1] / error) ** (1 / 3))
    k = int(np.argmax(worst <= error))
    if not np.isfinite(worst[k - 1]) or worst[k - 1] == worst[k]:
        return float(count[k])
    share = np.log(worst[k - 1] / error) / np.log(worst[k - 1] / worst[k])
    return float(count[k - 1] * (count[k] / count[k - 1]) ** share)


def exudyn(name: str) -> list[Point]:
    """Return the quickest of Exudyn's settings for each error that it reaches; against its own fine run."""
    case = PEERS[name]()
    run = peers_flexible.exudyn(case)
    if run is None:
        return []
    fine = run(steps=2 * peers_flexible.STEPS[-1], tolerance=1e-8, rho=0.9, sparse=False)[1]
    found = []
    for options in (options for ladder in peers_flexible.ladders(True) for options in ladder):
        try:
            spent, places = run(**options)
        except Exception:  # a step too long for it
            continue
        found.append(Point(options["steps"], np.nan, spent, peers_flexible.error(places, fine)))
    best: list[Point] = []
    for point in sorted(found, key=lambda point: point.spent):
        if not best or point.error < 0.7 * best[-1].error:
            best.append(point)
    return best


def measured(name: str, motion: Motion, quick: bool, draws: bool) -> tuple[dict[str, list[Point]], list[tuple]]:
    """Return curves by method, and for each tolerance its evaluations, over those of fixed steps, error over it."""
    case = Measured(motion)
    adaptive = case.adaptive("rosenbrock", FEW if quick else TOLERANCES)
    fixed = case.fixed(min(point.error for point in adaptive), ENOUGH * adaptive[-1].evaluations)
    curves = {"Rosenbrock, adaptive": adaptive, "Rosenbrock, fixed steps": fixed}
    if draws:
        curves["generalised-alpha"] = case.adaptive("generalised_alpha", TOLERANCES[:5])
        curves["explicit, DOP853"] = case.adaptive("explicit", TOLERANCES[1::2])
        curves["SciPy's Radau"] = [] if motion.system.closures else list(case.radau())
        curves["Exudyn"] = exudyn(name) if name in PEERS else []
    rows = [(p.setting, p.evaluations, p.evaluations / needed(fixed, p.error), p.error / p.setting) for p in adaptive]
    return curves, rows


def draw(curves: dict[str, dict[str, list[Point]]], path: str) -> None:
    """Draw error against time, a panel for each motion."""
    from matplotlib.figure import Figure

    mpl.rcParams.update({"font.size": 8, "axes.titlesize": 8})
    columns = 3
    figure = Figure(figsize=(8, 2.1 * -(-len(curves) // columns)), layout="constrained")
    axes = figure.subplots(-(-len(curves) // columns), columns, squeeze=False).ravel()
    for axis, (name, found) in zip(axes, curves.items(), strict=False):
        for method, points in found.items():
            rows = [p for p in points if np.isfinite(p.error) and p.error < 1.0]
            colour, line = STYLES[method]
            axis.loglog([1e3 * p.spent for p in rows], [p.error for p in rows], line, color=colour, ms=3, lw=1)
        axis.set_title(name)
        axis.grid(alpha=0.3)
        axis.set_ylim(1e-9, 1)
        axis.xaxis.set_minor_formatter(mpl.ticker.NullFormatter())
        axis.xaxis.set_major_locator(mpl.ticker.LogLocator(numticks=9))
    for axis in axes[len(curves) :]:
        axis.set_axis_off()
    for axis in axes[max(0, len(curves) - columns) : len(curves)]:
        axis.set_xlabel("CPU time (ms)")
    for axis in axes[::columns]:
        axis.set_ylabel("relative error")
    lines = [mpl.lines.Line2D([], [], color=colour, ls="--" if line == "--" else "-", marker=line[0].strip("-"), ms=3)
             for colour, line in STYLES.values()]  # fmt: skip
    figure.legend(lines, list(STYLES), loc="outside upper center", ncols=3, frameon=False)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Print a row for each motion, draw the picture, and print the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="two tolerances")
    parser.add_argument("--long", action="store_true", help="three more motions, minutes of fine runs")
    parser.add_argument("file", nargs="?", metavar="FILE.png", help="draw the diagram of all methods")
    asked = parser.parse_args()
    simulate.Integration = Counted
    curves, ratios, errors = {}, {}, {}
    for name, make in (MOTIONS | LONG if asked.long else MOTIONS).items():
        curves[name], rows = measured(name, make(), asked.quick, bool(asked.file))
        each = ", ".join(f"{t:.0e}: {n:.0f} ({r:.2f}, {e:.2g})" for t, n, r, e in rows)
        print(f"{name}, evaluations (over fixed steps, error over tolerance) {each}", flush=True)
        ratios[name], errors[name] = (round(max(row[k] for row in rows), 2) for k in (2, 3))
    if asked.file:
        draw(curves, asked.file)
    found = {"adaptive_over_fixed": max(ratios.values()), "error_over_tolerance": max(errors.values())}
    print(json.dumps(found | {"adaptive_over_fixed_by_motion": ratios, "error_over_tolerance_by_motion": errors}))


if __name__ == "__main__":
    main()
