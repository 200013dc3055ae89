"""What a Nastran deck says of its analyses: supports, loads, modes and damping of each subcase."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TypeVar

from modalprep.errors import InputError
from modalprep.fe.mesh.analysis import AnalysisCase, Damping
from modalprep.fe.mesh.left_out import left_out
from modalprep.fe.readers.loads import DeckLoad
from modalprep.fe.readers.nastran.builder import Builder
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.case_control import LETTERS, Subcase, case_control
from modalprep.fe.readers.nastran.loads import add_loads

Found = TypeVar("Found")
LISTS = ("EIGR", "EIGRL", "TABDMP1")
OTHERS = (  # commands that select what is not used; the last ones matrices
    *("DLOAD", "FREQUENCY", "TSTEP", "RANDOM", "STATSUB", "CMETHOD", "TEMPERATURE", "DEFORM", "SUPORT1"),
    *("K2GG", "K2PP", "M2GG", "M2PP", "B2GG", "B2PP", "P2G"),
)
GE = {"MAT1": 7, "MAT2": 12, "MAT8": 16}  # field of the structural damping
RATIO = {"G": 0.5, "": 0.5, "CRIT": 1.0}  # of critical by the values of TABDMP1; of Q it is 1 / (2 Q)


def add_cases(b: Builder, path: Path) -> None:
    """Give the mesh its loads, and what the case control says of each subcase."""
    loads = add_loads(b)
    subcases = case_control(path)
    cases = [_case(b, subcase, loads) for subcase in subcases or [_only(b, loads)]]
    b.cases = [case for case in cases if not case.is_empty]


def _only(b: Builder, loads: dict[int, DeckLoad]) -> Subcase:
    """Return what a deck of bulk data alone selects: the only set of each kind."""
    methods = {card.id for card in _cards(b, "EIGR", "EIGRL")}
    damping = {card.id for card in _cards(b, "TABDMP1")}
    joined = {card.id for card in _cards(b, "LOAD")}
    found = {"METH": methods, "SDAM": damping, "LOAD": joined or set(loads)}
    return Subcase(0, {name: str(min(numbers)) for name, numbers in found.items() if len(numbers) == 1})


def _cards(b: Builder, *names: str) -> Iterator[Card]:
    return (card for name in names for card in b.tables.get(name, {}).values())


def _case(b: Builder, subcase: Subcase, loads: dict[int, DeckLoad]) -> AnalysisCase:
    selected = {name: subcase.entries.get(name[:LETTERS]) for name in OTHERS}
    said = [f"{name} = {value}, which is not used" for name, value in selected.items() if value]
    held = subcase.selected("SPC")
    chosen = subcase.selected("LOAD")
    load = loads.get(chosen, DeckLoad()) if chosen else DeckLoad()
    if chosen and chosen not in loads:
        said.append(f"LOAD = {chosen}, which has no card that is read")
    said += left_out(load.unread, f"of load {chosen} these are not read; give them in [loads]")
    modes, lowest, highest = _tried(_modes, b, subcase, said) or (None, None, None)
    return AnalysisCase(
        number=subcase.number,
        name=f"subcase {subcase.number}" if subcase.number else "the case control",
        supports=(f"spc_{held}",) if f"spc_{held}" in b.supports else (),
        loads=(f"load_{chosen}",) if f"load_{chosen}" in b.loads else (),
        modes=modes,
        lowest=lowest,
        highest=highest,
        damping=_tried(_damping, b, subcase, said),
        gravity=load.gravity,
        said=tuple(said),
    )


def _tried(function: Callable[..., Found], b: Builder, subcase: Subcase, said: list[str]) -> Found | None:
    """Return what a function finds, or None and say what it refuses: a model does not need it."""
    try:
        return function(b, subcase, said)
    except InputError as error:
        said.append(str(error))
        return None


def _modes(b: Builder, subcase: Subcase, said: list[str]) -> tuple[int | None, float | None, float | None]:
    """Return the count and the band of EIGRL (SID, V1, V2, ND) or EIGR (SID, METHOD, F1, F2, NE, ND)."""
    number = subcase.selected("METHOD")
    card = next((card for card in _cards(b, "EIGRL", "EIGR") if card.id == number), None)
    if card is None:
        said.extend([f"METHOD = {number}, which is no EIGRL and no EIGR of the deck"] * (number is not None))
        return None, None, None
    first, count = (1, 3) if card.name == "EIGRL" else (2, 5)
    lowest, highest = (card.real(k, "a frequency", 0.0) for k in (first, first + 1))
    return card.integer(count, "ND", 0) or None, lowest if lowest > 0 else None, highest if highest > 0 else None


def _damping(b: Builder, subcase: Subcase, said: list[str]) -> Damping | None:
    """Return that of SDAMPING, else of PARAM G, W3 and ALPHA1, ALPHA2, else GE of the materials where it is one."""
    number = subcase.selected("SDAMPING")
    for card in _cards(b, "TABDMP1"):
        if card.id == number:
            return _of_table(card)
    value = {card.text(0): card.real(1, card.text(0), 0.0) for card in _cards(b, "PARAM") if card.text(0) in PARAMETERS}
    if value.get("ALPHA1") or value.get("ALPHA2"):
        return {"alpha": value.get("ALPHA1", 0.0), "beta": value.get("ALPHA2", 0.0)}
    if value.get("G") and value.get("W3"):
        return {"alpha": 0.0, "beta": value["G"] / value["W3"]}
    if value.get("G"):
        said.append(f"structural damping PARAM,G = {value['G']:g}: half of it is the share of critical damping")
        return value["G"] / 2
    return _of_materials(b, said)


PARAMETERS = ("G", "W3", "ALPHA1", "ALPHA2")


def _of_table(card: Card) -> list[list[float]]:
    """TABDMP1: TYPE, then from the ninth field on frequency and damping in pairs, to ENDT."""
    words = [text for text in card.fields[8:] if text and text != "ENDT"]
    inner = Card(card.name, words, card.file, card.line)
    pairs = [[inner.real(k, "f"), inner.real(k + 1, "g")] for k in range(0, len(words) - 1, 2)]
    kind = card.text(1)
    return [[f, 1 / (2 * g) if kind == "Q" else RATIO.get(kind, 0.5) * g] for f, g in pairs]


def _of_materials(b: Builder, said: list[str]) -> float | None:
    """GE of MAT1, MAT2 and MAT8: one for all is structural damping of the whole."""
    cards = [card for card in b.tables.get("material", {}).values() if card.name in GE]
    values = {card.real(GE[card.name], "GE", 0.0) for card in cards}
    if not any(values):
        return None
    if len(values) > 1:
        listed = ", ".join(f"{card.id} {card.real(GE[card.name], 'GE', 0.0):g}" for card in cards[:8])
        said.append(f"structural damping GE of its own for each material ({listed}), which is not used")
        return None
    [value] = values
    said.append(f"structural damping GE = {value:g} of all materials: half of it is the share of critical damping")
    return value / 2
