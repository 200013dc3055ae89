"""Where a part of a Nastran deck stands: SELOC moves it, SEMPLN mirrors it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from modalprep.fe.links.mirror import Plane, mirrored_mesh
from modalprep.fe.mesh.mesh import Mesh
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.grids import system_from_points
from modalprep.fe.readers.systems import BASIC, System

BOTH = "it has SELOC and SEMPLN: it is mirrored first and moved then"


@dataclass(slots=True)
class Place:
    """The cards that say where a part stands: SELOC, SEMPLN, or both."""

    cards: dict[str, Card] = field(default_factory=dict)

    @property
    def first(self) -> Card:
        """One of them."""
        return next(iter(self.cards.values()))


def places(tables: list[Card]) -> dict[int, Place]:
    """Return the places of the parts that are moved or mirrored.

    Raises
    ------
    InputError
        When a part has two cards of one name, or SEMPLN without being a mirror image.
    """
    found: dict[int, Place] = {}
    kinds = {card.id: card.text(1) for card in tables if card.name == "SEBULK"}
    for card in (card for card in tables if card.name in ("SELOC", "SEMPLN")):
        place = found.setdefault(card.id, Place())
        if card.name in place.cards:
            raise card.error(f"part {card.id} has another {card.name} in line {place.cards[card.name].line}; keep one")
        place.cards[card.name] = card
        if card.name == "SEMPLN" and kinds.get(card.id) != "MIRROR":
            raise card.error(
                f"part {card.id} is no mirror image; write SEBULK,{card.id},MIRROR,n with n the part it mirrors"
            )
    return found


def placed(place: Place, number: int, own: Mesh, residual: Mesh | None, build: Callable[[System], Mesh]) -> Mesh:
    """Return the mesh of a part in its place; `own` is the part where its cards have it.

    A part with both cards is mirrored first and moved then.
    """
    seloc, sempln = (place.cards.get(name) for name in ("SELOC", "SEMPLN"))
    plane = _plane(sempln, residual) if sempln else None
    system = BASIC
    if seloc:
        at = _grids(seloc, number, own, 1)
        there = _grids(seloc, 0, residual, 4)
        first, second = (system_from_points(seloc, x) for x in (plane.image(at) if plane else at, there))
        turn = second.axes.T @ first.axes
        system = System("R", second.origin - turn @ first.origin, turn.T)
    if plane is None:
        return build(system)
    built = build(_before(plane, system))
    image = mirrored_mesh(built, Plane(plane.point * built.scale, plane.normal))
    return image.with_(notes=(*image.notes, BOTH)) if seloc else image


def _before(plane: Plane, system: System) -> System:
    """Return the motion that has the effect of `system`, when the mirror comes after it and not before."""
    turn = plane.H @ system.axes.T @ plane.H
    origin = plane.image(system.to_basic(plane.image(np.zeros((1, 3)))))[0]
    return System("R", origin, turn.T)


def _plane(card: Card, residual: Mesh | None) -> Plane:
    """Return the plane through three grids of the residual structure, in units of the deck."""
    if card.text(1) != "PLANE":
        raise card.error(f"a mirror of type {card.text(1)!r} is not read; give PLANE and three grids")
    x = _grids(card, 0, residual, 2)
    axes = system_from_points(card, x).axes
    return Plane(x[0], axes[1])


def _grids(card: Card, part: int, mesh: Mesh | None, first: int) -> np.ndarray:
    """Return the places (3, 3) of three grids of a part, in units of the deck."""
    numbers = [card.integer(k, "a grid", lowest=1) for k in range(first, first + 3)]
    if mesh is None or not np.isin(numbers, mesh.labels).all():
        raise card.error(f"grids {numbers} are not in {f'part {part}' if part else 'the residual structure'}; add them")
    return mesh.points[np.searchsorted(mesh.labels, numbers)] / mesh.scale
