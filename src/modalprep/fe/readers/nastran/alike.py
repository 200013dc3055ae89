"""Many solids or shells of Nastran alike, at once where nothing about them is special."""

from __future__ import annotations

import numpy as np

from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.elements import SHELLS, SOLIDS
from modalprep.fe.readers.nastran.grids import FLUID
from modalprep.fe.readers.nastran.runs import CardBlock

SPECIAL = (2, 6)  # fields of PSOLID: axes of the material, fluids


def add_alike(b: Builder, block: CardBlock) -> bool:
    """Add a block of elements; False, and nothing added, where one of them asks for a look of its own."""
    nodes = block.values[:, 2:][:, ~np.isnan(block.values[0, 2:])].astype(int)
    cell = SOLIDS.get(block.name, {}).get(nodes.shape[1], SHELLS.get(block.name))
    rows = b.grids.find(nodes)
    order = np.sort(rows, axis=1)
    if cell is None or cell.count != nodes.shape[1]:
        return False
    if (order[:, 0] < 0).any() or (order[:, 1:] == order[:, :-1]).any() or (b.grids.cd[rows] == FLUID).any():
        return False
    numbers, first, of = np.unique(block.values[:, 1].astype(int), return_index=True, return_inverse=True)
    solids = b.tables.get("solid", {}) if cell.dimension == 3 else {}
    sections = [solids[number] for number in numbers.tolist() if number in solids]
    if any(section.text(k) not in ("", "0") for section in sections for k in SPECIAL):
        return False
    added = b.extend(cell.name, rows[:, cell.nastran_order or slice(None)])
    for k in np.argsort(first).tolist():
        own = (added.start + np.flatnonzero(of == k)).tolist()
        name = b.section(block.card(int(first[k])), "solid" if cell.dimension == 3 else "shell")
        b.join(name, cell.name, own)
        b.placed.append((block.ids[of == k], name, cell.name, own))
        if cell.name == "hexahedron20" and numbers[k] in solids and solids[int(numbers[k])].text(3) in ("2", "TWO"):
            b.put_all("integration", cell.name, own, 1.0)
    return True
