"""The text of a first pipeline file."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from modalprep.fe.mesh.analysis import AnalysisCase
from modalprep.pipeline.init.analysis import band_lines, damping_text, load_tables, modes_text, said_lines, vector_lines
from modalprep.pipeline.init.interfaces import MOST
from modalprep.pipeline.init.proposal import Proposal, comment, key, number, quoted
from modalprep.pipeline.init.survey import Survey
from modalprep.pipeline.init.units import extent

MOST_LISTED = 24  # further interfaces in comments
SHELL, ROD = 100, 40  # size of the part over the assumed thickness of shells and diameter of beams
UPS = (
    (0, 0, 1),
    (0, 1, 0),
    (1, 0, 0),
    (1, 2, 3),
    (3, 1, 2),
    (2, -3, 1),
)  # of beams, the first that none is parallel to
FAMILIES = {1: "beam", 2: "shell", 3: "solid"}


def pipeline_text(survey: Survey, target: Path, material: tuple[str, tuple[float, float, float]], given: bool) -> str:
    """Return the pipeline file of a part; `given` says whether the material is not an assumption."""
    parts = [
        f"# {target.stem}: from {survey.file.name} to a modal file. modalprep init wrote it; correct what it assumes.",
        _mesh(survey, target),
        *_materials(survey, material, given),
        *_supports(survey),
        *_interfaces(survey),
        *load_tables(survey.mesh, survey.case),
        _reduction(survey),
        "[output]\npictures = 6  # the report is written always",
    ]
    return "\n\n".join(parts) + "\n"


def _mesh(survey: Survey, target: Path) -> str:
    read = survey.read
    file = path_from(target.parent, survey.file)
    lines = [*(comment(f"note: {note}") for note in survey.notes), "[mesh]", f"file = {quoted(file)}"]
    lines.append(f'length_unit = "{read.length_unit}"  # {read.why}')
    if read.mass_unit is not None and survey.mesh.properties:
        lines.append(f'mass_unit = "{read.mass_unit}"  # of the materials of the deck')
    if read.dialect is not None:
        lines.append(f'dialect = "{read.dialect}"')
    if read.size is not None:  # of a CAD file
        lines.append(
            f"size = {number(read.size, read.size)}  # edge of an element; halve it to see what the mesh changes"
        )
        lines.append("order = 2")
    if survey.mesh.cyclic is not None:
        lines.append(f"\n[cyclic]  # the mesh is one of the {survey.mesh.cyclic.sectors} sectors that the deck states")
    return "\n".join(lines)


def path_from(folder: Path, file: Path) -> str:
    """Return a path from a folder to a file; the whole one where they are far apart."""
    try:
        path = Path(os.path.relpath(file.resolve(), folder.resolve()))
    except ValueError:  # another drive
        path = file.resolve()
    return (file.resolve() if path.parts.count("..") > 3 else path).as_posix()


def _materials(survey: Survey, material: tuple[str, tuple[float, float, float]], given: bool) -> list[str]:
    if not survey.structure:
        return ["# Materials and properties are those of the deck."]
    name, (E, nu, rho) = material
    assumed = "" if given else "# ASSUMPTION: the file says no material, and this one is taken.\n"
    table = f"{assumed}[materials.{name}]\nE = {E:.6g}  # Pa\nnu = {nu:.6g}\nrho = {rho:.6g}  # kg/m^3"
    return [table, *(_property(survey, group, dimension, name) for group, dimension in survey.structure.items())]


def _property(survey: Survey, group: str, dimension: int, material: str) -> str:
    size = extent(survey.mesh)
    lines = [f"[properties.{key(group)}]", f'type = "{FAMILIES[dimension]}"', f'material = "{material}"']
    if dimension == 2:
        lines.append(f"thickness = {size / SHELL:.2g}  # m; ASSUMPTION: the file says none")
    if dimension == 1:
        lines += _up(survey, group)
        lines.append(f'section = {{ shape = "rod", diameter = {size / ROD:.2g} }}  # m; ASSUMPTION: the file says none')
    return "\n".join(lines)


def _up(survey: Survey, group: str) -> list[str]:
    """Return a direction that no beam of a group is parallel to, where z is not one."""
    along = np.concatenate(
        [np.diff(survey.mesh.points[conn[:, :2]], axis=1)[:, 0] for conn in survey.mesh.group(group).values()]
    )
    along /= np.maximum(np.linalg.norm(along, axis=1), 1e-300)[:, None]
    straight = [up for up in UPS if np.abs(along @ up / np.linalg.norm(up)).max() < 1 - 1e-6]
    return [] if straight[:1] == [UPS[0]] else [f"up = {list((straight or UPS)[0])}"]


def _supports(survey: Survey) -> list[str]:
    if survey.supported is None:
        return []
    held = survey.mesh.supports[survey.supported]
    others = "".join(
        f"\n# [supports.{key(name)}]\n# set = {quoted(name)}"
        for name in survey.mesh.supports
        if name != survey.supported
    )
    return [
        f"# The first interface carries the body frame: here what holds {len(held.nodes)} nodes, as the deck does.\n"
        '[interfaces.support]\nkind = "support"',
        f"[supports.{key(survey.supported)}]\nset = {quoted(survey.supported)}{others}",
    ]


def _interfaces(survey: Survey) -> list[str]:
    active = survey.active
    first = survey.supported is None
    parts = []
    for k, one in enumerate(active):
        root = "; the first interface carries the body frame" if first and k == 0 else ""
        parts.append(f"# {one.what}{root}\n{_table(one)}")
    if not active and first:
        parts.append("# NO INTERFACE WAS FOUND: choose one, such as\n# [interfaces.root]\n# near = [0, 0, 0]")
    rest = [one for one in survey.interfaces if not any(one is other for other in active)]
    if rest:
        intro = f"# Further ones; each active interface adds six constraint modes, and {MOST} at most are taken."
        parts.append("\n\n".join([intro, *(comment(f"{one.what}\n{_table(one)}") for one in rest[:MOST_LISTED])]))
    if len(rest) > MOST_LISTED:
        parts.append(f"# {len(rest) - MOST_LISTED} more are not listed.")
    return parts


def _table(one: Proposal) -> str:
    return f"[interfaces.{key(one.name)}]\n{one.keys}"


def _reduction(survey: Survey) -> str:
    case = survey.case or AnalysisCase(number=0, name="")
    modes = f"modes = {modes_text(case, survey.in_band)}; the report says which matter"
    damping = f"damping = {damping_text(case)}"
    return "\n".join([*said_lines(case), "[reduction]", modes, *band_lines(case), damping, *vector_lines(case)])
