"""A system as the C part reads it: one file with the image of its records, and the variables of an FMU."""

from __future__ import annotations

import hashlib
import struct
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from modalprep.errors import InputError
from modalprep.multibody.checkpoints import times_from
from modalprep.multibody.evaluation.evaluate import Equations
from modalprep.multibody.integration.run import Integration
from modalprep.multibody.integration.stepping import CLOCK
from modalprep.multibody.integration.watching import new_watch
from modalprep.multibody.kernels.time_tables import Tables
from modalprep.multibody.model.events import Event
from modalprep.multibody.model.system import System
from modalprep.multibody.preparation import prepare
from modalprep.multibody.results.channels import STATE, Channels
from modalprep.multibody.results.record import histories
from modalprep.multibody.starts import Given, started, tolerances
from modalprep.runtime.changes import Change, changes, with_inputs
from modalprep.runtime.combinations import combinations
from modalprep.runtime.image import Image
from modalprep.runtime.indicators import COLUMN, COORDINATE, Code, Indicator, Unknown, kinks, of_event
from modalprep.runtime.kinds import kind_of
from modalprep.runtime.nominals import nominals
from modalprep.runtime.places import WORD, Place, Places
from modalprep.runtime.refusals import refuse_changes, refuse_far_deflections, refuse_python
from modalprep.runtime.roots import Outside
from modalprep.runtime.tangent import new_tangent, without_tangent
from modalprep.runtime.units import RATE_OF, about_channel, unit_of

# of value references: core.h
STATES, RATES, CHANNELS, COMBINED, GIVEN, GIVEN_RATES, GIVEN_ACCELERATIONS, INDICATORS = (k << 24 for k in range(1, 9))
MAGIC = b"MPMODEL4"
HEAD = (
    *("image", "relocations", "states", "width", "combined", "terms", "given", "inputs", "places", "stretches"),
    *("middles", "indicators", "codes", "method", "may_change", "bounded", "equations", "run", "watch", "outside"),
    *("y", "state", "ydot", "row", "time", "rtol", "looks", "sine"),
    *("slopes", "slope_relocations", "tangent", "seed", "found"),
)  # words of the head of model.bin
TOKEN = 64
WORK = "energy.work"
VALUE = 1  # column of a knot


class Variable(NamedTuple):
    """A variable of an FMU.

    `derivative` is the value reference of the state whose rate it is, `nominal` the size of a state.
    """

    name: str
    reference: int
    causality: str
    unit: str
    about: str
    start: float | None = None
    derivative: int | None = None
    nominal: float | None = None


@dataclass(frozen=True)
class Model:
    """A system without Python.

    Attributes
    ----------
    kind : str
        Of the library that it needs: one of `kinds.KINDS`.
    token : str
        Fingerprint of the model.
    content : bytes
        Of model.bin.
    variables : tuple of Variable
    begin, end, step, rtol : float
        Default experiment.
    method : str
    notes : tuple of str
        What the FMU leaves out.
    differentiable : bool
        Whether it has directional derivatives.
    """

    kind: str
    token: str
    content: bytes
    variables: tuple[Variable, ...]
    begin: float
    end: float
    step: float
    rtol: float
    method: str
    notes: tuple[str, ...] = field(default=())
    differentiable: bool = False


def model_of(
    system: System,
    *,
    t_end: float,
    output_step: float = 0.01,
    rtol: float = 1e-5,
    atol: float = 1e-10,
    method: str = "auto",
    max_step: float | None = None,
    step: float | None = None,
    shortest_event: float | None = None,
    start: Given = "rest",
    period: float | None = None,
    events: Sequence[Event] = (),
) -> Model:
    """Return a system as the C part reads it; the options are those of `simulate`.

    Raises
    ------
    InputError
        When the system has what an FMU cannot carry.
    """
    refuse_python(system)
    refuse_far_deflections(system)
    refuse_changes(events)
    state = started(system, start, period)
    moved = with_inputs(system)
    begin = 0.0 if state is None else state.t
    if not begin < t_end:
        raise InputError(f"an FMU up to t_end = {t_end:g} s begins at {begin:g} s; raise t_end")
    times, longest = times_from(begin, t_end, output_step), max_step or np.inf
    options: dict[str, Any] = {"method": method, "atol": atol, "longest": longest, "step": step}
    options["rtol"], options["finer"] = tolerances(start, state, rtol)
    integration = prepare(moved, times, start=state, shortest_event=shortest_event, **options)
    _refuse_change_point(integration)
    packing = Packing(moved, integration, Places(moved, t_end, shortest_event), events)
    notes = (*packing.notes, *_noted(integration))
    content, token = packing.content(auto=method == "auto")
    variables = unique(packing.variables())
    kind = kind_of(integration.equations)
    run = begin, t_end, output_step, rtol, integration.choice.name
    return Model(kind, token, content, variables, *run, notes, packing.tangent is not None)


def _refuse_change_point(integration: Integration) -> None:
    """Raise an `InputError` where the closed loops are at a change point at the start."""
    if integration.change_points.start is not None:
        raise InputError(
            "an FMU cannot start at a change point of its closed loops; give the joints other start values"
        )


def _noted(integration: Integration) -> Iterator[str]:
    if integration.loading.loops:
        yield (
            "the FMU tells where closed loops come near a change point, but not along which branch they go on, "
            "which simulate looks at"
        )


def unique(variables: list[Variable]) -> tuple[Variable, ...]:
    """Return the variables; refuse two of one name."""
    known: set[str] = set()
    for each in variables:
        if each.name in known:
            raise InputError(f"an FMU would have two variables {each.name!r}; rename a joint, a force or a body")
        known.add(each.name)
    return tuple(variables)


class Packing:
    """The parts of a model, from an integration that has not begun.

    Attributes
    ----------
    notes : list of str
        What is left out.
    """

    def __init__(self, system: System, integration: Integration, places: Places, events: Sequence[Event]) -> None:
        self.system, self.integration = system, integration
        self.packed, self.loading = integration.packed, integration.loading
        self.loading.enter(*self.loading.stretches[0])
        self.channels = Channels(system, self.packed, self.loading.loops)
        eq, run = integration.equations, integration.steps
        y = run.y.copy()
        self.watch = new_watch(np.zeros(0), np.asarray(integration.watch.size), len(y), eq)
        self.watch.branches[0] = self.loading.loops is not None
        self.out = Outside(run.y, y, np.zeros(len(y)), np.zeros(self.channels.width), *self.channels.columns)
        self.image = Image(eq, run, self.watch, self.out)
        without = [*without_tangent(system, eq)]
        self.tangent = None if without else new_tangent(self.packed)
        self.notes: list[str] = []
        if without:
            self.notes.append(f"the FMU has no directional derivatives, because of {', '.join(without)}")
        self.given = [*self._given(places)]
        self.combined = self._combined()
        self.indicators = [*self._indicators(events)]
        self.nominals = nominals(system, self.packed, np.asarray(self.watch.size))

    def _given(self, places: Places) -> Iterator[tuple[Any, list[Place]]]:
        for change in changes(self.system):
            found = self._in_knots(change, places.of(change))
            if found is not None and self._holds(change.value, found):
                yield change, found
            elif change.is_input:
                raise InputError(f"{change.name} cannot be an input of an FMU; give it as a function of time, as '0*t'")
            else:
                self.notes.append(f"{change.name} is no parameter of the FMU: what follows from it is computed before")

    def _in_knots(self, change: Change, places: list[Place] | None) -> list[Place] | None:
        """Return the places of an input with the times of their knots; None where one is in no knot."""
        if not change.is_input or places is None:
            return places
        found = [place for tables in _tables(self.integration.equations) for place in self._knots(tables, places)]
        return found if len(found) == len(places) else None

    def _knots(self, tables: Tables, places: list[Place]) -> Iterator[Place]:
        knots = np.asarray(tables.knots)
        first = self.image.of(knots)
        for place in places:
            row, column = divmod((place.at - first) // WORD, knots.shape[1])
            if 0 <= row < len(knots) and column == VALUE:
                begin = tables.knot[np.searchsorted(tables.knot, row, "right") - 1]
                yield place._replace(later=float(knots[row, 0] - knots[begin, 0]))

    def _indicators(self, events: Sequence[Event]) -> Iterator[Indicator]:
        places = self._codes()
        only = []
        for event in events:
            try:
                yield of_event(event, places)
            except Unknown as error:
                if event.terminal:
                    raise
                self.notes.append(f"the FMU does not look for an event: {error}")
            only += [] if event.terminal else [event.name]
        if only:
            self.notes.append(f"events that change nothing are reported in model exchange only: {', '.join(only)}")
        yield from kinks(self.system, self.packed, places)

    def _codes(self) -> dict[str, Code]:
        """Return where the numbers of all channels are, as codes: states need no evaluation."""
        found = {label: (COLUMN, float(column)) for label, column in self._columns()}
        return found | {name: (COORDINATE, float(k)) for k, name in enumerate(self.state_names)}

    def _columns(self) -> Iterator[tuple[str, int]]:
        for name, place in self.channels.index.items():
            numbers = range(place.start, place.stop) if isinstance(place, slice) else [place]
            yield from zip(_labels(name, place), numbers, strict=True)

    def _holds(self, value: float, places: list[Place]) -> bool:
        """Whether the places hold multiples of the value: images of the equations and of all records begin alike."""
        words = self.image.words.view(float)
        there = np.array([words[place.at // 8] for place in places])
        wanted = value * np.array([place.factor for place in places])
        return bool(np.allclose(there, wanted, rtol=1e-12, atol=0.0))

    def _combined(self) -> dict[str, Any]:
        index = self.channels.index

        def others(rows: np.ndarray) -> dict[str, np.ndarray]:
            found = histories(self.system, index, rows, np.zeros(len(rows)))
            return {name: values for name, values in found.items() if name not in index}

        found, left = combinations(others, self.channels.width)
        if left:
            self.notes.append(f"channels that are not linear in others are no outputs of the FMU: {', '.join(left)}")
        return found

    def variables(self) -> list[Variable]:
        """Return the variables of the FMU, without the time."""
        found = [*self._changeable(), *self._states(), *self._rates(), *self._outputs()]
        return [*found, *self._event_values()]

    def _changeable(self) -> Iterator[Variable]:
        for k, (change, _) in enumerate(self.given):
            causality = "input" if change.is_input else "parameter"
            yield Variable(change.name, GIVEN + k, causality, change.unit, change.about, change.value)
            if change.moves:
                for part, first in (("rate", GIVEN_RATES), ("acceleration", GIVEN_ACCELERATIONS)):
                    name = change.name.replace(".motion_input", f".motion_{part}_input")
                    unit = f"{change.unit}/s{'' if part == 'rate' else '2'}"
                    yield Variable(name, first + k, causality, unit, f"{part} of the {change.about}", 0.0)

    def _states(self) -> Iterator[Variable]:
        for k, name in enumerate(self.state_names):
            start = float(self.integration.steps.y[k])
            about = f"{about_channel(name)}; state: its start value may be set"
            size = float(self.nominals[k])
            yield Variable(name, STATES + k, "state", self._unit(name), about, start, nominal=size)

    def _rates(self) -> Iterator[Variable]:
        for k, name in enumerate(self.state_names):
            unit = RATE_OF.get(self._unit(name), "")
            yield Variable(f"der({name})", RATES + k, "local", unit, f"rate of {name}", derivative=STATES + k)

    def _outputs(self) -> Iterator[Variable]:
        states = set(self.state_names)
        for label, column in self._columns():
            if label not in states:
                yield Variable(label, CHANNELS + column, "output", self._unit(label), about_channel(label))
        number = 0
        for name, matrix in self.combined.items():
            for label in _labels(name, slice(matrix.shape[0]) if matrix.shape[0] > 1 else 0):
                yield Variable(label, COMBINED + number, "output", self._unit(label), about_channel(label))
                number += 1

    def _event_values(self) -> Iterator[Variable]:
        for k, each in enumerate(self.indicators):
            yield Variable(each.name, INDICATORS + k, "local", "", each.about)

    def _unit(self, label: str) -> str:
        return unit_of(self.system, label.partition("[")[0], self.channels.index)

    @property
    def state_names(self) -> list[str]:
        """Names of the numbers of a state (ny,): those of their channels."""
        columns = {column: label for label, column in self._columns()}
        names = [""] * len(self.integration.steps.y)
        for source, k, _, column in self.channels.columns.joints.tolist():
            if source == STATE:
                names[k] = columns[column]
        for name in self.system.order:
            for number, k in enumerate(range(*self.packed.modes_of(name).indices(len(names)))):
                names[k] = f"{name}.modal[{number + 1}]" if self._has_many(f"{name}.modal") else f"{name}.modal"
        names[-1] = WORK
        assert all(names), "every state has a channel"
        return names

    def _has_many(self, name: str) -> bool:
        place = self.channels.index[name]
        return isinstance(place, slice) and place.stop - place.start > 1

    def content(self, auto: bool) -> tuple[bytes, str]:
        """Return the file and its token."""
        arrays, sizes = self._arrays()
        eq, run = self.integration.equations, self.integration.steps
        clock = self.image.of(np.asarray(run.clock))
        of_clock = {name: clock + CLOCK.fields[name][1] for name in ("time", "rtol")}  # type: ignore[index]
        places = [self.image.of(each) for each in (eq, run, self.watch, self.out)]
        places += [self.image.of(each) for each in (run.y, self.out.state, self.out.ydot, self.out.row)]
        bounded = any(map(_varies, _tables(eq))) or len(self.loading.stretches) > 1 or bool(self.system.depletions)
        places += [of_clock["time"], of_clock["rtol"], self.image.of(self.watch.branches), self._sine(eq)]
        numbers = [*sizes, self.integration.choice.method, auto, bounded, *places]
        slopes, own = self._slopes()
        arrays, numbers = [*arrays, *slopes], [*numbers, *own]
        body = struct.pack(f"<{len(HEAD)}q", *map(int, numbers)) + b"".join(x.tobytes() for x in arrays)
        token = hashlib.sha256(body).hexdigest()[:32]
        return MAGIC + token.encode().ljust(TOKEN, b"\0") + body, token

    def _sine(self, eq: Equations) -> int:
        """Return the address in the image of the sine that tells how near closed loops came to a singular position."""
        return 0 if eq.work is None else self.image.of(eq.work.least_sine)

    def _slopes(self) -> tuple[list[np.ndarray], list[int]]:
        """Return the image for directional derivatives with its places, and what the head says of it."""
        if self.tangent is None:
            return [], [0, 0, 0, 0, 0]
        image, own = Image(self.tangent), self.tangent
        places = [image.of(each) for each in (own, own.seed, own.found)]
        arrays = [image.bytes, np.array(image.relocations, dtype=np.int64)]
        return arrays, [len(image.bytes), len(image.relocations), *places]

    def _arrays(self) -> tuple[list[np.ndarray], list[int]]:
        """Return what follows the head of the file, and how much of each, as core.h has it."""
        given, places = [], []
        for change, own in self.given:
            given.append((len(places), len(own), change.moves, change.value))
            places += own
        matrices = list(self.combined.values())
        rows = [row for matrix in matrices for row in _rows(matrix)]
        first = np.cumsum([0, *(len(columns) for columns, _ in rows)])
        terms = [(int(c), float(f)) for columns, factors in rows for c, f in zip(columns, factors, strict=True)]
        middles = [self.image.of(np.asarray(tables.middle)) for tables in _tables(self.integration.equations)]
        stretches = np.array(self.loading.stretches, dtype=float)
        inputs = sum(change.is_input for change, _ in self.given)
        sizes = [len(self.image.bytes), len(self.image.relocations), len(self.integration.steps.y)]
        sizes += [self.channels.width, len(rows), len(terms), len(given), inputs, len(places), len(stretches)]
        codes = [code for each in self.indicators for code in each.codes]
        middles = sorted(set(middles))
        arrays = [
            self.image.bytes,
            np.array(self.image.relocations, dtype=np.int64),
            first.astype(np.int64),
            np.array(terms, dtype=[("column", "<i8"), ("factor", "<f8")]),
            np.array(given, dtype=[("first", "<i8"), ("count", "<i8"), ("moves", "<i8"), ("start", "<f8")]),
            np.array([tuple(p) for p in places], dtype=[("at", "<i8"), ("factor", "<f8"), ("later", "<f8")]),
            stretches,
            np.array(middles, dtype=np.int64),
            self._of_indicators(),
            np.array(codes, dtype=[("operation", "<i8"), ("number", "<f8")]),
            self.nominals,
        ]
        return arrays, [*sizes, len(middles), len(self.indicators), len(codes)]

    def _of_indicators(self) -> np.ndarray:
        ends = np.cumsum([0, *(len(each.codes) for each in self.indicators)])
        rows = [
            (first, len(each.codes), each.direction, each.terminal, each.name.removeprefix("event.").encode())
            for first, each in zip(ends, self.indicators, strict=False)
        ]
        numbers = [(name, "<i8") for name in ("first", "count", "direction", "terminal")]
        return np.array(rows, dtype=[*numbers, ("name", "S64")])


def _rows(matrix: Any) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    for k in range(matrix.shape[0]):
        own = slice(matrix.indptr[k], matrix.indptr[k + 1])
        yield matrix.indices[own], matrix.data[own]


def _labels(name: str, place: int | slice) -> list[str]:
    """Return the names of the numbers of a channel."""
    if isinstance(place, slice) and place.stop - (place.start or 0) > 1:
        return [f"{name}[{k + 1}]" for k in range(place.stop - (place.start or 0))]
    return [name]


def _tables(eq: Equations) -> list[Tables]:
    """Return all tables of functions of time."""
    found = [eq.loads.environment.tables, *(cons.tables for cons in (eq.cons, eq.implicit) if cons is not None)]
    return [tables for tables in found if tables.middle.size]


def _varies(tables: Tables) -> bool:
    """Whether a function of time is not constant."""
    for first, last in zip(tables.knot[:-1], tables.knot[1:], strict=True):
        knots = tables.knots[first:last]
        if np.any(knots[:, 2:]) or np.ptp(knots[:, 1]):
            return True
    return False
