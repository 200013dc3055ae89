"""The loads of one run: packed, with their scratch, callbacks included."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np

from modalprep.errors import SimulationError
from modalprep.multibody.elements import registry
from modalprep.multibody.elements.dense import Frame
from modalprep.multibody.elements.registry import Energies, Loads
from modalprep.multibody.evaluation.laws_of_time import parts_of_time, smooth_times
from modalprep.multibody.evaluation.loops import Loops
from modalprep.multibody.evaluation.sampling import Sampling
from modalprep.multibody.evaluation.state import State, callback_loads
from modalprep.multibody.kernels.data import Data
from modalprep.multibody.kernels.interfaces import add_wrench, node_state, world
from modalprep.multibody.kernels.loads.variable_mass import refresh
from modalprep.multibody.kernels.time_tables import Tables
from modalprep.multibody.model.functions.survey import survey_width
from modalprep.multibody.model.loads import Callback
from modalprep.multibody.model.system import System
from modalprep.multibody.packing.deployment import no_reels
from modalprep.multibody.packing.packed import Packed
from modalprep.multibody.packing.step_bounds import NEGLIGIBLE, StepBounds, step_bounds


def frames(packed: Packed, data: Data) -> Callable[[str, int], Frame]:
    """Return ``(body, k) -> Frame``: the motion of interface k after `interfaces.world`."""

    def frame(body: str, k: int) -> Frame:
        position, rotation, *speeds = map(np.array, node_state(packed.model, data, packed.link_of(body), k))
        return Frame(position, rotation.reshape(3, 3), *speeds)

    return frame


def _is_constant(system: System, loads: Loads) -> bool:
    """Whether packed loads are those of any time span, and nothing is written to them."""
    return not (system.loads or system.depletions or len(loads.environment.tables.until))


class Loading:
    """Everything that loads or drives a system on [0, t_end].

    Attributes
    ----------
    active : bool
        Whether there is anything but prescribed motions and uniform gravity.
    compiled : bool
        Whether it runs without Python: no callbacks.
    tau : (nu,)
        Hinge forces of the last `apply`; zero without loads.
    slope : (2, nu)
        Their derivatives by the hinge's own coordinate and speed.
    motion : (nl, 3)
        Position, rate and acceleration of prescribed hinges of the last `prescribe`.
    loops : Loops or None
        Closed loops and motion constraints.
    reels : Reels
        Deployments, put in by `deploying`.
    sampling : Sampling
        The loads that are called once in each period.
    stretches : list of (float, float)
        What is integrated, between breaks of the functions of time and calls of sampled loads, s.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.multibody.model.joint import Joint
    >>> from modalprep.multibody.packing.tree import pack
    >>> from modalprep.multibody.model.time_function import TimeFunction
    >>> law = TimeFunction([(0.5, "0"), (float("inf"), "(t - 0.5)**2")])
    >>> hinge = Joint(name="hinge", type="revolute", parent="ground", child="arm", motion=law)
    >>> arm = System(bodies={"arm": uniform_beam(modes=1)}, joints=(hinge,))
    >>> loading = Loading(arm, pack(arm), t_end=2.0)
    >>> loading.stretches, loading.active, loading.prescribe(1.5).round(12).tolist()
    ([(0.0, 0.5), (0.5, 2.0)], False, [[1.0, 2.0, 2.0]])
    """

    def __init__(self, system: System, packed: Packed, t_end: float, shortest_event: float | None = None) -> None:
        self.shortest_event = shortest_event
        self.system, self.packed, self.t_end = system, packed, t_end
        is_constant = partial(_is_constant, system)
        self.arrays = packed.kept(
            "loads", lambda: registry.pack_loads(system, packed, t_end, shortest_event), is_constant
        )
        loaded = system.loads or system.orbit or system.depletions
        self.active = bool(loaded) or any(joint.elements for joint in system.joints)
        self.compiled = not any(isinstance(load, Callback) for load in system.loads)
        self.tau = np.zeros(packed.nu)
        self.slope = np.zeros((2, packed.nu))
        self.motion = np.zeros((len(packed.links), 3))
        self.loops = Loops(system, packed, t_end, shortest_event) if system.closures else None
        self.reels = no_reels()
        self.sampling = Sampling(system.loads, t_end)
        until = [
            *self.arrays.environment.tables.until,
            *(self.loops.breaks if self.loops else ()),
            *self.sampling.breaks,
        ]
        breaks = sorted({float(t) for t in until if 0 < t < t_end})
        self.stretches = list(pairwise([0.0, *breaks, t_end]))

    @property
    def closed_loops(self) -> Loops:
        """The loops of a system that has closures."""
        if self.loops is None:
            raise SimulationError("the system has no closures, so no loops that could be looked at")
        return self.loops

    def step_bounds(self, rtol: float = NEGLIGIBLE, beside: Sequence[Loading] = ()) -> StepBounds:
        """Return what the functions of time, and those in control laws, ask of the steps of a run to `rtol`.

        Those of the loadings `beside`, of systems of other parameters, count too.
        """
        width = survey_width(self.t_end, self.shortest_event)
        laws = [text for load in self.system.loads if isinstance(load, Callback) for text in load.laws]
        times = [smooth_times(part, self.t_end, width) for text in laws for part in parts_of_time(text)]
        tables = [tables for each in (self, *beside) for tables in each.tables]
        return step_bounds(tables, self.t_end, times, rtol)

    @property
    def tables(self) -> list[Tables]:
        """The functions of time of loads and motions, and those of closures."""
        return [self.arrays.environment.tables, *([self.loops.arrays.tables] if self.loops else [])]

    def clip(self, begin: float, end: float) -> None:
        """Integrate from `begin` to `end` only (s)."""
        parts = [(max(a, begin), min(b, end)) for a, b in self.stretches]
        self.stretches = [(a, b) for a, b in parts if a < b]

    def enter(self, begin: float, end: float) -> None:
        """Say which stretch between breaks is integrated, so that both its ends belong to it."""
        self.arrays.environment.tables.middle[0] = (begin + end) / 2
        if self.loops:
            self.loops.enter(begin, end)

    def prescribe(self, t: float, data: Data | None = None) -> np.ndarray:
        """Return `motion` at time t, and let bodies have the mass of that time in `data`."""
        if len(self.arrays.motions):
            registry.prescribe(self.arrays, t, self.motion)
        if data is not None and self.packed.depleting:
            refresh(self.arrays.fill, self.arrays.environment.tables, self.packed.model, data, t)
        return self.motion

    def apply(self, data: Data, y: np.ndarray, t: float) -> Energies:
        """Add all loads to the data and `tau`, between `kernel.outward` and `kernel.inward`."""
        if not self.active:
            return Energies(0.0, 0.0, 0.0)
        world(self.packed.model, data)
        energies = registry.apply(self.arrays, self.packed.model, data, y, t, self.tau, self.slope)
        return energies if self.compiled else energies._replace(power=energies.power + self.call(data, y, t))

    def call(self, data: Data, y: np.ndarray, t: float) -> float:
        """Add the loads of callbacks to the data and `tau`, after `registry.apply`; returns their power (W)."""
        state = State(self.system, self.packed, y, self.motion, frames(self.packed, data))
        wrenches, tau = callback_loads(self.system, self.packed, t, state)
        self.tau += tau
        power = float(tau @ y[self.packed.nx : self.packed.nx + self.packed.nu])
        for w in wrenches:
            moved = state.frame(w.body, w.interface)
            power += float(w.force @ moved.velocity + w.torque @ moved.angular_velocity)
            force = tuple(w.force.tolist())
            torque = tuple(w.torque.tolist())
            add_wrench(self.packed.model, data, self.packed.link_of(w.body), w.interface, force, torque)
        return power
