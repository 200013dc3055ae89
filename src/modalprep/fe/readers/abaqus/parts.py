"""Parts, instances and steps: the blocks of a deck in one list, each with the instance that it belongs to."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from modalprep.fe.readers.abaqus.lexer import Block

Move = tuple[np.ndarray, np.ndarray]  # turn (3, 3) and shift (3,) of an instance, units of the deck


class Parts:
    """The parts of a deck, and where its instances lie.

    Attributes
    ----------
    moves : {instance: (turn, shift)}
        By name in capitals, in the order of the deck.
    spelled : {instance: str}
        Names as the deck has them.
    """

    def __init__(self) -> None:
        self.moves: dict[str, Move] = {}
        self.spelled: dict[str, str] = {}
        self.parts: dict[str, list[Block]] = {}

    def placed(self, blocks: list[Block]) -> list[Block]:
        """Return the blocks with the parts put in the place of their instances."""
        found = list(self._walk(blocks))
        if self.parts and not self.moves:  # a file of parts alone
            for name, own in self.parts.items():
                scope = name if len(self.parts) > 1 else ""
                if scope:
                    self._place(scope, own[0].options["NAME"], (np.eye(3), np.zeros(3)))
                found += [replace(block, scope=scope) for block in own[1:]]
        return found

    def _walk(self, blocks: list[Block]) -> Iterator[Block]:
        part, instance, step, inside = "", None, 0, False
        for block in blocks:
            keyword = block.keyword
            if keyword == "PART":
                part = block.option("NAME").upper()
                if part in self.parts:
                    block.refuse(f"has the name {block.options['NAME']} of another part; give every part its own")
                self.parts[part] = [block]
            elif keyword == "END PART":
                part = ""
            elif keyword == "INSTANCE":
                instance = block
                yield from self._instance(block)
            elif keyword == "END INSTANCE":
                instance = None
            elif keyword == "STEP":
                step = step + 1
                inside = True
                yield replace(block, step=step)
            elif keyword == "END STEP":
                inside = False
            elif keyword not in ("ASSEMBLY", "END ASSEMBLY"):
                if part:
                    self.parts[part].append(block)
                else:
                    scope = instance.options["NAME"].upper() if instance else ""
                    yield replace(block, scope=scope, step=step if inside else 0)

    def _instance(self, block: Block) -> Iterator[Block]:
        name = block.option("NAME")
        part = block.options.get("PART", "")
        if "LIBRARY" in block.options or "INSTANCE" in block.options:
            block.refuse("imports the result of another analysis; give the part itself")
        if part.upper() not in self.parts:
            block.refuse(f"is one of part {part!r}, which is not before it; give the part first")
        self._place(name.upper(), name, _move(block), block)
        for own in self.parts[part.upper()][1:]:
            yield replace(own, scope=name.upper())

    def _place(self, scope: str, name: str, move: Move, block: Block | None = None) -> None:
        if scope in self.moves and block is not None:
            block.refuse(f"has the name {name} of another instance; give every instance its own")
        self.moves[scope], self.spelled[scope] = move, name


def _move(block: Block) -> Move:
    """Shift of the first line, then turn by an angle about the line a b of the second."""
    shift = np.array(block.row(0).reals(0, 3, "a translation"))
    if len(block.rows) < 2:
        return np.eye(3), shift
    row = block.row(1)
    a = np.array(row.reals(0, 3, "a"))
    b = np.array(row.reals(3, 3, "b"))
    angle = row.real(6, "an angle", 0.0)
    length = np.linalg.norm(b - a)
    if not length:
        raise row.error("the two points of the axis of rotation coincide; give two points")
    turn = Rotation.from_rotvec(np.radians(angle) * (b - a) / length).as_matrix()
    return turn, turn @ (shift - a) + a
