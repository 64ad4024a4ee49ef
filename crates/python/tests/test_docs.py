"""What the documents show works: docstrings, the README, docs/python.md, the notebooks."""

import doctest
import inspect
import json
import os
import re
import time

import pytest

import anisobond as ab
from anisobond import _html, _interop, _native, _progress, _table

import conftest

NOTEBOOKS = sorted((conftest.REPOSITORY / "docs/notebooks").glob("*.ipynb"))


def docstrings():
    """Every docstring of the package, by the name of what it describes."""
    modules = [ab, _native, _table, _html, _interop, _progress]
    for module in modules:
        yield module.__name__, module.__doc__
        for name, thing in vars(module).items():
            if inspect.isclass(thing) or inspect.isroutine(thing):
                yield f"{module.__name__}.{name}", thing.__doc__
            if inspect.isclass(thing):
                for member, value in vars(thing).items():
                    yield f"{module.__name__}.{name}.{member}", getattr(value, "__doc__", None)


def test_docstrings():
    parser, runner, seen = doctest.DocTestParser(), doctest.DocTestRunner(optionflags=doctest.NORMALIZE_WHITESPACE), set()
    for name, text in docstrings():
        if text and ">>>" in text and text not in seen:
            seen.add(text)
            runner.run(parser.get_doctest(text, {**vars(ab), "numpy": _table.numpy}, name, None, None))
    assert len(seen) >= 15 and runner.summarize().failed == 0


def blocks(path):
    """The Python blocks of a Markdown file, as one program whose lines are those of the file."""
    text = path.read_text()
    program, inside = [], False
    for line in text.splitlines():
        fence = re.match(r"```(\w*)", line)
        program.append("" if fence or not inside else line)
        if fence:
            inside = not inside and fence[1] == "python"
    assert any(program), path
    return "\n".join(program)


@pytest.mark.parametrize("name", ["README.md", "docs/python.md", "crates/python/README.md"])
def test_documents(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    os.symlink(conftest.REPOSITORY / "cases", "cases")
    path = conftest.REPOSITORY / name
    exec(compile(blocks(path), str(path), "exec"), {"__name__": "__main__"})


PACKING = conftest.REPOSITORY.parent / "shared/data/woo-packing-2556.txt"


@pytest.mark.parametrize("packing", [None, PACKING], ids=["", "its-packing"])
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks(path, packing, monkeypatch):
    if packing and "ANISOBOND_PACKING" not in path.read_text():
        pytest.skip("it takes no packing")
    if packing and not packing.exists():
        pytest.skip(f"{packing} is not here")
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    from matplotlib import pyplot

    # As Jupyter does, from the notebook's folder; the last value of a cell is shown.
    monkeypatch.chdir(path.parent)
    monkeypatch.delenv("ANISOBOND_PACKING", raising=False)
    if packing:
        monkeypatch.setenv("ANISOBOND_PACKING", str(packing))
    drawn, begun = 0, time.monotonic()

    def show():
        nonlocal drawn
        for number in pyplot.get_fignums():
            pyplot.figure(number).canvas.draw()
            drawn += 1
        pyplot.close("all")

    monkeypatch.setattr(pyplot, "show", show)
    names = {"__name__": "__main__"}
    for number, cell in enumerate(json.loads(path.read_text())["cells"], 1):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{path.name}, cell {number}", "exec"), names)
    assert drawn >= 3
    print(f"{path.name}: {drawn} figures, {time.monotonic() - begun:.0f} s")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_notebooks_hold_their_figures(path):
    """For those who only look: `verification/notebooks.py` keeps what the cells draw."""
    for number, cell in enumerate(json.loads(path.read_text())["cells"], 1):
        if "plt.show()" in "".join(cell["source"]) and cell["cell_type"] == "code" and "def " not in "".join(cell["source"]):
            assert any("image/png" in o.get("data", {}) for o in cell["outputs"]), f"{path.name}, cell {number}"
