"""The [run_sensitivities] of a pipeline file: derivatives of its run, their files and their table."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from modalprep.multibody.model.system import System
from modalprep.pipeline.console import Reporter
from modalprep.pipeline.schema.base import naming
from modalprep.pipeline.schema.derivatives import RunSensitivitiesTable
from modalprep.pipeline.schema.system import SimulationTable
from modalprep.report.run_page.derivatives import derivatives_table, write_derivatives_csv
from modalprep.sensitivity.course import Options, refuse
from modalprep.sensitivity.file import write_derivatives
from modalprep.sensitivity.gradient import Gradient, gradient
from modalprep.sensitivity.objective import Objective, integral, last
from modalprep.sensitivity.observed import find_channel
from modalprep.sensitivity.parameters import find
from modalprep.sensitivity.run_sensitivities import RunSensitivities, run_sensitivities

TABLE = "[run_sensitivities]"
LEFT_OUT = ("t_end", "rtol", "shortest_event")  # of the options of the run


@dataclass(frozen=True)
class Differentiated:
    """Histories and their derivatives, and a number and its derivatives, as far as they were asked for."""

    histories: RunSensitivities | None
    objective: str
    gradient: Gradient | None

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of both, each once."""
        both = [part for part in (self.histories, self.gradient) if part is not None]
        return tuple(dict.fromkeys(note for part in both for note in part.notes))


def derivative_files(table: RunSensitivitiesTable, stem: Path) -> list[Path]:
    """Return the files that are written; `stem` is the folder and the file's name."""
    endings = (".h5", ".csv") if table.channels else (".h5",)
    return [stem.with_name(f"{stem.name}-sensitivities{ending}") for ending in endings]


def refuse_derivatives(
    table: RunSensitivitiesTable, system: System, simulation: SimulationTable, known: Mapping[str, np.ndarray]
) -> None:
    """Refuse unknown parameters and channels, and systems and methods that have no derivatives.

    Parameters
    ----------
    known : {channel: (0,) or (0, k)}

    Raises
    ------
    InputError
        Which says what it is.
    """
    with naming(TABLE):
        find(system, table.parameters)
        named = table.objective.named.values() if table.objective else ()
        for name in (*table.channels, *named):
            find_channel(known, name)
        refuse(system, Options(duration=simulation.t_end, method=simulation.method))


def differentiate(
    path: Path,
    table: RunSensitivitiesTable,
    system: System,
    options: Mapping[str, Any],
    stem: Path,
    reporter: Reporter,
) -> Differentiated:
    """Differentiate the run of the pipeline file at `path`, write the files, and print a table.

    `options` are those of `simulate`.
    """
    given = {name: value for name, value in options.items() if name not in LEFT_OUT}
    given |= {"duration": options["t_end"], "rtol": table.rtol}
    with naming(path), naming(TABLE):
        histories = run_sensitivities(system, table.channels, table.parameters, **given) if table.channels else None
        slope = gradient(system, objective_of(table), table.parameters, **given) if table.objective else None
    named = table.objective.named if table.objective else {}
    said = " ".join(f"{kind.replace('_', ' ')} of {channel}" for kind, channel in named.items())
    found = Differentiated(histories, said, slope)
    derivatives_table(found.histories, found.objective, found.gradient, reporter.console)
    reporter.notes(found.notes)
    files = derivative_files(table, stem)
    reporter.wrote(write_derivatives(files[0], found.histories, found.gradient, objective=said))
    if histories is not None:
        reporter.wrote(write_derivatives_csv(histories, files[1]))
    return found


def objective_of(table: RunSensitivitiesTable) -> Objective:
    """Return the objective of a table that has one."""
    assert table.objective is not None
    kind, channel = next(iter(table.objective.named.items()))
    if kind == "last":
        return last(channel)
    return integral(channel, square=kind == "integral_of_square")
