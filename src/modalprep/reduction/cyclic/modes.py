"""Modes of a ring of equal sectors from one of them, by nodal diameter, at rest and at a speed of rotation."""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh, eigvalsh

from modalprep.drawing import Plotted
from modalprep.errors import AccuracyError, InputError
from modalprep.fe.assembly.model import FEModel
from modalprep.fe.mesh.cyclic import CyclicSymmetry
from modalprep.fe.mesh.mesh import Mesh
from modalprep.linalg.blas import one_numpy_thread
from modalprep.records import Record
from modalprep.reduction.cyclic.problem import Problem, single_modes
from modalprep.reduction.cyclic.sector import Sector, make_sector
from modalprep.reduction.cyclic.spin import at_speed, moved_mass
from modalprep.reduction.notes import UNCOUNTED
from modalprep.suggest import refuse_other
from modalprep.verdicts.notes import told, with_warnings

MORE = 20  # further modes that span the second-order mass and the Coriolis forces
TIE = 1e-6  # of the largest entry of a shape


@dataclass(frozen=True, eq=False, kw_only=True)
class CyclicModes(Record, Plotted):
    """Modes of a ring of equal sectors.

    Attributes
    ----------
    nodal_diameter : (k,) int
        Of each mode, ascending.
    frequency : (k,)
        Hz, ascending within a nodal diameter; at speed without Coriolis forces.
    backward, forward : (k,)
        Hz, in the rotating frame with Coriolis forces: of the waves that travel against the rotation and with it.
    multiplicity : (k,) int
        2 where the ring has two modes of this shape, turned against each other; else 1.
    shape : (n_dof, k) complex
        Of the sector: sector j of the ring moves by the real part of ``R^j shape e^{i n alpha j}``, R the rotation by
        one sector, alpha its angle; times -i it is the second mode of a pair. Of unit modal mass in the ring.
    sectors : int
    speed : float
        rad/s about the axis.
    notes : tuple of str
        Messages for the user.

    References
    ----------
    Theory 3.9.
    """

    nodal_diameter: np.ndarray
    frequency: np.ndarray
    backward: np.ndarray
    forward: np.ndarray
    multiplicity: np.ndarray
    shape: np.ndarray
    sectors: int
    speed: float
    notes: tuple[str, ...] = ()

    def rows(self) -> list[dict[str, float]]:
        """Return a row for each mode: nodal diameter, its number there, frequencies and multiplicity.

        Returns
        -------
        list of dict
            Frequencies in Hz.
        """
        first = np.searchsorted(self.nodal_diameter, self.nodal_diameter)
        columns = {
            "nodal_diameter": self.nodal_diameter,
            "mode": np.arange(len(first)) - first + 1,
            "frequency": self.frequency,
            "backward": self.backward,
            "forward": self.forward,
            "multiplicity": self.multiplicity,
        }
        return [
            dict(zip(columns, row, strict=True)) for row in zip(*map(np.ndarray.tolist, columns.values()), strict=True)
        ]

    def __repr__(self) -> str:
        """Size and range of frequencies, and the warnings."""
        n = self.nodal_diameter
        span = f"{self.frequency.min():.4g}..{self.frequency.max():.4g} Hz" if len(n) else "none"
        text = f"CyclicModes({self.sectors} sectors, {len(n)} modes of {len(set(n.tolist()))} nodal diameters, {span})"
        return with_warnings(text, self.notes)


class Harmonic(NamedTuple):
    """Modes of one nodal diameter: w^2 (k,), shapes of the sector (m, k), w of both waves (2, k), whether counted."""

    w2: np.ndarray
    shape: np.ndarray
    waves: np.ndarray
    counted: bool


@told
@one_numpy_thread(beside_mkl=True)
def cyclic_modes(
    model: FEModel,
    mesh: Mesh,
    cyclic: CyclicSymmetry | None = None,
    *,
    modes: int = 10,
    nodal_diameters: Iterable[int] | None = None,
    speed: float = 0.0,
    held: bool = True,
    solver: str = "auto",
) -> CyclicModes:
    """Return the lowest modes of a ring of equal sectors, by nodal diameter, from the model of one sector.

    At speed, the frame rotates with the ring: the stiffness includes the geometric stiffness of the centrifugal forces
    and their change with the displacement, the mass its second order as in `prestressed_modes`. Coriolis forces are in
    `backward` and `forward` only, within the span of the modes and `MORE` others.

    Parameters
    ----------
    model : FEModel
        Of the sector. Its interfaces are those of every sector.
    mesh : Mesh
        Of the sector.
    cyclic : CyclicSymmetry
        Default that of the deck (``Mesh.cyclic``).
    modes : int
        Number for each nodal diameter; pairs count once.
    nodal_diameters : iterable of int
        From 0 to half the number of sectors; default all.
    speed : float
        rad/s about the axis.
    held : bool
        Whether the fixed interfaces are held, the root among them; False lets the ring float.
    solver : {"auto", "in_memory", "single", "out_of_core", "superlu"}
        As `factorise` takes it.

    Returns
    -------
    CyclicModes

    Raises
    ------
    InputError
        When the edges of the sector do not fit each other, a nodal diameter does not exist, a ring that is not held
        rotates, or the centrifugal forces make it unstable.
    AccuracyError
        When a mode is not accurate, or one is missing.

    References
    ----------
    Theory 3.9. D. L. Thomas, Dynamics of rotationally periodic structures, Int. J. Numer. Meth. Engng 14 (1979) 81.

    Examples
    --------
    >>> from modalprep.examples import disc_sector
    >>> mesh, model, cyclic = disc_sector()
    >>> found = cyclic_modes(model, mesh, cyclic, modes=1, nodal_diameters=[0, 1, 2])
    >>> found.nodal_diameter, found.multiplicity
    (array([0, 1, 2]), array([1, 2, 2]))
    """
    refuse_other("cyclic_modes: the model", FEModel, model)
    cyclic = cyclic or mesh.cyclic
    if cyclic is None or cyclic.whole:
        raise InputError("cyclic_modes: the mesh has no cyclic symmetry; give that of a sector")
    if modes < 1:
        raise InputError(f"cyclic_modes: modes = {modes} must be at least 1")
    diameters = _diameters(cyclic, nodal_diameters)
    if speed and not held:
        raise InputError("cyclic_modes: a ring at speed must be held at its fixed interfaces; leave held = True")
    sector = make_sector(model, mesh, cyclic, held)
    problem = Problem(sector, held, solver)
    if speed:
        problem = at_speed(problem, speed)
    found = {n: _harmonic(problem, n, modes) for n in diameters}
    return _record(sector, found, speed)


def _diameters(cyclic: CyclicSymmetry, asked: Iterable[int] | None) -> list[int]:
    most = cyclic.sectors // 2
    found = sorted(set(range(most + 1) if asked is None else asked))
    for n in found:
        if n not in range(most + 1):
            raise InputError(f"nodal diameter {n} does not exist: {cyclic.sectors} sectors have 0 to {most}")
    return found


def _harmonic(problem: Problem, n: int, modes: int) -> Harmonic:
    """Return the modes of a nodal diameter."""
    K, M = problem.matrices(n)
    spin = problem.spin
    if spin is None:
        w2, Z, counted = single_modes(K, M, modes, problem.held, problem.solver)
        return Harmonic(w2, problem.sector.map(n) @ Z, np.sqrt([w2, w2]), bool(counted))
    w2 = np.zeros(1)  # of a ring that is not stable
    Z = np.zeros((0, 1))
    counted = ""
    with suppress(AccuracyError):
        w2, Z, counted = single_modes(K, M, modes + MORE, solver=problem.solver)
    if np.any(w2 <= 0):
        raise InputError(f"the ring is not stable at this speed in {n} nodal diameters; reduce the speed")
    w2, turn = eigh(np.diag(w2), moved_mass(problem, n, Z))
    Z = problem.sector.map(n) @ (Z @ turn)
    return Harmonic(w2[:modes], Z[:, :modes], _waves(w2, 1j * (Z.conj().T @ (spin.G @ Z)))[:, :modes], bool(counted))


def _waves(w2: np.ndarray, C: np.ndarray) -> np.ndarray:
    """Return the roots ``w^2 z = (diag(w2) + w C) z``, C Hermitian: (2, k), those above zero and minus those below.

    They are eigenvalues of the Hermitian ``[[C, W], [W, 0]]``, ``W^2 = diag(w2)``, for the vectors ``w z`` and ``W z``.
    """
    W = np.diag(np.sqrt(w2))
    roots = eigvalsh(np.block([[C, W], [W, np.zeros_like(W)]]))
    return np.array([roots[len(w2) :], -roots[: len(w2)][::-1]])


def _record(sector: Sector, found: dict[int, Harmonic], speed: float) -> CyclicModes:
    share = [1 if sector.single(n) else 2 for n in found]
    count = [len(each.w2) for each in found.values()]
    scale = np.sqrt(np.repeat(share, count) / sector.cyclic.sectors)
    waves = np.concatenate([each.waves for each in found.values()], axis=1) / (2 * np.pi)
    shape = sector.C @ np.concatenate([each.shape.astype(complex) for each in found.values()], axis=1)
    return CyclicModes(
        nodal_diameter=np.repeat(list(found), count),
        frequency=np.sqrt(np.concatenate([each.w2 for each in found.values()])) / (2 * np.pi),
        backward=waves[0],
        forward=waves[1],
        multiplicity=np.repeat(share, count),
        shape=_with_real_top(scale * shape),
        sectors=sector.cyclic.sectors,
        speed=float(speed),
        notes=(*sector.notes(), *_uncounted(found)),
    )


def _uncounted(found: dict[int, Harmonic]) -> tuple[str, ...]:
    """Say in which nodal diameters a mode may be missing."""
    open_to_doubt = [str(n) for n, each in found.items() if len(each.w2) and not each.counted]
    return (f"in nodal diameters {', '.join(open_to_doubt)} the {UNCOUNTED}",) if open_to_doubt else ()


def _with_real_top(shape: np.ndarray) -> np.ndarray:
    """Turn the phase of each shape so that the first of its largest entries is real and positive."""
    size = np.abs(shape)
    top = np.argmax(size >= (1 - TIE) * size.max(axis=0), axis=0)
    first = shape[top, np.arange(len(top))]
    return shape * (first.conj() / np.abs(first))
