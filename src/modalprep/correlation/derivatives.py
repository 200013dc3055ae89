"""How the frequencies of a model depend on its thicknesses, moduli, densities and sections, by the exact derivative."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.sensitivity.parameters import UNITS, ModelParameter, find_parameters
from modalprep.fe.sensitivity.rates import model_rates
from modalprep.linalg.modes import lowest_modes
from modalprep.notebook import html_table
from modalprep.records import Record
from modalprep.suggest import refuse_other, refuse_unknown
from modalprep.verdicts.notes import told

REPEATED = 1e-6  # of w^2: closer modes have one eigenspace, whose shapes are those that the parameter selects
CLOSE = 0.02  # of the frequency: such neighbours may exchange their places after a small change
RIGID = 1e-6  # of the lowest w^2 with the root clamped: below it a free body is rigid


@dataclass(frozen=True, eq=False, kw_only=True)
class Sensitivities(Record):
    """Derivatives of frequencies by parameters of the model.

    Attributes
    ----------
    frequency : (n,)
        Hz, of the finite-element model.
    parameters : tuple of ModelParameter
    relative : (n, p)
        Relative change of a frequency per relative change of a parameter, ``(p / f) df/dp``.
    repeated : tuple of tuples of int
        Modes of one frequency, counted from 0. Their derivatives, in rising order, are those of the branches into which
        the frequency splits, and the order may differ from one parameter to the next.
    notes : tuple of str

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> sensitivities(cantilever_model(), modes=4, kinds=["modulus", "density"])
    Sensitivities(4 modes, 2 parameters)
    """

    frequency: np.ndarray
    parameters: tuple[ModelParameter, ...]
    relative: np.ndarray
    repeated: tuple[tuple[int, ...], ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def derivative(self) -> np.ndarray:
        """Derivatives (n, p), Hz per unit of the parameter."""
        return self.relative * self.frequency[:, None] / np.array([p.value for p in self.parameters])

    def __repr__(self) -> str:
        """Numbers of modes and parameters."""
        return f"Sensitivities({len(self.frequency)} modes, {len(self.parameters)} parameters)"

    def rows(self) -> list[dict[str, Any]]:
        """Return a row for each mode and parameter: number from 1, Hz, % per %, Hz per unit.

        Returns
        -------
        list of dict
        """
        return [
            {
                "mode": k + 1,
                "frequency_Hz": float(f),
                "parameter": p.name,
                "kind": p.kind,
                "of": p.of,
                "value": float(p.value),
                "unit": p.unit,
                "percent_per_percent": float(self.relative[k, j]),
                "Hz_per_unit": float(self.derivative[k, j]),
            }
            for k, f in enumerate(self.frequency)
            for j, p in enumerate(self.parameters)
        ]

    def _repr_html_(self) -> str:
        """Return the relative derivatives as an HTML table."""
        head = ["mode", "Hz", *(p.name for p in self.parameters)]
        cells = zip(self.frequency.tolist(), self.relative.tolist(), strict=True)
        return html_table(repr(self), head, [[k + 1, f, *row] for k, (f, row) in enumerate(cells)])


@told
def sensitivities(
    model: FEModel,
    *,
    modes: int = 10,
    kinds: Sequence[str] = (),
    materials: Mapping[str, Any] | None = None,
    boundary: Literal["clamped", "free"] = "clamped",
) -> Sensitivities:
    """Return the derivatives of the lowest frequencies of a model by its parameters.

    For a mode of unit modal mass ``d(w^2)/dp = phi^T (dK/dp - w^2 dM/dp) phi``, where the derivatives of the element
    matrices are exact. Modes of one frequency are first turned to the shapes that the parameter selects, the
    eigenvectors of this form within their space.

    Parameters
    ----------
    model : FEModel
        Of a mesh; models from matrices have no properties.
    modes : int
    kinds : sequence of str
        Of ``thickness``, ``modulus``, ``density``, ``A``, ``Iy``, ``Iz``, ``J``, ``stiffness``, ``mass``; empty: all.
    materials : {name: material}, optional
        Names of the materials, for the table.
    boundary : "clamped" or "free"
        Held at the root interface alone, or floating.

    Returns
    -------
    Sensitivities

    Raises
    ------
    InputError
        When a kind is unknown, the model has no such parameter, or it comes from matrices.
    MechanismError, AccuracyError
        When its modes cannot be found.

    References
    ----------
    R. L. Fox, M. P. Kapoor, Rates of change of eigenvalues and eigenvectors, AIAA J. 6 (1968) 2426.
    W. C. Mills-Curran, Calculation of eigenvector derivatives for structures with repeated eigenvalues, AIAA J. 26
    (1988) 867.
    Theory 1.7.

    Examples
    --------
    >>> from modalprep.examples import cantilever_model
    >>> found = sensitivities(cantilever_model(), modes=2, kinds=["modulus", "density"])
    >>> found.relative.round(9)  # f ~ sqrt(E / rho)
    array([[ 0.5, -0.5],
           [ 0.5, -0.5]])
    """
    refuse_other("sensitivities: the model", FEModel, model)
    if boundary not in ("clamped", "free"):
        raise InputError(f"boundary = {boundary!r} is neither 'clamped' nor 'free'")
    if modes < 1:
        raise InputError(f"modes = {modes}: sensitivities need at least one mode")
    parameters = _wanted(model, kinds, materials or {})
    w2, phi = _modes(model, modes, boundary)
    relative, kept, notes = [], [], []
    groups = _groups(w2)
    for parameter in parameters:
        try:
            dK, dM = model_rates(model, parameter, phi)
        except InputError as error:
            notes.append(str(error))
            continue
        kept.append(parameter)
        relative.append(_derivatives(w2, dK, dM, groups) / (2 * w2))
    if not kept:
        raise InputError("; ".join(notes))
    frequency = np.sqrt(w2) / (2 * np.pi)
    return Sensitivities(
        frequency=frequency,
        parameters=tuple(kept),
        relative=np.stack(relative, axis=1),
        repeated=tuple(tuple(group.tolist()) for group in groups if len(group) > 1),
        notes=(*notes, *_notes(frequency, groups, len(w2) < modes)),
    )


def _wanted(model: FEModel, kinds: Sequence[str], names: Mapping[str, Any]) -> list[ModelParameter]:
    if model.elements is None:
        raise InputError("the model comes from matrices, whose dependence on thickness, modulus, density is not known")
    for kind in kinds:
        refuse_unknown(kind, UNITS, "sensitivity by")
    sections = {part.group: part.section for part in model.elements.parts}
    found = [p for p in find_parameters(sections, names) if not kinds or p.kind in kinds]
    if not found:
        raise InputError(f"the model has no {' and no '.join(kinds)} to derive by")
    return found


def _modes(model: FEModel, count: int, boundary: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest elastic ``w^2`` (n,) and their shapes (n_dof, n) of unit modal mass."""
    K, M = ((model.C.T @ A @ model.C).tocsr() for A in (model.K, model.M))
    i = np.setdiff1d(np.arange(K.shape[0]), np.searchsorted(model.free, model.interfaces[0].dofs))
    K_i, M_i = (A[i][:, i].tocsr() for A in (K, M))
    if boundary == "clamped":
        w2, x, _ = lowest_modes(K_i, M_i, count)
        phi = np.zeros((K.shape[0], len(w2)))
        phi[i] = x
        return w2, model.C @ phi
    softest = lowest_modes(K_i, M_i, 1).w2[0]
    w2, phi, _ = lowest_modes(K, M, count + 6, shift=-softest)
    elastic = w2 > RIGID * softest
    return w2[elastic][:count], model.C @ phi[:, elastic][:, :count]


def _groups(w2: np.ndarray) -> list[np.ndarray]:
    """Return the modes of each frequency, counted from 0."""
    return np.split(np.arange(len(w2)), np.flatnonzero(np.diff(w2) > REPEATED * w2[1:]) + 1)


def _derivatives(w2: np.ndarray, dK: np.ndarray, dM: np.ndarray, groups: list[np.ndarray]) -> np.ndarray:
    found = np.empty(len(w2))
    for group in groups:
        own = np.ix_(group, group)
        found[group] = np.linalg.eigvalsh(dK[own] - w2[group].mean() * dM[own])
    return found


def _notes(frequency: np.ndarray, groups: list[np.ndarray], fewer: bool) -> list[str]:
    notes = [f"the model has {len(frequency)} elastic modes only"] if fewer else []
    for group in (g for g in groups if len(g) > 1):
        names = ", ".join(str(k + 1) for k in group)
        notes.append(
            f"modes {names} have one frequency; their derivatives are those of the branches into which it splits, by "
            "size, and may belong to other shapes for each parameter"
        )
    ends = [(a[-1], b[0]) for a, b in pairwise(groups)]
    near = [f"{i + 1} and {j + 1}" for i, j in ends if frequency[j] - frequency[i] < CLOSE * frequency[j]]
    if near:
        notes.append(f"modes {'; '.join(near)} are within {100 * CLOSE:g} %: a small change may exchange them")
    return notes
