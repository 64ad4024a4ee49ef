"""Results as HTML for notebooks: what is one number or text in a table, matrices as tables, the rest to be unfolded."""

from __future__ import annotations

import html
from typing import Any

#: Units of stress, largest first.
_UNITS = [(1e12, "TPa"), (1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa")]

#: Items of a list of numbers that are shown.
_SHOWN = 12


def report(kind: str, summary: str, numbers: Any) -> str:
    """A result: its kind and summary, then its numbers."""
    head = f"<p><strong>{html.escape(kind)}</strong> of {html.escape(summary)}</p>"
    return f'<div class="anisobond">{head}{_of(numbers)}</div>'


def _of(value: Any) -> str:
    if isinstance(value, dict):
        return _dictionary(value)
    if isinstance(value, list):
        return _list(value)
    return html.escape(_text(value))


def _dictionary(value: dict[str, Any]) -> str:
    plain, folded = "", ""
    for key, item in value.items():
        name = html.escape(key.replace("_", " "))
        if isinstance(item, (dict, list)) and not _brief(item):
            open_ = " open" if _matrix(item) else ""
            folded += f"<details{open_}><summary>{name}</summary>{_of(item)}</details>"
        elif item not in (None, ""):
            plain += f"<tr><th style='text-align:left'>{name}</th><td style='text-align:left'>{_of(item)}</td></tr>"
    return (f"<table>{plain}</table>" if plain else "") + folded


def _list(value: list[Any]) -> str:
    if _matrix(value):
        return _matrix_table(value)
    if value and all(isinstance(item, dict) for item in value):
        return "".join(f"<details><summary>{i + 1}</summary>{_dictionary(item)}</details>" for i, item in enumerate(value))
    if any(isinstance(item, (list, dict)) for item in value):
        return "<br>".join(_of(item) for item in value)
    more = ", …" if len(value) > _SHOWN else ""
    return html.escape(", ".join(_text(item) for item in value[:_SHOWN])) + more


def _brief(value: Any) -> bool:
    """Whether a value fits into one cell."""
    return isinstance(value, list) and len(value) <= _SHOWN and not any(isinstance(item, (list, dict)) for item in value)


def _matrix(value: Any) -> bool:
    """Whether a value is a 6×6 or 3×3 matrix of numbers."""
    size = len(value) if isinstance(value, list) else 0
    return size in (3, 6) and all(
        isinstance(row, list) and len(row) == size and all(isinstance(x, (int, float)) for x in row) for row in value
    )


def _matrix_table(rows: list[list[float]]) -> str:
    """A matrix in the unit of stress that suits its largest component, its entries shaded by size."""
    largest = max(abs(x) for row in rows for x in row)
    unit, name = next(((size, name) for size, name in _UNITS if largest >= size), (1.0, ""))

    def cell(x: float) -> str:
        share = abs(x) / largest if largest else 0.0
        hue = "68, 1, 84" if x < 0 else "33, 145, 140"
        text = "0" if abs(x) < 5e-10 * largest else f"{x / unit:.5g}"
        style = f"background:rgba({hue},{0.5 * share:.3f});text-align:right;min-width:4em"
        return f'<td style="{style}">{text}</td>'

    body = "".join(f"<tr>{''.join(cell(x) for x in row)}</tr>" for row in rows)
    caption = f"<caption>{name}</caption>" if name else ""
    return f"<table>{caption}{body}</table>"


def _text(value: Any) -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.6g}" if isinstance(value, float) else str(value)
