"""Mesh quality: flaws of a mesh with their number, their location and a remedy."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from modalprep.fe.mesh.cells import cell_dimension, cell_of
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.properties.points import Spring
from modalprep.fe.quality import connectivity_findings
from modalprep.fe.quality.findings import Checked, Finding, Quality, Severity, Statistics
from modalprep.fe.quality.shape import Shape, measure
from modalprep.suggest import refuse_other

__all__ = ["Finding", "Quality", "Statistics", "check_mesh"]

# Limits. Angles and aspect are those at which Abaqus/CAE warns; warpage is that of Nastran's GEOMCHECK (Q4_WARP):
# the two halves of a square then meet at 22 degrees. A tetrahedron of scaled Jacobian 0.05 is about 5 % as high as
# the regular one. A mid-side node at a quarter of its edge makes the Jacobian vanish at the end of the edge.
ASPECT, WARPAGE, JACOBIAN, MIDDLE = 10.0, 0.05, 0.05, 0.25
ANGLES = {"triangle": (5.0, 170.0), "quad": (10.0, 160.0)}
ROUNDING = 1e-9


@dataclass(frozen=True)
class Rule:
    """A limit on one number of `Shape`, for some dimensions of cells; ``sign`` -1 when the number must not be below."""

    kind: str
    severity: Severity
    value: str
    text: str
    limit: float = np.nan
    sign: int = 1
    dimensions: tuple[int, ...] = (2, 3)


FLAWS = (
    Rule(
        "degenerate",
        "error",
        "degenerate",
        "{what} {are} degenerate (no length, area or volume, or one node used twice), the first near {at}; "
        "remove the collapsed cells or mesh there again",
    ),
    Rule(
        "inverted",
        "error",
        "inverted",
        "{what} {are} inverted (negative Jacobian), the first near {at}; reverse the order of the nodes, "
        "or mesh there again with straighter edges",
    ),
    Rule(
        "bow-tie",
        "error",
        "crossed",
        "{what} {are} crossed or re-entrant (an interior angle above 180 degrees), the first near {at}; "
        "list the corners around the cell, or split it into triangles",
    ),
)
LIMITS = (
    Rule(
        "aspect ratio",
        "warning",
        "aspect",
        "{what} {are} long and thin (longest over shortest edge up to {worst:.3g}, advised below {limit:g}), "
        "the first near {at}; mesh there with more even edges",
        ASPECT,
    ),
    Rule(
        "warped",
        "warning",
        "warpage",
        "{what} {are} warped (corners off their mean plane by up to {worst:.3g} of the diagonal, advised below "
        "{limit:g}), the first near {at}; split into triangles or mesh finer",
        WARPAGE,
    ),
    Rule(
        "flat",
        "warning",
        "jacobian",
        "{what} {are} nearly flat (scaled Jacobian down to {worst:.2g}, advised above {limit:g}), the first near {at}; "
        "optimize the mesh or mesh there again",
        JACOBIAN,
        -1,
        (3,),
    ),
    Rule(
        "middle node",
        "warning",
        "mid",
        "{what} {are} curved too much (a mid-side node up to {worst:.3g} of the edge away from its middle, advised "
        "below {limit:g}), the first near {at}; mesh there finer or with straight edges",
        MIDDLE,
        1,
        (1, 2, 3),
    ),
)
SMALL = (
    "{what} {are} pointed (angle down to {worst:.3g} degrees, advised above {limit:g}), the first near {at}; "
    "mesh there again"
)
LARGE = (
    "{what} {are} nearly folded flat (angle up to {worst:.4g} degrees, advised below {limit:g}), the first near {at}; "
    "mesh there again"
)


def check_mesh(
    mesh: Mesh, structural: Collection[str] | None = None, joined: Collection[str | np.ndarray] = ()
) -> Quality:
    """Check the shape and the connectivity of the cells of a mesh.

    Parameters
    ----------
    mesh : Mesh
    structural : groups, optional
        Names of the groups that carry properties, or a mapping from these to their properties, by which springs
        without length are recognised. None takes all cells but points; surface cells whose nodes all belong to
        solids are then taken as marks of the solids' surface.
    joined : groups, or arrays (k,) of nodes
        Whose nodes are tied together outside the mesh, for example by an rbe2 interface.

    Returns
    -------
    Quality
        Its findings, errors first, and statistics of each cell type. A flaw is a finding, never an exception.

    Raises
    ------
    InputError
        When a group is unknown.

    References
    ----------
    Limits of angles and aspect ratio: the warnings of Abaqus/CAE; of warpage: Q4_WARP of Nastran's GEOMCHECK.

    Examples
    --------
    >>> points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    >>> check_mesh(Mesh(points=points, cells={"quad": np.array([[0, 1, 2, 3]])}, groups={})).findings
    ()
    >>> print(check_mesh(Mesh(points=points, cells={"quad": np.array([[0, 1, 3, 2]])}, groups={})).errors[0].message)
    1 quad cell is crossed or re-entrant (an interior angle above 180 degrees), the first near (0.5, 0.5, 0) m;
    list the corners around the cell, or split it into triangles
    """
    refuse_other("check_mesh: the mesh", Mesh, mesh)
    checked = _checked(mesh, structural, joined)
    connected, edges = connectivity_findings.find(checked)
    found = [f for f in (*_shape_findings(checked), *connected) if f is not None]
    found.sort(key=lambda f: f.severity)  # "error" comes before "warning"
    statistics = {kind: Statistics.of(len(conn), checked.shapes.get(kind)) for kind, conn in checked.cells.items()}
    free = len(edges.free) if edges else 0
    joints = len(np.unique(edges.number[edges.shared > 2])) if edges else 0
    return Quality(tuple(found), statistics, free, joints)


def _checked(mesh: Mesh, structural: Collection[str] | None, joined: Collection[str | np.ndarray]) -> Checked:
    finite = np.asarray(np.isfinite(mesh.points).all(axis=1))
    rows = {kind: r[finite[mesh.cells[kind][r]].all(axis=1)] for kind, r in _structural_rows(mesh, structural).items()}
    rows = {kind: r for kind, r in rows.items() if len(r)}
    cells = {kind: mesh.cells[kind][r] for kind, r in rows.items()}
    owner = {kind: _owner(mesh, kind, r, structural or ()) for kind, r in rows.items()}
    springs = _spring_rows(mesh, structural)
    plain = {kind: ~np.isin(r, springs.get(kind, np.zeros(0, dtype=int))) for kind, r in rows.items()}
    links = [np.array([[link.node, *link.nodes]]) for link in mesh.links] + [_joined(mesh, which) for which in joined]
    links += [joining.nodes[None] for joining in (*mesh.equations, *mesh.matrices)]
    shapes = {kind: shape for kind, conn in cells.items() if (shape := measure(kind, conn, mesh.points)) is not None}
    shells = _shells(mesh, cells, structural is None)
    return Checked(
        mesh=mesh, rows=rows, cells=cells, owner=owner, plain=plain, shells=shells, links=links, shapes=shapes
    )


def _joined(mesh: Mesh, which: str | np.ndarray) -> np.ndarray:
    return (mesh.nodes(which) if isinstance(which, str) else which)[None]


def _owner(mesh: Mesh, kind: str, rows: np.ndarray, structural: Collection[str]) -> np.ndarray:
    owner = np.zeros(len(mesh.cells[kind]), dtype=int)
    for number, name in enumerate(structural):
        owner[mesh.groups[name].get(kind, [])] = number
    return owner[rows]


def _structural_rows(mesh: Mesh, structural: Collection[str] | None) -> dict[str, np.ndarray]:
    if structural is None:
        rows = {kind: np.arange(len(conn)) for kind, conn in mesh.cells.items()}
    else:
        for name in structural:
            mesh.group(name)  # refuses a name that is not there
        rows = {
            kind: np.unique(np.concatenate([mesh.groups[g].get(kind, np.zeros(0, dtype=int)) for g in structural]))
            for kind in (mesh.cells if structural else ())
        }
    return {kind: r for kind, r in rows.items() if cell_dimension(kind) > 0}


def _spring_rows(mesh: Mesh, structural: Collection[str] | None) -> dict[str, np.ndarray]:
    given = structural if isinstance(structural, Mapping) else {}
    sections = {**mesh.properties, **given}
    names = [g for g, s in sections.items() if isinstance(s, Spring) or getattr(s, "type", "") == "spring"]
    found: dict[str, np.ndarray] = {}
    for name in names:
        for kind, rows in mesh.groups.get(name, {}).items():
            found[kind] = np.concatenate([found.get(kind, rows[:0]), rows])
    return found


def _shells(mesh: Mesh, cells: dict[str, np.ndarray], skip_skin: bool) -> dict[str, np.ndarray]:
    solid = np.zeros(len(mesh.points), dtype=bool)
    for kind, conn in cells.items():
        if skip_skin and cell_dimension(kind) == 3:
            solid[conn] = True
    surface = {k: conn for k, conn in cells.items() if (cell := cell_of(k)) is not None and cell.dimension == 2}
    return {kind: np.flatnonzero(~solid[conn].all(axis=1)) for kind, conn in surface.items()}


def _shape_findings(checked: Checked) -> Iterator[Finding | None]:
    for rule in FLAWS:
        yield _flaw(checked, rule)
    sound = {kind: shape.sound() for kind, shape in checked.shapes.items()}
    for rule in LIMITS:
        yield _beyond(checked, rule, sound)
    for family, (small, large) in ANGLES.items():
        own = {kind: shape for kind, shape in sound.items() if _narrowest_face(kind) == family}
        yield _beyond(checked, Rule("small angle", "warning", "small", SMALL, small, -1), own)
        yield _beyond(checked, Rule("large angle", "warning", "large", LARGE, large), own)
    linear = {kind: np.arange(len(conn)) for kind, conn in checked.cells.items() if kind == "tetra"}
    text = "{what} {are} of first order and much too stiff in bending; save the mesh with second-order elements"
    yield checked.of_cells("linear tetra", "warning", linear, text)


def _narrowest_face(kind: str) -> str:
    """Return which limits of angles a cell has: those of triangles where it has a triangular face."""
    cell = cell_of(kind)
    return "triangle" if cell is not None and any(len(face) == 3 for face in cell.faces) else "quad"


def _flaw(checked: Checked, rule: Rule) -> Finding | None:
    plain = checked.plain
    chosen = {kind: np.flatnonzero(getattr(s, rule.value) & plain[kind]) for kind, s in checked.shapes.items()}
    worst, limit = np.nan, np.nan
    if rule.value == "inverted":
        values = [checked.shapes[kind].jacobian[rows] for kind, rows in chosen.items() if len(rows)]
        worst = float(np.concatenate(values).min()) if values else np.nan
        limit = 0.0
    return checked.of_cells(rule.kind, rule.severity, chosen, rule.text, worst=worst, limit=limit)


def _beyond(checked: Checked, rule: Rule, shapes: Mapping[str, Shape]) -> Finding | None:
    """Return the finding about the cells whose number is beyond the limit; NaN is never beyond."""
    values = {k: rule.sign * getattr(s, rule.value) for k, s in shapes.items() if cell_dimension(k) in rule.dimensions}
    limit = rule.sign * rule.limit
    chosen = {k: np.flatnonzero(v > limit + ROUNDING * abs(limit)) for k, v in values.items()}
    worst = max((v[chosen[k]].max(initial=-np.inf) for k, v in values.items()), default=np.nan)
    return checked.of_cells(rule.kind, rule.severity, chosen, rule.text, worst=rule.sign * worst, limit=rule.limit)
