"""Decks of a box of bricks in many of the ways in which programs write them, and in some in which they should not."""

from collections.abc import Callable

import numpy as np

N = 3  # bricks along each edge


def box() -> tuple[list[list[float]], list[list[int]]]:
    """Return coordinates, with many digits and few, and the nodes of bricks, which count from 1."""
    at = np.arange(N + 1)
    z, y, x = (part.ravel() for part in np.meshgrid(at, at, at, indexing="ij"))
    points = np.stack([x / 3 - 0.25, y * 1e-3, 1.25 * z], axis=1)
    first = [i + (N + 1) * (j + (N + 1) * k) + 1 for k in range(N) for j in range(N) for i in range(N)]
    corners = np.array([0, 1, N + 2, N + 1])
    return points.tolist(), (np.array(first)[:, None] + [*corners, *(corners + (N + 1) ** 2)]).tolist()


POINTS, BRICKS = box()


def second(nodes: list[int]) -> list[int]:
    """Return the nodes of a brick of second order, whose middles are other nodes of the box."""
    return [*nodes, *[n for n in range(1, len(POINTS) + 1) if n not in nodes][:12]]


# ------------------------------------------------------------------ Nastran


PROPERTIES = "MAT1,7,2.1+11,,.3,7800.\nPSOLID,5,7\n"


def short(value: float) -> str:
    """Return a number in eight letters, its exponent without a letter."""
    return f"{value:.3E}".replace("E-0", "-").replace("E+0", "+")


def small(name: str, *fields: object, marker: str = "") -> str:
    """Return a card in fields of eight letters; a marker ends each line that goes on."""
    rows = ["".join(f"{field!s:>8}" for field in fields[k : k + 8]) for k in range(0, len(fields), 8)]
    return "\n".join(
        (f"{name if not k else marker:<8}{row}".ljust(72) + marker * (k + 1 < len(rows))).rstrip()
        for k, row in enumerate(rows)
    )


def large(name: str, *fields: object) -> str:
    """Return a card in fields of sixteen letters."""
    rows = ["".join(f"{field!s:>16}" for field in fields[k : k + 4]) for k in range(0, len(fields), 4)]
    return "\n".join(f"{'*' if k else name + '*':<8}{row}" for k, row in enumerate(rows))


def grid(number: int, *x: float) -> str:
    """Return a GRID in small fields."""
    return small("GRID", number, "", *map(short, x))


def chexa(*fields: object) -> str:
    """Return a CHEXA in small fields."""
    return small("CHEXA", *fields)


def bdf(grid: Callable[..., str] = grid, brick: Callable[..., str] = chexa, between: str = "") -> str:
    """Return a Nastran deck of cards that two functions write."""
    grids = [grid(k, *x) for k, x in enumerate(POINTS, 1)]
    bricks = [brick(k, 5, *nodes) for k, nodes in enumerate(BRICKS, 1)]
    return "\n".join(["SOL 103", "CEND", "BEGIN BULK", *grids, between, *bricks, PROPERTIES + "ENDDATA", ""])


def apart(k: int, p: int, *n: int) -> str:
    """Return a CHEXA; the last one goes on behind another card."""
    if k < len(BRICKS):
        return chexa(k, p, *n)
    return small("CHEXA", k, p, *n[:6]).ljust(72) + "+Z\nCONM2,90,1,,1.\n+Z      " + "".join(f"{m:>8}" for m in n[6:])


def free(*fields: object, mark: str = "", head: str = "") -> str:
    """Return a card in free fields; `mark` ends each line that goes on, `head` begins the next."""
    name, *values = map(str, fields)
    rows = [values[k : k + 8] for k in range(0, len(values), 8)]
    lines = [[head if k else name, *row, *[mark] * (k + 1 < len(rows) and bool(mark))] for k, row in enumerate(rows)]
    return "\n".join(map(",".join, lines))


def free_grid(k: int, *x: float) -> str:
    """Return a GRID in free fields."""
    return free("GRID", k, "", *map(short, x))


BDF = {
    "small": bdf(),
    "large": bdf(
        lambda k, *x: large("GRID", k, "", *(f"{v:.9E}".replace("E", "D") for v in x), 0, "", ""),
        lambda *f: large("CHEXA", *f),
    ),
    "own markers": bdf(brick=lambda k, *f: small("CHEXA", k, *f, marker=f"+E{k}")),
    "one marker": bdf(brick=lambda *f: small("CHEXA", *f, marker="+")),
    "markers without a plus": bdf(brick=lambda k, *f: small("CHEXA", k, *f, marker=f"E{k}").replace("\nE", "\n+")),
    "free": bdf(
        lambda k, *x: f"GRID,{k},,{x[0]},{x[1]},{x[2]}",
        lambda *f: "CHEXA," + ",".join(map(str, f[:8])) + ",+\n+," + ",".join(map(str, f[8:])),
    ),
    "free without markers": bdf(free_grid, lambda *f: free("CHEXA", *f)),
    "free with marks": bdf(free_grid, lambda *f: free("CHEXA", *f, mark="+", head="+")),
    "free with a mark and no head": bdf(free_grid, lambda *f: free("CHEXA", *f, mark="+")),
    "free with own marks": bdf(free_grid, lambda k, *f: free("CHEXA", k, *f, mark=f"+E{k}", head=f"+E{k}")),
    "free with blanks": bdf(lambda k, *x: free("GRID", f" {k}", " ", *(f" {v:.6f} " for v in x), " 0", "")),
    "free with two numbers in a field": bdf(lambda k, *x: free_grid(k, *x).replace("GRID,7,", "GRID,7 0")),
    "free with tabs": bdf(lambda k, *x: free_grid(k, *x).replace("GRID,7,", "GRID,7\t,")),
    "free in turn": bdf(lambda k, *x: (free_grid if k % 9 else grid)(k, *x), lambda *f: free("CHEXA", *f)),
    "free and fixed": bdf(free_grid, lambda k, *f: free("CHEXA", k, *f) if k % 2 else chexa(k, *f)),
    "free with comments": bdf(lambda k, *x: free_grid(k, *x) + " $ here" * (k == 9)),
    "free of more than ten fields": bdf(brick=lambda *f: ",".join(map(str, ("CHEXA", *f)))),
    "free of ten fields": bdf(brick=lambda k, p, *n: ",".join(map(str, ("CHEXA", k, p, *n[:7]))) + f"\n,{n[7]}"),
    "free of second order": bdf(free_grid, lambda k, p, *n: free("CHEXA", k, p, *second(n))),
    "free with missing middles": bdf(free_grid, lambda k, p, *n: free("CHEXA", k, p, *second(n)[: 20 - (k == 9)])),
    "free shells": bdf(free_grid, lambda k, p, *n: free("CQUAD4", k, 4, *n[:4]), "PSHELL,4,7,.01,7"),
    "free shells with thickness": bdf(
        free_grid,
        lambda k, p, *n: free("CQUAD4", k, 4, *n[:4], *["", "", "", "", ".02"] * (k == 7)),
        "PSHELL,4,7,.01,7",
    ),
    "free systems": bdf(
        lambda k, *x: free("GRID", k, 4, *map(short, x), 4), between="CORD2C,4,,1.,0.,0.,1.,0.,1.,+\n+,2.,0.,0."
    ),
    "free with large fields": bdf(lambda k, *x: f"GRID*,{k},,{x[0]},{x[1]},*\n*,{x[2]}"),
    "free with a letter": bdf(lambda k, *x: free_grid(k, *x).replace("GRID,7,", "GRID,7,x")),
    "free and cut": bdf(
        free_grid, lambda k, *f: free("CHEXA", k, *f).split("\n")[0] if k == 9 else free("CHEXA", k, *f)
    ),
    "comments between": bdf(between="$ bricks\n$"),
    "a comment within": bdf(lambda k, *x: grid(k, *x) + "\n$ here" * (k == 40)),
    "held grids": bdf(lambda k, *x: small("GRID", k, 0, *map(short, x), 0, "123" if k < 9 else "")),
    "defaults": bdf(between="GRDSET,,,,,,,456"),
    "a system": bdf(
        lambda k, *x: small("GRID", k, 4, *map(short, x), 4), between="CORD2C,4,,1.,0.,0.,1.,0.,1.,+\n+,2.,0.,0."
    ),
    "two properties": bdf(brick=lambda k, p, *n: chexa(k, 5 + k % 2, *n), between="PSOLID,6,7"),
    "second order": bdf(brick=lambda k, p, *n: chexa(k, p, *second(n))).replace("PSOLID,5,7", "PSOLID,5,7,,2"),
    "missing middles": bdf(brick=lambda k, p, *n: chexa(k, p, *second(n)[: 20 - (k == 9)])),
    "a fluid": bdf().replace("PSOLID,5,7", "PSOLID,5,7,,,,,PFLUID"),
    "left-handed": bdf(brick=lambda k, p, *n: chexa(k, p, *(n[4:] + n[:4] if k in (7, 9) else n))),
    "the same again": bdf(between=f"{grid(5, *POINTS[4])}\n{chexa(1, 5, *BRICKS[0])}"),
    "another grid of that number": bdf(between=grid(5, 7.0, 0.0, 0.0)),
    "absent system": bdf(lambda k, *x: small("GRID", k, 9 if k == 30 else "", *map(short, x))),
    "absent grid": bdf(brick=lambda k, p, *n: chexa(k, p, *n[:7], 999 if k == 20 else n[7])),
    "a grid twice": bdf(brick=lambda k, p, *n: chexa(k, p, *n[:7], n[0] if k == 20 else n[7])),
    "absent property": bdf(brick=lambda k, p, *n: chexa(k, 8 if k == 12 else p, *n)),
    "no properties": bdf().replace(PROPERTIES, ""),
    "SEID": bdf(lambda k, *x: small("GRID", k, "", *map(short, x), "", "", 3 if k == 9 else "")),
    "sets and masses": bdf(between="CONM2,1,1,,5.\nSPC1,3,123,1,THRU,16\nNSM1,1,ELEMENT,1.,ALL"),
    "replication": bdf(between="GRID,900,,9.,0.,0.\n=,*1,=,*1.,==\n=(3)"),
    "replication in a continuation": bdf(between=f"{grid(900, 9.0, 0.0, 0.0)}\n+       {'=':>8}"),
    "replication behind a block": bdf(between=large("GRID", "*1", "=", "*1.", "=", "=", "", "", "")),
    "the last goes on elsewhere": bdf(brick=apart),
    "a line of no card": bdf(between="+Q      " + "       5"),
    "shells": bdf(brick=lambda k, p, *n: small("CQUAD4", k, 4, *n[:4]), between="PSHELL,4,7,.01,7"),
    "turned shells": bdf(brick=lambda k, p, *n: small("CQUAD4", k, 4, *n[:4], "10."), between="PSHELL,4,7,.01,7"),
    "triangles": bdf(brick=lambda k, p, *n: small("CTRIA3", k, 4, *n[:3]), between="PSHELL,4,7,.01,7"),
    "tetrahedra": bdf(brick=lambda k, p, *n: small("CTETRA", k, 5, n[0], n[1], n[3], n[4])),
    "wedges": bdf(brick=lambda k, p, *n: small("CPENTA", k, 5, *n[:3], *n[4:7])),
}


# ------------------------------------------------------------------ Ansys


def row(label: int, nodes: list[int], material: int = 1, system: int = 0) -> str:
    """Return the lines of an element of an EBLOCK."""
    numbers = [material, 1, 1, 1, system, 0, 0, 0, len(nodes), 0, label, *nodes]
    return "\n".join("".join(f"{n:9d}" for n in numbers[k : k + 19]) for k in range(0, len(numbers), 19))


def component(kind: str, name: str, numbers: list[int]) -> str:
    """Return a CMBLOCK."""
    rows = ["".join(f"{n:10d}" for n in numbers[k : k + 8]) for k in range(0, len(numbers), 8)]
    return "\n".join([f"CMBLOCK,{name},{kind},{len(numbers):8d}", "(8i10)", *rows])


def cdb(solid: Callable[..., str] = row, tail: str = "", kind: str = "185", points: list[list[float]] = POINTS) -> str:
    """Return an Ansys file."""
    rows = []
    for k, values in enumerate(points, 1):
        filled = max((j + 1 for j, value in enumerate(values) if value), default=0)
        rows.append(f"{k:9d}{0:9d}{0:9d}" + "".join(f"{value:21.13E}" for value in values[:filled]))
    elements = [solid(k, nodes) for k, nodes in enumerate(BRICKS, 1)]
    head = ["/PREP7", f"ET,1,{kind}"]
    head += [f"MP,{name},{k},{value}" for k in (1, 2) for name, value in (("EX", 1e11), ("PRXY", 0.3), ("DENS", 7800))]
    nodes = [f"NBLOCK,6,SOLID,{len(rows):9d},{len(rows):9d}", "(3i9,6e21.13e3)", *rows, "N,R5.3,LOC,       -1,"]
    blocks = [f"EBLOCK,19,SOLID,{len(elements):9d},{len(elements):9d}", "(19i9)", *elements, "       -1"]
    return "\n".join([*head, *nodes, *blocks, tail, "FINISH", ""])


THICK = "SECTYPE,1,SHELL\nSECDATA,.01,1"
FOOT = component("NODE", "FOOT", [*range(1, 41)])

CDB = {
    "bricks": cdb(tail=FOOT),
    "sets": cdb(
        tail="\n".join([FOOT, component("ELEM", "SOME", [*range(20, 0, -1), 27]), component("NODE", "R", [3, -9])])
    ),
    "absent in a set": cdb(tail=FOOT.replace("         7", "       700")),
    "two materials": cdb(lambda k, n: row(k, n, 1 + (k > 9))),
    "materials in turn": cdb(lambda k, n: row(k, n, 1 + k % 2)),
    "collapsed": cdb(lambda k, n: row(k, [*n[:3], n[2], *([n[4]] * 4 if k % 3 else [*n[4:7], n[6]])])),
    "pyramids": cdb(lambda k, n: row(k, [*n[:4], *[n[4]] * 4] if k > 5 else n)),
    "coincident": cdb(lambda k, n: row(k, [*n[:7], n[0]] if k == 8 else n)),
    "second order": cdb(lambda k, n: row(k, second(n)), kind="186"),
    "missing middles": cdb(lambda k, n: row(k, [*second(n)[:19], 0 if k == 3 else second(n)[19]]), kind="186"),
    "integrated fully": cdb(lambda k, n: row(k, second(n)), kind="186", tail="KEYOPT,1,2,1"),
    "tetrahedra": cdb(lambda k, n: row(k, [n[0], n[1], n[3], n[4], *second(n)[8:14]]), kind="187"),
    "orders in turn": cdb(lambda k, n: row(k, n if k % 2 else second(n)), kind="186"),
    "one point": cdb(tail="KEYOPT,1,2,1"),
    "systems": cdb(lambda k, n: row(k, n, system=11), tail="LOCAL,11,1,0,0,0"),
    "predefined systems": cdb(lambda k, n: row(k, n, system=(1, 2, 5)[k // 9 % 3])),
    "systems of shells": cdb(
        lambda k, n: row(k, n[:4] if k > 9 else [*n[:3], n[2]], system=11 + (k > 20)),
        kind="181",
        tail=f"{THICK}\nLOCAL,11,2,1,2,3,30\nLOCAL,12,0,0,0,0,40",
    ),
    "systems of second order": cdb(
        lambda k, n: row(k, second(n), system=11), kind="186", tail="LOCAL,11,1,.5,0,0,20,30"
    ),
    "absent system": cdb(lambda k, n: row(k, n, system=12 if k == 9 else 0)),
    "absent node": cdb(lambda k, n: row(k, [*n[:7], 999 if k == 9 else n[7]])),
    "absent type": cdb().replace("ET,1,185", "ET,2,185"),
    "shells": cdb(lambda k, n: row(k, n[:4]), kind="181", tail=THICK),
    "triangles": cdb(lambda k, n: row(k, n[:4] if k > 9 else [*n[:3], n[2]]), kind="181", tail=THICK),
    "shells of second order": cdb(lambda k, n: row(k, [*n[:4], *second(n)[8:12]]), kind="281", tail=THICK),
    "shells with missing middles": cdb(
        lambda k, n: row(k, [*n[:4], *second(n)[8:11], second(n)[11] * (k != 5)]), kind="281", tail=THICK
    ),
    "old shells": cdb(lambda k, n: row(k, n[:4]), kind="63", tail="R,1,.01"),
    "shells without a section": cdb(lambda k, n: row(k, n[:4]), kind="181"),
    "shells that coincide": cdb(lambda k, n: row(k, [*n[:3], n[k == 7]]), kind="181", tail=THICK),
    "angles": cdb(points=[[*x, 0.0, 0.0, 30.0 * (k == 3)] for k, x in enumerate(POINTS)], tail="D,4,UX,0."),
    "node twice": cdb().replace("\n        7        0        0", "\n        6        0        0"),
    "element twice": cdb(lambda k, n: row(k - (k == 5), n)),
    "more elements": cdb(tail="TYPE,1\nMAT,1\nE,1,2,6,5,17,18,22,21\nEN,200,1,2,6,5,17,18,22,21"),
    "the last goes on": cdb(tail="EMORE,1"),
    "more nodes": cdb(tail="N,900,1,2,3\nN,1,-.25,0,0"),
    "named by selections": cdb(tail="ALLSEL\nCM,EVERY,ELEM\nCM,THEM,NODE"),
    "a comment within": cdb().replace("\n        1        1        1", "\n! here\n        1        1        1", 1),
    "a blank line": cdb().replace("\n       -1\n", "\n\n       -1\n"),
    "cut short": cdb()[:-300],
    "bare": cdb().replace("MP,", "!MP,"),
}


# ------------------------------------------------------------------ Abaqus and CalculiX

STEEL = "*MATERIAL, NAME=steel\n*ELASTIC\n2.1e11, .3\n*DENSITY\n7800.\n"
SHELL = "*SHELL SECTION, ELSET=body, MATERIAL=steel\n.01\n"
BEAM = "*BEAM SECTION, ELSET=body, MATERIAL=steel, SECTION=RECT\n.1, .2\n0, 1, 0\n"
RANGES = "*NSET, NSET=r, GENERATE\n1, 60, 7\n2, 60, 7\n3, 60, 7\n*ELSET, ELSET=e, GENERATE\n1, 9\n"
COUPLED = "*NODE\n900, 9, 9, 9\n*RIGID BODY, NSET=foot, REF NODE=900\n*EQUATION\n2\n61, 1, 1., 62, 1, -1.\n"
COPIED = "*ELGEN, ELSET=body\n1, 1, 1, 1\n*ELCOPY, OLD SET=body, ELEMENT SHIFT=500, SHIFT NODES=0\n"
SOLID = "*SOLID SECTION, ELSET=body, MATERIAL=steel\n"


def lines(numbers: list[int], width: int = 16) -> list[str]:
    """Return numbers in lines of so many; those that go on end in a comma."""
    return [
        ", ".join(map(str, numbers[k : k + width])) + "," * (k + width < len(numbers))
        for k in range(0, len(numbers), width)
    ]


def node(number: int, *x: float) -> str:
    """Return a line of *NODE."""
    return ", ".join(map(str, (number, *x)))


def inp(
    node: Callable[..., str] = node,
    brick: Callable[..., list[int]] = lambda k, *n: [k, *n],
    kind: str = "C3D8",
    between: str = "",
    tail: str = SOLID + STEEL,
    nodes: str = "*NODE, NSET=all",
) -> str:
    """Return a deck of lines that two functions write."""
    rows = [node(k, *x) for k, x in enumerate(POINTS, 1)]
    bricks = [line for k, own in enumerate(BRICKS, 1) for line in lines(brick(k, *own))]
    elements = f"*ELEMENT, TYPE={kind}, ELSET=body"
    sets = ["*NSET, NSET=foot", *lines([*range(1, 60)]), "*ELSET, ELSET=some", *lines([*range(27, 0, -1)], 5)]
    return "\n".join([nodes, *rows, *filter(None, [between]), elements, *bricks, *sets, tail])


def instances(text: str) -> str:
    """Return a deck of a part, twice, one of them moved."""
    move = "0, 0, 9\n0, 0, 0, 1, 1, 1, 33\n"
    places = "".join(f"*INSTANCE, NAME={k}, PART=p\n{m}*END INSTANCE\n" for k, m in (("i", ""), ("j", move)))
    return f"*PART, NAME=p\n{text}*END PART\n*ASSEMBLY, NAME=a\n{places}*END ASSEMBLY\n{STEEL}"


INP = {
    "bricks": inp(),
    "exponents": inp(lambda k, *x: f"{k},{x[0]:.16e},{x[1]:.7E},{x[2]:.3e}"),
    "Fortran's exponents": inp(lambda k, *x: f"{k}, " + ", ".join(f"{v:.12E}".replace("E", "D") for v in x)),
    "exponents without a letter": inp(lambda k, *x: f"{k}, {x[0]}, {x[1]}, " + ("1.5-6" if k == 9 else "0.")),
    "blank coordinates": inp(lambda k, *x: f"{k}, {x[0]}, , {x[2]}"),
    "commas at the end": inp(lambda k, *x: f"{node(k, *x)},"),
    "two coordinates": inp(
        lambda k, *x: f"{k}, {x[0] + 9 * x[2]}, {x[1] * 7}", lambda k, *n: [k, *n[:4]], "CPS4", tail=""
    ),
    "plane stress": inp(brick=lambda k, *n: [k, *n[:4]], kind="CPS4"),
    "normals": inp(lambda k, *x: f"{node(k, *x)}, 0., 0., 1."),
    "cylinder": inp(nodes="*NODE, SYSTEM=C"),
    "a system": inp(nodes="*SYSTEM\n1, 0, 0, 1, 1, 0\n*NODE"),
    "comments": inp(between="** bricks\n\n**"),
    "a comment within": inp(lambda k, *x: "** here\n" * (k == 7) + node(k, *x)),
    "comments behind": inp(lambda k, *x: node(k, *x) + "\n** here\n" * (k == 64)),
    "a blank line": inp(lambda k, *x: node(k, *x) + "\n" * (k == 7)),
    "a blank line before a damaged one": inp().replace("\n17, ", "\n\n17, x").replace("17, x", "17, 999, "),
    "second order": inp(brick=lambda k, *n: [k, *second([*n])], kind="C3D20"),
    "reduced": inp(brick=lambda k, *n: [k, *second([*n])], kind="C3D20R"),
    "tetrahedra": inp(brick=lambda k, *n: [k, n[0], n[1], n[3], n[4]], kind="C3D4"),
    "wedges": inp(brick=lambda k, *n: [k, *n[:3], *n[4:7]], kind="C3D6"),
    "collapsed": inp(brick=lambda k, *n: [k, *n[:3], n[2], *n[4:7], n[6]]),
    "shells": inp(brick=lambda k, *n: [k, *n[:4]], kind="S4", tail=SHELL + STEEL),
    "beams": inp(brick=lambda k, *n: [k, n[0], n[1]], kind="B31", tail=BEAM + STEEL),
    "three nodes": inp(brick=lambda k, *n: [k, n[0], n[1], n[2]], kind="B32", tail=""),
    "points": inp(brick=lambda k, *n: [k, n[0]], kind="MASS", tail="*MASS, ELSET=body\n5.\n"),
    "bare points": inp(brick=lambda k, *n: [k, n[0], n[6]], kind="SPRINGA", tail=""),
    "missing nodes": inp(brick=lambda k, *n: [k, *n[: 8 - (k == 9)]]),
    "nodes too many": inp(brick=lambda k, *n: [k, *n, *n[:1] * (k == 9)]),
    "absent node": inp(brick=lambda k, *n: [k, *n[:7], 999 if k == 9 else n[7]]),
    "coincident": inp(brick=lambda k, *n: [k, *n[:7], n[0] if k == 9 else n[7]]),
    "the same element": inp(brick=lambda k, *n: [1, *BRICKS[0]] if k == 9 else [k, *n]),
    "another element of that number": inp(brick=lambda k, *n: [k - (k == 9), *n]),
    "the same node": inp(between=f"*NODE\n{node(9, *POINTS[8])}"),
    "more nodes": inp(between="*NODE\n" + "\n".join(node(k, *POINTS[k - 1]) for k in range(60, 65))),
    "other nodes": inp(between="*NODE\n" + "\n".join(node(k, k, 0, 1) for k in range(100, 110))),
    "unknown type": inp(kind="CONN3D2"),
    "ranges": inp(tail=RANGES + "*ELSET, ELSET=f\nbody, e\n" + SOLID + STEEL),
    "absent in sets": inp(tail="*NSET, NSET=r\n1, 2,\n999, 3,\n4, 5\n*ELSET, ELSET=e\n1\n400\n5\n" + SOLID + STEEL),
    "supports": inp(tail=f"{SOLID}{STEEL}*BOUNDARY\nfoot, 1, 3\n*STEP\n*FREQUENCY\n9\n*CLOAD\nall, 3, 1.\n*END STEP\n"),
    "couplings": inp(tail=SOLID + STEEL + COUPLED),
    "copies": inp(tail=COPIED + SOLID + STEEL),
    "instances": instances(inp(tail=SOLID)),
    "no sections": inp(tail=""),
    "without an end": inp(tail="").rstrip(),
}
