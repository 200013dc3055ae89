"""An output file in plain sentences, whatever it holds."""

from __future__ import annotations

import json
from pathlib import Path

from modalprep.errors import InputError
from modalprep.formats.hdf5 import file_format
from modalprep.formats.modalfile import FORMAT, read_body
from modalprep.formats.responsefile import RESPONSE, read_response
from modalprep.formats.resultfile import RESULT, read_result
from modalprep.report.explain.batch import explain_batch
from modalprep.report.explain.body import explain_body
from modalprep.report.explain.response import explain_response
from modalprep.report.explain.run import explain_run

BATCH, MANIFEST = "modalprep batch", "batch.json"
ADVICE = f"give a modal file, a result or a response (.h5), or a {MANIFEST}, that modalprep wrote"


def explain_file(path: Path) -> list[str]:
    """Return some ten sentences on a body, a run, a response or a batch.

    Raises
    ------
    InputError
        When the file is missing, damaged or of another kind.

    Examples
    --------
    >>> explain_file(Path("mesh.msh"))
    Traceback (most recent call last):
    modalprep.errors.InputError: file mesh.msh does not exist
    """
    if path.is_dir():
        path = path / MANIFEST
    if path.suffix == ".json":
        return explain_batch(_batch(path))
    if path.suffix == ".toml":
        raise InputError(f"{path} is a pipeline file: {ADVICE}, from its outputs")
    kind = file_format(path)
    if kind == FORMAT:
        return explain_body(read_body(path))
    if kind == RESULT:
        return explain_run(read_result(path))
    if kind == RESPONSE:
        return explain_response(read_response(path))
    raise InputError(f"{path} has the format {kind or 'of another program'!r}: {ADVICE}")


def _batch(path: Path) -> dict:
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read ({error.strerror}); {ADVICE}") from None
    except ValueError as error:
        raise InputError(f"{path} is damaged ({error}); {ADVICE}") from None
    if not isinstance(found, dict) or found.get("format") != BATCH:
        raise InputError(f"{path} is not the file of a batch; {ADVICE}")
    return found
