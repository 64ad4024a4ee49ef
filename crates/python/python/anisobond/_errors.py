"""Exceptions, with the texts of the command line."""


class Error(ValueError):
    """Wrong input: one sentence with place, problem and remedy."""


class FileError(Error, OSError):
    """A file could not be read or written."""


class NotExact(Error):
    """`require_exact` was asked and not reached; `calibration` has what was."""


class Interrupted(KeyboardInterrupt):
    """The user asked to stop. What was finished is kept; the text says where, and how to go on."""
