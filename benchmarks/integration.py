"""Elements of a deck against those of CalculiX, which integrates bricks otherwise and makes solids of shells and beams.

    python benchmarks/integration.py

Frequencies of clamped plates and of a clamped beam by the same decks, in % off those of a fine mesh: bricks of a plate
of 100 x 20 x 2 mm off 40 x 8 x 2 elements of C3D20R, shells of one of 100 x 50 x 1 mm off 32 x 16 of our quad8, beams
off 64 of ours. The last line is JSON: `bricks` and `lines` (shells and beams), the worst of ours and of CalculiX.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path

import numpy as np

import modalprep as mp
from modalprep.linalg.modes import lowest_modes
from modalprep.verdicts.notes import silent

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
from calculix import deck
from calculix import frequencies as theirs
from structured import box, surface

COUNT = 6
PLATE, SHEET = (0.1, 0.02, 0.002), (0.1, 0.05)
SHELL = "*SHELL SECTION, ELSET=E, MATERIAL=S\n.001\n"
BEAM = "*BEAM SECTION, ELSET=E, MATERIAL=S, SECTION=RECT\n.01, .02\n0, 1, 0\n"
MESHES = (((20, 4, 1), 0.0), ((20, 4, 2), 0.0), ((40, 8, 4), 0.0), ((40, 8, 4), 0.25))
SHELLS = {
    "S3": "triangle", "S4R": "quad", "S4": "quad", "S6": "triangle6", "S8R": "quad8", "S8": "quad8",
}  # fmt: skip


def ours(text: str) -> np.ndarray:
    """Frequencies (Hz) of a deck whose nodes of the set FIX are held in all components."""
    with tempfile.TemporaryDirectory() as folder, silent():
        file = Path(folder, "deck.inp")
        file.write_text(text)
        mesh = mp.read_mesh(file, dialect="calculix")
        model = mp.assemble(mesh, {}, {"root": mp.Interface(group="FIX")})
    dof = model.dof[: len(mesh.points)]
    free = np.setdiff1d(dof[dof >= 0], dof[mesh.nodes("FIX")])
    K, M = (A.tocsr()[free][:, free] for A in (model.K, model.M))
    return np.sqrt(lowest_modes(K, M, COUNT)[0]) / (2 * np.pi)


def calculix(text: str) -> np.ndarray:
    """The same by CalculiX."""
    with tempfile.TemporaryDirectory() as folder:
        return theirs(text, COUNT, Path(folder))


def bricks(kind: str, n: tuple[int, int, int], distort: float = 0.0) -> str:
    """Deck of the plate by solids."""
    points, cells = box("hexahedron20" if "20" in kind else "hexahedron", n, PLATE, distort=distort, seed=1)
    return deck(points, np.flatnonzero(np.isclose(points[:, 0], 0)), **{kind: cells})


def sheet(kind: str, n: tuple[int, int]) -> str:
    """Deck of the plate by shells."""
    points, cells = surface(*n, SHELLS[kind], lambda s, t: (SHEET[0] * s, SHEET[1] * t, 0 * s))
    text = deck(points, np.flatnonzero(np.isclose(points[:, 0], 0)), section=SHELL, **{kind: cells})
    return text.replace("FIX, 1, 3", "FIX, 1, 6")


def beam(kind: str, count: int) -> str:
    """Deck of the beam, 1 m long, of lines of two nodes (B31) or three (B32)."""
    step = 2 if kind.startswith("B32") else 1
    first = step * np.arange(count)
    points = np.linspace(0, 1, step * count + 1)[:, None] * [1, 0, 0]
    cells = first[:, None] + np.arange(step + 1)
    return deck(points, [0], section=BEAM, **{kind: cells}).replace("FIX, 1, 3", "FIX, 1, 6")


def row(text: str, fine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the errors of CalculiX and ours, %."""
    return 100 * (calculix(text) / fine - 1), 100 * (ours(text) / fine - 1)


def shown(errors: np.ndarray) -> str:
    return ", ".join(f"{error:.1f}" for error in errors)


def main() -> None:
    worst = {"bricks": [0.0, 0.0], "lines": [0.0, 0.0]}
    plate = ours(bricks("C3D20R", (40, 8, 2)))
    fine = {"S": ours(sheet("S8", (32, 16))), "B": ours(beam("B31", 64))}
    cases = [(f"{kind} {n} {d}", bricks(kind, n, d), plate) for n, d in MESHES for kind in ("C3D8R", "C3D8", "C3D8I")]
    cases += [(kind, sheet(kind, (8, 4)), fine["S"]) for kind in SHELLS]
    cases += [(kind, beam(kind, 8), fine["B"]) for kind in ("B31", "B31R", "B32", "B32R")]
    for name, text, exact in cases:
        errors = row(text, exact)
        print(f"{name:30} CalculiX {shown(errors[0]):45} here {shown(errors[1])}")
        kept = worst["bricks" if exact is plate else "lines"]
        kept[:] = [max(old, float(np.abs(new).max())) for old, new in zip(kept, errors[::-1], strict=True)]
    print(json.dumps({name: [round(value, 2) for value in pair] for name, pair in worst.items()}))


if __name__ == "__main__":
    main()
