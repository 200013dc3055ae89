"""What a deck says of its analyses, as one case for the pipeline file: of one subcase, or of all together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.sparse import csr_array

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.analysis import AnalysisCase
from modalprep.fe.mesh.mesh import Mesh
from modalprep.linalg.modes import count_below
from modalprep.reduction.loads import Load, nodal_load

BAND = 1.5  # times the highest frequency of interest: Craig-Bampton's usual margin
MOST_DOFS = 300_000  # of a model whose modes are counted, by one factorisation
FIRST = ("supports", "modes", "lowest", "highest", "damping", "gravity")  # what is taken of the first case that says it


def chosen_case(mesh: Mesh, number: int | None) -> AnalysisCase | None:
    """Return what the deck says of a subcase or step, or of all of them: the loads of all, else the first of each.

    Raises
    ------
    InputError
        When the deck has no such subcase.

    Examples
    --------
    >>> both = AnalysisCase(number=1, name="subcase 1", modes=9), AnalysisCase(number=2, name="subcase 2", modes=5)
    >>> mesh = Mesh(points=np.zeros((0, 3)), cells={}, groups={}, cases=both)
    >>> chosen_case(mesh, 2).modes, chosen_case(mesh, None).modes, chosen_case(mesh, None).said
    (5, 9, ('the cases differ in modes: those of subcase 1 are taken, --subcase chooses another',))
    """
    if number is None:
        return _joined(mesh.cases) if mesh.cases else None
    for case in mesh.cases:
        if case.number == number:
            return case
    known = ", ".join(str(case.number) for case in mesh.cases) or "none"
    raise InputError(f"mesh file {mesh.source} has no subcase or step {number} that says anything; it has {known}")


def idle_loads(model: FEModel, mesh: Mesh, names: Sequence[str]) -> dict[str, str]:
    """Return why loads of a mesh need no truncation vector, by name: they act on nothing but fixed interfaces."""
    fixed = np.concatenate([frame.dofs for frame in model.interfaces if frame.boundary == "fixed"])
    inside = ~np.isin(model.free, fixed)
    found = {}
    for name in names:
        try:
            acts = np.any((model.C.T @ nodal_load(model, mesh, name, Load(set=name)))[inside])
        except InputError as error:
            found[name] = str(error)
        else:
            found |= {} if acts else {name: f"load {name!r} acts on fixed interfaces only, which need no vector for it"}
    return found


def modes_in_band(model: FEModel, highest: float) -> int | None:
    """Return how many modes the clamped model has up to `BAND` times a frequency; None where to count takes long."""
    if model.n_dof > MOST_DOFS:
        return None
    fixed = np.concatenate([frame.dofs for frame in model.interfaces if frame.boundary == "fixed"])
    inside = model.C[:, ~np.isin(model.free, fixed)]
    K, M = (csr_array(inside.T @ A @ inside) for A in (model.K, model.M))
    return count_below(K, M, (2 * np.pi * BAND * highest) ** 2)


def _joined(cases: Sequence[AnalysisCase]) -> AnalysisCase:
    if len(cases) == 1:
        return cases[0]
    found: dict[str, Any] = {}
    said = []
    for key in FIRST:
        saying = [(case.name, value) for case in cases if (value := _value(case, key))]
        if not saying:
            continue
        name, found[key] = saying[0]
        if any(value != found[key] for _, value in saying):
            said.append(f"the cases differ in {key}: those of {name} are taken, --subcase chooses another")
    told = [(case.name, sentence) for case in cases for sentence in case.said]
    for sentence in dict.fromkeys(sentence for _, sentence in told):
        names = [name for name, other in told if other == sentence]
        said.append(sentence if len(names) == len(cases) else f"{', '.join(names)}: {sentence}")
    gravity = {key: np.array(value) for key, value in found.items() if key == "gravity"}
    loads = tuple(dict.fromkeys(load for case in cases for load in case.loads))
    return AnalysisCase(number=0, name="the deck", loads=loads, said=tuple(said), **{**found, **gravity})


def _value(case: AnalysisCase, key: str) -> Any:
    """Return what a case says, nothing where it says none."""
    value = getattr(case, key)
    return (tuple(value.tolist()) if any(value) else None) if key == "gravity" else value
