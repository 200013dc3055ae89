"""Terminals of an FMU 3.0: what belongs to each interface of a body."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from xml.etree.ElementTree import Element, SubElement, indent, tostring

from modalprep.multibody.model.loads import PointForce
from modalprep.multibody.model.system import System

SIGNALS = ("position", "velocity")  # of an interface
FLOWS = ("force", "torque")  # of a force on it


def terminals(system: System, names: Collection[str]) -> bytes:
    """Return terminalsAndIcons.xml: a terminal for each interface, with its motion and the forces that are inputs.

    Members of a terminal are called ``position[1]``, ``velocity[1]``, and ``force[1]``, ``torque[1]``; where several
    forces act on an interface, ``push.force[1]``.

    Parameters
    ----------
    names : collection of str
        Of the variables of the FMU.

    Examples
    --------
    >>> from modalprep.examples import small_systems
    >>> rod = small_systems()["rigid bodies in trees"]
    >>> print(terminals(rod, {"rod.tip.position[1]"}).decode().splitlines()[4].strip())
    <TerminalMemberVariable variableName="rod.tip.position[1]" memberName="position[1]" variableKind="signal" />
    """
    root = Element("fmiTerminalsAndIcons", fmiVersion="3.0")
    listed = SubElement(root, "Terminals")
    for name, body in system.bodies.items():
        for interface in body.interface_name:
            at = f"{name}.{interface}"
            members = [each for each in _members(system, at) if each[0] in names]
            if members:
                terminal = SubElement(listed, "Terminal", name=at, matchingRule="bus", description=f"interface {at}")
                for variable, member, kind in members:
                    own = {"variableName": variable, "memberName": member, "variableKind": kind}
                    SubElement(terminal, "TerminalMemberVariable", own)
    indent(root, " ")
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + tostring(root)


def _members(system: System, at: str) -> Iterator[tuple[str, str, str]]:
    """Yield variable, name as a member, and kind of what an interface may have."""
    numbers = range(1, 4)
    yield from ((f"{at}.{part}[{k}]", f"{part}[{k}]", "signal") for part in SIGNALS for k in numbers)
    forces = [load for load in system.loads if isinstance(load, PointForce) and load.at == at]
    for load in forces:
        owner = f"{load.name}." if len(forces) > 1 else ""
        yield from ((f"{load.name}.{part}[{k}]", f"{owner}{part}[{k}]", "inflow") for part in FLOWS for k in numbers)
