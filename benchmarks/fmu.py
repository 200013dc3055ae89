"""What a step of an FMU costs, over a step of `simulate`: the same kernels, linked by zig and called from C.

    python benchmarks/fmu.py [--quick]

Co-simulation FMUs of small systems take one communication step over the whole span, as a run without outputs does
natively; CPU time of one thread, least of alternating rounds. The last line is one of JSON: the ratio of each system,
`worst`, and `megabytes` of the largest file. FMUs need the extra `fmu` and FMPy.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave

from modalprep.examples import small_systems, uniform_beam
from modalprep.multibody.model.constraints import Closure
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.system import System
from modalprep.multibody.preparation import prepare
from modalprep.runtime.fmu import write_fmu

RTOL, ATOL = 1e-6, 1e-10


def systems() -> dict[str, tuple[System, str, float]]:
    """Return systems with a method and a span (s)."""
    arm = uniform_beam(modes=3)
    hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    elbow = Joint(name="elbow", type="revolute", parent="arm.tip", child="forearm", angle=0.5)
    down = np.array([0, -9.81, 0])
    two = System(bodies={"arm": arm, "forearm": arm}, joints=(hinge, elbow), gravity=down)
    wire = Closure(name="wire", type="distance", a="ground", b="forearm.tip", position=np.array([0, 20.0, 0]))
    rigid = replace(small_systems()["rigid bodies in trees"], gravity=down)
    return {
        "rigid": (rigid, "explicit", 200.0),
        "flexible": (two, "explicit", 50.0),
        "flexible_rosenbrock": (two, "rosenbrock", 10.0),
        "closed_loop": (replace(two, closures=(wire,)), "explicit", 1.0),
    }


def native(system: System, method: str, span: float) -> Callable[[], float]:
    """Return what takes the run here, and returns its CPU time (s)."""

    def run() -> float:
        made = prepare(system, np.array([0.0, span]), method=method, rtol=RTOL, atol=ATOL)
        begin = time.process_time()
        made.run(lambda times, states: None, None)
        return time.process_time() - begin

    return run


def imported(file: Path, span: float) -> Callable[[], float]:
    """Return the same for an FMU."""
    description = read_model_description(file)
    name = description.coSimulation.modelIdentifier
    given = {"guid": description.guid, "unzipDirectory": extract(file), "modelIdentifier": name, "instanceName": name}

    def run() -> float:
        unit = FMU2Slave(**given)  # `freeInstance` unloads the library
        unit.instantiate()
        unit.setupExperiment(tolerance=RTOL)
        unit.enterInitializationMode()
        unit.exitInitializationMode()
        begin = time.process_time()
        unit.doStep(0.0, span)
        spent = time.process_time() - begin
        unit.terminate()
        unit.freeInstance()
        return spent

    return run


def main() -> None:
    """Print the ratios."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="flexible systems in trees alone, three rounds")
    quick = parser.parse_args().quick
    found, size = {}, 0.0
    with tempfile.TemporaryDirectory() as folder:
        for name, (system, method, span) in systems().items():
            if quick and not name.startswith("flexible"):
                continue
            file = Path(folder) / f"{name}.fmu"
            write_fmu(system, file, kind="cs", t_end=span, method=method, rtol=RTOL, atol=ATOL, say=print)
            size = max(size, file.stat().st_size / 1e6)
            runs = native(system, method, span), imported(file, span)
            times = np.array([[run() for run in runs] for _ in range(3 if quick else 9)]).min(axis=0)
            found[name] = round(float(times[1] / times[0]), 3)
            print(f"{name}: {times[0]:.3f} s natively, {times[1]:.3f} s by the FMU: {found[name]:.2f}", flush=True)
    print(json.dumps({**found, "worst": max(found.values()), "megabytes": round(size, 3)}))


if __name__ == "__main__":
    main()
