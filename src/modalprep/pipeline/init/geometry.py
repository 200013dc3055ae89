"""Interfaces that the geometry of a mesh suggests: openings, pins and plane faces."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from modalprep.fe.features.openings import Opening
from modalprep.fe.features.planes import PlaneFace
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.mesh.select import NodeSet
from modalprep.pipeline.init.proposal import Proposal, number, numbers
from modalprep.pipeline.init.units import extent


def described(one: Opening, scale: float) -> str:
    """Say what a round opening or pin is, in the unit of the mesh."""
    size = 1e3 * one.cylinder.radius / scale
    noun = ("hole" if one.hole else "outer cylinder") if one.length else ("round edge" if one.hole else "round rim")
    centre = numbers(one.centre / scale, size)
    axis = numbers(one.cylinder.axis, 1e3)
    return f"{noun} of radius {number(one.cylinder.radius / scale, size)} at {centre} along {axis}"


def round_ones(mesh: Mesh, rounds: list[Opening]) -> Iterator[Proposal]:
    """Yield the openings, which are likely, and the pins."""
    count = {True: 0, False: 0}
    for one in rounds:
        count[one.hole] += 1
        name = f"hole_{count[True]}" if one.hole else f"pin_{count[False]}"
        keys, nodes = _round_keys(mesh, one)
        yield Proposal(
            name=name,
            keys=keys,
            what=f"{described(one, mesh.scale)}, {len(nodes)} nodes",
            nodes=nodes,
            direction=one.cylinder.axis,
            place=one.centre,
            radius=one.cylinder.radius,
            likely=one.hole,
        )


def _round_keys(mesh: Mesh, one: Opening) -> tuple[str, np.ndarray]:
    """Return the node set of an opening: its cylinder, with a tolerance where nodes lie off it, or its plane."""
    c, scale = one.cylinder, mesh.scale
    size = extent(mesh) / scale
    used = used_nodes(mesh)
    text = f"point = {numbers(c.point / scale, size)}, axis = {numbers(c.axis, 1.0)}"
    text += f", radius = {number(c.radius / scale, size)}"
    found = NodeSet(cylinder=(tuple(c.point), tuple(c.axis), c.radius)).nodes(mesh, used) if _near(mesh, one) else []
    if not np.isin(one.nodes, found).all():
        off = 1.5 * float(np.abs(c.distance(mesh.points[one.nodes])).max())
        found = NodeSet(cylinder=(tuple(c.point), tuple(c.axis), c.radius, off)).nodes(mesh, used)
        text += f", tolerance = {off / scale:.2g}"
    if one.length or len(found) == len(one.nodes):
        return f"cylinder = {{ {text} }}", np.asarray(found)
    flat = NodeSet(plane=(tuple(c.point), tuple(c.axis))).nodes(mesh, used)
    plane = f"plane = {{ point = {numbers(c.point / scale, size)}, normal = {numbers(c.axis, 1.0)} }}"
    return plane, flat


def _near(mesh: Mesh, one: Opening) -> bool:
    """Whether nodes of an opening lie on its cylinder to the tolerance of node sets."""
    return bool((np.abs(one.cylinder.distance(mesh.points[one.nodes])) <= 1e-6 * extent(mesh)).any())


def used_nodes(mesh: Mesh) -> np.ndarray:
    """Return the nodes of the cells that are no points (k,)."""
    found = np.zeros(len(mesh.points), dtype=bool)
    for kind, conn in mesh.cells.items():
        if cell_dimension(kind):
            found[conn] = True
    return np.flatnonzero(found)


def plane_ones(mesh: Mesh, planes: list[PlaneFace], nothing: bool) -> Iterator[Proposal]:
    """Yield the plane faces; where there is nothing else, those at the ends of the longest extension are likely.

    Without such ends the two largest are.
    """
    axis = int(np.argmax(np.ptp(mesh.points, axis=0)))
    size = extent(mesh) / mesh.scale
    used = used_nodes(mesh)
    ends = mesh.points[used, axis].min(), mesh.points[used, axis].max()
    outer = [
        abs(one.normal[axis]) > 0.999 and min(abs(one.point[axis] - end) for end in ends) < 1e-4 * extent(mesh)
        for one in planes
    ]
    for k, one in enumerate(planes, 1):
        point = numbers(one.point / mesh.scale, 10 * size)
        normal = numbers(one.normal, 1.0)
        nodes = used[np.abs((mesh.points[used] - one.point) @ one.normal) <= 1e-6 * extent(mesh)]
        if not len(nodes):
            continue
        yield Proposal(
            name=f"plane_{k}",
            keys=f"plane = {{ point = {point}, normal = {normal} }}",
            what=f"plane face across {normal} of area {one.area / mesh.scale**2:.3g}",
            nodes=nodes,
            likely=nothing and bool(outer[k - 1] if any(outer) else k <= 2),
        )


def first_nodes(mesh: Mesh) -> Proposal:
    """Return nodes at the lower end of the longest extension, for a file that runs where nothing else is found."""
    used = used_nodes(mesh)
    axis = int(np.argmax(np.ptp(mesh.points, axis=0)))
    along = mesh.points[used, axis]
    near = used[along <= along.min() + 0.02 * np.ptp(along)]
    points = mesh.points[near] / mesh.scale
    size = extent(mesh) / mesh.scale
    return Proposal(
        name="root",
        keys=f"box = [{numbers(points.min(axis=0), size)}, {numbers(points.max(axis=0), size)}]",
        what=f"A PLACEHOLDER, because nothing was found: {len(near)} nodes at the end along {'xyz'[axis]}",
        nodes=near,
    )
