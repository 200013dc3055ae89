"""Bodies from files of other programs: one entry, which chooses the reader by the suffix."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import numpy as np
from numpy.linalg import LinAlgError

from modalprep.body.checks import indefinite
from modalprep.body.flexible_body import FlexibleBody
from modalprep.body.frames import reroot
from modalprep.body.mass import stated_mass_matrix
from modalprep.body.quality.units import implausible_units
from modalprep.errors import InputError
from modalprep.formats.bodies.described import NOTES, in_si_units, notes_of
from modalprep.formats.export import EXPORTS, SHAPES
from modalprep.formats.modalfile import CONSEQUENCE, refuse_impossible
from modalprep.verdicts.notes import told

FAULTS = (ArithmeticError, LookupError, ValueError, TypeError, OSError, RecursionError, LinAlgError, MemoryError)


UNITS = ("length_unit", "mass_unit")
ADVICE = {
    "interfaces": "the file names its interfaces",
    "nodes": "the file has the places of its nodes",
}


@dataclass(frozen=True)
class BodyFormat:
    """A format of files with bodies.

    Attributes
    ----------
    name : str
    suffixes : tuple of str
    reader : str
        ``module.function``, which takes the path and returns a body.
    takes : tuple of str
        Options of `import_body` that the reader takes; one that takes units returns SI units.
    beside : tuple of str
        Suffixes of further files with the same name that are read too.
    """

    name: str
    suffixes: tuple[str, ...]
    reader: str
    takes: tuple[str, ...] = ()
    beside: tuple[str, ...] = ()


FORMATS = (
    BodyFormat("SID_FEM", (".sid", ".sid_fem"), "sid.sid_body"),
    BodyFormat("MBDyn", (".fem",), "mbdyn.mbdyn_body"),
    BodyFormat("Exudyn", (".npz",), "exudyn.exudyn_body", takes=("interfaces",)),
    BodyFormat("OUTPUT4", (".op4",), "superelements.output4_body", takes=UNITS, beside=(".asm", ".pch")),
    BodyFormat("DMIG", (".dmig", ".bdf", ".dat", ".nas", ".pch"), "matrices.dmig_body", takes=(*UNITS, "interfaces")),
    BodyFormat("substructure", (".mtx", ".inp"), "matrices.substructure_body", takes=(*UNITS, "interfaces", "nodes")),
)
PICTURES = "it holds mode shapes but no mass integrals, without which there is no body; export another format"
NO_BODY = {
    ".h5": "it is a modal file already, which the other commands take as it is",
    **{export.suffix: PICTURES for export in EXPORTS.values() if export.holds == SHAPES},
    ".json": "coupling matrices hold small motions of the root alone, and no body; export another format",
    ".mat": "state spaces, coupling matrices and data of Simscape are not read; export another format",
    ".extptfm": "it holds small motions of the root alone, and no body; export another format",
    ".mo": "Modelica records are not read; export another format",
    ".sub": "the binary substructures of Ansys are not read; write the matrices of the unreduced model (.full with its "
    ".cdb) and name them in a pipeline file under [matrices]",
    ".asm": "it places a superelement, and the matrices are in its .op4 file; name that one",
    ".op2": "OUTPUT2 files are not read; let Nastran write the superelement with EXTSEOUT and DMIGOP4 or DMIGPCH",
}


@told
def import_body(
    path: str | Path,
    *,
    root: str | None = None,
    length_unit: str = "m",
    mass_unit: str | None = None,
    interfaces: Mapping[str, Sequence[int]] | None = None,
    nodes: str | Path | None = None,
) -> FlexibleBody:
    """Read a body that another program, or an export of this one, has reduced.

    What the file does not hold, and how it was rebuilt, is said in the body's ``provenance``; `notes_of` lists it. The
    coordinates become the modes of the file's stiffness and mass where these are not diagonal. A node without
    displacement at the origin of the file's frame becomes the root.

    Parameters
    ----------
    path : path
        Of a format in `FORMATS`, chosen by its suffix.
    root : str
        Interface to which the frame is moved, as `reroot` does: a body in mean axes, of which no node is at rest, needs
        it for any other joint than a free one.
    length_unit, mass_unit : str
        Units of the file's numbers, with seconds; ``mass_unit`` may be left out with metres (kg).
    interfaces : {name: numbers of nodes}
        Interfaces that the file does not name, on the mean motion of their nodes; those of Exudyn are numbered from 0.
    nodes : path
        File with the places of the nodes, for the substructures of Abaqus and CalculiX.

    Returns
    -------
    FlexibleBody
        In SI units.

    Raises
    ------
    InputError
        When the file is missing, of no such format, damaged, truncated, contradicts itself, or describes what no body
        is; or the root does not exist.

    Examples
    --------
    >>> import tempfile
    >>> from modalprep.examples import uniform_beam
    >>> from modalprep.formats.mbdyn import write_mbdyn
    >>> body = import_body(write_mbdyn(uniform_beam(modes=2), Path(tempfile.mkdtemp()) / "beam.fem"))
    >>> round(body.m, 9), body.interface_name, body.notes[0]
    (12.0, ('root', 'tip'), 'the file does not hold mesh and shapes between the nodes: pictures show the nodes alone')
    """
    path = Path(path)
    chosen = known_format(path)
    length, mass = _factors(length_unit, mass_unit)
    units = {"length_unit": length_unit, "mass_unit": mass_unit}
    options = {key: value for key, value in {"interfaces": interfaces, "nodes": nodes}.items() if value}
    for key in options.keys() - set(chosen.takes):
        raise InputError(f"{path}: {ADVICE[key]}; leave out {key}")
    if own := set(UNITS) <= set(chosen.takes):
        options |= units
    module, function = chosen.reader.split(".")
    reader = getattr(import_module(f"modalprep.formats.bodies.{module}"), function)
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused
            body = reader(path, **options)
            body = body if own else in_si_units(body, length, mass)
            _refuse_negative_mass(body)
            refuse_impossible(body, vouched=True)
        body = _with_source(body, path, "SI" if length == mass == 1.0 else f"{length_unit}, {mass_unit} and s")
        body = body if root is None else reroot(body, root)
        lost = (f"the file does not hold {note}" for note in notes_of(body))
        return body.with_(notes=(*lost, *implausible_units(body, length)))
    except InputError as error:
        said = str(error)
        raise InputError(said if str(path) in said else f"{chosen.name} file {path}: {said}") from None
    except FAULTS as error:
        raise InputError(f"{chosen.name} file {path} is damaged or no {chosen.name} file ({error})") from None


def known_format(path: Path) -> BodyFormat:
    """Return the format of a file.

    Raises
    ------
    InputError
        When files with its suffix describe no body.

    Examples
    --------
    >>> known_format(Path("arm.fem")).name
    'MBDyn'
    >>> known_format(Path("arm.vtu"))  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    modalprep.errors.InputError: arm.vtu: it holds mode shapes but no mass integrals...
    """
    suffix = path.suffix.lower()
    for known in FORMATS:
        if suffix in known.suffixes:
            return known
    listed = ", ".join(f"{suffix} ({known.name})" for known in FORMATS for suffix in known.suffixes)
    raise InputError(f"{path}: {NO_BODY.get(suffix, f'bodies are read from files {listed}')}")


def _factors(length_unit: str, mass_unit: str | None) -> tuple[float, float]:
    if length_unit == "m" and mass_unit is None:
        return 1.0, 1.0
    from modalprep.fe.external.model import unit_factors

    return unit_factors(length_unit, mass_unit)


def _refuse_negative_mass(body: FlexibleBody) -> None:
    M = stated_mass_matrix(body)
    if indefinite(M) > CONSEQUENCE:
        lowest = np.linalg.eigvalsh(M)[0]
        raise InputError(
            f"its mass matrix of rigid motions and modes has the negative eigenvalue {lowest:.3g} (SI units): mass and "
            "inertia are too small for the momentum of the modes, or the modal mass is wrong; correct it where the "
            "file was made"
        )


def _with_source(body: FlexibleBody, path: Path, units: str) -> FlexibleBody:
    """Return the body with its file and the units of its numbers in the provenance."""
    notes = f"{body.provenance[NOTES]}; units: the numbers are taken as {units}"
    source = {NOTES: notes, "file": path.name, "file_sha256": body_digest(path)}
    return body.with_(provenance=body.provenance | source)


def files_of(path: Path) -> list[Path]:
    """Return the file of a body and those beside it that are read with it.

    Examples
    --------
    >>> files_of(Path("arm.fem"))
    [PosixPath('arm.fem')]
    """
    beside = (path.with_suffix(suffix) for suffix in known_format(path).beside)
    return [path, *(file for file in beside if file != path and file.is_file())]


def body_digest(path: Path) -> str:
    """Return the SHA-256 of the files of a body; empty when it is not there."""
    if not path.is_file():
        return ""
    whole = hashlib.sha256()
    for file in files_of(path):
        whole.update(file.read_bytes())
    return whole.hexdigest()
