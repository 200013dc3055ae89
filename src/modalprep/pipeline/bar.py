"""The bar of a job on a terminal; a file of its own, as what draws it takes time to import."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, Progress, ProgressColumn, Task, TextColumn
from rich.text import Text

from modalprep.report.terminal import clock


@contextmanager
def drawn_bar(
    console: Console, total: float, stage: str = "", unit: str = ""
) -> Iterator[tuple[Callable[..., None], list[tuple[str, float]]]]:
    """Draw a bar from 0 to total; yield the function that moves it, and the list of stages with their starts (s).

    Examples
    --------
    >>> import io
    >>> with drawn_bar(Console(file=io.StringIO()), 10.0, "first") as (reach, stages):
    ...     reach(5.0, "second")
    >>> [name for name, _ in stages]
    ['first', 'second']
    """
    stages = [(stage, time.perf_counter())]
    columns = (
        TextColumn("  {task.description}", markup=False),
        BarColumn(bar_width=None),
        TextColumn(f"{{task.completed:.4g}} of {total:.4g} {unit}" if unit else "{task.percentage:3.0f}%"),
        _StageTime(),
    )
    with Progress(*columns, console=console, transient=True, expand=True) as bar:
        task = bar.add_task(stage, total=total, since=stages[0][1])

        def reach(value: float, begun: str = "") -> None:
            bar.update(task, completed=value)
            if begun:
                stages.append((begun, time.perf_counter()))
                bar.update(task, description=begun, since=stages[-1][1])

        yield reach, stages


class _StageTime(ProgressColumn):
    """The time of the stage."""

    def render(self, task: Task) -> Text:
        """Return it as text."""
        return Text(clock(time.perf_counter() - task.fields["since"]))
