"""Collects the outcomes of cases, as they come."""

from __future__ import annotations

import numpy as np

from modalprep.ensemble.record import DIVERGED, DONE, WAITING, Ensemble
from modalprep.ensemble.task import CaseTask, Ended
from modalprep.errors import InputError


class Collected:
    """The arrays of an ensemble; those of cases that are waiting hold NaN.

    Parameters
    ----------
    task : CaseTask

    Raises
    ------
    InputError
        When there is not enough memory for them.
    """

    def __init__(self, task: CaseTask) -> None:
        count, times = len(task.values), len(task.times)
        self._task = task
        self.status = [WAITING] * count
        self.message, self.audit = [""] * count, [""] * count
        numbers = count * times * sum(int(np.prod(shape)) for shape in task.shapes.values())
        try:
            self._channels = {name: np.full((count, times, *shape), np.nan) for name, shape in task.shapes.items()}
        except MemoryError:
            raise InputError(
                f"simulate_many: {numbers:.1e} numbers do not fit into memory; name fewer channels or raise output_step"
            ) from None
        self._end, self._energy_error, self._momentum_error = np.full((3, count), np.nan)
        self._events = {event.name: np.full(count, np.nan) for event in task.options.get("events", ())}

    @property
    def waiting(self) -> list[int]:
        """Cases that are to be run."""
        return [case for case, status in enumerate(self.status) if status == WAITING]

    @property
    def finished(self) -> int:
        """Number of cases that were run, failed ones too."""
        return len(self.status) - self.status.count(WAITING)

    def take(self, ended: Ended) -> None:
        """Write the outcome of a case."""
        case = ended.case
        self.status[case], self.message[case] = ended.status, ended.message
        self._end[case], self.audit[case] = ended.end, ended.audit
        self._energy_error[case] = ended.energy_error
        self._momentum_error[case] = ended.momentum_error
        for found, given in ((self._events, ended.events), (self._channels, ended.channels)):
            for name, values in given.items():
                found[name][case] = values

    def adopt(self, before: Ensemble | None) -> None:
        """Take the finished cases of an earlier call; those that failed are to be run again."""
        if before is None:
            return
        for case in range(len(before)):
            if before.status[case] in (DONE, DIVERGED):
                tables = (
                    {name: values[case] for name, values in table.items()} for table in (before.events, before.channels)
                )
                self.take(
                    Ended(
                        case,
                        before.status[case],
                        before.message[case],
                        0.0,
                        before.end[case],
                        before.energy_error[case],
                        before.momentum_error[case],
                        before.audit[case],
                        *tables,
                    )
                )

    def record(self) -> Ensemble:
        """Return the ensemble as it is now."""
        return Ensemble(
            cases=self._task.cases,
            time=self._task.times,
            channels=self._channels,
            status=tuple(self.status),
            message=tuple(self.message),
            audit=tuple(self.audit),
            end=self._end.copy(),
            energy_error=self._energy_error.copy(),
            momentum_error=self._momentum_error.copy(),
            events={name: values.copy() for name, values in self._events.items()},
        )
