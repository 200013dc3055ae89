"""Nastran property cards to sections in SI units."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np

from modalprep.fe.properties.materials import Material, Orthotropic
from modalprep.fe.properties.points import Spring
from modalprep.fe.properties.properties import Beam, Ply, Property, Shell, Solid, Truss
from modalprep.fe.readers.nastran.cards import Card
from modalprep.fe.readers.nastran.materials import (
    Conversion,
    bar_material,
    density,
    elastic,
    made,
    sheet_material,
    solid_material,
)
from modalprep.fe.readers.nastran.sections import Section

SLIGHT = 1e-6  # a stiffness Nastran lets be zero, as a fraction of the section's others
RIGID = 1e6  # shear factor of a plane without shear flexibility


def bar(conversion: Conversion, card: Card, section: Section) -> Beam | Truss:
    """Return the beam of a section, a truss when it has no bending stiffness.

    ``up`` is Nastran's y axis, so e3 = y and Iy = I1, kz = K1.
    """
    material, factor = bar_material(conversion, card, 1)
    m, inertial = conversion.units.length, conversion.units.inertial
    nsm = section.nsm * inertial / m
    I1, I2, _ = section.turned
    if not (I1 or I2):
        return made(card, Truss, material=material, A=section.A * m**2, J=section.J * factor * m**4, nsm=nsm)
    if not (I1 and I2 and section.J * factor):
        conversion.note(f"zero I1, I2 or J of bars is replaced by {SLIGHT:g} of the section's largest moment")
    slight = SLIGHT * max(I1, I2)
    k1, k2 = section.k1 * factor, section.k2 * factor
    if section.I12:
        k1 = k2 = 0.0  # Nastran drops shear when I12 is given
    return made(
        card,
        Beam,
        material=material,
        A=section.A * m**2,
        Iy=(I1 or slight) * m**4,
        Iz=(I2 or slight) * m**4,
        J=(section.J * factor or slight) * m**4,
        kz=k1 or RIGID,
        ky=k2 or RIGID,
        nsm=nsm,
        theory="timoshenko" if k1 or k2 else "euler-bernoulli",
        fibres=tuple((y * m, z * m) for y, z in section.fibres),
        taper=tuple(
            (
                x,
                A * m**2,
                (I1 or slight) * m**4,
                (I2 or slight) * m**4,
                (J * factor or slight) * m**4,
                more / m * inertial,
            )
            for x, A, I1, I2, J, more in section.stations
        ),
        offset=tuple(m * x for x in section.ours(*section.neutral)),
        shear_centre=tuple(0.0 - m * x for x in section.ours(*section.neutral)),
        bar=card.name in ("PBAR", "PBARL"),
    )


def rod(conversion: Conversion, card: Card, first: int = 1) -> Truss:
    """PROD, and CONROD with its MID in field `first`."""
    material, factor = bar_material(conversion, card, first)
    m = conversion.units.length
    A = card.real(first + 1, "A")
    J = card.real(first + 2, "J", 0.0)
    nsm = card.real(first + 4, "NSM", 0.0)
    nsm *= conversion.units.inertial / m
    return made(card, Truss, material=material, A=A * m**2, J=J * factor * m**4, nsm=nsm)


def tube(conversion: Conversion, card: Card) -> Truss:
    """PTUBE: outer diameters at both ends and the thickness, blank or zero for a solid rod."""
    material, factor = bar_material(conversion, card, 1)
    m = conversion.units.length
    first = card.real(2, "OD")
    t = card.real(3, "T", 0.0)
    outer = (first + card.real(5, "OD2", first)) / 2
    if outer != first:
        conversion.note("PTUBE with OD2: the mean of both diameters holds along the whole rod")
    inner = outer - 2 * t if t else 0.0
    if inner < 0:
        raise card.error(f"its wall of {t:g} is thicker than its radius of {outer / 2:g}; give a thinner one")
    A = math.pi / 4 * (outer**2 - inner**2)
    J = math.pi / 32 * (outer**4 - inner**4)
    nsm = card.real(4, "NSM", 0.0) * conversion.units.inertial / m
    return made(card, Truss, material=material, A=A * m**2, J=J * factor * m**4, nsm=nsm)


def panel(conversion: Conversion, card: Card) -> Shell:
    """PSHEAR: a sheet that resists shear in its plane, and little else."""
    source = conversion.material(card, 1, "MID", ("MAT1",))
    E, G, _ = elastic(source)
    stress, m = conversion.units.stress, conversion.units.length
    soft = SLIGHT * E * stress
    moduli = {"E1": soft, "E2": soft, "G12": (G or E / 2) * stress, "G13": soft, "G23": soft}
    material = made(source, Orthotropic, nu12=0.0, rho=density(conversion, source, 4), **moduli)
    conversion.note("CSHEAR: the panel is a sheet with its shear stiffness and 1e-6 of the others")
    nsm = card.real(3, "NSM", 0.0) * conversion.units.inertial / m**2
    thickness = card.real(2, "T") * m
    return made(card, Shell, material=material, thickness=thickness, nsm=nsm, bending_ratio=SLIGHT)


def flange(conversion: Conversion, card: Card, factor: float, across: float) -> Truss:
    """Return the rod along an edge of a panel that is `across` wide (deck units), by the factor F1 or F2 of PSHEAR."""
    t = card.real(2, "T")
    m = conversion.units.length
    area = factor * t * (across / 2 if factor <= 1.01 else t / 2)
    source = conversion.material(card, 1, "MID", ("MAT1",))
    E, _, nu = elastic(source)
    material = made(source, Material, E=E * conversion.units.stress, nu=nu, rho=0.0)
    return made(card, Truss, material=material, A=area * m**2)


def solid(conversion: Conversion, card: Card) -> Solid:
    """PSOLID; the axes of its material come with the elements."""
    if card.text(6) not in ("", "SMECH"):
        raise card.error(f"FCTN {card.text(6)} is not a structure; leave the fluid out of the deck")
    return Solid(material=solid_material(conversion, conversion.material(card, 1, "MID", ("MAT1", "MAT9", "MAT11"))))


def pshell(conversion: Conversion, card: Card) -> Shell:
    """PSHELL: blank MID2 means no bending, blank MID3 no shear flexibility."""
    if not card.text(1) or card.text(10) not in ("", "0"):
        raise card.error("needs MID1 and no MID4; give the membrane's material, and offsets as ZOFFS")
    material = sheet_material(conversion, card, 1)
    t = card.real(2, "T")
    bends, shears = card.text(3) not in ("", "0"), card.text(5) not in ("", "0")
    if not bends:
        conversion.note("PSHELL without MID2 (membrane only) keeps 1e-3 of its bending stiffness")
    return made(
        card,
        Shell,
        material=material,
        thickness=t * conversion.units.length,
        nsm=card.real(7, "NSM", 0.0) * conversion.units.inertial / conversion.units.length**2,
        bending_material=sheet_material(conversion, card, 3) if bends and card.text(3) != card.text(1) else None,
        bending_ratio=card.real(4, "12I/T**3", 1.0) if bends else 1e-3,
        shear_material=sheet_material(conversion, card, 5) if shears and card.text(5) != card.text(1) else None,
        shear_ratio=(card.real(6, "TS/T", 0.0) or 5 / 6) if shears or not bends else 1e3,
    )


def pcomp(conversion: Conversion, card: Card) -> Shell:
    """PCOMP and PCOMPG: plies from the bottom up; Z0 is the height of the bottom over the nodes."""
    if (lam := card.text(7)) not in ("", "SYM"):
        raise card.error(f"LAM = {lam} is not read; leave LAM blank or SYM")
    plies = _plies(conversion, card)
    if not plies:
        raise card.error("it has no plies; give MID and T of each")
    plies += plies[::-1] if lam else []
    total = sum(ply.thickness for ply in plies)
    m = conversion.units.length
    offset = card.real(1, "Z0") * m + total / 2 if card.text(1) else 0.0
    nsm = card.real(2, "NSM", 0.0) * conversion.units.inertial / m**2
    return made(card, Shell, plies=tuple(plies), offset=offset, nsm=nsm)


def _plies(conversion: Conversion, card: Card) -> list[Ply]:
    """Blank material and thickness repeat those of the ply before; a ply without any entry is none."""
    step, first = (8, 9) if card.name == "PCOMPG" else (4, 8)
    plies = []
    material = None
    t = 0.0
    for k in range(first, len(card.fields), step):
        if any(card.fields[k : k + 4]):
            material = sheet_material(conversion, card, k) if card.text(k) or material is None else material
            t = card.real(k + 1, f"T of ply {len(plies) + 1}", t or None) * (
                conversion.units.length if card.text(k + 1) else 1
            )
            angle = math.radians(card.real(k + 2, "THETA", 0.0))
            plies.append(made(card, Ply, material=material, thickness=t, angle=angle))
    return plies


STRUCTURAL = "; a body is damped by one ratio for each mode, and by viscous dampers (B)"


def bush(conversion: Conversion, card: Card, location: float) -> Spring:
    """PBUSH: its K and B rows."""
    six = {"K": [0.0] * 6, "B": [0.0] * 6}
    for row in range(card.rows):
        _, kind, *values = card.row(row)
        if kind in six:
            six[kind] = [card.real(8 * row + 2 + i, f"{kind}{i + 1}", 0.0) for i in range(6)]
        elif kind not in ("", "M") and any(values):
            conversion.note(f"PBUSH: its {kind} row is left out{STRUCTURAL if kind == 'GE' else ''}")
    return spring(conversion, card, six["K"], location, six["B"])


def bush_mass(card: Card) -> float:
    """Return the mass of a PBUSH in units of the deck: that of its M row."""
    rows = [row for row in range(card.rows) if card.row(row)[1] == "M"]
    return card.real(8 * rows[0] + 2, "M", 0.0) if rows else 0.0


def spring(
    conversion: Conversion, card: Card, k: Sequence[float], location: float = 0.5, c: Sequence[float] = (0.0,) * 6
) -> Spring:
    """Return a spring of six stiffnesses and dampings in deck units (force is mass length / s^2)."""
    unit = np.repeat([1.0, conversion.units.length**2], 3) * conversion.units.mass
    stiffness, damping = ((unit * values).tolist() for values in (k, c))
    return made(
        card,
        Spring,
        translation=tuple(stiffness[:3]),
        rotation=tuple(stiffness[3:]),
        location=location,
        translation_damping=tuple(damping[:3]),
        rotation_damping=tuple(damping[3:]),
    )


BUILDERS: dict[str, Callable[[Conversion, Card], Property]] = {
    "PROD": rod,
    "PTUBE": tube,
    "PSHEAR": panel,
    "PSOLID": solid,
    "PSHELL": pshell,
    "PCOMP": pcomp,
    "PCOMPG": pcomp,
}
