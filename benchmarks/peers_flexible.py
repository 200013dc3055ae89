"""Flexible mechanisms here and in Exudyn: the time each needs to follow its interface to a given relative error.

Both integrate the same conventional modal bodies (Exudyn has no geometric stiffness), three-dimensional. The error is
the largest of ten times against a fine run of the same program, over the way it goes. Exudyn runs its fast module,
generalized-alpha or the trapezoidal rule, modified Newton, one sensor and no files; counted is SolveDynamic, of the
quickest of several tolerances, solvers and numbers of steps that reach the accuracy. Counted of ours is the same:
scratch, choice of the method, the step loop, states at the output times; not the channels that `simulate` makes of
them. All is CPU time. Exudyn is general: redundant coordinates, any topology, contact.
"""

from __future__ import annotations

import itertools
import multiprocessing
import statistics
import sys
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import numpy as np

import modalprep as mp
from modalprep.examples import beam_mesh, spinup_section
from modalprep.formats.exudyn import write_exudyn
from modalprep.multibody import simulate
from modalprep.multibody.integration.run import Integration

OUTPUTS = 10
GRAVITY = np.array([0, -9.81, 0])
STEPS = tuple(10 * 2**k for k in range(9))  # 10 to 2560 in the whole time


class Case(NamedTuple):
    """A mechanism of equal theory in both programs: revolute joints about z, beams from root to tip."""

    name: str
    bodies: tuple[mp.body.FlexibleBody, ...]
    angles: tuple[float, ...]  # rad, of each joint
    slides: bool  # the last tip on the x axis through the origin
    watched: int  # body whose tip is followed
    t_end: float  # s


def beam(length: float, modes: int) -> mp.body.FlexibleBody:
    """Aluminium beam of square section, 20 mm: six constraint modes of its tip, the others with the tip fixed."""
    a = 0.02
    section = spinup_section(A=a**2, Iy=a**4 / 12, Iz=a**4 / 12, J=0.14 * a**4)
    ends = {name: mp.Interface(group=name, kind="node") for name in ("root", "tip")}
    model = mp.assemble(beam_mesh(20, length), {"beam": section}, ends)
    reduction = mp.craig_bampton(model, modes=modes - 6, truncation=()) if modes > 6 else mp.guyan(model)
    return mp.flexible_body(model, reduction, name="link").conventional()


def swing(modes: int) -> Case:
    """Return a chain of five that starts level and falls."""
    return Case(f"5 bodies of {modes} modes", (beam(0.5, modes),) * 5, (0.0,) * 5, False, 4, 0.8)


def slider_crank(modes: int) -> Case:
    """Return a crank and a rod, flexible, whose end slides on the x axis; it starts at 60 degrees and falls."""
    crank, rod, angle = 0.3, 0.5, np.pi / 3
    fold = -np.arcsin(crank / rod * np.sin(angle)) - angle
    return Case(
        f"slider-crank of {modes} modes each", (beam(crank, modes), beam(rod, modes)), (angle, fold), True, 0, 0.6
    )


def system(case: Case) -> mp.System:
    """Return the mechanism as a tree, and its closure."""
    parents = ["ground", *(f"b{i}.tip" for i in range(len(case.bodies) - 1))]
    joints = tuple(
        mp.Joint(name=f"j{i}", type="revolute", parent=parent, child=f"b{i}", angle=angle)
        for i, (parent, angle) in enumerate(zip(parents, case.angles, strict=True))
    )
    last = f"b{len(case.bodies) - 1}.tip"
    slide = mp.multibody.Closure(name="slide", type="point_on_line", a="ground", b=last, axis=np.array([1.0, 0, 0]))
    bodies = {f"b{i}": body for i, body in enumerate(case.bodies)}
    return mp.System(bodies=bodies, joints=joints, closures=(slide,) if case.slides else (), gravity=GRAVITY)


class Counted(Integration):
    """A run that counts its own seconds, without what is made of its samples."""

    last: Counted

    def __init__(self, *given, **options) -> None:
        begin = time.process_time()
        super().__init__(*given, **options)
        self.spent, Counted.last = time.process_time() - begin, self

    def run(self, record, progress):
        def outside(*samples) -> None:
            begin = time.process_time()
            record(*samples)
            self.spent -= time.process_time() - begin

        begin = time.process_time()
        outcome = super().run(outside, progress)
        self.spent += time.process_time() - begin
        return outcome


def ours(case: Case) -> Callable[..., tuple[float, np.ndarray]]:
    """Return a run by options of `simulate`: seconds, and places of the watched tip (OUTPUTS, 3)."""
    made = system(case)
    simulate.Integration = Counted

    def run(**options) -> tuple[float, np.ndarray]:
        found = mp.simulate(made, t_end=case.t_end, output_step=case.t_end / OUTPUTS, **options)
        return Counted.last.spent, found[f"b{case.watched}.tip.position"][1:]

    return run


def exudyn(case: Case) -> Callable[..., tuple[float, np.ndarray]] | None:
    """Return a run of Exudyn by steps, tolerances and solver: the same; None where it is not installed."""
    sys.exudynFast = True
    try:
        import exudyn as exu
        from exudyn import FEM, itemInterface
    except ImportError:
        return None
    exu.SetWriteToConsole(False)
    folder = tempfile.TemporaryDirectory()
    files = {id(b): write_exudyn(b, Path(folder.name) / f"{i}.npz") for i, b in enumerate(case.bodies)}

    def run(*, steps: int, tolerance: float, rho: float | None, sparse: bool) -> tuple[float, np.ndarray]:
        container = exu.SystemContainer()
        mbs = container.AddSystem()
        sensor = assembled(case, mbs, files, exu, FEM, itemInterface)
        settings = exudyn_settings(exu, case, steps, tolerance, rho, sparse)
        begin = time.process_time()
        mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)
        spent = time.process_time() - begin
        return spent, np.array(mbs.GetSensorStoredData(sensor))[1:, 1:]

    run.folder = folder  # its files live as long as the run
    return run


def assembled(case: Case, mbs, files: dict, exu, FEM, items) -> int:
    """Fill an Exudyn system; returns the sensor of the watched tip."""
    origin, angle = np.zeros(3), 0.0
    ground = mbs.AddObject(items.ObjectGround())
    before = wall = mbs.AddMarker(items.MarkerBodyRigid(bodyNumber=ground))
    for i, (body, turn) in enumerate(zip(case.bodies, case.angles, strict=True)):
        angle += turn
        R = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
        reduced = FEM.ObjectFFRFreducedOrderInterface()
        reduced.LoadFromFile(str(files[id(body)]), mode="NPZ")
        added = reduced.AddObjectFFRFreducedOrder(mbs, positionRef=origin, rotationMatrixRef=R, gravity=GRAVITY)
        root = mbs.AddMarker(items.MarkerNodeRigid(nodeNumber=added["nRigidBody"]))
        mbs.AddObject(items.ObjectJointGeneric(markerNumbers=[before, root], constrainedAxes=[1, 1, 1, 1, 1, 0]))
        number, six = added["oFFRFreducedOrder"], len(body.points) + 6 + np.arange(6)
        tip = items.MarkerSuperElementRigid(bodyNumber=number, meshNodeNumbers=six, weightingFactors=[1 / 6] * 6)
        before = mbs.AddMarker(tip)
        if i == case.watched:
            watched = items.SensorMarker(
                markerNumber=before, outputVariableType=exu.OutputVariableType.Position, storeInternal=True
            )
        origin = origin + R @ body.interface_position[1]
    if case.slides:
        mbs.AddObject(items.ObjectJointGeneric(markerNumbers=[wall, before], constrainedAxes=[0, 1, 1, 0, 0, 0]))
    sensor = mbs.AddSensor(watched)
    mbs.Assemble()
    return sensor


def exudyn_settings(exu, case: Case, steps: int, tolerance: float, rho: float | None, sparse: bool):
    """Return settings of a run; rho None is the trapezoidal rule."""
    settings = exu.SimulationSettings()
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = case.t_end, steps
    newton, alpha = settings.timeIntegration.newton, settings.timeIntegration.generalizedAlpha
    newton.useModifiedNewton, newton.relativeTolerance, newton.absoluteTolerance = True, tolerance, tolerance / 10
    alpha.useNewmark = alpha.useIndex2Constraints = rho is None
    alpha.spectralRadius = rho or 1.0
    settings.linearSolverType = exu.LinearSolverType.EigenSparse if sparse else exu.LinearSolverType.EXUdense
    settings.solution.sensors.writePeriod = case.t_end / OUTPUTS
    settings.solution.file.write = False
    settings.timeIntegration.verboseMode = 0
    return settings


def error(found: np.ndarray, fine: np.ndarray) -> float:
    """Largest distance from the fine run, over the longest way between two output times."""
    if found.shape != fine.shape or not np.all(np.isfinite(found)):
        return np.inf
    travel = np.linalg.norm(fine[:, None] - fine, axis=2).max()
    return float(np.linalg.norm(found - fine, axis=1).max() / travel)


def ladders(quick: bool) -> Iterator[list[dict]]:
    """Yield series of Exudyn's settings, each from coarse to fine."""
    tolerances, sparse = ((1e-4, 1e-6), (False,)) if quick else ((1e-3, 1e-4, 1e-5, 1e-6, 1e-8), (False, True))
    for tolerance, rho, way in itertools.product(tolerances, (0.9, 0.6, None), sparse):
        yield [{"steps": n, "tolerance": tolerance, "rho": rho, "sparse": way} for n in STEPS]


def own_ladders(case: Case, quick: bool) -> Iterator[list[dict]]:
    """Yield series of our settings: the default method first."""
    for method in ("auto", "generalised_alpha", "rosenbrock", *(() if quick else ("explicit",))):  # half decades
        yield [{"method": method, "rtol": 10.0 ** (-k / 2)} for k in range(3, 16)]
    for method in ("generalised_alpha", "rosenbrock"):
        yield [{"method": method, "step": case.t_end / n, "rtol": 1e-3} for n in STEPS]


def apart(run: Callable) -> Callable:
    """Return a run in a process of its own: Exudyn 1.13 ends its process where some steps of 12 modes diverge."""
    context = multiprocessing.get_context("fork")

    def call(**options) -> tuple[float, np.ndarray]:
        here, there = context.Pipe(duplex=False)

        def answer() -> None:
            with suppress(Exception):  # then nothing is sent
                there.send(run(**options))

        child = context.Process(target=answer)
        child.start()
        there.close()
        try:
            return here.recv()
        finally:
            child.join()

    return call


def quickest(run: Callable, series: Iterable[list[dict]], fine: np.ndarray, wanted: float) -> dict | None:
    """Return the settings that reach the error soonest; None when none does."""
    best: tuple[float, dict | None] = (np.inf, None)
    for ladder in series:
        for options in ladder:
            try:
                spent, found = run(**options)
            except Exception:  # a step too long for one of the programs
                continue
            if error(found, fine) <= wanted:
                spent = min(spent, run(**options)[0])
                best = min(best, (spent, options), key=lambda pair: pair[0])
                break
            if spent > 2 * best[0]:
                break
    return best[1]


def compare(case: Case, wanted: float, quick: bool, fine: tuple[np.ndarray, np.ndarray]) -> tuple[float, float] | None:
    """Print and return Exudyn's time over ours, default method and best, at an error: medians of alternating runs.

    Each follows one like it, which is not counted. Straight after the other program a run of half a millisecond takes
    half as long again, by what that has left in the caches.
    """
    here, there = ours(case), exudyn(case)
    series = list(own_ladders(case, quick))
    settings = [quickest(here, series[:1], fine[0], wanted), quickest(here, series, fine[0], wanted)]
    settings.append(quickest(apart(there), ladders(quick), fine[1], wanted))
    if None in settings:
        print(f"{case.name}, error {wanted:g}: not reached by {[s is not None for s in settings]}")
        return None
    spent: list[list[float]] = [[], [], []]
    for _ in range(5 if quick else 15):
        for times, run, options in zip(spent, (here, here, there), settings, strict=True):
            run(**options)  # caches then hold what this program needs, not what the other one left
            times.append(run(**options)[0])
    default, best, theirs = (statistics.median(times) for times in spent)
    print(
        f"{case.name}, error {wanted:g}: Exudyn takes {theirs / default:.2f} times our default, "
        f"{theirs / best:.2f} times our best"
    )
    print(f"  Exudyn {settings[2]}; ours {settings[0]}, best {settings[1]}", flush=True)
    return theirs / default, theirs / best


def flexible(quick: bool) -> dict[str, float | None]:
    """Print the comparisons; return the smallest ratios of the default method, null without Exudyn."""
    cases = (swing(6), slider_crank(6)) if quick else (swing(6), swing(12), slider_crank(6), slider_crank(12))
    found: dict[float, list] = {1e-3: [], 1e-5: []}
    for case in cases:
        if exudyn(case) is None:
            return dict.fromkeys(("flexible_vs_exudyn_1e3", "flexible_vs_exudyn_1e5"))
        here, there = ours(case), exudyn(case)
        fine = (
            here(method="explicit", rtol=1e-9)[1],
            there(steps=2 * STEPS[-1], tolerance=1e-8, rho=0.9, sparse=False)[1],
        )
        for wanted, ratios in found.items():
            ratios.append(compare(case, wanted, quick, fine))
    return {
        f"flexible_vs_exudyn_{name}": min((round(r[0], 2) for r in found[wanted] if r), default=None)
        for name, wanted in (("1e3", 1e-3), ("1e5", 1e-5))
    }
