"""How far is the geometric stiffness of shells and beams from that of solids?

    python benchmarks/geometric_stiffness.py [--quick]

One strip of .8 m, ten times as wide as thick, clamped at its root, with a free tip frame: straight, an arch, cambered,
pretwisted, a cylindrical and a spherical panel; of HEX20 solids, and of quads and triangles at two refinements. Stocky
strips (60 x 30 mm) also of beams, laminates against layered solids. Each line: the largest difference of the first six
frequencies, and of every block of `Kg_A`, `Kg_W` (inertia loads), `Kg_F`, `Kg_T` (tip loads) for the first six modes,
over the largest block of its array; per cent.

`--quick`: three shapes, under a minute. The last line is JSON, per cent, at the finer mesh: `quad`, `triangle`, `beam`,
`laminate` (symmetric) and `bimetal` (unsymmetric, straight), the worst over the shapes; `coarse_over_fine`, the
worst of shells at the coarse mesh over that at the fine one; `solids`, what other solids change.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent.parent / "tests"))  # the strips that the tests compare

from strips import ALUMINIUM, STIFF, SURFACES, Modal, beams, differences, modal, shells, solids

import modalprep as mp

WIDTH = {"cambered": 0.2, "cylindrical": 0.2}  # m; others .1
QUICK = ("arch", "twisted", "spherical")


def compare(name: str, own: Modal, reference: Modal) -> float:
    """Print one line; the worst of the four arrays, per cent."""
    off = {key: 100 * value for key, value in differences(own, reference).items()}
    frequency = 100 * np.abs(own.body.frequency[:6] / reference.body.frequency[:6] - 1).max()
    print(f"{name:34}{frequency:8.2f}  " + "  ".join(f"{value:8.2f}" for value in off.values()), flush=True)
    return max(off.values())


def thin(shape: str, quick: bool, found: dict[str, list[float]]) -> None:
    """Shells of one shape at two refinements."""
    width = WIDTH.get(shape, 0.1)
    surface, layers = SURFACES[shape](width), [(ALUMINIUM, width / 10)]
    solid = modal(solids(surface, layers, (50, 8) if quick else (80, 12)), surface)
    found["solids"].append(compare(f"{shape}, solids", modal(solids(surface, layers, (40, 8)), surface), solid))
    section = mp.Shell(material=ALUMINIUM, thickness=width / 10)
    for kind in ("quad", "triangle"):
        for size, cells in (
            (("coarse", (40, 8)), ("fine", (80, 16))) if not quick else (("coarse", (20, 4)), ("fine", (60, 12)))
        ):
            own = modal(shells(surface, section, cells, kind), surface)
            off = compare(f"{shape}, {kind} {cells[0]} x {cells[1]}", own, solid)
            found[kind if size == "fine" else "coarse"].append(off)


def layered(name: str, shape: str, shares, quick: bool, found: dict[str, list[float]]) -> None:
    """A laminate of one shape."""
    width = WIDTH.get(shape, 0.1)
    surface, layers = SURFACES[shape](width), [(material, share * width / 10) for material, share in shares]
    plies = tuple(mp.fe.Ply(material=material, thickness=t) for material, t in layers)
    solid = modal(solids(surface, layers, (50, 8), each=1 if quick else 2), surface)
    own = modal(shells(surface, mp.Shell(plies=plies), (60, 12)), surface)
    found[name].append(compare(f"{shape}, {name}, quad 60 x 12", own, solid))


def stocky(shape: str, found: dict[str, list[float]]) -> None:
    """Beams of 60 x 30 mm."""
    surface = SURFACES[shape](0.06)
    solid = modal(solids(surface, [(ALUMINIUM, 0.03)], (50, 6)), surface)
    for elements in (30, 60):
        own = modal(beams(surface, 0.06, 0.03, elements), surface)
        off = compare(f"{shape}, beam {elements}", own, solid)
    found["beam"].append(off)


def main() -> None:
    """Print the table and the JSON line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="three shapes, under a minute")
    quick = parser.parse_args().quick
    found = {key: [] for key in ("quad", "triangle", "beam", "laminate", "bimetal", "coarse", "solids")}
    print(
        f"{'per cent of the solids':34}{'Hz':>8}  " + "  ".join(f"{key:>8}" for key in ("Kg_A", "Kg_W", "Kg_F", "Kg_T"))
    )
    for shape in QUICK if quick else SURFACES:
        thin(shape, quick, found)
    for shape in ("straight", "arch", "twisted"):
        stocky(shape, found)
    sandwich, bimetal = ((STIFF, 0.3), (ALUMINIUM, 0.4), (STIFF, 0.3)), ((ALUMINIUM, 0.5), (STIFF, 0.5))
    for shape in ("arch",) if quick else ("straight", "arch", "cambered"):
        layered("laminate", shape, sandwich, quick, found)
    layered("bimetal", "straight", bimetal, quick, found)
    worst = {key: max(values) for key, values in found.items()}
    worst["coarse_over_fine"] = worst.pop("coarse") / max(worst["quad"], worst["triangle"])
    print(json.dumps({key: round(value, 2) for key, value in worst.items()}))


if __name__ == "__main__":
    main()
