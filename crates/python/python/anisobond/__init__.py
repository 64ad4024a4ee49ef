"""From an elastic stiffness tensor to the bonds of a discrete model.

>>> import anisobond as ab
>>> bonds = ab.calibrate("KIO3", horizon=3, spacing="2 mm")
>>> bonds.micromodulus.shape, round(100 * bonds.error, 4)
((122,), 3.1873)

SI units throughout; texts carry their own ("2 mm", "130 MPa"). Every result prints the words of the command line, has
`to_dict()` with its numbers, and `to_pandas()` and `to_arrow()`. The guide is docs/python.md.
"""

from ._errors import Error, FileError, Interrupted, MissingFileError, NotExact
from ._native import (
    Advice,
    Calibration,
    Case,
    Cavity,
    ElementTest,
    GridTest,
    Lattice,
    Neighbourhood,
    Packing,
    Report,
    Run,
    Stiffness,
    Sweep,
    __version__,
    advise,
    builtin_materials,
    calibrate,
    calibrate_table,
    element_test,
    export,
    fields,
    grid_test,
    lattice,
    open_run,
    rank,
    report,
    run,
    set_threads,
    sweep,
    verify,
)
from ._table import Table

__all__ = [
    "Advice",
    "Calibration",
    "Case",
    "Cavity",
    "ElementTest",
    "Error",
    "FileError",
    "GridTest",
    "Interrupted",
    "Lattice",
    "MissingFileError",
    "Neighbourhood",
    "NotExact",
    "Packing",
    "Report",
    "Run",
    "Stiffness",
    "Sweep",
    "Table",
    "advise",
    "builtin_materials",
    "calibrate",
    "calibrate_table",
    "element_test",
    "export",
    "fields",
    "grid_test",
    "lattice",
    "open_run",
    "rank",
    "report",
    "run",
    "set_threads",
    "sweep",
    "verify",
]
