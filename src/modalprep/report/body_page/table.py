"""Tables of the report page: HTML, with the same numbers in full as a CSV file inside the page."""

from __future__ import annotations

import base64
import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib.resources import files
from itertools import zip_longest
from typing import TYPE_CHECKING, Any

import numpy as np
from markupsafe import Markup

from modalprep.atomic import csv_text
from modalprep.report.numbers import number, raised

if TYPE_CHECKING:
    from jinja2 import Environment

CLASSES = {"passed": "good", "FAILED": "bad", "not checked": "open", "warning": "warn"}  # of cells with these words


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of a page.

    Attributes
    ----------
    name : str
        Its anchor and the name of its CSV file: small letters, digits and hyphens.
    columns : sequence of str
        Headings, with units.
    rows : sequence of sequence of str, number, bool or None
        None, and NaN, leave the cell empty. Columns of numbers only stand at the right.
    caption : str
        A sentence above the table; also its name for a screen reader.
    total : sequence, optional
        A row in the foot, such as sums.
    below : sequence of rows
        Further rows in the foot, such as what the sums are compared with.
    forms : {column: format}
        How numbers are written; default ``.5g``. The page has powers of ten in place of exponents, and those of forms
        with ``g`` below 1e-4 and from 1e7 only. The CSV file has the numbers in full.
    heat : sequence of str
        Columns whose numbers, in %, shade their cells; their headings stand upright.
    marks : sequence of str
        Anchors of the rows, such as ``mode-7``, to which their first cell is a link.

    Examples
    --------
    >>> masses = Table(name="mass", columns=("group", "mass (kg)"), rows=[("skin", 1 / 3)], total=("sum", 1 / 3))
    >>> masses.csv().splitlines()
    ['group,mass (kg)', 'skin,0.3333333333333333', 'sum,0.3333333333333333']
    >>> "0.33333" in masses.html()
    True
    """

    name: str
    columns: Sequence[str]
    rows: Sequence[Sequence[Any]]
    caption: str = ""
    total: Sequence[Any] = ()
    below: Sequence[Sequence[Any]] = ()
    forms: Mapping[str, str] = field(default_factory=dict)
    heat: Sequence[str] = ()
    marks: Sequence[str] = ()

    def html(self) -> Markup:
        """Return the table in a frame that scrolls sideways, with the link to its CSV file.

        Returns
        -------
        Markup
            With all texts escaped.
        """
        numeric = [_numeric([row[k] for row in self.rows]) for k in range(len(self.columns))]
        return part(
            "table.html",
            table=self,
            head=list(zip(self.columns, numeric, strict=True)),
            body=list(zip_longest([self._cells(row, numeric) for row in self.rows], self.marks)),
            foot=[self._cells(row, numeric) for row in self._foot],
            address=data_address(self.csv().encode(), "text/csv"),
        )

    def csv(self) -> str:
        """Return the table as text of a CSV file, numbers in full.

        Returns
        -------
        str
            Heading, rows, and the total where there is one.
        """
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        writer.writerow(map(csv_text, self.columns))
        writer.writerows([_plain(cell) for cell in row] for row in (*self.rows, *self._foot))
        return text.getvalue()

    @property
    def _foot(self) -> list[Sequence[Any]]:
        return [row for row in (self.total, *self.below) if row]

    def _cells(self, row: Sequence[Any], numeric: Sequence[bool]) -> list[dict]:
        return [
            {
                "text": written(cell, self.forms.get(name, ".5g")),
                "class": "n" if number else _class(name, str(cell)),
                "heat": round(cell) if name in self.heat and cell is not None and cell >= 0.5 else 0,
            }
            for cell, name, number in zip(row, self.columns, numeric, strict=True)
        ]


def _class(column: str, text: str) -> str:
    return "bad" if column.startswith("margin") and text.startswith("-") else CLASSES.get(text, "")


def written(cell: Any, form: str = ".5g") -> str:
    """Return a cell as text: numbers in a format, nothing for None and NaN.

    Examples
    --------
    >>> written(0.123456789), written(float("nan")), written(12), written("skin"), written(True)
    ('0.12346', '', '12', 'skin', 'yes')
    """
    if cell is None or (isinstance(cell, (float, np.floating)) and np.isnan(cell)):
        return ""
    if isinstance(cell, (bool, np.bool_)):
        return "yes" if cell else "no"
    if not isinstance(cell, (float, np.floating)):
        return str(cell)
    return number(float(cell), int(form[1:-1])) if form.endswith("g") else raised(format(float(cell), form))


def _plain(cell: Any) -> str:
    """Return a cell of the CSV file; `repr` of a float has all its digits."""
    number = isinstance(cell, (float, np.floating)) and not np.isnan(cell)
    return repr(float(cell)) if number else csv_text(written(cell))


def _numeric(cells: Sequence[Any]) -> bool:
    """Whether a column has numbers, and nothing else but empty cells."""
    known = [cell for cell in cells if cell not in (None, "")]
    return bool(known) and all(
        isinstance(cell, (int, float, np.number)) and not isinstance(cell, bool) for cell in known
    )


def data_address(data: bytes, kind: str) -> str:
    """Return a data address, by which a page holds a file.

    Examples
    --------
    >>> data_address(b"a,b", "text/csv")
    'data:text/csv;base64,YSxi'
    """
    return f"data:{kind};base64,{base64.b64encode(data).decode()}"


def part(file: str, folder: str = "body_page", /, **values: Any) -> Markup:
    """Return a template from a folder of the reports, filled in; every text is escaped."""
    return Markup(_templates().get_template(f"{folder}/{file}").render(**values))


def texts(*names: str) -> Markup:
    """Return files of the reports, such as styles and scripts, one after the other."""
    return Markup("".join(files("modalprep.report").joinpath(name).read_text(encoding="utf-8") for name in names))


@cache
def _templates() -> Environment:
    from jinja2 import Environment, PackageLoader, StrictUndefined

    loader = PackageLoader("modalprep.report", ".")
    found = Environment(loader=loader, autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    found.filters |= {"engineering": raised, "cell": written}
    return found
