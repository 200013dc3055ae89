"""Proposals for the interfaces of a part: rigid elements, named sets, openings, ends and plane faces."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import numpy as np

from modalprep.fe.features.openings import Opening
from modalprep.fe.features.planes import PlaneFace
from modalprep.fe.mesh.cells import cell_dimension
from modalprep.fe.mesh.mesh import Mesh
from modalprep.pipeline.init.geometry import first_nodes, plane_ones, round_ones
from modalprep.pipeline.init.proposal import Proposal
from modalprep.pipeline.init.sets import named_sets, single_node, spiders

MOST = 6  # interfaces that are active: each adds six constraint modes
ROOTS = re.compile(r"(root|base|mount|ground|fix|support|launch|inner|hub)", re.IGNORECASE)


def proposals(mesh: Mesh, structure: Iterable[str], rounds: list[Opening], planes: list[PlaneFace]) -> list[Proposal]:
    """Return the interfaces that a part may have, those that are likely first; names differ.

    Parameters
    ----------
    mesh : Mesh
    structure : iterable of str
        Groups that are no sets.
    rounds : list of Opening
    planes : list of PlaneFace
    """
    named = list(named_sets(mesh, set(structure) | set(mesh.properties), rounds))
    found = [*(one for one in named if one.asked), *spiders(mesh), *(one for one in named if not one.asked)]
    taken = [set(one.nodes) for one in found]
    left = [
        one for one in rounds if set(one.nodes) not in taken and not any(set(one.nodes) <= nodes for nodes in taken)
    ]
    holes = list(round_ones(mesh, left))
    found += sorted(holes, key=lambda one: -one.radius) if sum(one.likely for one in holes) > MOST else holes
    if not any(one.likely for one in found):
        found += _ends(mesh)
    nothing = not (mesh.supports or any(one.likely for one in found))
    if nothing:
        found = [one.with_(likely=True) if not one.likely and one.direction is not None else one for one in found]
    found += plane_ones(mesh, planes, nothing and not any(one.likely for one in found))
    if not (mesh.supports or any(one.likely for one in found)):
        found.append(first_nodes(mesh))
    return _chosen(_unique(found))


def without(proposals: list[Proposal], name: str, why: str) -> list[Proposal]:
    """Return the proposals with one, which a model refuses, as the last and not likely."""
    refused = [one.with_(likely=False, what=f"{one.what}; {why}") for one in proposals if one.name == name]
    return [one for one in proposals if one.name != name] + refused


def _chosen(proposals: list[Proposal]) -> list[Proposal]:
    """Return the proposals with the root first; at most MOST stay likely beside those that the deck keeps.

    None shares nodes with another.
    """
    order = sorted(proposals, key=lambda one: (not one.likely, not one.asked, not ROOTS.search(one.name)))
    used: set[int] = set()
    chosen = []
    for one in order:
        free = used.isdisjoint(one.nodes.tolist())
        likely = one.likely and free and (one.asked or sum(other.likely for other in chosen) < MOST)
        what = one.what if free or not one.likely else f"{one.what}; shares nodes with one above"
        chosen.append(one.with_(likely=likely, what=what))
        used |= set(one.nodes.tolist()) if likely else set()
    return sorted(chosen, key=lambda one: not one.likely)


def _unique(proposals: list[Proposal]) -> list[Proposal]:
    """Return the proposals with different nodes, under different names."""
    names: dict[str, int] = {}
    unique = []
    seen = set()
    for one in proposals:
        if (nodes := one.nodes.tobytes()) in seen:
            continue
        seen.add(nodes)
        count = names[one.name] = names.get(one.name, 0) + 1
        unique.append(one if count == 1 else one.with_(name=f"{one.name}_{count}"))
    return unique


def _ends(mesh: Mesh) -> Iterator[Proposal]:
    """Yield the nodes where one line alone ends, in a mesh of lines."""
    lines = [conn[:, :2] for kind, conn in mesh.cells.items() if cell_dimension(kind) == 1]
    others = [conn.ravel() for kind, conn in mesh.cells.items() if cell_dimension(kind) > 1]
    nodes, times = np.unique(np.concatenate(lines), return_counts=True) if lines else (np.zeros(0, dtype=int),) * 2
    free = np.setdiff1d(nodes[times == 1], np.concatenate(others) if others else [])
    few = len(free) <= (2 if mesh.supports else MOST)
    for k, node in enumerate(free, 1):
        end = single_node(mesh, node, "a free end of the beams")
        yield end.with_(name=f"end_{k}", likely=end.likely and few)
