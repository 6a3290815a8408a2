"""A search for a factor of safety that ends with its parent process: `python -m colluvium.ensemble.search SCENE --out DIR`."""

import argparse
import os
import signal
import sys
import threading
from collections.abc import Sequence

from colluvium.running.searches import NAME
from colluvium.safety import command as safety
from coupler_protocol import exits
from coupler_protocol.process import command_line


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    threading.Thread(target=_end_with_parent, name="tether", daemon=True).start()
    parser = argparse.ArgumentParser(prog=NAME)
    safety.add_command(parser.add_subparsers(required=True))
    options = parser.parse_args(["fos", *(sys.argv[1:] if argv is None else argv)])
    codes: list[int] = []
    ended = command_line.exit_code_of(NAME, lambda: codes.append(options.work(options)))
    return ended or next(iter(codes), exits.DONE)


def _end_with_parent() -> None:
    """Stops the search as Ctrl-C does once standard input closes."""
    while os.read(0, 4096):
        pass
    os.kill(os.getpid(), signal.SIGINT)


if __name__ == "__main__":
    sys.exit(main())
