"""A modal body built by a pipeline, and its cache entry."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.formats.modalfile import read_body, write_body
from modalprep.pipeline.build.cache import Cache
from modalprep.report.body_page.table import Table

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.reduction.error import ReductionError


class Tables(NamedTuple):
    """Tables of the page of a body: of its model, and of the energies of its modes by group."""

    model: Sequence[Table] = ()
    energies: Sequence[Table] = ()


NO_TABLES = Tables()


@dataclass(frozen=True)
class Built:
    """A modal body with its file, checks, notes for the user, reduction error if measured, and tables of its model."""

    body: FlexibleBody
    file: Path
    checks: list[Check]
    notes: tuple[str, ...]
    error: ReductionError | None = None
    tables: Tables = NO_TABLES

    @property
    def error_curves(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Curves of the relative errors over frequency (Hz) for the report; empty if not measured."""
        if self.error is None:
            return {}
        found = {"frequencies": (self.error.full, self.error.frequency)}
        if len(self.error.sweep):
            found["compliance at the interfaces"] = (self.error.sweep, self.error.dynamic)
        return found


def body_key(cache: Cache, name: str, inputs: dict[str, str]) -> str:
    """Return the key of a body: its name, mesh and options, independent of the name of its pipeline file."""
    return cache.key("body", name, inputs["mesh_sha256"], inputs["options_sha256"])


def store_body(cache: Cache, key: str, built: Built, seconds: float) -> None:
    """Store a body with its computing time: modal file, checks, notes and error."""
    tables = [[asdict(table) for table in part] for part in built.tables]
    said = json.dumps({"checks": [asdict(check) for check in built.checks], "notes": built.notes, "tables": tables})
    arrays = {"modal_file": np.frombuffer(built.file.read_bytes(), dtype=np.uint8), "said": np.array(said)}
    if built.error is not None:
        arrays |= {f"error_{f.name}": np.asarray(getattr(built.error, f.name)) for f in fields(built.error)}
    cache.use.computed += 1
    cache.write(key, arrays, seconds)


def recall_body(cache: Cache, key: str, file: Path, provenance: dict[str, str]) -> Built | None:
    """Write the modal file of an entry as `file`, with its own provenance; None when there is no entry."""
    from modalprep.body.checks import Check

    found = cache.read(key)
    if found is None:
        return None
    with atomic_path(file) as temporary:
        temporary.write_bytes(found["modal_file"].tobytes())
    body = read_body(file)
    body = body.with_(provenance=body.provenance | provenance)
    write_body(body, file)
    cache.took(found)
    said = json.loads(str(found["said"]))
    tables = Tables(*([Table(**table) for table in part] for part in said["tables"]))
    return Built(body, file, [Check(**check) for check in said["checks"]], tuple(said["notes"]), _error(found), tables)


def _error(found: dict[str, np.ndarray]) -> ReductionError | None:
    from modalprep.reduction.error import ReductionError

    values = {name.removeprefix("error_"): array for name, array in found.items() if name.startswith("error_")}
    return ReductionError(**values | {"up_to": float(values["up_to"])}) if values else None
