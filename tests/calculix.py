"""Decks of solids, and the frequencies of CalculiX (ccx, Debian's calculix-ccx) of them."""

import re
import shutil
import subprocess

import numpy as np
import pytest

needs_ccx = pytest.mark.skipif(shutil.which("ccx") is None, reason="CalculiX (ccx) is not installed")
STEEL = "*MATERIAL, NAME=S\n*ELASTIC\n2.1e11, .3\n*DENSITY\n7800.\n"  # m, kg, s
ON_A_LINE = 15  # entries; a number has at most twenty characters


def deck(points, held, *, section="*SOLID SECTION, ELSET=E, MATERIAL=S\n", **cells):
    """A deck of the cells of each type, in meshio's order, with nodes that are held in 1 to 3."""
    lines = ["*NODE", *(f"{k}, {x:.13g}, {y:.13g}, {z:.13g}" for k, (x, y, z) in enumerate(points, start=1))]
    number = 0
    for kind, rows in cells.items():
        lines.append(f"*ELEMENT, TYPE={kind}, ELSET=E")
        for row in rows + 1:
            number += 1
            entries = [str(entry) for entry in (number, *row)]
            groups = [entries[k : k + ON_A_LINE] for k in range(0, len(entries), ON_A_LINE)]
            lines += [", ".join(group) + "," * (group is not groups[-1]) for group in groups]
    lines += ["*NSET, NSET=FIX", *(f"{node + 1}," for node in np.asarray(held))]
    return "\n".join(lines) + "\n" + STEEL + section + "*BOUNDARY\nFIX, 1, 3\n"


def frequencies(text, count, folder):
    """The first frequencies (Hz), of seven digits."""
    (folder / "job.inp").write_text(f"{text}*STEP\n*FREQUENCY\n{count}\n*END STEP\n")
    subprocess.run(["ccx", "job"], cwd=folder, check=True, capture_output=True)
    printed = (folder / "job.dat").read_text()
    printed = printed[: printed.index("P A R T I C I P A T I O N")]
    return np.array(re.findall(r"^\s+\d+\s+\S+\s+\S+\s+(\S+)\s+\S+\s*$", printed, re.MULTILINE)[:count], dtype=float)
