"""What does T, the second order of the modal mass, cost?

    python benchmarks/second_order_mass.py [--quick]

Chains of ten arches (60 degrees, beams) of 3 to 24 modes, whose bodies have T or not: time of one evaluation of the
accelerations with T over that without, medians of alternating rounds, CPU time of one thread. Then `flexible_body` of
an arch of shells: its time with T, and with the question whether T matters, over that without. The last line is JSON:
`evaluation_with_T_<modes>`, `slope_modes` (exponent of what T adds, between the two largest), `body_with_T`,
`body_auto`.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
import time
from pathlib import Path

import numpy as np
from chains import arguments, compiled, medians

import modalprep as mp
from modalprep.examples import beam_mesh

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from structured import surface

ALUMINIUM = mp.Material(E=70e9, nu=0.3, rho=2700.0)
MODES = (3, 6, 12, 24)


def arch(modes: int) -> mp.body.FlexibleBody:
    """Beams bent to 60 degrees, radius .8 m, 60 x 30 mm."""
    a = np.linspace(0, np.pi / 3, 31)
    line = np.stack([0.8 * np.sin(a), 0 * a, 0.8 * (1 - np.cos(a))], axis=1)
    section = mp.fe.beam_section("rectangle", ALUMINIUM, width=0.06, height=0.03, up=(0, 1, 0))
    ends = {name: mp.Interface(group=name, kind="node", boundary="free") for name in ("root", "tip")}
    model = mp.assemble(beam_mesh(30).with_(points=line), {"beam": section}, ends, root="root")
    return mp.flexible_body(model, mp.craig_bampton(model, modes=modes, truncation=()), name="arch")


def chain(body: mp.body.FlexibleBody, count: int = 10) -> mp.System:
    """Return equal links with hinges along y."""
    parents = ["ground", *(f"l{i}.tip" for i in range(count - 1))]
    joints = tuple(
        mp.Joint(name=f"j{i}", type="revolute", parent=parent, child=f"l{i}", axis=np.array([0, 1.0, 0]))
        for i, parent in enumerate(parents)
    )
    return mp.System(bodies={f"l{i}": body for i in range(count)}, joints=joints, gravity=np.array([0, 0, -9.81]))


def evaluations(rounds: int) -> dict[str, float]:
    """Print the time of an evaluation with T and without."""
    found, added = {}, []
    for modes in MODES:
        body = arch(modes)
        calls = [compiled(arguments(chain(each))) for each in (body, body.with_(T=None))]
        with_T, without = medians(calls, rounds)
        added.append(with_T - without)
        found[f"evaluation_with_T_{modes}"] = round(with_T / without, 3)
        print(f"{modes:2d} modes: an evaluation with T takes {with_T / without:.2f} times that without", flush=True)
    slope = np.log(added[-1] / added[-2]) / np.log(MODES[-1] / MODES[-2])
    return found | {"slope_modes": round(float(slope), 2)}


def bodies(quick: bool) -> dict[str, float]:
    """Print the time of `flexible_body`."""
    points, cells = surface(*((40, 8) if quick else (120, 24)), "quad", lambda s, t: (
        0.8 * np.sin(s), 0.1 * t, 0.8 - 0.8 * np.cos(s)))  # fmt: skip
    root = np.flatnonzero(points[:, 0] < 1e-9)
    groups = {"skin": {"quad": np.arange(len(cells))}, "root": {"vertex": np.arange(len(root))}}
    mesh = mp.fe.Mesh(points=points, cells={"quad": cells, "vertex": root[:, None]}, groups=groups)
    skin = {"skin": mp.Shell(material=ALUMINIUM, thickness=0.01)}
    model = mp.assemble(mesh, skin, {"root": mp.Interface(group="root")})
    reduction, spent = mp.craig_bampton(model, modes=30), {False: [], "auto": [], True: []}
    for _ in range(3 if quick else 5):
        for choice, times in spent.items():
            start = time.process_time()
            mp.flexible_body(model, reduction, name="arch", second_order_mass=choice)
            times.append(time.process_time() - start)
    least, auto, full = (statistics.median(times) for times in spent.values())
    print(
        f"flexible_body with T takes {full / least:.2f} times that without, deciding and taking it {auto / least:.2f}"
    )
    return {"body_with_T": round(full / least, 2), "body_auto": round(auto / least, 2)}


def main() -> None:
    """Print both studies."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="fewer rounds, a coarser shell")
    quick = parser.parse_args().quick
    print(json.dumps(evaluations(11 if quick else 31) | bodies(quick)))


if __name__ == "__main__":
    main()
