"""The kinds of systems whose equations have types of their own, each with the smallest system of it."""

from __future__ import annotations

from modalprep.multibody.evaluation.evaluate import Equations
from modalprep.multibody.model.system import System

KINDS = {  # names in `examples.small_systems`
    "rigid-open": "rigid bodies in trees",
    "rigid-closed": "rigid bodies in closed loops",
    "modal-open": "flexible bodies in trees",
    "modal-closed": "flexible bodies in closed loops",
}


def kind_of(eq: Equations) -> str:
    """Return the kind of a system's equations; springs and bushings are constraints of an implicit step."""
    bodies = "rigid" if eq.model.modal is None else "modal"
    return f"{bodies}-{'open' if eq.cons is None else 'closed'}"


def is_tree(kind: str) -> bool:
    """Return whether a kind has neither closed loops nor springs and bushings; its library has exact derivatives."""
    return kind.endswith("open")


def example(kind: str) -> System:
    """Return the smallest system of a kind."""
    from modalprep.examples import small_systems

    return small_systems()[KINDS[kind]]
