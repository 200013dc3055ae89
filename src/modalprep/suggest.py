"""Sentences that name what exists."""

from __future__ import annotations

import difflib
import unicodedata
from collections.abc import Collection, Iterable, Mapping
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from modalprep.errors import InputError

MADE_BY = {
    "Mesh": "read one with read_mesh(path), or make one with make_mesh",
    "FEModel": "make one with assemble(mesh, properties, interfaces)",
    "Reduction": "make one with craig_bampton(model, modes=...)",
    "FlexibleBody": "make one with flexible_body(model, reduction) or rigid_body, or read one with read_body(path)",
    "System": "make one with System(bodies=..., joints=...)",
    "Result": "simulate returns one",
    "StateSpace": "linearise returns one",
}


def suggestion(wrong: str, known: Iterable[str], intro: str) -> str:
    """Say which names exist, the closest first when one is close.

    Examples
    --------
    >>> suggestion("bolt_c", ["body", "bolt_a"], "it has")
    "did you mean 'bolt_a'? it has body, bolt_a"
    """
    known = list(known)
    close = difflib.get_close_matches(wrong, known, n=1)
    guess = f"did you mean {close[0]!r}? " if close else ""
    return f"{guess}{intro} {', '.join(known) or 'none'}"


def matching(names: Iterable[str], wanted: str) -> list[str]:
    """Return the names that are as wanted, begin so before a dot, or fit a pattern with ``*``.

    Examples
    --------
    >>> matching(["tip.x", "tips.x", "tip.y"], "tip"), matching(["tip.1.N", "tip.1.T", "tip.2.N"], "tip.*.N")
    (['tip.x', 'tip.y'], ['tip.1.N', 'tip.2.N'])
    """
    return [x for x in names if x == wanted or x.startswith(f"{wanted}.") or ("*" in wanted and fnmatchcase(x, wanted))]


def refuse_other(call: str, kind: type, value: object) -> None:
    """Raise an `InputError` when a value is of another type than the call needs, with a word on how to make one.

    Examples
    --------
    >>> refuse_other("repeat: the text", str, "a")
    >>> refuse_other("repeat: the text", str, 3)
    Traceback (most recent call last):
    modalprep.errors.InputError: repeat: the text must be of type str, not int
    """
    if not isinstance(value, kind):
        advice = f"; {MADE_BY[kind.__name__]}" if kind.__name__ in MADE_BY else ""
        raise InputError(f"{call} must be of type {kind.__name__}, not {type(value).__name__}{advice}")


def refuse_missing(path: Path, what: str, advice: str = "") -> None:
    """Raise an `InputError` when there is no file; `what` it is starts the message, `advice` ends it.

    Examples
    --------
    >>> refuse_missing(Path("no.csv"), "table of time")
    Traceback (most recent call last):
    modalprep.errors.InputError: table of time no.csv does not exist
    >>> refuse_missing(Path("/"), "table of time")
    Traceback (most recent call last):
    modalprep.errors.InputError: table of time / is a folder; name a file in it
    """
    if path.is_dir():
        raise InputError(f"{what} {path} is a folder; name a file in it")
    if not path.is_file():
        raise InputError(f"{what} {path} does not exist{advice and '; '}{advice}")


def refuse_name(name: str, what: str, without: str = "/") -> None:
    """Raise an `InputError` for a name that references and files cannot carry; `what` it names starts the message.

    Examples
    --------
    >>> refuse_name("arm", "body")
    >>> refuse_name("left/arm", "body")
    Traceback (most recent call last):
    modalprep.errors.InputError: body 'left/arm' has '/' in its name; choose another name
    """
    if not name:
        raise InputError(f"{what} {name!r} has an empty name; give it one")
    if name == "ground":
        raise InputError(f"{what} {name!r} has the name of the ground; choose another name")
    for sign in name:
        if sign in without or unicodedata.category(sign) == "Cc":
            raise InputError(f"{what} {name!r} has {sign!r} in its name; choose another name")


def refuse_unknown(name: str, known: Iterable[str], what: str) -> None:
    """Raise an `InputError` when a name is not known; `what` it names starts the message.

    Examples
    --------
    >>> refuse_unknown("hub", ["hub", "arm"], "placement: body")
    >>> refuse_unknown("hup", ["hub", "arm"], "placement: body")
    Traceback (most recent call last):
    modalprep.errors.InputError: placement: body 'hup' does not exist; did you mean 'hub'? known are hub, arm
    """
    known = known if isinstance(known, Collection) else list(known)
    if name not in known:
        raise InputError(f"{what} {name!r} does not exist; {suggestion(name, known, 'known are')}")


def find_interface(bodies: Mapping[str, Any], end: str, what: str) -> tuple[str, int]:
    """Return the body and the number of the interface that ``body.interface`` names.

    Raises
    ------
    InputError
        When there is no such body or interface; `what` starts the message.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> find_interface({"arm": uniform_beam(modes=1)}, "arm.tip", "weld 1")
    ('arm', 1)
    """
    name, _, interface = end.partition(".")
    refuse_unknown(name, bodies, f"{what}: body")
    known = bodies[name].interface_name
    if interface not in known:
        raise InputError(f"{what}: {end!r} names no interface; {suggestion(interface, known, f'{name} has')}")
    return name, known.index(interface)
