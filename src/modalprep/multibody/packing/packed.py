"""A system as the kernels read it, and where its joints and bodies stand in the state."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from typing import Any, NamedTuple, TypeVar
from weakref import finalize

import numpy as np

from modalprep.compiler.by_address import Pattern
from modalprep.multibody.kernels.data import Data, ModalData, Model, new_data
from modalprep.multibody.kernels.tangents.data import Modes, Sweep, new_sweep
from modalprep.multibody.model.joint import Joint
from modalprep.multibody.model.joint_types import KINDS, PRESCRIBED

Made = TypeVar("Made")
Place = int | tuple[int, int]  # in the state (nx + nu,), or of a prescribed hinge in the motion (nl, 3)
OF_TREE = (
    "patterns",
    "softest",
    "flexible",
    "linear",
    "dampers",
    "types",
    "columns",
    "with_stations",
    "branches",
    "_link_of_body",
    "_links_of_joint",
    "_places_of_joint",
)
MOST_PATTERNS = 64  # of one tree: systems that share it may differ in their springs, each of which has its own


class Link(NamedTuple):
    """One link: its joint, which hinge of the joint it is, its body (None for a massless link)."""

    joint: Joint
    hinge: int
    body: str | None


@dataclass(frozen=True)
class Packed:
    """A system as the kernels read it: `model` is constant, `data()` makes what an evaluation writes."""

    model: Model
    links: tuple[Link, ...]
    nu: int  # number of speeds
    depleting: bool

    def with_(self, joints: Mapping[int, Joint], gravity: np.ndarray, *, kept: bool) -> Packed:
        """Return the same tree with other joints that move alike, by the `id` of those here, and another gravity.

        `kept` tells that loads, closures and the elements of joints are the same too.
        """
        links = tuple(Link(joints[id(joint)], hinge, body) for joint, hinge, body in self.links)
        same = np.array_equal(gravity, self.model.gravity)
        model = self.model if same else self.model._replace(gravity=np.array(gravity))
        found = Packed(model, links, self.nu, self.depleting)
        names = OF_TREE + ("_data",) * same + ("_constant",) * kept
        vars(found).update((name, getattr(self, name)) for name in names)
        return found

    def pattern(self, key: tuple, make: Callable[[], Pattern]) -> Pattern:
        """Return what is made anew for each run of the system, by what it depends on."""
        found = self.patterns.get(key)
        if found is None:
            if len(self.patterns) >= MOST_PATTERNS:
                self.patterns.clear()
            found = self.patterns[key] = make()
        return found

    @cached_property
    def patterns(self) -> dict[tuple, Pattern]:
        """What `pattern` has made."""
        return {}

    def kept(self, name: str, make: Callable[[], Made], is_constant: Callable[[Made], bool] = bool) -> Made:
        """Return what is made once where it `is_constant`, else anew."""
        found = self._constant.get(name) or make()
        if is_constant(found):
            self._constant[name] = found
        return found

    @cached_property
    def _constant(self) -> dict[str, Any]:
        return {}

    @cached_property
    def softest(self) -> float:
        """1 / K of the softest mode, 0 without modes."""
        stiffness = self.model.modal.K if self.model.modal else np.zeros(0)
        return 1 / stiffness[stiffness > 0].min() if np.any(stiffness > 0) else 0.0

    @cached_property
    def flexible(self) -> tuple[tuple[int, slice, slice], ...]:
        """Of links with modes: their number, the places of their coordinates and speeds, and speeds."""
        columns = (self.model.links[name].tolist() for name in ("modes", "xq", "uq"))
        return tuple(
            (i, slice(x, x + n), slice(u, u + n)) for i, (n, x, u) in enumerate(zip(*columns, strict=True)) if n
        )

    @cached_property
    def linear(self) -> np.ndarray:
        """Stiffness and damping of all speeds (2, nu), those of modes; zero at joints and between modes."""
        found = np.zeros((2, self.nu))
        kinds = self.model.links["kind"]
        modal = self.model.modal
        if modal is not None:
            for i, _, own in self.flexible:
                n = own.stop - own.start
                found[:, own] = modal.K[kinds[i], :n], modal.D[kinds[i], :n]
        return found

    @cached_property
    def dampers(self) -> np.ndarray:
        """Damping (nu, nu) between different modes, which dampers couple."""
        found = np.zeros((self.nu, self.nu))
        rows, modal = self.model.links["dampers"], self.model.modal
        if modal is not None and len(modal.dampers):
            for i, _, own in self.flexible:
                n = own.stop - own.start
                found[own, own] = modal.dampers[rows[i], :n, :n] if rows[i] >= 0 else 0.0
        return found

    @cached_property
    def columns(self) -> list[tuple[int, int, int, float]]:
        """Of every link: joint type, first coordinate and speed, turn per unit."""
        return list(zip(*(self.model.links[name].tolist() for name in ("joint", "x", "u", "about")), strict=True))

    @cached_property
    def quaternions(self) -> tuple[slice, ...]:
        """Slices of the state with the quaternions of joints."""
        kinds = [(KINDS[code], x) for code, x, _, _ in self.columns]
        return tuple(slice(x + kind.quaternion, x + kind.quaternion + 4) for kind, x in kinds if kind.quaternion >= 0)

    @cached_property
    def with_stations(self) -> bool:
        """Whether a body has stations."""
        return bool(np.any(self.model.links["stations"] >= 0))

    @cached_property
    def branches(self) -> bool:
        """Whether a link, or the ground, carries several."""
        parents = self.model.links["parent"]
        return len(np.unique(parents)) < len(parents)

    @property
    def nx(self) -> int:
        """Number of coordinates."""
        return self.model.nx

    @cached_property
    def types(self) -> np.ndarray:
        """Joint type of every link (nl,)."""
        return self.model.links["joint"]

    def turns(self, link: int) -> bool:
        """Whether the coordinate of a joint of one axis is an angle."""
        return bool(self.model.links["about"][link])

    def data(self) -> Data:
        """Return new data."""
        links, modal, parts = self._data
        if modal is None:
            return links.copy()
        own = {name: part.copy() for name, part in parts.items()}
        return links.copy(modal=modal.copy(**own))

    @cached_property
    def _data(self) -> tuple[Pattern[Data], Pattern[ModalData] | None, dict[str, Pattern]]:
        """Patterns of the data, of those of the modes and of its records, where bodies lose mass or have stations."""
        new = new_data(self.model, depleting=self.depleting)
        if new.modal is None:
            return Pattern(new), None, {}
        records = {"integrals": self.depleting, "parts": self.with_stations}
        parts = {name: Pattern(getattr(new.modal, name)) for name, own in records.items() if own}
        return Pattern(new), Pattern(new.modal), parts

    def sweep(self, more: int = 0) -> Sweep:
        """Return new work of the derivatives of the inverse dynamics; `more` as `new_sweep` has it."""
        if more:
            return new_sweep(self.model, more)
        sweep, modes, parts = self._sweep
        if modes is None:
            return sweep.copy()
        return sweep.copy(modes=modes.copy(**{name: part.copy() for name, part in parts.items()}))

    @cached_property
    def _sweep(self) -> tuple[Pattern[Sweep], Pattern[Modes] | None, dict[str, Pattern]]:
        """Patterns of the work of the derivatives, of that of the modes, and of its records."""
        new = new_sweep(self.model)
        if new.modes is None:
            return Pattern(new), None, {}
        parts = {name: Pattern(getattr(new.modes, name)) for name in ("bends", "turns", "bodies", "stations")}
        return Pattern(new), Pattern(new.modes), parts

    def work_of(self, owner: object) -> tuple[Data, Sweep]:
        """Return data and work of the derivatives that are the owner's own while it lives, then the next one's.

        They hold what was left there; each evaluation writes what it reads.
        """
        found = self._free.pop() if self._free else (self.data(), self.sweep())
        finalize(owner, self._free.append, found)
        return found

    @cached_property
    def _free(self) -> list[tuple[Data, Sweep]]:
        """What `work_of` has given to owners that are gone."""
        return []

    def link_of(self, body: str) -> int:
        """Return the link that carries a body."""
        return self._link_of_body[body]

    def links_of(self, joint: str) -> list[int]:
        """Return the links of a joint, inboard first."""
        return self._links_of_joint.get(joint, [])

    @cached_property
    def _link_of_body(self) -> dict[str, int]:
        return {link.body: i for i, link in enumerate(self.links) if link.body is not None}

    @cached_property
    def _links_of_joint(self) -> dict[str, list[int]]:
        of = [link.joint.name for link in self.links]  # those of a joint follow each other
        return {name: list(found) for name, found in groupby(range(len(of)), of.__getitem__)}

    def places_of(self, joint: str) -> tuple[list[Place], list[Place]]:
        """Return the places of a joint's position and of its rate, prescribed ones included."""
        return self._places_of_joint.get(joint, ([], []))

    def coordinates_of(self, joint: str) -> list[int]:
        """Return the places of a joint's coordinates in the state."""
        return [place for place in self.places_of(joint)[0] if isinstance(place, int)]

    def speeds_of(self, joint: str) -> list[int]:
        """Return the numbers of a joint's speeds, the first of all is 0."""
        return [place - self.nx for place in self.places_of(joint)[1] if isinstance(place, int)]

    @cached_property
    def _places_of_joint(self) -> dict[str, tuple[list[Place], list[Place]]]:
        found: dict[str, tuple[list[Place], list[Place]]] = {name: ([], []) for name in self._links_of_joint}
        columns = (self.model.links[name].tolist() for name in ("joint", "x", "u"))
        for i, (link, kind, x, u) in enumerate(zip(self.links, *columns, strict=True)):
            position, rate = found[link.joint.name]
            position += [(i, 0)] if kind == PRESCRIBED else range(x, x + KINDS[kind].coordinates)
            rate += [(i, 1)] if kind == PRESCRIBED else range(self.nx + u, self.nx + u + KINDS[kind].speeds)
        return found

    def modes_of(self, body: str) -> slice:
        """Return the places of a body's modal coordinates in the state."""
        row = self.model.links[self.link_of(body)]
        return slice(int(row["xq"]), int(row["xq"] + row["modes"]))

    def modal_rates_of(self, body: str) -> slice:
        """Return the slice of the state with the rates of a body's modal coordinates."""
        row = self.model.links[self.link_of(body)]
        first = self.nx + int(row["uq"])
        return slice(first, first + int(row["modes"]))

    def align(self, link: int) -> np.ndarray:
        """Return the rotation from a link's frame to its body's frame (3, 3)."""
        return self.model.links["align"][link].reshape(3, 3)
