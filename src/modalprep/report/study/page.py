"""The page of a study: what failed first, a table with filters, a plot, extremes; one file, quick at 10,000 jobs."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from markupsafe import Markup

from modalprep.atomic import write_text
from modalprep.report.body_page.frame import framed, now
from modalprep.report.body_page.section import Section
from modalprep.report.body_page.table import part
from modalprep.report.study.data import is_number, page_data, varying
from modalprep.report.study.facts import WAITING, counts, extremes, facts, troubles

FIRST = 50  # rows without scripts
COLUMNS = 12  # quantities that are shown at first
SELDOM = re.compile(
    r"(?:centre|inertia|mode|effective_mass)_|\w*frequency_(?:[4-9]|10)_|system_damping_|(?:energy|momentum)_error|"
    r"steps|run_status|end_time|not_met|warnings"
)  # and are not among them
SUFFIX = {"body": ".html", "run": "-run.html", "log": ".log"}  # of the job's name
Columns = Mapping[str, Sequence[Any]]


def write_study_page(
    columns: Columns,
    path: Path,
    *,
    rows: Sequence[Mapping[str, Any]],
    parameters: Sequence[str] = (),
    file: str = "study.csv",
) -> Path:
    """Write the page of a study.

    The page is one file; it loads no script, style or picture from elsewhere, and links to the pages of the jobs.

    Parameters
    ----------
    columns : {name: list}
        Of the table, with None where a job has no value: ``job``, parameters, ``status``, ``verdict``, ``cause``,
        ``seconds``, quantities.
    path : Path
    rows : sequence of dict
        The jobs with their folders and verdicts.
    parameters : sequence of str
        Columns that were chosen, not found.
    file : str
        With the same table, in the same folder.

    Examples
    --------
    >>> import tempfile
    >>> columns = {"job": ["a"], "status": ["done"], "verdict": ["PASS"], "cause": [None], "seconds": [1.0]}
    >>> rows = [{"job": "a", "status": "done", "seconds": 1.0}]
    >>> page = write_study_page(columns, Path(tempfile.mkdtemp()) / "index.html", rows=rows)
    >>> "1 of 1 jobs has ended" in page.read_text(encoding="utf-8")
    True
    """
    folders = _folders(rows, path.parent)
    shown = _shown(columns, parameters)
    links = Links(columns, folders)
    named = {"columns": columns, "links": links, "shown": shown, "first": range(min(FIRST, len(rows)))}
    groups = troubles(rows)
    more = {
        "folders": folders,
        "shown": shown,
        "parameters": list(parameters),
        "groups": {each.name: each.jobs for each in groups},
    }
    data = page_data(columns, more, [links.words(k) for k in range(len(rows))])
    sections = [
        *_section("Failures and warnings", "failures", "failures.html", groups=groups, **named),
        *_section("Jobs", "jobs", "jobs.html", data=Markup(data), file=file, **named),
        *_section("Plot", "plot", "plot.html", numbers=any(map(is_number, columns.values()))),
        *_section("Extremes", "extremes", "extremes.html", rows=extremes(columns, parameters), **named),
    ]
    number = counts(rows)
    box = part("box.html", "study", counts=number, facts=facts(rows), **named)
    have = "has" if number.ended == 1 else "have"
    lead = f"{number.ended} of {len(rows)} jobs {have} ended." + " Reload the page for more." * bool(number.waiting)
    text = framed(
        "/".join(path.absolute().parts[-3:-1]),
        "study",
        lead,
        now(),
        box,
        sections,
        scripts=("study/table.js", "study/plot.js"),
        styles=("study/study.css",),
    )
    return write_text(text, path, errors="backslashreplace")  # names of files in other encodings


def _section(title: str, anchor: str, template: str, **values: Any) -> list[Section]:
    html = part(template, "study", **values)
    return [Section(title=title, anchor=anchor, html=html)] if html.strip() else []


class Links(NamedTuple):
    """Pages and logs of the jobs, as seen from the page."""

    columns: Columns
    folders: Sequence[str]

    def words(self, row: int) -> str:
        """Return which of the ``body``, ``run`` and ``log`` a job has."""
        columns = self.columns
        known = {"body": columns.get("mass_kg"), "run": columns.get("end_time_s")}
        found = [word for word, values in known.items() if values and values[row] is not None]
        return " ".join([*found, *(["log"] if columns["status"][row] != WAITING else [])])

    def first(self, row: int) -> str:
        """Return the address of the first of them, or of the folder."""
        path = self.folders[row]
        words = self.words(row).split()
        return f"{path}/{path.rpartition('/')[2]}{SUFFIX[words[0]]}" if words else f"{path}/"


def _folders(rows: Sequence[Mapping[str, Any]], folder: Path) -> list[str]:
    """Return the address of the folder of each job as seen from the page."""
    home = str(folder)
    found = []
    for row in rows:
        head, tail = os.path.split(row.get("folder") or row["job"])
        relative = tail if head in (home, "") else os.path.relpath(os.path.join(head, tail), home)
        found.append(quote(os.fsencode(relative.replace(os.sep, "/")), safe="/=,+"))
    return found


def _shown(columns: Columns, parameters: Sequence[str]) -> list[str]:
    """Return the columns that are shown at first: parameters, how it ended, some quantities that vary."""
    fixed = ["job", *parameters, "status", "verdict", "seconds"]
    others = [name for name in columns if name not in (*fixed, "cause") and not SELDOM.match(name)]
    return [*fixed, *[name for name in others if varying(columns[name])][:COLUMNS]]
