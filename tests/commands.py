"""Our programs as a user starts them: in this process, or a module or a script in a process of its own."""

import io
import signal
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

from colluvium import cli
from coupler_protocol import exits
from coupler_protocol.compiled import threads

ROOT = Path(__file__).resolve().parent.parent


def command(module, *words):
    """Command line of one of our programs."""
    return [sys.executable, "-m", module, *map(str, words)]


def finished(words, **options):
    """The process of a command line once it has ended, its output as text; killed after 300 s where nothing else is said."""
    return subprocess.run([*map(str, words)], capture_output=True, text=True, **{"timeout": 300, **options})


def run_colluvium(*words, **options):
    """`colluvium WORDS` once it has ended, in this process; with options of subprocess.run in a process of its own.

    Either way the servers of a run are processes, unless the words contain --in-process.
    """
    if options:
        return finished(command("colluvium.cli", *words), **options)
    words, out, errors = [*map(str, words)], io.StringIO(), io.StringIO()
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)}
    size = threads.size()
    try:
        with redirect_stdout(out), redirect_stderr(errors):
            code = cli.main(words)
    except SystemExit as end:  # of argparse
        code = end.code or 0
    finally:
        threads.set_size(size)
        for number, handler in handlers.items():
            signal.signal(number, handler)
    if code == exits.INTERRUPTED:
        raise KeyboardInterrupt  # it was meant for the tests
    return subprocess.CompletedProcess(["colluvium", *words], code, out.getvalue(), errors.getvalue())


def run_script(name, *words, **options):
    """The process of `python scripts/NAME WORDS` once it has ended."""
    return finished([sys.executable, ROOT / "scripts" / name, *words], **options)
