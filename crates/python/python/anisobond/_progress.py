"""What may be given as `progress`, as one callable."""

from ._errors import Error


class _Callable:
    """A user's function of (done, total, message)."""

    def __init__(self, function):
        self._function = function

    def __call__(self, done, total, message):
        self._function(done, total, message)

    def close(self):
        """Nothing to close."""


class _Bar:
    """A bar of tqdm's protocol: `total`, `update`, `set_postfix_str`."""

    def __init__(self, bar, ours):
        self._bar, self._ours, self._done = bar, ours, 0

    def __call__(self, done, total, message):
        if total and self._bar.total != total:
            self._bar.total = total
        if message and hasattr(self._bar, "set_postfix_str"):
            self._bar.set_postfix_str(message, refresh=False)
        self._bar.update(done - self._done)
        self._done = done

    def close(self):
        """Close a bar that was made here; one that was given is its owner's."""
        if self._ours:
            self._bar.close()


def reporter(progress, title):
    """A callable (done, total, message) with `close`, or None for `progress` None or False.

    `progress` is True (tqdm where it is installed), a class of tqdm's protocol, such a bar, or a function.
    """
    if progress is None or progress is False:
        return None
    if progress is True:
        try:
            from tqdm.auto import tqdm as progress
        except ImportError as error:
            raise Error("progress=True needs tqdm; pip install tqdm, or give a function (done, total, message)") from error
    if isinstance(progress, type) and hasattr(progress, "update"):
        return _Bar(progress(total=None, desc=title, unit=""), ours=True)
    if hasattr(progress, "update") and hasattr(progress, "total"):
        return _Bar(progress, ours=False)
    if callable(progress):
        return _Callable(progress)
    raise Error("progress is neither True, a function (done, total, message), nor tqdm; leave it out, or give one of them")
