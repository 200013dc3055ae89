"""Vibration of a whole system about a state or a steady motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from modalprep.multibody.analysis.inputs_outputs import AXES
from modalprep.multibody.analysis.linearise import linearise
from modalprep.multibody.analysis.tangent import roots
from modalprep.multibody.model.system import System
from modalprep.records import Record
from modalprep.suggest import refuse_other

UNCERTAIN = 10.0  # a root below this multiple of its estimated error counts as zero


@dataclass(frozen=True, eq=False, kw_only=True)
class SystemModes(Record):
    """Eigenvalues and mode shapes, by ascending frequency; a complex pair counts once.

    Attributes
    ----------
    eigenvalue : (n,) complex
        1/s.
    frequency : (n,)
        Hz, ``|eigenvalue| / 2 pi``; 0 for motions without stiffness.
    damping : (n,)
        ``-Re / |eigenvalue|``: 1 if overdamped, negative if unstable, 0 without stiffness.
    shape : (nu, n) complex
        All coordinates of the tree, dependent ones included; the largest of each mode is 1.
    motion : dict of (6, n) complex
        ``body.interface``: displacement (m) and rotation (rad) in inertial axes.
    modal : dict of (k, n) complex
        Modal coordinates of each body.
    joints : dict of (k, n) complex
        Coordinates of each joint.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> body = uniform_beam(modes=2)
    >>> weld = Joint(name="wall", type="weld", parent="ground", child="beam")
    >>> found = system_modes(System(bodies={"beam": body}, joints=(weld,)))
    >>> bool(np.allclose(found.frequency, body.frequency, rtol=1e-9))
    True
    """

    eigenvalue: NDArray[np.complex128]
    frequency: np.ndarray
    damping: np.ndarray
    shape: NDArray[np.complex128]
    motion: dict[str, NDArray[np.complex128]]
    modal: dict[str, NDArray[np.complex128]]
    joints: dict[str, NDArray[np.complex128]]


def system_modes(system: System, y: np.ndarray | None = None, t: float = 0.0) -> SystemModes:
    """Return the modes of the linear equations about a state; arguments and errors as `linearise`.

    Mass, gyroscopic matrix and stiffness stand apart, so that stiff bodies do not cost slow modes their digits. About a
    steady motion the shapes are relative to the moving reference. Rigid-body motions have double zero roots, which
    round-off splits; a root within its first-order error (Wilkinson 1965, chapter 2: ``y E x / y x``, E the error of
    the matrices) counts as zero, and a pair of them once.

    Returns
    -------
    SystemModes
        Eigenvalues (1/s) and mode shapes by ascending frequency (Hz).

    References
    ----------
    J. H. Wilkinson, The Algebraic Eigenvalue Problem, Oxford 1965, chapter 2.
    """
    refuse_other("system_modes: the system", System, system)
    ends = [f"{name}.{interface}" for name, body in system.bodies.items() for interface in body.interface_name]
    names = [f"{end}.{what}.{axis}" for end in ends for what in ("position", "rotation") for axis in AXES]
    linear = linearise(system, y, t, outputs=names)
    found = roots(linear.equations)
    values, vectors = found.values, found.vectors
    kept = _once(values, found.error)
    values = values[kept]
    vectors = vectors[:, kept]
    shape = linear.R @ vectors[: len(linear.independent)]
    largest = shape[np.argmax(np.abs(shape), axis=0), np.arange(len(kept))]
    vectors, shape = vectors / largest, shape / largest
    motion = (linear.C @ vectors).reshape(len(ends), 6, -1)
    size = np.where(values == 0, 1.0, np.abs(values))
    return SystemModes(
        eigenvalue=values,
        frequency=np.abs(values) / (2 * np.pi),
        damping=-values.real / size,
        shape=shape,
        motion=dict(zip(ends, motion, strict=True)),
        modal={name: shape[_rows(linear.owner, ("body", name))] for name in system.bodies},
        joints={joint.name: shape[_rows(linear.owner, ("joint", joint.name))] for joint in system.joints},
    )


def _once(values: NDArray[np.complex128], error: np.ndarray) -> np.ndarray:
    """Set roots within their error to zero; return the index of one of each pair, by ascending magnitude."""
    values[np.abs(values) <= UNCERTAIN * error] = 0.0
    values.imag[np.abs(values.imag) <= 1e-9 * np.abs(values)] = 0.0
    zero = np.flatnonzero(values == 0)[::2]
    kept = np.concatenate([zero, np.flatnonzero((values != 0) & (values.imag >= 0))])
    return kept[np.lexsort((values[kept].imag, values[kept].real, np.abs(values[kept])))]


def _rows(owner: tuple, of: tuple[str, str]) -> list[int]:
    return [k for k, each in enumerate(owner) if each == of]
