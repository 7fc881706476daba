"""The command ``voxtile``, also as ``python -m voxtile``."""

import signal
import sys

from ._voxtile import run_command


def main() -> None:
    """Runs the command with the arguments of this process and exits with its exit code."""
    # Python's handler would only set a flag for the interpreter, which does not run during the command.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    run_command(["voxtile", *sys.argv[1:]])


if __name__ == "__main__":
    main()
