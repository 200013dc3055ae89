"""How large a solid becomes a modal body on this machine, and what does it take?

    python benchmarks/million.py [--quick] [--dofs 3e6] [--solver single] [--leave 2]

A thick-walled bracket of quadratic tetrahedra with four interfaces, held on all of them: mesh, assembly, 30 modes whose
number is counted where the memory has room for that, truncation vectors, modal body with geometric stiffness.
`--quick`: 30 000 DOFs, in less memory than a factor in double precision needs.
The run ends itself where less than `--leave` GiB of memory are free.

The last line is JSON: `dofs`, `minutes` and `peak_gib` of the process by stage (assembly, reduction, body), `forecast`
(what was said of the first factor), `orthogonality` (largest error of the modal stiffness, over the frequencies of row
and column) and `counted`, empty where it is not proven that no mode is missing.
"""

from __future__ import annotations

import argparse
import json
import logging
import os
import threading
import time
from itertools import permutations

import numpy as np
import psutil
from assembly import EDGES, STEEL

import modalprep as mp
from modalprep.linalg.memory import BUDGET
from modalprep.reduction.basis import Reduction

MODES, THICK, DEEP = 30, 2, 60  # bricks of the wall and of the depth
SHARE = 8.7  # nodes of a brick, about
PATCH = 8  # bricks of the side of an interface
QUICK = 30_000, 0.15  # DOFs, GiB


def bracket(dofs: float) -> mp.fe.Mesh:
    """An L of two legs, each brick cut into Kuhn's six tetrahedra, of about so many DOFs."""
    deep = int(min(DEEP, max(4, (dofs / 3 / SHARE / THICK / 4) ** 0.5)))
    leg = int(dofs / 3 / SHARE / (2 * THICK * deep) + THICK / 2)
    bricks = np.stack(np.meshgrid(np.arange(leg), np.arange(deep), np.arange(leg), indexing="ij"), axis=-1)
    bricks = bricks[(bricks[..., 0] < THICK) | (bricks[..., 2] < THICK)]
    fine = 2 * np.array([leg, deep, leg]) + 1
    points, cells = _tetrahedra(bricks, fine)
    groups = {"body": {"tetra10": np.arange(len(cells))}}
    vertices: list[np.ndarray] = []
    for name, low, end in (("root", True, 0), ("b", False, 0), ("c", True, 2), ("d", False, 2)):
        found = _patch(points, low, end, fine)
        first = sum(map(len, vertices))
        groups[name] = {"vertex": np.arange(first, first + len(found))}
        vertices.append(found)
    return mp.fe.Mesh(
        points=points * (0.001 / 2),  # bricks of a millimetre
        cells={"tetra10": cells, "vertex": np.concatenate(vertices)[:, None]},
        groups=groups,
    )


def _tetrahedra(bricks: np.ndarray, fine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 3), in half bricks, and cells of the bricks."""
    cells = []
    for path in permutations(range(3)):
        corner = np.zeros((4, 3), dtype=int)
        for step, axis in enumerate(path):
            corner[step + 1 :, axis] = 2
        if np.linalg.det(corner[1:]) < 0:
            corner[1:3] = corner[2:0:-1]
        at = 2 * bricks[:, None] + np.concatenate([corner, [(corner[i] + corner[j]) // 2 for i, j in EDGES]])
        cells.append(np.ravel_multi_index(tuple(np.moveaxis(at, -1, 0)), fine))
    grid = np.stack(cells, axis=1).reshape(-1, 10)
    used = np.zeros(int(np.prod(fine)), dtype=bool)
    used[grid] = True
    number = np.cumsum(used, dtype=np.int64) - 1
    points = np.stack(np.unravel_index(np.flatnonzero(used), fine), axis=1)
    return points.astype(float), number[grid]


def _patch(points: np.ndarray, low: bool, end: int, fine: np.ndarray) -> np.ndarray:
    """Nodes of a square on the outer face at the end of a leg along axis `end`, at the low or the high depth."""
    size = min(2 * PATCH, (fine[1] - 1) // 2 - 1)
    depth = points[:, 1] if low else fine[1] - 1 - points[:, 1]
    inside = (depth <= size) & (points[:, end] >= fine[end] - 1 - size) & (points[:, 2 - end] == 0)
    return np.flatnonzero(inside)


class Watch(threading.Thread):
    """Looks at free memory; ends this process before the machine lacks it."""

    def __init__(self, leave: float) -> None:
        super().__init__(daemon=True)
        self.leave = leave * 2**30

    def run(self) -> None:
        """Look, again and again."""
        while True:
            if psutil.virtual_memory().available < self.leave:
                print("ended: other work needs the memory", flush=True)
                os._exit(3)
            time.sleep(1.0)


class Stages:
    """Minutes and peak memory of each stage."""

    def __init__(self) -> None:
        self.minutes, self.peak, self.begin = {}, {}, time.perf_counter()

    def end(self, name: str, what: object = "") -> None:
        """Note the end of a stage."""
        now = time.perf_counter()
        self.minutes[name], self.begin = round((now - self.begin) / 60, 2), now
        self.peak[name] = round(_peak(), 2)
        print(f"{name}: {self.minutes[name]} min, peak {self.peak[name]} GiB. {what}", flush=True)


def _peak() -> float:
    """GiB of the highest resident memory since the last call; since the start where there is no /proc."""
    try:
        with open("/proc/self/status") as status:
            found = next(int(line.split()[1]) for line in status if line.startswith("VmHWM")) / 2**20
        with open("/proc/self/clear_refs", "w") as refs:
            refs.write("5")
        return found
    except OSError:
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def orthogonality(model: mp.fe.FEModel, reduction: Reduction) -> float:
    """Largest entry of ``basis^T K basis`` less its diagonal, over the frequencies of its row and column."""
    w = 2 * np.pi * reduction.frequency
    worst = 0.0
    for k in range(0, len(w), 8):
        own = reduction.basis.T @ (model.K @ reduction.basis[:, k : k + 8]) / w[:, None] / w[k : k + 8]
        worst = max(worst, float(np.abs(own - np.eye(len(w))[:, k : k + 8]).max()))
    return worst


def main() -> None:
    """Run the road once."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="30 000 DOFs, in a fraction of a gibibyte")
    parser.add_argument("--dofs", type=float, default=3e6, help="about so many DOFs")
    parser.add_argument("--solver", default="auto", help="auto, in_memory, single, out_of_core, superlu")
    parser.add_argument("--leave", type=float, default=2.0, help="GiB of memory to leave free")
    given = parser.parse_args()
    if given.quick:
        given.dofs, os.environ[BUDGET] = QUICK[0], str(QUICK[1])
    logging.basicConfig(format="%(message)s")
    Watch(given.leave).start()
    stages = Stages()
    mesh = bracket(given.dofs)
    interfaces = {name: mp.Interface(group=name) for name in ("root", "b", "c", "d")}
    model = mp.assemble(mesh, {"body": mp.Solid(material=STEEL)}, interfaces)
    stages.end("assembly", f"{model.n_dof} DOFs")
    reduction = mp.craig_bampton(model, modes=MODES, solver=given.solver)
    stages.end("reduction", reduction)
    body = mp.flexible_body(model, reduction, name="bracket")
    stages.end("body", body)
    line = {
        "dofs": model.n_dof,
        "minutes": stages.minutes,
        "peak_gib": stages.peak,
        "forecast": [note for note in reduction.notes if "was factorised" in note],
        "orthogonality": orthogonality(model, reduction),
        "counted": [note for note in reduction.notes if "were found" in note],
    }
    print(json.dumps(line))


if __name__ == "__main__":
    main()
