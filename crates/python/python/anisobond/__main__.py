"""`python -m anisobond` is the command `anisobond`."""

from ._command import main

if __name__ == "__main__":
    main()
