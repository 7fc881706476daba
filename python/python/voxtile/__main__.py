"""The command ``voxtile``, also as ``python -m voxtile``."""

import signal
import sys

from ._voxtile import run_command


def main() -> None:
    """Runs the command with the arguments of this process, and ends it with the command's exit code."""
    # Python's handler only notes the signal, for an interpreter that does not run meanwhile.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    run_command(["voxtile", *sys.argv[1:]])


if __name__ == "__main__":
    main()
