"""Is a large assembly quicker and leaner when its components are reduced one by one and joined by mode synthesis?

    python benchmarks/components.py [--quick]

Boxes of quadratic tetrahedra, each of its own stiffness, in a row: they meet in rigid interfaces (rbe2), the first is
clamped. In one piece: the matrices of all boxes with their common interfaces, and the lowest modes of the whole. In
components: each box to a Craig-Bampton body in processes of two, one thread each, and `synthesise`. Each way runs in a
process of its own, mesh to frequencies; memory is the largest sum over its processes that was resident at a time.
Eight boxes, 440 000 DOFs, 40 modes; `--quick`: four, 74 000 DOFs, 10 modes. The last line is JSON: `dofs`,
`time_ratio` and `memory_ratio` (in one piece over in components), `worst_frequency_error`.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from assembly import tet_mesh
from scipy.sparse import block_diag, csr_array

import modalprep as mp
from modalprep.linalg.modes import lowest_modes

WORKERS = 2
RICHER = 6  # modes of a component, by those wanted of the whole over the components


def component(bricks: int, k: int) -> mp.fe.FEModel:
    """Return box k, its faces x = 0 and x = 1 rigid."""
    ends = {"root": mp.Interface(box=((0, 0, 0), (0, 1, 1))), "tip": mp.Interface(box=((1, 0, 0), (1, 1, 1)))}
    material = mp.Material(E=2.1e11 * (1 + 0.2 * k), nu=0.3, rho=7800.0)
    return mp.assemble(tet_mesh((bricks, bricks, bricks)), {"body": mp.Solid(material=material)}, ends)


def in_one_piece(count: int, bricks: int, modes: int) -> tuple[int, np.ndarray]:
    """Return the number of DOFs and the lowest frequencies (Hz) of the whole."""
    parts, number, last, joint = [], [], 6, np.arange(6)  # the first six are the clamped root
    for k in range(count):
        model = component(bricks, k)
        root, tip = (np.searchsorted(model.free, frame.dofs) for frame in model.interfaces)
        own = np.full(len(model.free), -1)
        own[root] = joint
        rest = np.flatnonzero(own < 0)
        own[rest] = last + np.arange(len(rest))
        last, joint = last + len(rest), own[tip]
        parts.append([(model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M)])
        number.append(own)
    column = np.concatenate(number)
    join = csr_array((np.ones(len(column)), (np.arange(len(column)), column)))
    K, M = ((join.T @ block_diag(blocks, format="csr") @ join).tocsr()[6:, 6:] for blocks in zip(*parts, strict=True))
    w2, _, _ = lowest_modes(K, M, modes)
    return last, np.sqrt(w2) / (2 * np.pi)


def body_of(arguments: tuple[int, int, int]) -> mp.body.FlexibleBody:
    """Return one component as a modal body without geometric stiffness."""
    bricks, k, modes = arguments
    model = component(bricks, k)
    reduction = mp.craig_bampton(model, modes=modes, truncation=("inertia",))
    return mp.flexible_body(model, reduction, name=f"box{k}").conventional()


def in_components(count: int, bricks: int, modes: int) -> np.ndarray:
    """Return the lowest frequencies (Hz) by synthesis."""
    own = max(4, RICHER * modes // count)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(WORKERS, mp_context=context) as pool:
        found = list(pool.map(body_of, [(bricks, k, own) for k in range(count)]))
    bodies = {body.name: body for body in found}
    welds = [(f"box{k}.tip", f"box{k + 1}.root") for k in range(count - 1)]
    return mp.reduction.synthesise(bodies, welds, ground=["box0.root"], modes=modes).frequency


def resident(pid: int) -> int:
    """Bytes of a process and its children."""
    try:
        pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
        children = Path(f"/proc/{pid}/task/{pid}/children").read_text().split()
    except (FileNotFoundError, ProcessLookupError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE") + sum(resident(int(child)) for child in children)


def measured(way: str, sizes: tuple[int, int, int], threads: int) -> tuple[float, float, object]:
    """Run one way in a process of its own; return seconds, its largest memory (GiB) and what it found."""
    os.environ["MKL_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(1, mp_context=context) as pool:
        pool.submit(os.getpid).result()  # started
        begin, most, done = time.perf_counter(), [0], threading.Event()
        (pid,) = pool._processes

        def watch() -> None:
            while not done.wait(0.05):
                most[0] = max(most[0], resident(pid))

        watcher = threading.Thread(target=watch)
        watcher.start()
        found = pool.submit(globals()[way], *sizes).result()
        spent = time.perf_counter() - begin
        done.set()
        watcher.join()
    return spent, most[0] / 2**30, found


def main() -> None:
    """Print both ways and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="four boxes, 74 000 DOFs")
    sizes = (4, 9, 10) if parser.parse_args().quick else (8, 13, 40)
    body_of((2, 0, 2))  # compiled
    whole, whole_memory, (dofs, frequency) = measured("in_one_piece", sizes, WORKERS)
    split, split_memory, by_parts = measured("in_components", sizes, 1)
    error = float(np.abs(by_parts / frequency - 1).max())
    print(f"{dofs} DOFs, {sizes[2]} modes to {frequency[-1]:.4g} Hz, {sizes[0]} components")
    print(
        f"in one piece {whole_memory:.2f} GiB, in components {split_memory:.2f} GiB and {split / whole:.2f} of the time"
    )
    ratios = {"time_ratio": round(whole / split, 2), "memory_ratio": round(whole_memory / split_memory, 2)}
    print(json.dumps({"dofs": dofs} | ratios | {"worst_frequency_error": float(f"{error:.2g}")}))


if __name__ == "__main__":
    main()
