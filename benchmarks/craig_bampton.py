"""Where does the time of the road from a mesh to a modal file go?

    python benchmarks/craig_bampton.py [--quick]

A box of quadratic tetrahedra with five rigid interfaces on its faces, 100 modes, truncation vectors, all geometric
stiffness matrices, HDF5 file: seconds by stage are shares of the whole. `--quick`: 20 000 DOFs and 40 modes; else
100 000 and 100. The second-order modal mass T, which this box has, is timed by itself: it takes the geometric stiffness
of one prestress more for each coordinate, two thirds of all. The last line is JSON: `share_outside_factor_and_eigen`,
and `share_without_T`.
"""

from __future__ import annotations

import argparse
import json
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from assembly import STEEL, tet_mesh

import modalprep as mp
from modalprep.linalg.algebra import DIRECT, Algebra


def interfaces() -> dict[str, mp.Interface]:
    """Five patches: the root face x = 0 and a corner patch on four other faces."""
    patches = {"root": ((0, 0, 0), (0, 1, 1))}
    patches["tip"] = ((1, 0, 0), (1, 0.3, 0.3))
    patches["left"] = ((0.4, 0, 0.4), (0.8, 0, 0.8))
    patches["right"] = ((0.4, 1, 0.4), (0.8, 1, 0.8))
    patches["top"] = ((0.4, 0.4, 1), (0.8, 0.8, 1))
    return {name: mp.Interface(box=corners) for name, corners in patches.items()}


def clocked(spent: dict[str, float]) -> Algebra:
    """Return linear algebra that adds its time to the stages ``factor`` and ``eigen``."""

    def timed(call: Callable, stage: str) -> Callable:
        def run(*arguments, **options):
            start = time.perf_counter()
            try:
                return call(*arguments, **options)
            finally:
                spent[stage] = spent.get(stage, 0.0) + time.perf_counter() - start

        return run

    return Algebra(timed(DIRECT.factorise, "factor"), timed(DIRECT.lowest_modes, "eigen"), DIRECT.count_below)


def road(mesh: mp.fe.Mesh, count: int, folder: Path) -> dict[str, float]:
    """Seconds of each stage; that of T is what the modal body takes longer with it."""
    spent: dict[str, float] = {}
    marks = [time.perf_counter()]
    model = mp.assemble(mesh, {"body": mp.Solid(material=STEEL)}, interfaces())
    marks.append(time.perf_counter())
    reduction = mp.craig_bampton(model, modes=count, algebra=clocked(spent))
    marks.append(time.perf_counter())
    mp.flexible_body(model, reduction, name="box", second_order_mass=False)
    marks.append(time.perf_counter())
    body = mp.flexible_body(model, reduction, name="box")
    marks.append(time.perf_counter())
    mp.write_body(body, folder / "box.h5")
    marks.append(time.perf_counter())
    assembly, reduce, integrals, whole, file = np.diff(marks)
    spent |= {"rest of the reduction": reduce - spent["factor"] - spent["eigen"], "integrals and Kg": integrals}
    return {"assembly": assembly} | spent | {"T": max(whole - integrals, 0.0), "file": file}


def main() -> None:
    """Run once to compile, then measure."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="20 000 DOFs and 40 modes")
    quick = parser.parse_args().quick
    with tempfile.TemporaryDirectory() as folder:
        road(tet_mesh((2, 2, 2)), 2, Path(folder))
        spent = road(tet_mesh((9, 8, 8) if quick else (16, 16, 16)), 40 if quick else 100, Path(folder))
    total = sum(spent.values())
    for stage, seconds in spent.items():
        print(f"{stage:24} {100 * seconds / total:5.1f} %")
    solved = spent["factor"] + spent["eigen"]
    print(json.dumps({
        "share_outside_factor_and_eigen": round(1 - solved / total, 3),
        "share_without_T": round(1 - solved / (total - spent["T"]), 3),
    }))  # fmt: skip


if __name__ == "__main__":
    main()
