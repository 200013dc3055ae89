"""A modal body built by a pipeline, and its cache entry."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from modalprep.atomic import atomic_path
from modalprep.body.flexible_body import FlexibleBody
from modalprep.formats.modalfile import read_body, write_body
from modalprep.pipeline.building.cache import Cache
from modalprep.report.body_page.table import Table

if TYPE_CHECKING:
    from modalprep.body.checks import Check
    from modalprep.reduction.error import ReductionError
    from modalprep.reduction.recoveries.convergence import Convergence

ROUND_OFF = 1e-16  # of errors on a logarithmic axis


class Tables(NamedTuple):
    """Tables of the page of a body: of its model, and of the energies of its modes by group."""

    model: Sequence[Table] = ()
    energies: Sequence[Table] = ()


NO_TABLES = Tables()


@dataclass(frozen=True)
class Built:
    """A modal body with its file, its checks, and, where computed, its error, its tables and convergence."""

    body: FlexibleBody
    file: Path
    checks: list[Check]
    error: ReductionError | None = None
    tables: Tables = NO_TABLES
    convergence: Convergence | None = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the validity of the body."""
        return self.body.notes

    @property
    def error_curves(self) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        """Curves of the relative errors over frequency (Hz) for the report; empty if not measured."""
        if self.error is None:
            return {}
        curves = {"frequencies": (self.error.full, self.error.frequency)}
        if len(self.error.sweep):
            curves["compliance at the interfaces"] = (self.error.sweep, self.error.dynamic)
        pairs = zip(self.error.recoveries, self.error.recovery, strict=True)
        above = self.error.recovery_at > 0
        f = self.error.recovery_at[above]
        curves |= {f"recovery {name}": (f, np.maximum(values[above], ROUND_OFF)) for name, values in pairs}
        return {label: curve for label, curve in curves.items() if len(curve[0])}  # empty below the first mode


def body_key(cache: Cache, name: str, inputs: dict[str, str]) -> str:
    """Return the key of a body: its name, mesh and options, independent of the name of its pipeline file."""
    return cache.key("body", name, inputs["mesh_sha256"], inputs["options_sha256"])


def store_body(cache: Cache, key: str, built: Built, seconds: float) -> None:
    """Store a body with its computing time: modal file, checks and error."""
    tables = [[asdict(table) for table in part] for part in built.tables]
    report = json.dumps({"checks": [asdict(check) for check in built.checks], "tables": tables})
    arrays = {"modal_file": np.frombuffer(built.file.read_bytes(), dtype=np.uint8), "report": np.array(report)}
    for kind, record in (("error", built.error), ("convergence", built.convergence)):
        if record is not None:
            arrays |= {f"{kind}_{f.name}": np.asarray(getattr(record, f.name)) for f in fields(record)}
    cache.use.computed += 1
    cache.write(key, arrays, seconds)


def recall_body(cache: Cache, key: str, file: Path, provenance: dict[str, str]) -> Built | None:
    """Write the modal file of an entry as `file`, with its own provenance; None when there is no entry."""
    from modalprep.body.checks import Check
    from modalprep.reduction.error import ReductionError
    from modalprep.reduction.recoveries.convergence import Convergence

    entry = cache.read(key)
    if entry is None:
        return None
    with atomic_path(file) as temporary:
        temporary.write_bytes(entry["modal_file"].tobytes())
    body = read_body(file)
    body = body.with_(provenance=body.provenance | provenance)
    write_body(body, file)
    cache.count_use(entry)
    report = json.loads(str(entry["report"]))
    checks = [Check(**check) for check in report["checks"]]
    tables = Tables(*([Table(**table) for table in part] for part in report["tables"]))
    error = _record(ReductionError, "error", entry)
    return Built(body, file, checks, error, tables, _record(Convergence, "convergence", entry))


def _record(record: type, kind: str, entry: dict[str, np.ndarray]) -> Any:
    """Return a record of numbers and names from the arrays of a cache entry; None where it has none."""
    values = {name.removeprefix(f"{kind}_"): array for name, array in entry.items() if name.startswith(f"{kind}_")}
    plain = {name: tuple(array.tolist()) for name, array in values.items() if name in ("recoveries", "methods")}
    return record(**values | plain | {"up_to": float(values["up_to"])}) if values else None
