"""The table of a study as a CSV file, a Parquet file and a page, written again and again while its jobs end."""

from __future__ import annotations

import csv
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from modalprep.atomic import atomic_path, csv_text
from modalprep.extras import missing
from modalprep.pipeline.study.table import Cell, StudyTable, study_table
from modalprep.report.study.page import write_study_page


class Written(NamedTuple):
    """The files of a study, and what to tell about them once."""

    files: list[Path]
    notes: tuple[str, ...]


def write_study(rows: Sequence[Mapping[str, Any]], folder: Path, name: str = "study") -> Written:
    """Write ``<name>.csv``, ``<name>.parquet`` where pyarrow is installed, and ``index.html``, each completely.

    Parameters
    ----------
    rows : sequence of dict
        The jobs, as ``batch.json`` lists them.
    folder : Path
    name : str
        Of the files.

    Returns
    -------
    Written
        The files, and that one was not written, where it was not.

    Raises
    ------
    OutputError
        When the folder cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> folder = Path(tempfile.mkdtemp())
    >>> written = write_study([{"job": "a", "status": "done", "quantities": {"mass_kg": 1.5}}], folder)
    >>> (folder / "study.csv").read_text().split()
    ['job,status,verdict,cause,seconds,mass_kg', 'a,done,,,,1.5']
    """
    table = study_table(rows)
    why = missing("pyarrow", f"{name}.parquet")
    files = [_write_csv(table, folder / f"{name}.csv")]
    if why:
        (folder / f"{name}.parquet").unlink(missing_ok=True)  # which would be older than the others
    else:
        files.append(_write_parquet(table, folder / f"{name}.parquet"))
    files.append(
        write_study_page(
            table.columns, folder / "index.html", rows=rows, parameters=table.parameters, file=f"{name}.csv"
        )
    )
    return Written(files, (f"{why}; {name}.csv has the same",) if why else ())


def _write_csv(table: StudyTable, path: Path) -> Path:
    with atomic_path(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(map(csv_text, table.columns))
        writer.writerows(zip(*(_of_csv(table, name) for name in table.columns), strict=True))
    return path


def _of_csv(table: StudyTable, name: str) -> list[Cell]:
    """Return a column for a CSV file; its numbers have all their digits there."""
    cells = table.columns[name]
    return cells if table.is_number(name) else [csv_text(x) if isinstance(x, str) else x for x in cells]


def _write_parquet(table: StudyTable, path: Path) -> Path:
    import pyarrow
    from pyarrow import parquet

    arrays = {
        name: pyarrow.array(cells, pyarrow.float64())
        if table.is_number(name)
        else pyarrow.array([None if x is None else str(x) for x in cells], pyarrow.string())
        for name, cells in table.columns.items()
    }
    with atomic_path(path) as temporary:
        parquet.write_table(pyarrow.table(arrays), temporary)
    return path
