"""Recovered quantities of a system at one state, for events and for outputs of linear equations (theory 4.9)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from modalprep.body.recovery import Recovery
from modalprep.errors import InputError
from modalprep.multibody.evaluation.evaluate import Equations
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.results.channels import Channels
from modalprep.multibody.results.observation import observe
from modalprep.multibody.results.recovered import AppliedLoad, recovery_channels
from modalprep.suggest import suggestion

RECOVERY = "recovery"  # second word of such a channel


class RecoveredState:
    """The recovered channels that are asked for, at the state that was observed last.

    Attributes
    ----------
    wanted : {body: {recovery: {place}}}
    values : {channel: float}

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> root = Recovery(kind="force", places=("a",), components=("N",), units=("N",), q=np.array([[[2.0]]]))
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm")
    >>> system = System(bodies={"arm": uniform_beam(modes=1).with_(recovery={"root": root})}, joints=(hinge,))
    >>> found = RecoveredState(system, pack(system), None)
    >>> found.reader("arm.recovery.root.a.N", "event 'x'") is None, found.reader("arm.modal.1", "event 'x'") is None
    (False, True)
    """

    def __init__(self, system: System, packed: Packed, loops: Loops | None) -> None:
        self.system, self.packed, self.loops = system, packed, loops
        self.wanted: dict[str, dict[str, set[str]]] = {}
        self.values: dict[str, float] = {}
        self._channels: Channels | None = None

    def reader(self, name: str, what: str) -> Callable[[Any], float] | None:
        """Return the function of anything that gives the value of ``<body>.recovery.<name>.<place>.<component>``.

        Returns
        -------
        callable or None
            None where the name is not that of a recovery.

        Raises
        ------
        InputError
            When the body has no such recovery, place or component; `what` begins the sentence.
        """
        owner, _, rest = name.partition(".")
        if owner not in self.system.bodies or not rest.startswith(f"{RECOVERY}."):
            return None
        key, _, column = rest.removeprefix(f"{RECOVERY}.").partition(".")
        blocks = self.system.bodies[owner].recovery if self.system.bodies[owner].n else {}
        if key not in blocks:
            raise InputError(
                f"{what}: no channel {name!r}; {suggestion(key, blocks, f'the recoveries of {owner} are')}"
            )
        places = {f"{p}.{c}".rstrip("."): p for p in blocks[key].places for c in blocks[key].full_components}
        if column not in places:
            raise InputError(f"{what}: no channel {name!r}; {suggestion(column, places, f'{key} of {owner} has')}")
        self.wanted.setdefault(owner, {}).setdefault(key, set()).add(places[column])
        self._channels = None
        return lambda state: self.values[name]

    def observe(
        self, eq: Equations, t: float, y: np.ndarray, ydot: np.ndarray, applied: Sequence[AppliedLoad] = ()
    ) -> None:
        """Take the values at a state after its accelerations, ``ydot (nx + nu + 1,)``; `applied` are further loads."""
        if not self.wanted:
            return
        if self._channels is None:
            self._channels = Channels(self._reduced(), self.packed, self.loops)
        row = np.zeros((1, self._channels.width))
        observe(eq, self._channels.columns, t, y, ydot, row[0])
        found = {name: row[:, columns] for name, columns in self._channels.index.items()}
        found = recovery_channels(self._channels.system, np.array([t]), found, applied)
        self.values = {name: float(history[0]) for name, history in found.items() if history.ndim == 1}

    def _reduced(self) -> System:
        """Return the system with what is asked for alone."""
        bodies = {
            name: body.with_(
                recovery={key: at_places(body.recovery[key], p) for key, p in self.wanted.get(name, {}).items()}
            )
            for name, body in self.system.bodies.items()
        }
        return self.system.with_(bodies=bodies)


def at_places(block: Recovery, places: set[str]) -> Recovery:
    """Return a recovery at some of its places.

    Examples
    --------
    >>> rows = np.array([[[2.0]], [[3.0]]])
    >>> both = Recovery(kind="force", places=("a", "b"), components=("N",), units=("N",), q=rows)
    >>> at_places(both, {"b"}).q
    array([[[3.]]])
    """
    rows = [i for i, place in enumerate(block.places) if place in places]
    named = ("q", "qdd", "loads", "position", "node", "cell")
    arrays = {name: getattr(block, name)[rows] for name in named if getattr(block, name) is not None}
    c = len(block.components)
    units = block.units if len(block.units) == c else tuple(u for i in rows for u in block.units[c * i : c * i + c])
    return block.with_(places=tuple(block.places[i] for i in rows), units=units, **arrays)
