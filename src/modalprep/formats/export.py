"""Exchange formats by name: file suffix, writer and variants."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from modalprep.errors import InputError
from modalprep.suggest import refuse_unknown

if TYPE_CHECKING:
    from modalprep.body.flexible_body import FlexibleBody


MOTION = "equations of motion"
MATRICES = "matrices"
SHAPES = "mode shapes"
HUB = "motion of the root"


@dataclass(frozen=True)
class Export:
    """A format.

    Attributes
    ----------
    suffix : str
        Of its file.
    writer : str
        ``module.function``.
    option : str or None
        The writer's, if it has one.
    holds : str
        MOTION, MATRICES (what is linear of it), SHAPES, or HUB (small motions of the root alone).
    read : bool
        Whether `import_body` reads a file with what makes a body.
    """

    suffix: str
    writer: str
    option: str | None = None
    holds: str = MOTION
    read: bool = True


EXPORTS: dict[str, Export] = {
    "sid": Export(".sid_fem", "sid.write_sid", "dialect"),
    "mbdyn": Export(".fem", "mbdyn.write_mbdyn", "version"),
    "exudyn": Export(".npz", "exudyn.write_exudyn"),
    "op4": Export(".op4", "nastran.write_output4", holds=MATRICES),
    "nastran": Export(".op4", "nastran.write_output4", holds=MATRICES),
    "dmig": Export(".dmig", "nastran.write_dmig", holds=MATRICES),
    "coupling": Export(".json", "coupling.write_coupling", "point", holds=HUB),
    "extptfm": Export(".extptfm", "openfast.write_extptfm", holds=HUB),
    "simscape": Export(".mat", "simscape.write_simscape", holds=MATRICES, read=False),
    "modelica": Export(".mo", "modelica.write_modelica", read=False),
    "uff": Export(".unv", "uff.write_uff", holds=SHAPES),
    "vtu": Export(".vtu", "vtu.write_vtu", holds=SHAPES),
}


def export_body(body: FlexibleBody, to: str, path: str | Path, **options: str | None) -> Path:
    """Write a body in an exchange format; the file is written completely or not at all.

    Parameters
    ----------
    to : str
        A name of `EXPORTS`.
    options : str or None
        ``dialect`` of sid, ``version`` of mbdyn, ``point`` of coupling; None: the writer's default.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        When the name is unknown, the format has no such option or value, it cannot hold the body, or the folder
        cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> export_body(uniform_beam(modes=2), "mbdyn", Path(tempfile.mkdtemp()) / "beam.fem").name
    'beam.fem'
    """
    export = known_export(to)
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name != export.option:
            takers = ", ".join(key for key, other in EXPORTS.items() if other.option == name) or "no format"
            raise InputError(f"format {to!r} has no {name}; leave --{name} out, it is for {takers}")
    module, function = export.writer.split(".")
    getattr(import_module(f"modalprep.formats.{module}"), function)(body, path, **given)
    return Path(path)


def lost_in(body: FlexibleBody, to: str) -> list[str]:
    """Return notes on the dynamics of a body that a format cannot represent.

    Examples
    --------
    >>> from modalprep.examples import uniform_beam
    >>> lost_in(uniform_beam(modes=2), "sid"), len(lost_in(uniform_beam(modes=2), "exudyn"))
    ([], 1)
    """
    said = []
    if to == "exudyn" and body.has_geometric_stiffness:
        said.append(
            "geometric stiffness has no place in this format: a fast turning body softens instead of stiffening"
        )
    if EXPORTS[to].holds == MATRICES:
        said.append(
            "all that is not linear has no place in this format: of the geometric stiffness and of P and H, which "
            "large rotations need, a reader can rebuild a part"
        )
    if EXPORTS[to].holds == HUB:
        said.append("it describes small motions of the root, without geometric stiffness and without other interfaces")
    if body.coupled_damping is not None and to in ("coupling", "uff"):
        said.append(
            "the modes have damping ratios of their own: what dampers pass from one to another has no place here"
        )
    if body.stations is not None and EXPORTS[to].holds in (MOTION, MATRICES):
        said.append(
            "the stations of large_deflection have no place in this format: its reader moves the body by its modes "
            "alone, which holds to about a tenth of its size"
        )
    if body.T is not None and EXPORTS[to].holds in (MOTION, MATRICES):
        said.append(
            "the second order of the modal mass (T) has no place in this format: a body that bends under a steady load "
            "has other frequencies there"
        )
    return said


def known_export(name: str) -> Export:
    """Return a format by its name.

    Raises
    ------
    InputError
        When it is unknown.

    Examples
    --------
    >>> known_export("sid").suffix
    '.sid_fem'
    >>> known_export("x")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    modalprep.errors.InputError: format 'x' does not exist; known are sid, mbdyn, ...
    """
    refuse_unknown(name, EXPORTS, "format")
    return EXPORTS[name]
