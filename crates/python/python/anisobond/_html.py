"""Results as HTML for notebooks: what is one number or text in a table, matrices as tables, the rest to be unfolded."""

from __future__ import annotations

import html
from typing import Any

#: Units of stress, largest first.
_UNITS = [(1e12, "TPa"), (1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa")]

#: Items of a list of numbers that are shown.
_SHOWN = 12


#: Units of numbers by the name of their key (SI). Others are without unit, or of none that their key alone tells.
_UNIT_OF = {
    **dict.fromkeys(
        ["norm", "kelvin_moduli", "bulk", "shear", "hill_young", "young", "pressure", "smallest_eigenvalue", "e1", "e2", "e3", "g23", "g13", "g12"]
        + ["ex", "ey", "ez", "gyz", "gzx", "gxy", "en_a", "en_b", "et_a", "et_b", "given", "dependent"],
        "Pa",
    ),
    **dict.fromkeys(["micromodulus", "tangential_micromodulus", "lower_bound"], "N/m⁶"),
    **dict.fromkeys(["smallest_normal", "largest_normal", "smallest_tangential", "largest_tangential"], "N/m"),
    **dict.fromkeys(["spacing", "radius", "length"], "m"),
    **dict.fromkeys(["kinetic", "strain_energy", "fracture_energy"], "J"),
    **dict.fromkeys(["speed", "largest_speed"], "m/s"),
    **dict.fromkeys(["seconds", "stable_step_s", "step_s", "expected_seconds"], "s"),
    "density": "kg/m³",
    "volume": "m³",
    "linear_compressibility": "1/Pa",
    "memory": "bytes",
}

#: Keys that say which of several numbers of the key above them.
_OF_ABOVE = {"min", "max", "mean", "least", "most", "value"}


def report(kind: str, summary: str, numbers: Any) -> str:
    """A result: its kind and summary, then its numbers."""
    head = f"<p><strong>{html.escape(kind)}</strong> of {html.escape(summary)}</p>"
    return f'<div class="anisobond">{head}{_of(numbers)}</div>'


def stiffness(name: str, facts: dict[str, Any], matrix: list[list[float]]) -> str:
    """A tensor: its matrix, and beside it what it comes to."""
    head = f"<p><strong>Stiffness</strong> of {html.escape(name)}</p>"
    beside = f'<div style="margin-left:2em">{_dictionary(facts)}</div>'
    both = f'<div style="display:flex;flex-wrap:wrap;align-items:flex-start">{_matrix_table(matrix)}{beside}</div>'
    return f'<div class="anisobond">{head}{both}</div>'


def _of(value: Any, unit: str = "", key: str = "") -> str:
    if isinstance(value, dict):
        return _dictionary(value, key)
    if isinstance(value, list):
        return _list(value, unit)
    return html.escape(_text(value, unit))


def _dictionary(value: dict[str, Any], above: str = "") -> str:
    plain, folded = "", ""
    for key, item in value.items():
        name, unit = html.escape(key.replace("_", " ")), _UNIT_OF.get(above if key in _OF_ABOVE else key, "")
        if item is None or (isinstance(item, (str, list, dict)) and not item):
            continue
        if isinstance(item, (dict, list)) and not _brief(item):
            open_ = " open" if _matrix(item) else ""
            deeper = above if key in _OF_ABOVE else key
            folded += f"<details{open_}><summary>{name}</summary>{_of(item, unit, deeper)}</details>"
        else:
            cell = f'<td style="text-align:left;padding:0.1em 0.7em">{_of(item, unit)}</td>'
            plain += f'<tr><th style="text-align:left">{name}</th>{cell}</tr>'
    return (f"<table>{plain}</table>" if plain else "") + folded


def _list(value: list[Any], unit: str = "") -> str:
    if _matrix(value):
        return _matrix_table(value)
    if value and all(isinstance(item, dict) for item in value):
        return "".join(f"<details><summary>{i + 1}</summary>{_dictionary(item)}</details>" for i, item in enumerate(value))
    if any(isinstance(item, (list, dict)) for item in value):
        return "<br>".join(_of(item) for item in value)
    more = ", …" if len(value) > _SHOWN else ""
    shown = value[:_SHOWN]
    if unit == "Pa" and shown:
        size, unit = _unit_of_stress(max(abs(x) for x in shown))
        shown = [x / size for x in shown]
    words = f"{', '.join(_text(item) for item in shown)}{more}"
    return html.escape(f"{words} {unit}".rstrip())


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
    unit, name = _unit_of_stress(largest)
    # A matrix without unit is of numbers of about one.
    name = name if unit > 1.0 else ""

    def cell(x: float) -> str:
        share = abs(x) / largest if largest else 0.0
        hue = "68, 1, 84" if x < 0 else "33, 145, 140"
        text = "0" if abs(x) < 5e-10 * largest else f"{x / unit:.5g}"
        style = f"background:rgba({hue},{0.5 * share:.3f});text-align:right;min-width:4em;padding:0.1em 0.5em"
        return f'<td style="{style}">{text}</td>'

    body = "".join(f"<tr>{''.join(cell(x) for x in row)}</tr>" for row in rows)
    caption = f"<caption>{name}</caption>" if name else ""
    return f"<table>{caption}{body}</table>"


def _unit_of_stress(largest: float) -> tuple[float, str]:
    """The unit (Pa) that suits a stress, and its name."""
    return next(((size, name) for size, name in _UNITS if largest >= size), (1.0, "Pa"))


def _text(value: Any, unit: str = "") -> str:
    if isinstance(value, bool):
        return "yes" if value else "no"
    if unit == "Pa" and isinstance(value, (int, float)):
        size, unit = _unit_of_stress(abs(value))
        value = value / size
    text = f"{value:.6g}" if isinstance(value, float) else str(value)
    return f"{text} {unit}".rstrip()
