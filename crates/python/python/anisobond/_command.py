"""The command `anisobond`."""

import signal
import sys


def main() -> None:
    """Run the command line of this process."""
    from ._native import command_line

    # As in a program of its own: Ctrl-C ends it, unless the command keeps what it has finished and takes over.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    words = ["anisobond", *sys.argv[1:]]
    sys.exit(command_line(words))
