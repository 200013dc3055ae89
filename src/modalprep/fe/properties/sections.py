"""Beam sections by shape: area, second moments, torsion constant, shear factors and outer fibres from dimensions."""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable
from typing import Any

from modalprep.errors import InputError
from modalprep.fe.properties.materials import Material
from modalprep.fe.properties.properties import Beam, BeamTheory, Vector
from modalprep.suggest import refuse_other, suggestion

CATALAN = 0.915965594177219  # sum of (-1)^k / (2 k + 1)^2


def beam_section(
    shape: str, material: Material, *, up: Vector = (0.0, 0.0, 1.0), theory: BeamTheory = "timoshenko", **sizes: Any
) -> Beam:
    """Return a beam of a standard section; `height` lies along e3 ('up'), `width` along e2.

    Its `fibres` are four: the corners, from +e2 +e3 on anticlockwise, or of round sections +e2, +e3, -e2, -e3; a
    rectangle, whose torsion shears the middles of its sides and not its corners, has those of +e2, +e3, -e2, -e3 too.

    Parameters
    ----------
    shape : {"rectangle", "rod", "tube", "box", "i"}
    material : Material
    theory : {"timoshenko", "euler-bernoulli"}
    **sizes
        Of the shape, m: ``rectangle(width, height)``, ``rod(diameter)``, ``tube(diameter, thickness)``,
        ``box(width, height, thickness)``, ``i(width, height, flange, web)``; `offset`, `nsm`, `shear_centre` and
        `taper` as in `Beam`.

    Returns
    -------
    Beam
        With the shear factors and, in `fibres`, the outer fibres of the shape.

    Raises
    ------
    InputError
        When the shape or a size is unknown, missing, not positive, or walls overlap.

    References
    ----------
    S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, 3rd edition (1970), section 109: torsion of rectangles.
    G. R. Cowper, The shear coefficient in Timoshenko's beam theory, J. Appl. Mech. 33 (1966) 335: round sections.

    Examples
    --------
    >>> steel = Material(E=210e9, nu=0.3, rho=7800.0)
    >>> round(beam_section("rectangle", steel, width=0.02, height=0.03).Iy * 1e8, 6)
    4.5
    """
    refuse_other("beam_section: the shape", str, shape)
    refuse_other("beam_section: the material", Material, material)
    if shape not in SHAPES:
        raise InputError(f"unknown section shape {shape!r}; {suggestion(shape, SHAPES, 'known are')}")
    more = {name: sizes.pop(name) for name in ("offset", "nsm", "shear_centre", "taper") if name in sizes}
    wanted = list(inspect.signature(SHAPES[shape]).parameters)[1:]
    if set(sizes) != set(wanted):
        raise InputError(f"section {shape!r} needs {', '.join(wanted)}; got {', '.join(sizes) or 'nothing'}")
    for name, value in sizes.items():
        if not 0 < value < float("inf"):
            raise InputError(f"section {shape!r}: {name} = {value:g} m must be positive")
    return Beam(
        material=material, up=(up[0], up[1], up[2]), theory=theory, **SHAPES[shape](material.nu, **sizes), **more
    )


def _rectangle(nu: float, width: float, height: float) -> dict[str, Any]:
    """Torsion by Saint-Venant's series (Timoshenko and Goodier, section 109)."""
    long = max(width, height)
    short = min(width, height)
    series = sum(math.tanh(n * math.pi * long / (2 * short)) / n**5 for n in range(1, 40, 2))
    J = long * short**3 / 3 * (1 - 192 * short / (math.pi**5 * long) * series)
    on_long, on_short = _middles(long / short)
    y, z = (on_long, on_short) if height >= width else (on_short, on_long)
    sides = _round(width / 2, height / 2, y * short / J, z * short / J)
    fibres = (*_corners(width, height, 0.0), *sides)
    return {"A": width * height, "Iy": width * height**3 / 12, "Iz": height * width**3 / 12, "J": J, "fibres": fibres}


def _middles(ratio: float) -> tuple[float, float]:
    """Shear in the middle of the long and the short sides, over that of an endless strip, ``T short / J``."""
    odd = range(1, 20, 2)
    b = math.pi * ratio / 2
    on_long = 1 - 8 / math.pi**2 * sum(1 / (n**2 * math.cosh(min(n * b, 100.0))) for n in odd)
    on_short = CATALAN - sum((-1) ** (n // 2) * (1 - math.tanh(n * b)) / n**2 for n in odd)
    return on_long, 8 / math.pi**2 * on_short


def _corners(width: float, height: float, torsion: float) -> tuple[tuple[float, float, float], ...]:
    signs = ((1, 1), (-1, 1), (-1, -1), (1, -1))
    return tuple((y * width / 2, z * height / 2, torsion) for y, z in signs)


def _round(y: float, z: float, on_y: float, on_z: float) -> tuple[tuple[float, float, float], ...]:
    """Fibres on the axes of the section, with the shear of a unit torque there."""
    return (y, 0.0, on_y), (0.0, z, on_z), (-y, 0.0, on_y), (0.0, -z, on_z)


def _rod(nu: float, diameter: float) -> dict[str, Any]:
    return _ring(nu, diameter / 2, 0.0)


def _tube(nu: float, diameter: float, thickness: float) -> dict[str, Any]:
    _refuse_thick("tube", thickness, diameter)
    return _ring(nu, diameter / 2, diameter / 2 - thickness)


def _ring(nu: float, outer: float, inner: float) -> dict[str, Any]:
    """Shear factor of Cowper (1966), table 1."""
    second = math.pi / 4 * (outer**4 - inner**4)
    m2 = (inner / outer) ** 2
    k = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
    area = math.pi * (outer**2 - inner**2)
    torsion = outer / (2 * second)
    return {
        "A": area,
        "Iy": second,
        "Iz": second,
        "J": 2 * second,
        "ky": k,
        "kz": k,
        "fibres": _round(outer, outer, torsion, torsion),
    }


def _box(nu: float, width: float, height: float, thickness: float) -> dict[str, Any]:
    """Torsion by Bredt's formula for thin walls; shear by the two walls along the force."""
    _refuse_thick("box", thickness, min(width, height))
    w = width - 2 * thickness
    h = height - 2 * thickness
    t = thickness
    area = width * height - w * h
    return {
        "A": area,
        "Iy": (width * height**3 - w * h**3) / 12,
        "Iz": (height * width**3 - h * w**3) / 12,
        "J": 2 * t * ((width - t) * (height - t)) ** 2 / (width + height - 2 * t),
        "ky": 2 * width * t / area * 5 / 6,
        "kz": 2 * height * t / area * 5 / 6,
        "fibres": _corners(width, height, 1 / (2 * t * (width - t) * (height - t))),
    }


def _i(nu: float, width: float, height: float, flange: float, web: float) -> dict[str, Any]:
    """Torsion of thin strips, ``sum b t^3 / 3``; shear by the web, and by the flanges across it."""
    _refuse_thick("i", flange, height)
    if web >= width:
        raise InputError(f"section 'i': web = {web:g} m must be thinner than the width {width:g} m")
    clear = height - 2 * flange
    area = 2 * width * flange + clear * web
    J = (2 * width * flange**3 + (height - flange) * web**3) / 3
    return {
        "A": area,
        "Iy": (width * height**3 - (width - web) * clear**3) / 12,
        "Iz": (2 * flange * width**3 + clear * web**3) / 12,
        "J": J,
        "fibres": _corners(width, height, flange / J),
        "ky": 2 * width * flange / area * 5 / 6,
        "kz": height * web / area,
    }


def _refuse_thick(shape: str, wall: float, across: float) -> None:
    if 2 * wall >= across:
        raise InputError(f"section {shape!r}: walls of {wall:g} m overlap in {across:g} m; give thinner walls")


SHAPES: dict[str, Callable] = {"rectangle": _rectangle, "rod": _rod, "tube": _tube, "box": _box, "i": _i}
