#!/usr/bin/env python3
"""Runs the notebooks of docs/notebooks and keeps what they print and draw in them. Needs the package with what its notebooks use:
pip install ./crates/python[notebooks,tables]; then python verification/notebooks.py."""

from pathlib import Path

import nbformat
from nbclient import NotebookClient

SETTINGS = "%matplotlib inline\nimport matplotlib\nmatplotlib.rcParams['figure.dpi'] = 60"

root = Path(__file__).resolve().parent.parent
for path in sorted((root / "docs/notebooks").glob("*.ipynb")):
    notebook = nbformat.read(path, as_version=4)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(SETTINGS))
    NotebookClient(notebook, timeout=600, kernel_name="python3", resources={"metadata": {"path": path.parent}}).execute()
    del notebook.cells[0]
    # What differs from run to run says nothing.
    notebook.metadata.pop("language_info", None)
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        if cell.cell_type == "code":
            cell.execution_count = None
            for output in cell.outputs:
                if "execution_count" in output:
                    output.execution_count = None
                if "metadata" in output:
                    output.metadata.clear()
    nbformat.write(notebook, path)
    print(path.relative_to(root), len(notebook.cells), "cells")
