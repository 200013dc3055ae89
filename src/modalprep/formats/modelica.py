"""Modelica: a body as a record of its integrals, for a model of flexible bodies of one's own."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.errors import InputError
from modalprep.formats.refusals import refuse_without_modes

ARRAYS = {  # fields of a body, and what they are
    "s0": "first moment of mass, kg m",
    "E0": "second moments of mass, kg m2",
    "S": "momentum of the modes, sqrt(kg)",
    "H": "integral of position times mode, sqrt(kg) m",
    "P": "integral of mode times mode",
    "K": "modal stiffness, (rad/s)2",
    "D": "modal damping, 1/s",
    "coupled_damping": "the whole damping matrix where dampers couple the modes, 1/s",
    "Kg_A": "geometric stiffness of accelerations",
    "Kg_W": "geometric stiffness of the centrifugal field",
    "Kg_F": "geometric stiffness of forces on interfaces",
    "Kg_T": "geometric stiffness of torques on interfaces",
    "phi": "translations of the interfaces by the modes",
    "psi": "rotations of the interfaces by the modes",
    "interface_position": "places of the interfaces, m",
}


def write_modelica(body: FlexibleBody, path: str | Path) -> Path:
    """Write the integrals of a body as a Modelica record, in full precision.

    Its name is that of the file. The parameters have the names and shapes of `FlexibleBody`, in SI units and the axes
    of frame B; theory 4 has the equations of motion.

    Lost: mesh, stress, mode table; the second order of the modal mass (``T``).

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the body has no modes, the name of the file is no name in Modelica, or the folder cannot be written.

    References
    ----------
    Modelica Association, Modelica Language Specification 3.6: class definitions, arrays.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> file = write_modelica(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.mo")
    >>> for line in file.read_text().splitlines()[:3]: print(line)
    record beam "beam by modalprep, SI units"
      extends Modelica.Icons.Record;
      parameter Integer n = 2 "number of modes";
    """
    path = Path(path)
    refuse_without_modes(body, "for Modelica", "take a body of the standard library")
    if not re.fullmatch(r"[A-Za-z_]\w*", path.stem, flags=re.ASCII):
        raise InputError(f"{path}: {path.stem!r} is no name in Modelica; begin with a letter, then letters and digits")
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(_lines(body, path.stem)) + "\n", encoding="utf-8")
    return path


def _lines(body: FlexibleBody, name: str) -> Iterator[str]:
    yield f"record {name} {_text(f'{body.name} by modalprep, SI units')}"
    yield "  extends Modelica.Icons.Record;"
    yield f'  parameter Integer n = {body.n} "number of modes";'
    yield f'  parameter Real m = {body.m!r} "mass, kg";'
    names = ", ".join(map(_text, body.interface_name))
    yield f'  parameter String interface_name[{len(body.interface_name)}] = {{{names}}} "interfaces";'
    for field, what in ARRAYS.items():
        if getattr(body, field) is None:
            continue
        values = np.asarray(getattr(body, field), dtype=float)
        shape = ", ".join(map(str, values.shape))
        yield f"  parameter Real {field}[{shape}] = {_array(values)} {_text(what)};"
    yield f"end {name};"


def _array(values: np.ndarray) -> str:
    parts = [repr(float(value)) for value in values] if values.ndim == 1 else [_array(row) for row in values]
    return "{" + ", ".join(parts) + "}"


def _text(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", " ") + '"'
