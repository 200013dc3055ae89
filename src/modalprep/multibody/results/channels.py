"""Names of all channels of a system, and the columns in which `observation` writes their values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from modalprep.multibody.elements.registry import OBSERVED
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.kernels.free_parts import PART
from modalprep.multibody.model.constraints import Coupler
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import KINDS, PRESCRIBED
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.coordinate_names import words_of
from modalprep.multibody.packing.free_parts import count_parts, part_of_links
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.tree import blank

# the first columns: energies and momenta of the whole system
KINETIC = 0
STRAIN = 1
GRAVITY = 2
STORED = 3
WORK = 4
POWER_IN = 5
LINEAR = 6
ANGULAR = 9
SUMS = 12
TOTALS = {
    "energy.kinetic": KINETIC,
    "energy.strain": STRAIN,
    "energy.gravity": GRAVITY,
    "energy.stored": STORED,
    "energy.work": WORK,
    "power.input": POWER_IN,
    "momentum.linear": slice(LINEAR, ANGULAR),
    "momentum.angular": slice(ANGULAR, SUMS),
}
ENERGIES = ("energy.kinetic", "energy.strain", "energy.gravity", "energy.stored")
STATE, HINGE_FORCE, MOTION, REACTION, WEIGHT, ACCELERATION = range(6)  # what a number is: arrays of one evaluation
MOMENTA = 8  # of a part: linear and angular momentum, three numbers each, and how large they can be with its energy
INTERFACE = ("position", "velocity", "deflection", "acceleration")  # three numbers each, in this order
Index = dict[str, int | slice]  # columns by the channel's name


class Columns(NamedTuple):
    """Layout of a row; link -1 is the ground."""

    joints: np.ndarray  # (n, 4) int: STATE, HINGE_FORCE and so on, index, second index, column; masses too
    wrenches: np.ndarray  # (joints, 4) int: link, parent link and interface, column of force and torque
    bodies: np.ndarray  # (bodies, 4) int: link, column of modal, origin, orientation; interfaces, their column
    closures: np.ndarray  # (closures, 4) int: first row, rows, whether a coupler, column
    elements: np.ndarray  # (force elements, 4) int: kind, number, 0, first of two columns
    motions: np.ndarray  # (bodies with recovery by mode acceleration, 4) int: link, first column, 0, 0
    momenta: np.ndarray  # (parts whose momenta stay, 4) int: 0, first column, 0, 0
    part: np.ndarray  # (nl,) int, the part of each link, -1 of all others
    reactions: np.ndarray  # (nl, 6) work array
    sums: np.ndarray  # (parts,) work array


class Channels:
    """All channels of a system.

    Attributes
    ----------
    index : dict of int or slice
        Column of a scalar or columns of a vector by the channel's name: ``rows[:, index[name]]`` is its history.
    columns : Columns
    width : int
        Number of columns.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> arm = System(bodies={"arm": uniform_beam(modes=2)}, joints=(hinge,))
    >>> channels = Channels(arm, pack(arm), None)
    >>> channels.width, channels.index["hinge.angle"], channels.index["arm.modal"]
    (56, 12, slice(23, 25, None))
    """

    def __init__(self, system: System, packed: Packed, loops: Loops | None) -> None:
        self.system, self.packed = system, packed
        self.index: Index = dict(TOTALS)
        self.width = SUMS
        self.columns = Columns(
            _rows(self._joints()),
            _rows(self._wrenches()),
            _rows(self._bodies()),
            _rows(self._closures(loops) if loops else []),
            _rows(self._elements()),
            _rows(self._motions()),
            _rows(self._momenta()),
            part_of_links(system, packed),
            np.zeros((len(packed.links), 6)),
            blank(PART, count_parts(system, packed)),
        )

    def _number(self, name: str) -> int:
        self.index[name] = self.width
        self.width += 1
        return self.width - 1

    def _vector(self, name: str, size: int) -> int:
        first = self.width
        self.width = self.width + size
        if size:
            self.index[name] = slice(first, self.width)
        return first

    def _joints(self) -> list[tuple]:
        found: dict[str, list[tuple]] = {}
        for i, link in enumerate(self.packed.links):
            for name, source in self._hinge(i, link.joint):
                found.setdefault(f"{link.joint.name}.{name}", []).append(source)
        rows = []
        for name, sources in found.items():
            first = self._number(name) if len(sources) == 1 else self._vector(name, len(sources))
            rows += [(*source, first + k) for k, source in enumerate(sources)]
        rows += self._modal_rates()
        return rows + [
            (WEIGHT, self.packed.link_of(each.body), 0, self._number(f"{each.body}.mass"))
            for each in self.system.depletions
        ]

    def _modal_rates(self) -> Iterator[tuple]:
        for name in self.system.order:
            rates = self.packed.modal_rates_of(name)
            column = self._vector(f"{name}.modal_rate", rates.stop - rates.start)
            yield from ((STATE, k, 0, column + k - rates.start) for k in range(rates.start, rates.stop))

    def _hinge(self, i: int, joint: Joint) -> list[tuple[str, tuple]]:
        """Return the values of one link's hinge: name, source, indices."""
        code, x, u, _ = self.packed.columns[i]
        kind = KINDS[code]
        words = words_of(self.packed, i)
        if kind.named:
            drive = [("drive", (HINGE_FORCE, u, 0))] if joint.elements else []
            rates = [
                (words.rate[0], (STATE, self.packed.nx + u, 0)),
                ("acceleration", (ACCELERATION, self.packed.nx + u, 0)),
            ]
            return [(words.position[0], (STATE, x, 0)), *rates, *drive]
        if code == PRESCRIBED:
            rates = [(words.rate[0], (MOTION, i, 1)), ("acceleration", (MOTION, i, 2))]
            return [(words.position[0], (MOTION, i, 0)), *rates, ("drive", (REACTION, i, 0))]
        if kind.quaternion >= 0:
            n = kind.translations
            first = self.packed.nx + u
            places = [("displacement", (STATE, x + k, 0)) for k in range(n)]
            places += [("quaternion", (STATE, x + n + k, 0)) for k in range(4)]
            places += [("speed", (STATE, first + k, 0)) for k in range(n)]
            rates = {"angular_velocity": STATE, "angular_acceleration": ACCELERATION}
            return places + [(name, (source, first + n + k, 0)) for name, source in rates.items() for k in range(3)]
        return []

    def _wrenches(self) -> list[tuple]:
        rows = []
        for joint in self.system.joints:
            parent = self.system.parent(joint)
            at = (self.packed.link_of(parent[0]), parent[1]) if parent else (-1, 0)
            first = self._vector(f"{joint.name}.force", 3)
            self._vector(f"{joint.name}.torque", 3)
            rows.append((self.packed.link_of(self.system.child(joint)), *at, first))
        return rows

    def _bodies(self) -> list[tuple]:
        rows = []
        for name in self.system.order:
            body = self.system.bodies[name]
            first = self._vector(f"{name}.modal", body.n)
            self._vector(f"{name}.origin", 3)
            self._vector(f"{name}.orientation", 4)
            rows.append((self.packed.link_of(name), first, len(body.interface_name), self.width))
            for interface in body.interface_name:
                for part in INTERFACE:
                    self._vector(f"{name}.{interface}.{part}", 3)
        return rows

    def _motions(self) -> list[tuple]:
        """Columns of the motion of the frame and of the rates of the modes, where recoveries need them."""
        rows = []
        for name in self.system.order:
            body = self.system.bodies[name]
            if any(block.moves for block in body.recovery.values()):
                first = self._vector(f"{name}.frame_acceleration", 3)
                self._vector(f"{name}.frame_angular_velocity", 3)
                self._vector(f"{name}.frame_angular_acceleration", 3)
                self.width += body.n  # the rates of the modes, which every body has
                self._vector(f"{name}.modal_acceleration", body.n)
                rows.append((self.packed.link_of(name), first, 0, 0))
        return rows

    def _momenta(self) -> list[tuple]:
        """Columns without names: `results.momenta` makes one channel of them."""
        parts = range(count_parts(self.system, self.packed))
        self.width += MOMENTA * len(parts)
        return [(0, self.width - MOMENTA * (k + 1), 0, 0) for k in parts]

    def _closures(self, loops: Loops) -> list[tuple]:
        rows = []
        for k, closure in enumerate(self.system.closures):
            own = loops.closing.of(k)
            couples = isinstance(closure, Coupler)
            first = self._number(f"{closure.name}.violation")
            if couples:
                self._number(f"{closure.name}.multiplier")
            else:
                self._vector(f"{closure.name}.force", 3)
                self._vector(f"{closure.name}.torque", 3)
            rows.append((own[0], len(own), couples, first))
        return rows

    def _elements(self) -> list[tuple]:
        rows = []
        for number, kind in enumerate(OBSERVED.values()):
            names = [getattr(load, "name", "") for load in self.system.loads if isinstance(load, kind.record)]
            rows += [(number, i, 0, self._pair(name, *kind.channels)) for i, name in enumerate(names)]
        return rows

    def _pair(self, name: str, one: str, two: str) -> int:
        first = self._number(f"{name}.{one}")
        self._number(f"{name}.{two}")
        return first


def _rows(parts: list[tuple]) -> np.ndarray:
    return np.array(parts, dtype=np.int64).reshape(-1, 4)
