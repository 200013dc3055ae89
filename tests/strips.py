"""One strip, straight or curved, as beams, quads, triangles and HEX20 solids: do their prestress matrices agree?

The strip hangs on its root edge; its tip edge moves as a rigid interface. Solids stand on the normals of the middle
surface, so that at a small thickness all kinds are one body.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from structured import grid_cells

import modalprep as mp

ALUMINIUM = mp.Material(E=70e9, nu=0.3, rho=2700.0)
STIFF = mp.Material(E=210e9, nu=0.3, rho=5400.0)
LENGTH = 0.8  # m; also the radius of curved axes
KG = ("Kg_A", "Kg_W", "Kg_F", "Kg_T")
CLOSE = 0.05  # modes whose frequencies differ by less may mix
HEX20 = np.vstack(  # nodes in half cells, meshio's order
    [
        [(0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2)],
        [(1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2)],
        [(0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1)],
    ]
)
Surface = Callable[[np.ndarray, np.ndarray], np.ndarray]
Layers = Sequence[tuple[mp.Material, float]]


# --- middle surfaces ----------------------------------------------------------------------------------------------


def _across(width: float, opening: float):
    """Place y and height z of a cross-section bent to an arc of the angle `opening`, per share v of its width."""
    radius = width / opening
    return lambda v: (radius * np.sin(opening * v), radius * (np.cos(opening * v) - 1))


def _rolled(width: float, opening: float) -> Surface:
    section = _across(width, opening)
    return lambda u, v: np.stack([LENGTH * u, *section(v)], axis=-1)


def _twisted(width: float, angle: float) -> Surface:
    return lambda u, v: np.stack([LENGTH * u, width * v * np.cos(angle * u), width * v * np.sin(angle * u)], axis=-1)


def _straight(width: float) -> Surface:
    return lambda u, v: np.stack([LENGTH * u, width * v, 0 * u * v], axis=-1)


def _arch(width: float) -> Surface:
    def place(u, v):
        a = u * np.pi / 3
        return np.stack([LENGTH * np.sin(a), width * v, LENGTH * (1 - np.cos(a))], axis=-1)

    return place


def _sphere(width: float) -> Surface:
    def place(u, v):
        a, b = u * np.pi / 3, v * width / LENGTH
        return LENGTH * np.stack([np.sin(a) * np.cos(b), np.sin(b), 1 - np.cos(a) * np.cos(b)], axis=-1)

    return place


SURFACES: dict[str, Callable[[float], Surface]] = {
    "straight": _straight,
    "arch": _arch,  # 60 degrees
    "cambered": lambda width: _rolled(width, np.pi / 4),
    "twisted": lambda width: _twisted(width, np.pi / 6),
    "cylindrical": lambda width: _rolled(width, 2 * np.pi / 3),
    "spherical": _sphere,
}


def normals(surface: Surface, u: np.ndarray, v: np.ndarray, step: float = 1e-5) -> np.ndarray:
    """Unit normals ``(..., 3)``, which shells call e3."""
    du, dv = surface(u + step, v) - surface(u - step, v), surface(u, v + step) - surface(u, v - step)
    n = np.cross(du, dv)
    return n / np.linalg.norm(n, axis=-1, keepdims=True)


# --- models -------------------------------------------------------------------------------------------------------


def grid(*cells: int) -> list[np.ndarray]:
    """Shares u from 0 to 1, v (and w) from -1/2 to 1/2, at the corners of cells."""
    return np.meshgrid(*(np.linspace(0, 1, n + 1) - (k > 0) / 2 for k, n in enumerate(cells)), indexing="ij")


def ends_of(surface: Surface, kind: str = "rbe2") -> dict[str, mp.Interface]:
    """Held root and free tip, both framed at the middle of their edge."""
    root, tip = surface(np.array([0.0, 1.0]), np.zeros(2))
    if kind == "node":
        return {
            "root": mp.Interface(group="root", kind="node"),
            "tip": mp.Interface(group="tip", kind="node", boundary="free"),
        }
    return {
        "root": mp.Interface(group="root", kind=kind, position=tuple(root)),
        "tip": mp.Interface(group="tip", kind=kind, boundary="free", position=tuple(tip)),
    }


def model_of(points, kind, groups, properties, root, tip, interfaces, data=None) -> mp.fe.FEModel:
    """Assemble ``groups {name: cells}`` of one kind between the nodes `root` and `tip`."""
    cells = np.concatenate(list(groups.values()))
    rows = np.split(np.arange(len(cells)), np.cumsum([len(c) for c in groups.values()])[:-1])
    held = {"root": np.arange(len(root)), "tip": len(root) + np.arange(len(tip))}
    mesh = mp.fe.Mesh(
        points=points,
        cells={kind: cells, "vertex": np.append(root, tip)[:, None]},
        groups={name: {kind: k} for name, k in zip(groups, rows, strict=True)}
        | {name: {"vertex": k} for name, k in held.items()},
        data=data or {},
    )
    return mp.assemble(mesh, properties, interfaces)


def shells(
    surface: Surface, section: mp.Shell, cells=(60, 6), kind="quad", below=0.0, fine_edges=False
) -> mp.fe.FEModel:
    """Quads or triangles of any order with their nodes at the distance `below` under the middle surface.

    At free edges twisting moments turn into transverse shear within a third of the thickness; equal cells wider than
    the thickness miss it and twist too stiffly by up to ``.63 t/w``. `fine_edges` narrows the cells towards them.
    """
    second = kind[-1] in "689"
    u, v = grid(*(k * (2 if second else 1) for k in cells))
    v = np.sin(np.pi * v) / 2 if fine_edges else v
    points = surface(u, v) - below * normals(surface, u, v)
    net = grid_cells(*cells, kind.rstrip("689"), diagonal="alternating")
    k = np.arange(u.size).reshape(u.shape)
    if second:  # corners are every other point, the other nodes those between
        place = 2 * np.stack(np.unravel_index(net, [n + 1 for n in cells]))
        middle = (place + np.roll(place, -1, axis=2)) // 2
        centre = place.mean(axis=2, keepdims=True).astype(int)[:, :, : kind == "quad9"]
        net = k[tuple(np.concatenate([place, middle, centre], axis=2))]
    return model_of(points.reshape(-1, 3), kind, {"all": net}, {"all": section}, k[0], k[-1], ends_of(surface))


def solids(surface: Surface, layers: Layers, cells=(40, 4), each: int = 2) -> mp.fe.FEModel:
    """HEX20, `each` of them through the thickness of each of the layers (material, thickness), bottom first."""
    n = (*cells, each * len(layers))
    u, v, w = grid(*(2 * k for k in n))
    faces = np.concatenate([[0.0], np.cumsum([t for _, t in layers])]) - sum(t for _, t in layers) / 2
    z = np.interp((w + 0.5) * len(layers), np.arange(len(faces)), faces)
    points = surface(u, v) + z[..., None] * normals(surface, u, v)
    k = np.arange(u.size).reshape(u.shape)
    first = np.stack(np.meshgrid(*(np.arange(0, 2 * m, 2) for m in n), indexing="ij"), axis=-1)
    net = k[tuple(np.moveaxis(first[..., None, :] + HEX20, -1, 0))]  # (nu, nv, nw, 20)
    used = np.zeros(u.size, dtype=bool)
    used[net] = True
    new = np.cumsum(used) - 1
    groups = {f"layer{p}": new[net[:, :, each * p : each * (p + 1)].reshape(-1, 20)] for p in range(len(layers))}
    properties = {f"layer{p}": mp.Solid(material=material) for p, (material, _) in enumerate(layers)}
    root, tip = (new[e[used[e]]] for e in (k[0].ravel(), k[-1].ravel()))
    return model_of(points.reshape(-1, 3)[used], "hexahedron20", groups, properties, root, tip, ends_of(surface))


def beams(surface: Surface, width: float, thickness: float, elements: int = 60, material=ALUMINIUM) -> mp.fe.FEModel:
    """A line of beams whose sections turn with the surface."""
    points = surface(np.linspace(0, 1, elements + 1), np.zeros(elements + 1))
    up = normals(surface, (np.arange(elements) + 0.5) / elements, np.zeros(elements))
    net = np.stack([np.arange(elements), np.arange(1, elements + 1)], axis=-1)
    section = mp.fe.beam_section("rectangle", material, width=width, height=thickness)
    ends = np.array([0]), np.array([elements])
    return model_of(
        points, "line", {"all": net}, {"all": section}, *ends, ends_of(surface, "node"), {"up": {"line": up}}
    )


# --- comparison ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Modal:
    """A modal body with the motion ``(3k, n)`` of k points of the middle surface that all kinds share."""

    body: mp.body.FlexibleBody
    motion: np.ndarray


def modal(model: mp.fe.FEModel, surface: Surface, modes: int = 10) -> Modal:
    """Reduce a model; points between the nodes of a beam move with its sections."""
    reduction = mp.craig_bampton(model, modes=modes, truncation=())
    at = surface(*grid(10, 2)).reshape(-1, 3)
    nodes = model.points[: len(model.dof)]
    node = cKDTree(nodes).query(at)[1]
    if "line" in model.cells:
        node = cKDTree(nodes).query(np.repeat(surface(np.linspace(0, 1, 11), np.zeros(11)), 3, axis=0))[1]
    dof, arm = model.dof[node], at - nodes[node]
    move = reduction.basis[dof[:, :3]]
    if np.any(np.abs(arm) > 1e-9):
        move = move + np.cross(reduction.basis[dof[:, 3:]], arm[..., None], axis=1)
    body = mp.flexible_body(model, reduction, name="strip", second_order_mass=False)  # of which nothing is compared
    return Modal(body, move.reshape(-1, move.shape[2]))


def alignment(own: Modal, reference: Modal) -> np.ndarray:
    """Orthogonal ``T (n, n)`` so that ``own.motion @ T`` is next to the reference: signs, and turns of close modes."""
    frequency = reference.body.frequency
    parts = np.split(np.arange(len(frequency)), 1 + np.flatnonzero(np.diff(frequency) > CLOSE * frequency[1:]))
    T = np.zeros((len(frequency),) * 2)
    for k in parts:
        left, _, right = np.linalg.svd(own.motion[:, k].T @ reference.motion[:, k])
        T[np.ix_(k, k)] = left @ right
    return T


def mac(own: Modal, reference: Modal, modes: int = 6) -> np.ndarray:
    """Cosine between each aligned mode and that of the reference: 1 where they are the same."""
    a, b = (own.motion @ alignment(own, reference))[:, :modes], reference.motion[:, :modes]
    return np.sum(a * b, axis=0) / np.linalg.norm(a, axis=0) / np.linalg.norm(b, axis=0)


def differences(own: Modal, reference: Modal, modes: int = 6) -> dict[str, float]:
    """Largest difference over every block of each array of Kg, over the largest of that array."""
    T, found = alignment(own, reference), {}
    for name in KG:
        a, b = getattr(own.body, name), getattr(reference.body, name)
        a, b = (T.T @ a @ T)[..., :modes, :modes], b[..., :modes, :modes]
        found[name] = float(np.abs(a - b).max() / np.abs(b).max())
    return found
