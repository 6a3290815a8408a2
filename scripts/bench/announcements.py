"""What a benchmark does at the moment, on standard error, with the seconds since its start."""

import sys
import time
from contextlib import contextmanager

from numba.core import event


class Compilations(event.Listener):
    """Announces every kernel that is compiled; a kernel that another one calls is part of that one."""

    def __init__(self, say):
        self.say, self.depth = say, 0

    def on_start(self, compilation):
        """Called before a function is compiled."""
        if not self.depth:
            self.say(f"compiling {compilation.data['dispatcher'].py_func.__name__}")
        self.depth += 1

    def on_end(self, compilation):
        """Called after a function was compiled."""
        self.depth -= 1


@contextmanager
def announcements():
    """Gives `say`, which prints a text; while this lasts, compilations are printed as well."""
    begin = time.perf_counter()

    def say(text):
        print(f"{time.perf_counter() - begin:7.1f} s  {text}", file=sys.stderr, flush=True)

    with event.install_listener("numba:compile", Compilations(say)):
        yield say
