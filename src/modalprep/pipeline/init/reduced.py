"""The first pipeline file of a body that another program has reduced."""

from __future__ import annotations

from pathlib import Path

from modalprep.atomic import refuse_folder
from modalprep.body.flexible_body import FlexibleBody
from modalprep.formats.bodies.described import notes_of
from modalprep.formats.bodies.read import FORMATS, import_body
from modalprep.pipeline.init.pendulum import body_pendulum_text
from modalprep.pipeline.init.proposal import comment, quoted
from modalprep.pipeline.init.text import path_from
from modalprep.pipeline.init.write import written_files

OF_MESHES = {".bdf", ".dat", ".nas", ".inp"}  # suffixes of decks, which are read as meshes
NOT_READ = {".op2", ".sub", ".asm"}  # of reduced bodies too, for which there is a sentence


def is_reduced(file: Path) -> bool:
    """Whether a file holds a reduced body, by its suffix.

    Examples
    --------
    >>> is_reduced(Path("arm.sid_fem")), is_reduced(Path("arm.bdf"))
    (True, False)
    """
    suffix = file.suffix.lower()
    return suffix in NOT_READ or (suffix not in OF_MESHES and any(suffix in known.suffixes for known in FORMATS))


def init_reduced(
    file: Path,
    target: Path | None = None,
    *,
    length_unit: str | None = None,
    mass_unit: str | None = None,
    force: bool = False,
) -> tuple[FlexibleBody, list[str], list[Path]]:
    """Write a pipeline file for a reduced body, and beside it one of a pendulum where its root can carry one.

    Parameters
    ----------
    file, target, force
        As in `init_pipeline`.
    length_unit, mass_unit : str, optional
        Of the file, which says none; default m and kg.

    Returns
    -------
    The body, what its file does not hold, and the files.

    Raises
    ------
    InputError
        When the file cannot be read, or one of the files to write is there already.
    """
    target = target or Path(f"{file.stem}.toml")
    refuse_folder(target)
    body = import_body(file, length_unit=length_unit or "m", mass_unit=mass_unit)
    notes = notes_of(body)
    texts = [_text(file, target, body, notes, length_unit, mass_unit)]
    if body.at_root:
        texts.append(body_pendulum_text(body, target))
    return body, notes, written_files(file, target, texts, force)


def _text(
    file: Path, target: Path, body: FlexibleBody, notes: list[str], length_unit: str | None, mass_unit: str | None
) -> str:
    names = ", ".join(body.interface_name)
    assumed = "" if length_unit else "  # ASSUMPTION: the file says no units; with another one also mass_unit"
    mass = f'mass_unit = "{mass_unit}"\n' if mass_unit else ""
    root = f"# root = {quoted(body.interface_name[-1])}  # interface that carries the body frame, of {names}\n"
    return f"""\
# {target.stem}: the body of {file.name}, reduced by another program. modalprep init wrote it; correct what it assumes.

{comment(chr(10).join(f"the file does not hold {note}" for note in notes))}
[body]
file = {quoted(path_from(target.parent, file))}
length_unit = "{length_unit or "m"}"{assumed}
{mass}{root}
[output]
pictures = 6  # the report is written always
"""
