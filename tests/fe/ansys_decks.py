"""Small Ansys input files, written from the description of the commands in Ansys' help."""

from collections.abc import Iterable, Sequence
from pathlib import Path

STEEL = ["MP,EX,1,2.1e11", "MP,PRXY,1,0.3", "MP,DENS,1,7800."]
SHEET = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
UNIT_CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]


def deck(folder: Path, lines: Iterable[str]) -> Path:
    """Write a file of these lines."""
    path = folder / "deck.cdb"
    path.write_text("\n".join(["/PREP7", *lines, "FINISH", ""]))
    return path


def nblock(points: Sequence[Sequence[float]], first: int = 1) -> list[str]:
    """Return nodes as CDWRITE writes them, without the zeros at the end of a row."""
    rows = []
    for k, point in enumerate(points, first):
        values = list(point)
        while values and not values[-1]:
            values.pop()
        rows.append(f"{k:9d}{0:9d}{0:9d}" + "".join(f"{x:21.13E}" for x in values))
    count = len(points)
    return [f"NBLOCK,6,SOLID,{count:9d},{count:9d}", "(3i9,6e21.13e3)", *rows, "N,R5.3,LOC,       -1,"]


def eblock(*elements: Sequence[int], kind=1, material=1, real=1, section=1, system=0, first: int = 1) -> list[str]:
    """Return elements as CDWRITE writes them, eight nodes in the first line."""
    rows = []
    for label, nodes in enumerate(elements, first):
        head = [material, kind, real, section, system, 0, 0, 0, len(nodes), 0, label]
        numbers = [*head, *nodes]
        rows.append("".join(f"{x:9d}" for x in numbers[:19]))
        rows += ["".join(f"{x:9d}" for x in numbers[k : k + 19]) for k in range(19, len(numbers), 19)]
    return [f"EBLOCK,19,SOLID,{len(elements):9d},{len(elements):9d}", "(19i9)", *rows, "       -1"]


def bricks(count: int, width: float, height: float, length: float) -> list[str]:
    """Return a row of 8-node bricks along x."""
    points = []
    for k in range(count + 1):
        x = length * k / count
        points += [(x, 0, 0), (x, width, 0), (x, width, height), (x, 0, height)]
    elements = [tuple(4 * k + n for n in (1, 5, 6, 2, 4, 8, 7, 3)) for k in range(count)]
    return [*nblock(points), *eblock(*elements)]


def beam_line(count: int, length: float) -> list[str]:
    """Return nodes along x and one that says where z is."""
    return nblock([*((length * k / count, 0, 0) for k in range(count + 1)), (0, 0, 1)])
