"""A table of named columns: what pandas and pyarrow take, and what a notebook shows."""

from __future__ import annotations

import csv
import html
import io
from typing import Any, Iterable, Iterator, Mapping

import numpy

from ._errors import Error

#: Rows that are shown.
_SHOWN = 10


class Table:
    """Columns of equal length by name: NumPy arrays, or lists of texts.

    >>> t = Table("squares", {"x": [1, 2, 3], "y": numpy.array([1.0, 4.0, 9.0])})
    >>> len(t), t.columns, float(t["y"].sum())
    (3, ['x', 'y'], 14.0)
    """

    def __init__(self, title: str, columns: Mapping[str, Any]):
        self.title = title
        self._columns = dict(columns)
        lengths = {len(column) for column in self._columns.values()}
        if len(lengths) > 1:
            raise Error(f"the columns have {sorted(lengths)} rows; give columns of equal length")

    @classmethod
    def from_csv(cls, title: str, text: str) -> Table:
        """From the text of a CSV file of numbers with a heading, as probes.csv; empty cells are NaN."""
        rows = list(csv.reader(io.StringIO(text)))
        if not rows:
            return cls(title, {})
        names, rows = rows[0], rows[1:]
        return cls(title, {name: _column([row[k] for row in rows]) for k, name in enumerate(names)})

    @classmethod
    def from_records(cls, title: str, records: Iterable[Mapping[str, Any]]) -> Table:
        """From dictionaries of equal keys."""
        records = list(records)
        names = list(dict.fromkeys(key for record in records for key in record))
        return cls(title, {name: [record.get(name) for record in records] for name in names})

    @property
    def columns(self) -> list[str]:
        """Names of the columns."""
        return list(self._columns)

    def __getitem__(self, name: str) -> Any:
        try:
            return self._columns[name]
        except KeyError:
            import difflib

            near = difflib.get_close_matches(str(name), self.columns, n=1)
            remedy = f"did you mean {near[0]}?" if near else f"the columns are {', '.join(self.columns)}"
            # A KeyError prints the representation of its text; ours is one sentence.
            raise Error(f"there is no column {name}; {remedy}") from None

    def __contains__(self, name: object) -> bool:
        return name in self._columns

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(next(iter(self._columns.values()), ()))

    def to_dict(self) -> dict[str, list[Any]]:
        """The columns by name as lists, which JSON can hold: NaN is None."""
        return {name: [_plain(value) for value in column] for name, column in self._columns.items()}

    def to_pandas(self) -> Any:
        """As a pandas DataFrame."""
        try:
            import pandas
        except ImportError as error:
            raise ImportError("to_pandas needs pandas; pip install pandas") from error
        return pandas.DataFrame(self._columns)

    def to_arrow(self) -> Any:
        """As a pyarrow Table."""
        try:
            import pyarrow
        except ImportError as error:
            raise ImportError("to_arrow needs pyarrow; pip install pyarrow") from error
        return pyarrow.table(self._columns)

    def __repr__(self) -> str:
        return f"<Table of {self.title}: {len(self)} rows, columns {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        def cells(tag: str, values: Iterable[Any]) -> str:
            styled = zip(styles, values)
            return "".join(f'<{tag} style="{style}">{html.escape(_shown(value))}</{tag}>' for style, value in styled)

        styles = [_style(column) for column in self._columns.values()]
        shown = range(min(len(self), _SHOWN))
        body = "".join(f"<tr>{cells('td', (c[i] for c in self._columns.values()))}</tr>" for i in shown)
        more = f"<p>{len(self)} rows, the first {_SHOWN} shown</p>" if len(self) > _SHOWN else f"<p>{len(self)} rows</p>"
        head = f"<caption>{html.escape(self.title)}</caption><tr>{cells('th', self.columns)}</tr>"
        return f"<table>{head}{body}</table>{more}"


def _column(texts: list[str]) -> Any:
    """Numbers as an array; where one cell is none, all as they are."""
    try:
        return numpy.array([float(text) if text else numpy.nan for text in texts])
    except ValueError:
        return texts


def _plain(value: Any) -> Any:
    """A value of a column as JSON has it."""
    if isinstance(value, numpy.generic):
        value = value.item()
    return None if isinstance(value, float) and value != value else value


def _style(column: Any) -> str:
    """Numbers to the right, texts and truths to the left."""
    values = numpy.asarray(column) if len(column) else numpy.zeros(0)
    return f"text-align:{'right' if values.dtype.kind in 'iuf' else 'left'};padding:0.1em 0.7em"


def _shown(value: Any) -> str:
    """A value in a cell: six digits of numbers that are not whole."""
    if isinstance(value, (float, numpy.floating)):
        return "" if value != value else f"{value:.6g}"
    return "" if value is None else str(value)
