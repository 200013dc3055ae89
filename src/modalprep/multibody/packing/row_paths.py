"""Rows of constraints in vectors of four, and the links on which they act."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from modalprep.compiler.lanes import WIDTH
from modalprep.multibody.kernels.closed_loops.constraints import (
    ANGLE,
    BUNDLE,
    COUPLER,
    DISTANCE,
    ENTRY,
    GROUP,
    POINT,
    SLIP,
    Constraints,
    Paths,
)
from modalprep.multibody.model.joint_types import NAMED, REVOLUTE, WITH_QUATERNION
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import rows

PARALLEL = 1e-12  # sine of parallel directions, far below the lever of `packing.constraints.IMMOBILE`


def row_paths(arrays: Constraints, packed: Packed) -> Paths:
    """Return groups of up to four rows between the same ends, and bundles of groups that act on nearly the same links.

    Rows that no joint between their ends can move act on none: in a planar mechanism those out of its plane.
    """
    links = packed.model.links
    parent = np.where(links["parent"] < len(links), links["parent"], -1).tolist()
    movable = _movable(arrays, links, parent)
    members = _groups(arrays, movable)
    paths = [_path(arrays, parent, rows[0]) if movable[rows[0]] else [] for rows in members]
    bundled = _bundles(arrays, members, paths)
    acts = sorted({(-link, b) for b, own in enumerate(bundled) for k in own for link in paths[k]})
    entry = {(-link, b): p for p, (link, b) in enumerate(acts)}
    groups, bundles = (
        np.zeros(len(each), kind).view(np.recarray) for each, kind in ((members, GROUP), (bundled, BUNDLE))
    )
    groups.bundle = -1
    lane = np.zeros(len(arrays.rows), dtype=np.int64)
    for b, own in enumerate(bundled):
        for k in own:
            count = bundles[b].count
            groups[k].bundle, groups[k].lane = b, count
            bundles[b].rows[count : count + len(members[k])] = members[k]
            bundles[b].count += len(members[k])
    for k, rows_of in enumerate(members):
        _fill(arrays, links, groups[k], rows_of, entry)
        lane[rows_of] = WIDTH * k + groups[k].lane + np.arange(len(rows_of))
    places = np.where(np.arange(WIDTH) < bundles.count[:, None], bundles.rows, -1).ravel()
    count = sum(movable[rows[0]] for rows in members)
    slides = int((arrays.rows["kind"] == SLIP).sum())
    driven = slides + int((arrays.rows["table"] >= 0).sum())
    entries = _entries(arrays, links, parent, entry, groups, lane)
    entries.count = bundles.count[entries.bundle]
    planar = _planar(arrays, links, movable)
    return Paths(groups, bundles, lane, places, entries, count, slides, driven, planar)


def _bundles(arrays: Constraints, members: list[list[int]], paths: list[list[int]]) -> list[list[int]]:
    """Return the groups of each bundle: they fit into its lanes, and each acts on a link of those before it."""
    found: list[list[int]] = []
    room = 0
    links = set()
    for k, path in enumerate(paths):
        if not path:
            continue
        alone = arrays.rows[members[k][0]].kind == COUPLER
        if alone or len(members[k]) > room or links.isdisjoint(path):
            found.append([])
            room = WIDTH
            links = set()
        found[-1].append(k)
        room = 0 if alone else room - len(members[k])
        links = links | set(path)
    return found


def _planar(arrays: Constraints, links, movable: list[bool]) -> bool:
    """Return whether all links are rigid on parallel hinges, and all movable rows constrain points across these."""
    if not any(movable) or links["modes"].any() or (links["joint"] != REVOLUTE).any():
        return False
    turns = links["rotation"].reshape(-1, 3, 3)
    roots = links["parent"] >= len(links)
    z = np.array([0, 0, 1.0])
    normals = turns[roots] @ z
    inner = turns[~roots]
    tilts = inner @ z - z, z @ inner - z, normals - normals[0]
    tilts += (np.array([_normal_part(arrays, links, normals[0], i) for i in np.flatnonzero(movable).tolist()]),)
    return all((np.abs(tilt) < PARALLEL).all() for tilt in tilts)


def _normal_part(arrays: Constraints, links, normal: np.ndarray, i: int) -> float:
    """Return the component of row i along the normal of the plane, or 1 if it does not constrain a point."""
    row = arrays.rows[i]
    axis = _axes(links, arrays.ends[row.a]) @ row.in_a
    if row.kind != POINT:
        return 1.0
    return float(axis @ normal) if arrays.ends["link"][row.a] < 0 else float(axis[2])


def _fill(arrays: Constraints, links: np.ndarray, group, members: list[int], entry: dict) -> None:
    """Write the other fields of a group, after its bundle and lane."""
    row = arrays.rows[members[0]]
    count = len(members)
    group.kind, group.a, group.b, group.count = row.kind, row.a, row.b, count
    group.rows[:count] = members
    group.link_a, group.link_b = arrays.ends["link"][[row.a, row.b]]
    group.time_dependent = (arrays.rows["table"][members] >= 0).any()
    lanes = slice(group.lane, group.lane + count)
    for end, name, axes in ((row.a, "entry_a", "in_a"), (row.b, "entry_b", "in_b")):
        link = int(arrays.ends["link"][end])
        group[name] = -1 if row.kind == COUPLER else entry.get((link, int(group.bundle)), -1)
        group[axes].reshape(3, WIDTH)[:, lanes] = _axes(links, arrays.ends[end]) @ arrays.rows[axes][members].T
    if row.kind == DISTANCE:
        group.in_a[lanes] = 1.0  # its line has no direction of its own


def _entries(
    arrays: Constraints, links, parent: list[int], entry: dict, groups: np.recarray, lane: np.ndarray
) -> np.recarray:
    """Return the entries: each bundle at each of its links."""
    factors = np.zeros(len(entry))
    for term in arrays.terms[arrays.terms["x"] >= 0]:
        factors[entry[int(term.link), int(groups["bundle"][lane[term.row] // WIDTH])]] += term.factor
    speeds = np.where(np.isin(links["joint"], NAMED), links["u"], -1).tolist()
    reached: set[int] = set()
    for group in groups:
        for end in ("b", "a"):  # the order in which forces on the ends are written
            group[f"accumulates_{end}"] = group[f"entry_{end}"] in reached
            reached.add(int(group[f"entry_{end}"]))
    found = []
    for link, same in groupby(entry, lambda key: key[0]):  # the order in which the recursion takes them
        bundles = [k for _, k in same]
        begin = len(found)
        end = len(found) + len(bundles)
        for k in bundles:
            above = entry.get((parent[link], k), -1)
            found.append((k, link, begin, end, 0, speeds[link], above, above in reached, factors[len(found)]))
            reached.add(above)
    return rows(ENTRY, found)


def _groups(arrays: Constraints, movable: list[bool]) -> list[list[int]]:
    """Return the rows of each group, immovable ones last."""
    keys = [
        (not movable[i], row.kind, row.a, row.b, i if row.kind == COUPLER else -1) for i, row in enumerate(arrays.rows)
    ]
    found = []
    for _, same in groupby(sorted(range(len(keys)), key=keys.__getitem__), keys.__getitem__):
        group = list(same)
        found += [group[k : k + WIDTH] for k in range(0, len(group), WIDTH)]
    return sorted(found, key=lambda group: (not movable[group[0]], group))


def _path(arrays: Constraints, parent: list[int], i: int) -> list[int]:
    """Return the links between the ground and what row i acts on."""
    row = arrays.rows[i]
    found = set()
    begins = arrays.ends["link"][[row.a, row.b]]
    if row.kind == COUPLER:
        begins = arrays.terms["link"][(arrays.terms["row"] == i) & (arrays.terms["x"] >= 0)]
    for link in map(int, begins):
        while link >= 0 and link not in found:
            found.add(link)
            link = parent[link]
    return sorted(found)


def _movable(arrays: Constraints, links: np.ndarray, parent: list[int]) -> list[bool]:
    """Return whether the joints between its ends can move each row."""
    found = [True] * len(arrays.rows)
    fixed = np.isin(arrays.rows["kind"], (POINT, ANGLE)) & np.isinf(arrays.rows["stiffness"])
    ends: list[tuple[int, int]] = arrays.rows[["a", "b"]].tolist()
    for (a, b), same in groupby(np.flatnonzero(fixed).tolist(), ends.__getitem__):
        between = _between(links, parent, arrays.ends[a], arrays.ends[b])
        if between is None:
            continue
        turning, sliding, frame_a, frame_b = between
        for i in same:
            row = arrays.rows[i]
            normals = [frame_a @ row.in_a] + ([frame_b @ row.in_b] if row.kind == ANGLE else [])
            found[i] = not any(
                np.abs(np.cross(turning, n)).max(initial=0.0) < PARALLEL
                and np.abs(sliding @ n).max(initial=0.0) < PARALLEL
                for n in normals
            )
    return found


def _between(links, parent: list[int], a, b):
    """Return the axes of turning and of sliding joints between two ends, and the ends' frames, at zero coordinates.

    All in one frame; None where a body bends or a joint has no axis.
    """
    paths: tuple[list[int], list[int]] = ([], [])
    ends = [int(a.link), int(b.link)]
    while ends[0] != ends[1]:
        side = 0 if ends[0] > ends[1] else 1  # parents have the lower numbers
        paths[side].append(ends[side])
        ends[side] = parent[ends[side]]
    passed = [*paths[0], *paths[1]]
    bodies = passed if ends[0] < 0 else [*passed, ends[0]]
    if links["modes"][bodies].any() or np.isin(links["joint"][passed], WITH_QUATERNION).any():
        return None
    turns = [_rotations(links, path[::-1]) for path in paths]
    axes = np.concatenate([turn[1:, :, 2] for turn in turns])
    frames = [turn[-1] @ _axes(links, end) for turn, end in zip(turns, (a, b), strict=True)]
    passed = [*paths[0][::-1], *paths[1][::-1]]
    return axes[links["about"][passed] != 0], axes[links["along"][passed] != 0], *frames


def _rotations(links, path: list[int]) -> np.ndarray:
    """Return the rotations of links to the frame of the first one's parent at zero coordinates, and of that itself."""
    found = [np.eye(3)]
    for turn in links["rotation"][path].reshape(-1, 3, 3):
        found.append(found[-1] @ turn)
    return np.array(found)


def _axes(links, end) -> np.ndarray:
    """Return the axes of an end in those of its link."""
    return links["align"][end.link].reshape(3, 3).T if end.link >= 0 else end.rotation.reshape(3, 3)
