"""How fast are decks read, against the programs that read one kind of deck each?

    python benchmarks/reading.py [--quick] [--peers PYTHON]

Writes one box of bricks as a deck of Nastran in fixed and in free fields, of Abaqus, and of Ansys without and with a
coordinate system of the elements (ESYS), and reads it by `read_mesh`, which makes a mesh in SI
units with groups, materials and checks of it, and in turn by pyNastran (`read_bdf`, no cross-references), meshio and
ansys-mapdl-reader (`Archive`, no grid of VTK). Each reading is that of a new process, which has read a small deck of
the kind before, and is measured in CPU time; the memory is what the process has at most, less what it had before.

pyNastran needs an older NumPy than this package: `--peers` names the Python of an environment with the peers, by
default this one. A peer that is not there gives no figure, and the line of JSON says null.

Prints a table, medians of the rounds, and one line of JSON: for each kind of deck ``bdf_over_pynastran``,
``free_over_pynastran``, ``inp_over_meshio``, ``cdb_over_mapdl`` and ``esys_over_mapdl``, our time over that of the
peer; ``*_memory`` likewise; and the seconds of `modalprep init` on each deck over those of `read_mesh`.
"""

from __future__ import annotations

import argparse
import json
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

import numpy as np

OURS = "import modalprep as mp; read = mp.read_mesh"
INIT = """
from modalprep.cli import main
def read(path): assert main(["init", path, "--force"]) == 0
"""
PEERS = {
    "bdf": (
        "pynastran",
        "from pyNastran.bdf.bdf import read_bdf\ndef read(path): return read_bdf(path, xref=False, debug=None)",
    ),
    "inp": ("meshio", "from meshio import read"),
    "cdb": (
        "mapdl",
        "from ansys.mapdl.reader.archive import Archive\ndef read(path): return Archive(path, parse_vtk=False)",
    ),
}
PEERS |= {"free": PEERS["bdf"], "esys": PEERS["cdb"]}
ENDINGS = {"free": "bdf", "esys": "cdb"}  # of others the kind is the ending
MEASURE = """
import sys, time
def memory(name): return next(int(s.split()[1]) for s in open("/proc/self/status") if s.startswith(name)) / 1024
read(sys.argv[1])
open("/proc/self/clear_refs", "w").write("5")  # forget the peak so far
before = memory("VmRSS")
begin = time.process_time()
found = read(sys.argv[2])
print(time.process_time() - begin, memory("VmHWM") - before)
"""


def box(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes of n x n x n bricks, and the bricks by the numbers of their nodes."""
    at = np.linspace(0, 1, n + 1)
    z, y, x = (part.ravel() for part in np.meshgrid(at, at, at, indexing="ij"))
    i = 1 + np.arange((n + 1) ** 3).reshape(n + 1, n + 1, n + 1)
    rings = [(slice(None, -1), slice(None, -1)), (slice(None, -1), slice(1, None))]
    rings += [(slice(1, None), slice(1, None)), (slice(1, None), slice(None, -1))]
    layers = (slice(None, -1), slice(1, None))
    return np.stack([x, y, z], axis=1), np.stack([i[k, *ring].ravel() for k in layers for ring in rings], axis=1)


def bdf(points: np.ndarray, bricks: np.ndarray) -> Iterator[str]:
    """Yield a deck of Nastran in small fields."""
    yield "SOL 103\nCEND\nSUBCASE 1\nBEGIN BULK\nMAT1,7,2.1+11,,.3,7800.\nPSOLID,5,7\n"
    yield from (f"GRID    {k:8d}        {x:8.6f}{y:8.6f}{z:8.6f}\n" for k, (x, y, z) in enumerate(points.tolist(), 1))
    for k, nodes in enumerate(bricks.tolist(), 1):
        row = "".join(f"{n:8d}" for n in nodes)
        yield f"CHEXA   {k:8d}       5{row[:48]}\n        {row[48:]}\n"
    yield "ENDDATA\n"


def free(points: np.ndarray, bricks: np.ndarray) -> Iterator[str]:
    """Yield a deck of Nastran in free fields."""
    yield "SOL 103\nCEND\nSUBCASE 1\nBEGIN BULK\nMAT1,7,2.1+11,,.3,7800.\nPSOLID,5,7\n"
    yield from (f"GRID,{k},,{x:.6f},{y:.6f},{z:.6f}\n" for k, (x, y, z) in enumerate(points.tolist(), 1))
    for k, nodes in enumerate(bricks.tolist(), 1):
        row = [str(n) for n in nodes]
        yield f"CHEXA,{k},5,{','.join(row[:6])},+\n+,{','.join(row[6:])}\n"
    yield "ENDDATA\n"


def inp(points: np.ndarray, bricks: np.ndarray) -> Iterator[str]:
    """Yield a deck of Abaqus."""
    yield "*NODE, NSET=all\n"
    yield from (f"{k}, {x:.9g}, {y:.9g}, {z:.9g}\n" for k, (x, y, z) in enumerate(points.tolist(), 1))
    yield "*ELEMENT, TYPE=C3D8, ELSET=body\n"
    yield from (f"{k}, {str(nodes)[1:-1]}\n" for k, nodes in enumerate(bricks.tolist(), 1))
    foot = (1 + np.flatnonzero(points[:, 2] == 0)).tolist()
    yield "*NSET, NSET=foot\n"
    yield from (f"{str(foot[k : k + 16])[1:-1]},\n" for k in range(0, len(foot), 16))
    yield "*SOLID SECTION, ELSET=body, MATERIAL=steel\n*MATERIAL, NAME=steel\n*ELASTIC\n2.1e11, .3\n*DENSITY\n7800.\n"


def esys(points: np.ndarray, bricks: np.ndarray) -> Iterator[str]:
    """Yield a file of CDWRITE whose elements have a coordinate system of their own."""
    yield from cdb(points, bricks, 11)


def cdb(points: np.ndarray, bricks: np.ndarray, system: int = 0) -> Iterator[str]:
    """Yield a file of CDWRITE."""
    yield "/PREP7\nET,1,185\nMP,EX,1,2.1e11\nMP,PRXY,1,.3\nMP,DENS,1,7800.\n"
    yield f"NBLOCK,6,SOLID,{len(points):9d},{len(points):9d}\n(3i9,6e21.13e3)\n"
    for k, x in enumerate(points.tolist(), 1):
        yield f"{k:9d}        0        0" + "".join(f"{value:21.13E}" for value in x).removesuffix(f"{0:21.13E}") + "\n"
    yield f"N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,{len(bricks):9d},{len(bricks):9d}\n(19i9)\n"
    for k, nodes in enumerate(bricks.tolist(), 1):
        yield "".join(f"{n:9d}" for n in (1, 1, 1, 1, system, 0, 0, 0, 8, 0, k, *nodes)) + "\n"
    foot = (1 + np.flatnonzero(points[:, 2] == 0)).tolist()
    yield f"       -1\nCMBLOCK,FOOT,NODE,{len(foot):8d}\n(8i10)\n"
    yield from ("".join(f"{n:10d}" for n in foot[k : k + 8]) + "\n" for k in range(0, len(foot), 8))
    yield "LOCAL,11,0,0,0,0,30\nFINISH\n" if system else "FINISH\n"


def measured(python: str, code: str, small: Path, deck: Path) -> tuple[float, float] | None:
    """Return CPU seconds and MiB of a reading in a new process; None where the reader is not there."""
    done = subprocess.run([python, "-c", code + MEASURE, small, deck], capture_output=True, text=True, cwd=deck.parent)
    if done.returncode:
        if "ModuleNotFoundError" not in done.stderr:
            sys.exit(done.stderr)
        return None
    seconds, mebibytes = done.stdout.split()[-2:]
    return float(seconds), float(mebibytes)


def compare(kind: str, small: Path, deck: Path, rounds: int, python: str) -> dict[str, float | None]:
    """Print what both readers of a kind of deck take, in turn."""
    name, code = PEERS[kind]
    rows = [[measured(sys.executable, OURS, small, deck), measured(python, code, small, deck)] for _ in range(rounds)]
    ours, peer = (
        [statistics.median(values) for values in zip(*own, strict=True)] if all(own) else None
        for own in zip(*rows, strict=True)
    )
    init = measured(sys.executable, INIT, small, deck)
    assert ours is not None
    assert init is not None
    theirs = "is not there" if peer is None else f"{peer[0]:.2f} s, {peer[1]:.0f} MiB"
    print(f".{kind}: {ours[0]:.2f} s, {ours[1]:.0f} MiB; {name} {theirs}; init {init[0]:.2f} s", flush=True)
    ratios = (None, None) if peer is None else [round(a / b, 3) for a, b in zip(ours, peer, strict=True)]
    return {
        f"{kind}_over_{name}": ratios[0],
        f"{kind}_over_{name}_memory": ratios[1],
        f"{kind}_init_over_read": round(init[0] / ours[0], 2),
    }


def main() -> None:
    """Print the table and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="a deck of 68,921 nodes in place of 226,981, one round")
    parser.add_argument("--peers", default=sys.executable, help="the Python that has the peers")
    given = parser.parse_args()
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for write in (bdf, free, inp, cdb, esys):
            kind = write.__name__
            files = []
            for n in (10, 40 if given.quick else 60):
                files.append(Path(folder) / f"{kind}{n}.{ENDINGS.get(kind, kind)}")
                with files[-1].open("w") as file:
                    file.writelines(write(*box(n)))
            found |= compare(kind, *files, rounds=1 if given.quick else 5, python=given.peers)
    print(json.dumps(found))


if __name__ == "__main__":
    main()
