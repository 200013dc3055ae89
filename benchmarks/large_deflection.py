"""One body with stations, segments of our own, Exudyn's geometrically exact beams, and CalculiX with NLGEOM.

    python benchmarks/large_deflection.py [--quick]

A clamped strip, 1 m by 20 mm by 2 mm of steel:

- *motion*: it falls from level in a gravity that bends it by .4 of its length, for one period of its first mode. The
  error is the largest of ten times against runs of Exudyn with more elements and steps, extrapolated, over the way of
  the tip; counted is CPU time of the quickest setting that reaches an error: of tolerances and numbers of steps, of
  stations and modes, of segments, of elements. Segments are modal bodies welded at beam nodes, the other way to large
  deflections here. Exudyn has its plane element, which is at an advantage over our spatial ones, modified Newton and
  no files;
- *statics*: a dead force at the tip bends it by .4 of its length; the error is that of the tip against the elastica,
  over the length. CalculiX is counted as a whole process, by its CPU time;
- *cost*: CPU time of an evaluation in runs of a cantilever with 12 modes, with 8, 16 and 32 stations over without.

Prints tables, then one line of JSON: `motion` and `statics` have seconds and errors by program, `cost` the ratios.
"""

from __future__ import annotations

import argparse
import json
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

import modalprep as mp
from modalprep.examples import large_cantilever

LENGTH, WIDTH, THICKNESS, E, RHO = 1.0, 0.02, 0.002, 2.1e11, 7850.0
AREA, EI = WIDTH * THICKNESS, E * WIDTH * THICKNESS**3 / 12
GRAVITY = 9.81 * 1.5  # the strip overshoots to .4 of its length
PERIOD = 2 * np.pi / 3.516015 * np.sqrt(RHO * AREA * LENGTH**4 / EI)
OUTPUTS = 10
CELLS = 48


class Outcome(NamedTuple):
    """What a setting needs and reaches."""

    name: str
    seconds: float
    error: float


def strip(length: float, cells: int, modes: int, stations: int, derivatives: int) -> mp.body.FlexibleBody:
    """Return the body of a piece of the strip along x, which bends about y."""
    points = np.zeros((cells + 1, 3))
    points[:, 0] = np.linspace(0, length, cells + 1)
    lines = np.stack([np.arange(cells), np.arange(1, cells + 1)], axis=1)
    mesh = mp.fe.Mesh(points=points, cells={"line": lines}, groups={"line": {"line": np.arange(cells)}})
    steel = mp.Material(E=E, nu=0.3, rho=RHO)
    bending, across = WIDTH * THICKNESS**3 / 12, THICKNESS * WIDTH**3 / 12
    section = mp.Beam(material=steel, A=AREA, Iy=bending, Iz=across, J=4 * bending, theory="euler-bernoulli")
    ends = {"root": mp.Interface(node=1, kind="node")}
    ends["tip"] = mp.Interface(node=cells + 1, kind="node", boundary="fixed")
    model = mp.assemble(mesh, {"line": section}, ends)
    more = ("derivatives",) if derivatives else ()
    reduction = mp.craig_bampton(model, modes=modes, truncation=more, derivatives=derivatives or 1)
    return mp.flexible_body(model, reduction, name="strip", stations=stations)


def chain(pieces: list[mp.body.FlexibleBody], **options) -> mp.System:
    """Return pieces welded to each other and to the ground."""
    names = [f"b{k}" for k in range(len(pieces))]
    parents = ["ground", *(f"{name}.tip" for name in names[:-1])]
    joints = tuple(
        mp.Joint(name=f"j{k}", type="weld", parent=parent, child=name)
        for k, (parent, name) in enumerate(zip(parents, names, strict=True))
    )
    return mp.System(bodies=dict(zip(names, pieces, strict=True)), joints=joints, **options)


def timed(call: Callable) -> tuple[float, object]:
    """Return the CPU seconds of the second call, and what it returns."""
    call()
    begin = time.process_time()
    found = call()
    return time.process_time() - begin, found


def ours(pieces: list[mp.body.FlexibleBody], rtol: float) -> tuple[float, np.ndarray]:
    """Return seconds, and places of the tip (OUTPUTS, 2)."""
    falling = chain(pieces, gravity=np.array([0, 0, -GRAVITY]))
    seconds, run = timed(lambda: mp.simulate(falling, t_end=PERIOD, output_step=PERIOD / OUTPUTS, rtol=rtol))
    tip = run[f"b{len(pieces) - 1}.tip.position"][1:]
    return seconds, tip[:, [0, 2]]


def exudyn_runs() -> Callable[..., tuple[float, np.ndarray]] | None:
    """Return a run of Exudyn by elements and steps: the same; None where it is not installed."""
    sys.exudynFast = True
    try:
        import exudyn as exu
        from exudyn import itemInterface as items
    except ImportError:
        return None
    exu.SetWriteToConsole(False)

    def run(cells: int, steps: int) -> tuple[float, np.ndarray]:
        container = exu.SystemContainer()
        mbs = container.AddSystem()
        sensor = exact_beam(mbs, exu, items, cells)
        settings = exu.SimulationSettings()
        settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = PERIOD, steps
        settings.timeIntegration.newton.useModifiedNewton = True
        settings.timeIntegration.newton.relativeTolerance = 1e-5  # forces of stretch have round-off
        settings.timeIntegration.newton.absoluteTolerance = 1e-6
        settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
        settings.linearSolverType = exu.LinearSolverType.EigenSparse
        settings.solution.sensors.writePeriod = PERIOD / OUTPUTS
        settings.solution.file.write = False
        settings.timeIntegration.verboseMode = 0
        begin = time.process_time()
        mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha)
        spent = time.process_time() - begin
        return spent, np.array(mbs.GetSensorStoredData(sensor))[1:, 1:3]

    return run


def exact_beam(mbs, exu, items, cells: int) -> int:
    """Fill an Exudyn system with a clamped beam in gravity; returns the sensor of its tip."""
    nodes = [
        mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=[LENGTH * k / cells, 0, 0])) for k in range(cells + 1)
    ]
    G = E / 2.6
    for k in range(cells):
        beam = mbs.AddObject(
            items.ObjectBeamGeometricallyExact2D(
                nodeNumbers=[nodes[k], nodes[k + 1]], physicsLength=LENGTH / cells, physicsMassPerLength=RHO * AREA,
                physicsCrossSectionInertia=RHO * WIDTH * THICKNESS**3 / 12, physicsBendingStiffness=EI,
                physicsAxialStiffness=E * AREA, physicsShearStiffness=G * AREA * 5 / 6,
            )
        )  # fmt: skip
        marker = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=beam))
        mbs.AddLoad(items.LoadMassProportional(markerNumber=marker, loadVector=[0, -GRAVITY, 0]))
    ground = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=mbs.AddNode(items.NodePointGround()), coordinate=0))
    for c in range(3):
        held = mbs.AddMarker(items.MarkerNodeCoordinate(nodeNumber=nodes[0], coordinate=c))
        mbs.AddObject(items.ObjectConnectorCoordinate(markerNumbers=[ground, held]))
    sensor = items.SensorNode(
        nodeNumber=nodes[-1], outputVariableType=exu.OutputVariableType.Position, storeInternal=True
    )
    number = mbs.AddSensor(sensor)
    mbs.Assemble()
    return number


def motions(run: Callable, quick: bool) -> Iterator[Outcome]:
    """Yield what each program needs in the fall."""
    coarse, finer = (run(n, 2000 if quick else 8000)[1] for n in ((32, 64) if quick else (64, 128)))
    fine = (4 * finer - coarse) / 3
    travel = np.linalg.norm(fine[:, None] - fine, axis=2).max()

    def outcome(name: str, found: tuple[float, np.ndarray]) -> Outcome:
        return Outcome(name, found[0], float(np.linalg.norm(found[1] - fine, axis=1).max() / travel))

    for stations, modes in ((8, 3), (16, 3)) if quick else ((4, 2), (8, 2), (8, 3), (16, 3), (16, 4), (32, 4)):
        body = strip(LENGTH, CELLS, modes, stations, 3)
        for rtol in (1e-4,) if quick else (1e-3, 1e-4, 1e-6):
            yield outcome("stations", ours([body], rtol))
    for pieces in (4,) if quick else (4, 8, 12):
        piece = strip(LENGTH / pieces, CELLS // pieces, 0, 0, 0)
        yield outcome("segments", ours([piece] * pieces, 1e-4))
    for cells in (16, 32) if quick else (8, 16, 32):
        for steps in (250, 1000) if quick else (100, 250, 500, 1000, 2000):
            yield outcome("Exudyn", run(cells, steps))


def elastica(w: float) -> tuple[float, float]:
    """Return ``P L^2 / EI`` and the shortening over L of a cantilever whose tip deflects by w L (Bisshopp 1945)."""
    from scipy.optimize import brentq
    from scipy.special import ellipe, ellipeinc, ellipk, ellipkinc

    def tip(p: float) -> tuple[float, float]:
        def gap(angle: float) -> float:
            m = (1 + np.sin(angle)) / 2
            return ellipk(m) - ellipkinc(np.arcsin(1 / np.sqrt(2 * m)), m) - np.sqrt(p)

        angle = brentq(gap, 1e-9, np.pi / 2 - 1e-12)
        m = (1 + np.sin(angle)) / 2
        long = ellipe(m) - ellipeinc(np.arcsin(1 / np.sqrt(2 * m)), m)
        return 1 - 2 * long / np.sqrt(p), 1 - np.sqrt(2 * np.sin(angle) / p)

    load = brentq(lambda p: tip(p)[0] - w, 1e-3, 60)
    return load, tip(load)[1]


def statics(quick: bool) -> Iterator[Outcome]:
    """Yield what each program needs for the elastica at .4 of the length."""
    load, shorter = elastica(0.4)
    exact = np.array([1 - shorter, 0.4]) * LENGTH
    force = load * EI / LENGTH**2
    pushed = (mp.PointForce(name="push", at="b0.tip", force=np.array([0, 0, force])),)
    for stations in (8, 16):
        held = chain([strip(LENGTH, CELLS, 4, stations, 3)], loads=pushed)
        seconds, rest = timed(lambda held=held: mp.static_equilibrium(held))
        tip = rest["b0.tip.position"][[0, 2]]
        yield Outcome("stations", seconds, float(np.linalg.norm(tip - exact) / LENGTH))
    if shutil.which("ccx"):
        for cells in (12,) if quick else (12, 24, 48):
            seconds, tip = calculix(cells, force)
            yield Outcome("CalculiX", seconds, float(np.linalg.norm(tip - exact) / LENGTH))


def calculix(cells: int, force: float) -> tuple[float, np.ndarray]:
    """Return seconds of CalculiX for so many quadratic beams, and the place of the tip."""
    nodes = "".join(f"{k + 1},{LENGTH * k / (2 * cells):.9g},0,0\n" for k in range(2 * cells + 1))
    lines = "".join(f"{k + 1},{2 * k + 1},{2 * k + 2},{2 * k + 3}\n" for k in range(cells))
    last = 2 * cells + 1
    deck = (
        f"*NODE,NSET=ALL\n{nodes}*ELEMENT,TYPE=B32R,ELSET=STRIP\n{lines}*NSET,NSET=TIP\n{last}\n"
        f"*MATERIAL,NAME=STEEL\n*ELASTIC\n{E:g},0.\n*DENSITY\n{RHO:g}\n"
        f"*BEAM SECTION,ELSET=STRIP,MATERIAL=STEEL,SECTION=RECT\n{WIDTH:g},{THICKNESS:g}\n0,1,0\n"
        f"*BOUNDARY\n1,1,6\n*STEP,NLGEOM,INC=1000\n*STATIC\n0.1,1.\n"
        f"*CLOAD\n{last},3,{force:.12g}\n*NODE PRINT,NSET=TIP,FREQUENCY=1000\nU\n*END STEP\n"
    )
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "strip.inp").write_text(deck)
        begin = os.times().children_user
        subprocess.run(["ccx", "strip"], cwd=folder, check=True, capture_output=True)
        seconds = os.times().children_user - begin
        rows = [line.split() for line in Path(folder, "strip.dat").read_text().splitlines()]
    moved = [list(map(float, row[1:4])) for row in rows if len(row) == 4 and row[0] == str(last)][-1]
    return seconds, np.array([LENGTH + moved[0], moved[2]])


def cost(quick: bool) -> dict[str, float]:
    """Return the seconds of an evaluation of a cantilever of 12 modes with stations over those without."""
    bodies = {str(stations): large_cantilever(modes=2, stations=stations) for stations in (8, 16, 32)}
    bodies["none"] = bodies["8"].with_(stations=None)
    hinge = mp.Joint(name="hinge", type="revolute", parent="ground", child="b0", axis=(0, 1, 0))
    systems = {
        name: mp.System(bodies={"b0": body}, joints=(hinge,), gravity=np.array([0, 0, -9.81]))
        for name, body in bodies.items()
    }
    best = dict.fromkeys(systems, np.inf)
    for _ in range(3 if quick else 10):
        for name, system in systems.items():
            begin = time.process_time()
            run = mp.simulate(system, t_end=1.0, output_step=1.0, rtol=1e-8, method="explicit")
            best[name] = min(best[name], (time.process_time() - begin) / run.stats["evaluations"])
    return {name: round(seconds / best["none"], 2) for name, seconds in best.items() if name != "none"}


def printed(title: str, found: list[Outcome]) -> dict[str, list[list[float]]]:
    """Print outcomes; returns seconds and errors by program, of those that no other of it beats in both."""
    print(f"{title}: program, seconds, error")
    kept: dict[str, list[list[float]]] = {}
    for each in sorted(found, key=lambda x: (x.name, x.error)):
        print(f"  {each.name:10} {each.seconds:9.4f} {each.error:9.1e}")
        rows = kept.setdefault(each.name, [])
        if not rows or each.seconds < rows[-1][0]:
            rows.append([round(each.seconds, 5), float(f"{each.error:.2g}")])
    return kept


def main() -> None:
    """Print the tables, and the JSON line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--quick", action="store_true", help="few settings, less than a minute")
    quick = parser.parse_args().quick
    run = exudyn_runs()
    found = {"cost": cost(quick), "statics": printed("statics", list(statics(quick)))}
    if run:
        found["motion"] = printed("motion", list(motions(run, quick)))
    print(json.dumps(found))


if __name__ == "__main__":
    main()
