"""Exceptions, with the texts of the command line."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ._native import Calibration


class Error(ValueError):
    """One sentence with place, problem and remedy; `kind` says what it is, for programs.

    Kinds: "input" (what was given is wrong), "diverged" (a motion left what its time step can follow), "not-converged" (a
    solver or search did not find what was asked), "mechanism" (something moves that nothing holds); of subclasses "file",
    "not-exact".
    """

    kind: str = "input"

    def __init__(self, text: str = "", kind: str | None = None):
        super().__init__(text)
        if kind is not None:
            self.kind = kind


class FileError(Error, OSError):
    """A file could not be read or written; `errno` and `filename` as of an `OSError`."""

    kind = "file"

    def __init__(self, text: str, errno: int | None = None, filename: str | os.PathLike[str] | None = None):
        super().__init__(text)
        self.errno, self.filename = errno, None if filename is None else os.fspath(filename)

    def __str__(self) -> str:
        return str(self.args[0])

    def __reduce__(self):
        return type(self), (self.args[0], self.errno, self.filename)


class MissingFileError(FileError, FileNotFoundError):
    """A file is not there."""


class NotExact(Error):
    """`require_exact` was asked and not reached; `calibration` has what was."""

    kind = "not-exact"
    calibration: Calibration


class Interrupted(KeyboardInterrupt):
    """The user asked to stop. What was finished is kept; the text says where, and how to go on."""

    kind = "interrupted"
