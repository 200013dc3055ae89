"""A slight mass of parts without density, where interfaces could move them without strain.

A strut without mass between two hinges turns about its line without strain and without inertia: such a motion of an
interface has no modal mass. Where the model has several fixed interfaces, parts without density share `SHARE` of the
mass of all others.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from modalprep.fe.assembly.parts import Part
from modalprep.fe.elements.distribution import MassRule
from modalprep.fe.properties.properties import Beam, Property, Shell, Solid, Truss

SHARE = 1e-12


def with_slight_mass(parts: list[Part], rule: MassRule, points: np.ndarray) -> list[Part]:
    """Return the parts, those without density with one that gives them their share of the mass."""
    light = [_has_no_density(part.section) for part in parts]
    if not any(light):
        return parts
    mass = volume = 0.0
    for part, massless in zip(parts, light, strict=True):
        for piece in part.pieces():
            block = part.block(piece, points, np.zeros(3))
            if massless:
                volume += float(block.volume().sum())
            else:
                found = rule.inertia(block, points).mass()
                mass += found.rigid.m if found else 0.0
    if not (mass > 0 and volume > 0):
        return parts
    rho = SHARE * mass / volume
    return [
        replace(part, section=_dense(part.section, rho)) if massless else part
        for part, massless in zip(parts, light, strict=True)
    ]


def _has_no_density(section: Property) -> bool:
    plies = section.plies if isinstance(section, Shell) else ()
    materials = [getattr(section, "material", None), *(ply.material for ply in plies)]
    densities = [material.rho for material in materials if material is not None]
    return bool(densities) and not any(densities) and not getattr(section, "nsm", 0.0)


def _dense(section: Property, rho: float) -> Property:
    """Return a section whose materials have a density."""
    if isinstance(section, Shell) and section.plies:
        return replace(section, plies=tuple(replace(p, material=replace(p.material, rho=rho)) for p in section.plies))
    assert isinstance(section, (Beam, Truss, Shell, Solid))  # others have no material
    assert section.material is not None  # a shell without plies has one
    return replace(section, material=replace(section.material, rho=rho))
