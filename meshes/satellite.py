"""A satellite of shells, beams, bars, bricks and springs: `python meshes/satellite.py` writes satellite.msh.

`--size N` sets the cells along an edge of the bus (a multiple of 8); 8 gives 5 thousand DOFs, 24 gives 48 thousand.
`-o FILE` writes elsewhere. Nothing but numpy is needed, and the same size gives the same bytes.
"""

import argparse
from pathlib import Path

import numpy as np

# m; the bus is a cube on z = 0, its centre line along z, the wings along y
BUS = 1.5
WING_WIDTH, WING_LENGTH, WING_ROOT = 2.0, 4.0, 1.25  # along x and y, and where it begins
DRIVE, HINGE = 0.10, 0.05  # length of the drive's shaft and of the spring behind it
YOKE = 0.5  # half the width at the wing
DISH, FOCUS, VERTEX = 0.6, 0.5, 1.85  # radius, focal length, height of the vertex
BLOCK = 0.3  # height of the payload over its panel; its foot is a quarter of the panel's edge
ADAPTER = 0.25  # height of the launcher adapter below the bus
MERGE = 1e-6  # nodes closer than this are one

GMSH = {"vertex": (0, 15), "line": (1, 1), "triangle": (2, 2), "quad": (2, 3), "hexahedron": (3, 5)}  # dimension, type
KIND = {1: "vertex", 2: "line", 3: "triangle", 4: "quad", 8: "hexahedron"}


# --- pieces: arrays (cells, corners, 3) of coordinates ------------------------------------------------------------


def lines(points):
    """Line cells through points (k, 3)."""
    points = np.asarray(points, dtype=float)
    return np.stack([points[:-1], points[1:]], axis=1)


def line(start, end, n):
    return lines(np.linspace(start, end, n + 1))


def quads(points):
    """Quads on points (p, q, 3); the normal is that of the first direction cross the second."""
    return np.stack([points[:-1, :-1], points[1:, :-1], points[1:, 1:], points[:-1, 1:]], axis=2).reshape(-1, 4, 3)


def panel(corner, along, across, n, m):
    """Plane panel of n x m quads on two edge vectors."""
    s, t = np.linspace(0, 1, n + 1)[:, None, None], np.linspace(0, 1, m + 1)[None, :, None]
    return quads(np.asarray(corner) + s * np.asarray(along) + t * np.asarray(across))


def square(centre, along, across, n):
    """Points (4 n, 1, 3) around a square of half edges `along` and `across`, n cells on an edge."""
    t = np.linspace(-1, 1, n + 1)[:-1, None]
    a, b = np.asarray(along), np.asarray(across)
    sides = [t * a - b, a + t * b, b - t * a, -a - t * b]
    return (np.asarray(centre) + np.concatenate(sides))[:, None]


def bricks(low, size, n):
    """Hexahedra of a box."""
    steps = [np.linspace(a, a + d, k + 1) for a, d, k in zip(low, size, n, strict=True)]
    p = np.stack(np.meshgrid(*steps, indexing="ij"), axis=-1)
    corners = [(i, j, k) for k in (0, 1) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))]
    cut = [p[i : i + n[0], j : j + n[1], k : k + n[2]].reshape(-1, 3) for i, j, k in corners]
    return np.stack(cut, axis=1)


def dish_point(ring, place, rings):
    """Point number `place` of the 6*ring on a ring of the paraboloid."""
    r, angle = DISH * ring / rings, np.pi * place / (3 * max(ring, 1))
    return np.array([r * np.cos(angle), r * np.sin(angle), VERTEX + r**2 / (4 * FOCUS)])


def dish(rings):
    """Triangles of a paraboloid, six sectors of rings^2 each."""
    found = []
    for sector in range(6):
        for k in range(1, rings + 1):
            outer = [dish_point(k, sector * k + j, rings) for j in range(k + 1)]
            inner = [dish_point(k - 1, sector * (k - 1) + j, rings) for j in range(k)]
            found += [(outer[j], outer[j + 1], inner[j]) for j in range(k)]
            found += [(inner[j], outer[j + 1], inner[j + 1]) for j in range(k - 1)]
    return np.array(found)


def adapter_circle(k):
    """Points (8 k + 1, 2) around the eight bolts of the adapter, k cells from bolt to bolt, the last as the first."""
    first = np.arctan2(1, 3)  # bolts at (3, 1) / 8 of the bus, and its mirror images
    quarter = np.concatenate([np.linspace(first, np.pi / 2 - first, k + 1)[:-1],
                              np.linspace(np.pi / 2 - first, np.pi / 2 + first, k + 1)[:-1]])  # fmt: skip
    angle = np.concatenate([quarter + turn * np.pi / 2 for turn in range(4)] + [[first + 2 * np.pi]])
    return BUS * np.sqrt(10) / 8 * np.column_stack([np.cos(angle), np.sin(angle)])


# --- the satellite ------------------------------------------------------------------------------------------------


def bus(n):
    """Six panels with outward normals, the web in the plane x = 0 and the beams along the twelve edges."""
    h, x, y, z = BUS / 2, np.array([BUS, 0, 0]), np.array([0, BUS, 0]), np.array([0, 0, BUS])
    low, top = np.array([-h, -h, 0]), np.array([-h, -h, BUS])
    decks = [panel(low, y, x, n, n), panel(top, x, y, n, n)]
    sides = [panel(low, x, z, n, n), panel(low + x, y, z, n, n)]
    sides += [panel(low + x + y, -x, z, n, n), panel(low + y, -y, z, n, n)]
    edges = [line(c + a, c + a + b, n) for c in (low, top) for a, b in ((0, x), (x, y), (x + y, -x), (y, -y))]
    edges += [line(low + a, low + a + z, n) for a in (0 * x, x, x + y, y)]
    return {
        "decks": np.concatenate(decks),
        "sides": np.concatenate(sides),
        "web": panel(low + x / 2, y, z, n, n),
        "frame": np.concatenate(edges),
    }


def wing(n, side):
    """Wing, its frame, its yoke, the drive with its spring, and the cross on the panel that carries it."""
    half, level, w = BUS / 2, BUS / 2, WING_WIDTH / 2
    root, tip = side * WING_ROOT, side * (WING_ROOT + WING_LENGTH)
    foot, near = np.array([0, side * half, level]), np.array([0, side * (half + DRIVE), level])
    far = near + np.array([0, side * HINGE, 0])
    ends = [np.array([x, root, level]) for x in (-YOKE, YOKE)]
    first = min(root, tip)
    corners = [(-w, root, level), (w, root, level), (w, tip, level), (-w, tip, level)]
    rim = zip(corners, corners[1:] + corners[:1], (n, 2 * n, n, 2 * n), strict=True)
    arms = [(BUS / 8, 0, 0), (0, 0, BUS / 8)]
    return {
        "wings": panel((-w, first, level), (WING_WIDTH, 0, 0), (0, WING_LENGTH, 0), n, 2 * n),
        "wing_frame": np.concatenate([line(a, b, k) for a, b, k in rim]),
        "yoke": np.concatenate([line(far, end, n // 4) for end in ends]),
        "struts": lines([(far + end) / 2 for end in ends]),
        "drive": line(foot, near, 2),
        "hinge": lines([near, far]),
        "brackets": np.concatenate([line(foot - arm, foot + arm, n // 4) for arm in arms]),
    }


def antenna(n):
    """Dish on six struts from three points of the deck to three points of its middle ring; its rim."""
    rings = n // 2
    feet = BUS / 4 * np.array([[1, 1, 4], [-1, 0, 4], [1, -1, 4]])
    heads = np.array([dish_point(rings // 2, turn * rings, rings) for turn in range(3)])
    pairs = [(0, 0), (0, 2), (1, 0), (1, 1), (2, 1), (2, 2)]  # head, foot
    rim = np.array([dish_point(rings, k, rings) for k in range(6 * rings)])
    return {"dish": dish(rings), "struts": np.array([(feet[f], heads[h]) for h, f in pairs]), "rim": rim[:, None]}


def adapter(n):
    """Cylinder below the bus, beams along its rims, and beams across the deck through the nodes that join the two."""
    circle, steps = adapter_circle(3 * n // 8), np.linspace(-ADAPTER, 0, n // 4 + 1)
    points = np.concatenate([np.broadcast_to(circle[:, None], (len(circle), len(steps), 2)),
                             np.broadcast_to(steps[None, :, None], (len(circle), len(steps), 1))], axis=2)  # fmt: skip
    rims = np.concatenate([lines(points[:, 0]), lines(points[:, -1])])
    q, h = BUS / 8, BUS / 2
    beams = [line((s * q, -h, 0), (s * q, h, 0), n) for s in (-1, 1)]
    beams += [line((-h, s * q, 0), (h, s * q, 0), n) for s in (-1, 1)]
    return {"adapter": quads(points), "ring": rims, "stiffeners": np.concatenate(beams), "launcher": points[:-1, :1]}


def equipment(n):
    """Payload block on the +x panel, and the node rings that carry the tank and the wheels."""
    q = BUS / 8
    return {
        "payload": bricks((4 * q, -q, 3 * q), (BLOCK, 2 * q, 2 * q), (n // 4,) * 3),
        "tank_ring": square((0, 0, 4 * q), (0, 2 * q, 0), (0, 0, 2 * q), n // 2),
        "wheel_ring_a": square((-2 * q, -2 * q, 0), (q, 0, 0), (0, q, 0), n // 4),
        "wheel_ring_b": square((-2 * q, 2 * q, 0), (q, 0, 0), (0, q, 0), n // 4),
    }


def satellite(n):
    """Return {group: corner coordinates (cells, corners, 3)}."""
    if n < 8 or n % 8:
        raise SystemExit(f"--size {n} must be a multiple of 8")
    groups = {}
    for piece in (bus(n), wing(n, 1), wing(n, -1), antenna(n), adapter(n), equipment(n)):
        for name, cells in piece.items():
            groups.setdefault(name, []).append(cells)
    return {name: np.concatenate(cells) for name, cells in groups.items()}


def merged(groups):
    """Return the points (k, 3) and {group: cells (cells, corners)}: corners in one place are one node."""
    corners = np.concatenate([cells.reshape(-1, 3) for cells in groups.values()])
    _, first, number = np.unique(np.round(corners / MERGE).astype(int), axis=0, return_index=True, return_inverse=True)
    cuts = np.cumsum([cells.shape[0] * cells.shape[1] for cells in groups.values()])[:-1]
    cells = [c.reshape(g.shape[:2]) for c, g in zip(np.split(number.ravel(), cuts), groups.values(), strict=True)]
    return corners[first] + 0.0, dict(zip(groups, cells, strict=True))


def write(path, groups, digits=9):
    """Write a .msh 4.1 file, ASCII: one entity and one physical name per group."""
    points, cells = merged(groups)
    kinds = {name: KIND[c.shape[1]] for name, c in cells.items()}
    dimension = {name: GMSH[kind][0] for name, kind in kinds.items()}
    tag = {name: k for k, name in enumerate(cells, 1)}
    order = sorted(cells, key=lambda name: dimension[name])
    text = ["$MeshFormat", "4.1 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(cells))]
    text += [f'{dimension[name]} {tag[name]} "{name}"' for name in order]
    text += ["$EndPhysicalNames", "$Entities", " ".join(str(list(dimension.values()).count(d)) for d in range(4))]
    for name in order:
        box = points[cells[name].ravel()]
        bounds = box[0] if dimension[name] == 0 else [*box.min(axis=0), *box.max(axis=0)]
        text.append(" ".join(f"{v:.6g}" for v in bounds) + f" 1 {tag[name]}" + " 0" * (dimension[name] > 0))
        text[-1] = f"{tag[name]} {text[-1]}"
    text += ["$EndEntities", "$Nodes", f"1 {len(points)} 1 {len(points)}", f"2 {tag['decks']} 0 {len(points)}"]
    text += [str(k) for k in range(1, len(points) + 1)]
    text += [" ".join(f"{v:.{digits}g}" for v in p) for p in points]
    count = sum(len(c) for c in cells.values())
    text += ["$EndNodes", "$Elements", f"{len(cells)} {count} 1 {count}"]
    number = 0
    for name in order:
        text.append(f"{dimension[name]} {tag[name]} {GMSH[kinds[name]][1]} {len(cells[name])}")
        for nodes in (cells[name] + 1).tolist():
            number += 1
            text.append(" ".join(map(str, (number, *nodes))))
    Path(path).write_text("\n".join([*text, "$EndElements", ""]))


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--size", type=int, default=8, help="cells along an edge of the bus, a multiple of 8")
    parser.add_argument("-o", dest="target", default=str(Path(__file__).with_suffix(".msh")), help="mesh file")
    given = parser.parse_args()
    write(given.target, satellite(given.size))
