"""What the steps of a deck say of its analyses: loads, modes, damping, and the nodes that a substructure keeps."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np

from modalprep.errors import InputError
from modalprep.fe.mesh.analysis import AnalysisCase, Damping, LoadSet
from modalprep.fe.mesh.cells import CELLS
from modalprep.fe.mesh.face_forces import LoadedFace
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.readers.abaqus.deck import Deck, Key
from modalprep.fe.readers.abaqus.lexer import Block, Row
from modalprep.fe.readers.abaqus.sets import face_of, surface_of
from modalprep.fe.readers.coverage import Entry
from modalprep.fe.readers.loads import DeckLoad

RETAINED = "retained"  # the group of the nodes that a substructure keeps
ADVICE = "of this step these are not used"
OTHER = ("IMAGINARY", "SECTOR", "CYCLIC MODE", "USER", "SUBMODEL")  # parameters that make a load another one
IDLE = {  # parameters of keywords in steps that change nothing here
    *("OP", "REAL", "EIGENSOLVER", "NORMALIZATION", "STORAGE", "GLOBAL", "SOLVER", "CYCMPC", "SORTED", "FIELD"),
    *("REGION TYPE", "FOLLOWER"),
}


@dataclass
class Step(DeckLoad):
    """One step: its load in units of the deck, and what it says else."""

    number: int = 0
    modes: int | None = None
    band: tuple[float | None, float | None] = (None, None)
    damping: Damping | None = None
    said: list[str] = field(default_factory=list)
    options: frozenset[str] = frozenset()  # of *STEP

    @property
    def has_modes(self) -> bool:
        """Whether it asks for modes."""
        return self.modes is not None or any(self.band)


def read_steps(deck: Deck, blocks: list[Block], known: Mapping[str, Entry], quiet: set[str]) -> None:
    """Read the `known` keywords of the steps; others that are not `quiet` are said, as what cannot be read is."""
    steps: dict[int, Step] = {}
    for block in blocks:
        step = steps.setdefault(block.step, Step(number=block.step))
        entry = known.get(block.keyword)
        if block.keyword == "STEP":
            step.options = _options(block)
        try:
            if entry and entry.handle and (other := _other_load(block)):
                step.unread.append((f"*{block.keyword} with {other}", f"line {block.line}"))
            elif entry and entry.handle:
                entry.handle(deck, block, step)
                step.unread += [
                    (f"parameter {name} of *{block.keyword}", f"line {block.line}")
                    for name in block.options.unread
                    if name not in IDLE
                ]
            elif block.keyword not in quiet:
                step.unread.append((f"*{block.keyword}", f"line {block.line}"))
        except InputError as error:
            step.said.append(str(error))
    deck.current["steps"] = [steps[number] for number in sorted(steps)]


def _options(block: Block) -> frozenset[str]:
    """Return which of NLGEOM and PERTURBATION a step has."""
    given = {name for name in ("NLGEOM", "PERTURBATION") if name in block.options}
    return frozenset(given - {"NLGEOM"} if block.options.get("NLGEOM", "").strip().upper() == "NO" else given)


def _stiffened(deck: Deck, step: Step, earlier: Collection[Step]) -> list[str]:
    """Return the sentence on modes of a structure under load: NLGEOM before, in CalculiX PERTURBATION."""
    program = deck.spoken.dialect
    asked = "PERTURBATION" in step.options and program != "abaqus"
    asked = asked or (program != "calculix" and any("NLGEOM" in one.options for one in earlier))
    if not (step.has_modes and earlier and asked):
        return []
    return [
        "its modes are those of the structure under the loads of the steps before; modes here are of the unloaded one, "
        "and loads stiffen or soften a body as it moves (modes under a load: prestressed_modes)"
    ]


def _other_load(block: Block) -> str:
    """Return what makes a load another one than a real static load, empty without any."""
    if block.options.get("LOAD CASE", "1").strip() != "1":
        return "LOAD CASE (the imaginary part)"
    return next((name for name in OTHER if name in block.options), "")


def cases(deck: Deck, supports: tuple[str, ...], loads: Collection[str]) -> Iterator[AnalysisCase]:
    """Yield what each step says, with the names of its supports, and of its load among those of the mesh."""
    general = _of_materials(deck)
    steps = deck.current.get("steps", [])
    for k, step in enumerate(steps):
        said = (
            *step.said,
            *_stiffened(deck, step, steps[:k]),
            *left_out(step.unread, ADVICE),
            *([general[1]] if general else []),
        )
        yield AnalysisCase(
            number=step.number,
            name=f"step {step.number}",
            supports=supports,
            loads=(f"step_{step.number}",) if f"step_{step.number}" in loads else (),
            modes=step.modes,
            lowest=step.band[0],
            highest=step.band[1],
            damping=step.damping or (general[0] if general else None),
            gravity=step.gravity * deck.units.length,
            said=said,
        )


def load_sets(deck: Deck, place: np.ndarray) -> dict[str, LoadSet]:
    """Return the loads of the steps as ``step_1``, node i as ``place[i]``."""
    points = np.array(deck.points)
    found = {f"step_{step.number}": step.in_si(points, deck.units) for step in deck.current.get("steps", [])}
    return {name: load.renumbered(place) for name, load in found.items() if not load.is_zero}


def _of_materials(deck: Deck) -> tuple[Damping | None, str] | None:
    """Return what *DAMPING of the materials is for the whole where all have the same, and a sentence on it."""
    table = deck.tables.get("material", {}).values()
    values = {(*substance.damping, substance.structural) for substance in table}
    if not any(any(value) for value in values):
        return None
    if len(values) > 1:
        return None, "materials have a *DAMPING of their own each, which is not used"
    [(alpha, beta, structural)] = values
    if alpha or beta:
        return {"alpha": alpha, "beta": beta}, "*DAMPING of all materials is Rayleigh's of the whole"
    return structural / 2, f"structural damping {structural:g} of all materials: half of it is that of critical"


def initial_conditions(deck: Deck, block: Block) -> None:
    """``*INITIAL CONDITIONS``: a stress is said, as it stiffens the structure."""
    kind = block.choice("TYPE")
    if kind == "STRESS":
        deck.skipped.append(("*INITIAL CONDITIONS, TYPE=STRESS", f"line {block.line}"))


def frequency(deck: Deck, block: Block, step: Step) -> None:
    """``*FREQUENCY``: count, lowest and highest frequency."""
    row = block.row()
    step.modes = row.integer(0, "number of eigenvalues", 0) or None
    lowest, highest = (row.real(k, "a frequency", 0.0) for k in (1, 2))
    step.band = (lowest if lowest > 0 else None, highest if highest > 0 else None)


def point_load(deck: Deck, block: Block, step: Step) -> None:
    """``*CLOAD``: node or set, component and value, along the axes of *TRANSFORM."""
    for row in block.rows:
        component = row.integer(1, "a component") - 1
        value = row.real(2, "a load")
        if not 0 <= component < 6:
            step.unread.append((f"*CLOAD in component {component + 1}", f"line {row.line}"))
            continue
        for node in deck.nodes_of(row, block.scope, row.text(0)):
            vector = value * deck.axes.get(node, np.eye(3))[component % 3]
            step.terms += [(node, component - component % 3 + c, float(x)) for c, x in enumerate(vector)]


def element_load(deck: Deck, block: Block, step: Step) -> None:
    """``*DLOAD``: gravity, and pressures: along the normal of shells, into solids on one of their faces."""
    for row in block.rows:
        label = row.text(1).upper()
        if label == "GRAV":
            direction = np.array(row.reals(3, 3, "a direction"))
            size = np.linalg.norm(direction)
            if not size:
                raise row.error("gravity has no direction; give its three components")
            step.gravity = step.gravity + row.real(2, "gravity") * direction / size
        elif label == "P" or (label[:1] == "P" and label[1:].isdigit()):
            for key in deck.elements_of(row, block.scope, row.text(0)):
                _press(deck, block, step, key, label.replace("P", "S") if label != "P" else "", row.real(2, "a load"))
        else:
            step.unread.append((f"*DLOAD of type {label}", f"line {row.line}"))


def surface_load(deck: Deck, block: Block, step: Step) -> None:
    """``*DSLOAD``: a pressure against the outward normal of a surface."""
    for row in block.rows:
        if row.text(1).upper() != "P":
            step.unread.append((f"*DSLOAD of type {row.text(1).upper()}", f"line {row.line}"))
            continue
        for key, side in surface_of(deck, block, row.text(0)).faces:
            of_shell = all(CELLS[kind].dimension == 2 for kind, _ in deck.elements[key].cells)
            sign = 1.0 if not of_shell or side in ("SNEG", "S1") else -1.0
            _press(deck, block, step, key, "" if of_shell else side, sign * row.real(2, "a load"))


def _press(deck: Deck, block: Block, step: Step, key: Key, side: str, pressure: float) -> None:
    """Add a pressure along the normal of a shell, or against that of a face of a solid."""
    for kind, row in deck.elements[key].cells:
        nodes = deck.cells[kind][row]
        if CELLS[kind].dimension == 3:
            kind, nodes = face_of(block, kind, nodes, side, key[1])
            pressure = -pressure
        elif CELLS[kind].dimension != 2:
            block.refuse(f"presses on element {key[1]}, which has no face; give *CLOAD")
        step.faces.append(LoadedFace(kind, nodes, np.full(len(CELLS[kind].corners), pressure)))


def modal_damping(deck: Deck, block: Block, step: Step) -> None:
    """``*MODAL DAMPING``: one ratio for all modes, ratios over the frequency, or Rayleigh's."""
    factor = 0.5 if "STRUCTURAL" in block.options else 1.0
    if block.choice("DEFINITION", "MODE NUMBERS") == "FREQUENCY RANGE":
        step.damping = [[row.real(0, "a frequency"), factor * row.real(1, "damping")] for row in block.rows]
        return
    rayleigh = "RAYLEIGH" in block.options
    values = {tuple(row.reals(2, 2, "damping")[: 1 + rayleigh]) for row in block.rows}
    if len(values) != 1 or "COMPOSITE" in (block.choice("VISCOUS"), block.choice("MODAL")):
        step.unread.append(("*MODAL DAMPING with ratios by mode", f"line {block.line}"))
    elif rayleigh:
        step.damping = dict(zip(("alpha", "beta"), values.pop(), strict=True))
    else:
        step.damping = factor * values.pop()[0]


def global_damping(deck: Deck, block: Block, step: Step) -> None:
    """``*GLOBAL DAMPING``: Rayleigh's, or structural damping of the whole."""
    at = Row([block.options.get(name, "") for name in ("ALPHA", "BETA", "STRUCTURAL")], block.file, block.line)
    alpha, beta, structural = at.reals(0, 3, "damping")
    step.damping = {"alpha": alpha, "beta": beta} if alpha or beta else structural / 2


def retained(deck: Deck, block: Block, step: Step) -> None:
    """``*RETAINED NODAL DOFS``: the nodes that a substructure keeps are a group."""
    nodes = [node for row in block.rows for node in deck.nodes_of(row, block.scope, row.text(0))]
    deck.members("NSET", "", RETAINED).extend(deck.keys[node] for node in nodes)
