"""What force elements share: rows of records, the functions of time of a system, ends at interfaces, their motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from modalprep.compiler.by_address import by_address
from modalprep.compiler.jit import compile_kernel
from modalprep.multibody.elements.dense import DenseLoads, Scene
from modalprep.multibody.elements.slopes import BodySlopes, EndSlopes
from modalprep.multibody.kernels.algebra.matrices import UNIT9
from modalprep.multibody.kernels.algebra.tuples import ZERO3
from modalprep.multibody.kernels.interfaces import node_state
from modalprep.multibody.kernels.time_tables import Tables
from modalprep.multibody.model.loads import locate
from modalprep.multibody.model.system import System
from modalprep.multibody.model.time_function import TimeFunction
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.time_tables import tabulate

TWO_ENDS = (
    ("link_a", np.int64),  # -1: the ground
    ("interface_a", np.int64),
    ("link_b", np.int64),
    ("interface_b", np.int64),
)  # the first fields of an element between two interfaces


@by_address
class Environment(NamedTuple):
    """What all elements may read: the functions of time, and the planet (`kernels.loads.gravity`)."""

    tables: Tables
    planet: np.ndarray  # (1,) PLANET


@dataclass(frozen=True)
class ImplicitRow:
    """Stiffness and damping along a line or about an axis of the first end, which an implicit step knows."""

    kind: int  # DISTANCE, POINT or ABOUT of `kernels.closed_loops.constraints`
    axis: np.ndarray  # (3,) in the axes of the first end
    stiffness: float
    damping: float
    ends: tuple[tuple, tuple]  # link, interface, position and rotation on the ground


@dataclass(frozen=True)
class ElementKind:
    """One kind of force element: the `KIND` of its file.

    Attributes
    ----------
    record : type
        The user's class.
    pack : callable
        ``pack(packer, records)`` returns what the compiled law reads.
    apply : callable
        Compiled, ``apply(elements, environment, model, data, t)`` adds the forces of all; returns power (W), energy
        stored and potential (J). What was packed is the field of `elements` with the name of the file.
    dense : callable
        ``dense(record, scene)`` is its reference implementation.
    tangent : callable
        ``tangent(record, scene)`` returns its forces with their derivatives; `c` of the scene's bodies and points is
        their whole acceleration.
    channels : tuple of str
        Names of the two numbers that `observe` gives for each record.
    observe : callable or None
        Compiled, ``observe(elements, environment, model, data, t, i)`` returns the channels of element i.
    implicit : callable or None
        ``implicit(packed)`` returns its `ImplicitRow`.
    adds_mass : bool
        Whether `apply` changes the inertia that other elements read.
    """

    record: type
    pack: Callable[[Packer, Sequence[Any]], Any]
    apply: Callable
    dense: Callable[[Any, Scene], DenseLoads]
    tangent: Callable[[Any, Scene], EndSlopes | BodySlopes]
    channels: tuple[str, ...] = ()
    observe: Callable | None = None
    implicit: Callable[[Any], list[ImplicitRow]] | None = None
    adds_mass: bool = False


class Packer:
    """Collects functions of time while the rows of the elements are made."""

    def __init__(self, system: System, packed: Packed) -> None:
        self.system, self.packed = system, packed
        self.functions: list[tuple[str, TimeFunction]] = []

    def table(self, name: str, function: TimeFunction | None) -> int:
        """Return the number of a function; -1 for none, and for the constant zero."""
        if function is None or function.source == 0:
            return -1
        self.functions.append((name, function))
        return len(self.functions) - 1

    def end(self, text: str) -> tuple[int, int]:
        """Return link and interface of ``body.interface``; -1, 0 for the ground."""
        found = locate(self.system.bodies, text, text)
        return (self.packed.link_of(found[0]), found[1]) if found else (-1, 0)

    def ends(self, between: Sequence[str]) -> tuple[int, int, int, int]:
        """Return the fields `TWO_ENDS`."""
        return (*self.end(between[0]), *self.end(between[1]))

    def tabulate(self, t_end: float, shortest_event: float | None) -> Tables:
        """Return the tables of all functions on [0, t_end].

        Raises
        ------
        InputError
            When a function cannot be used there; the message names its owner.
        """
        names = [name for name, _ in self.functions]
        functions = [function for _, function in self.functions]
        return tabulate(functions, t_end, names, shortest_event)


def ground_or_interface(row: Any, rotation: Sequence[float] | np.ndarray = UNIT9) -> tuple[tuple, tuple]:
    """Return both ends of an element as `ImplicitRow` has them, with its position and a rotation on the ground."""
    place = row.position, rotation
    return (row.link_a, row.interface_a, *place), (row.link_b, row.interface_b, *place)


@compile_kernel
def motion(model, data, link, node, position, rotation):
    """Position, rotation, velocity and angular velocity of an interface, or of a frame on the ground (link -1)."""
    if link >= 0:
        return node_state(model, data, link, node)
    return position, rotation, ZERO3, ZERO3
