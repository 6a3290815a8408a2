"""Our programs as a user starts them: a module or a script in a process of its own."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def command(module, *words):
    """Command line of one of our programs."""
    return [sys.executable, "-m", module, *map(str, words)]


def finished(words, **options):
    """The process of a command line once it has ended, its output as text; killed after 300 s where nothing else is said."""
    return subprocess.run([*map(str, words)], capture_output=True, text=True, **{"timeout": 300, **options})


def run_colluvium(*words, **options):
    """The process of `colluvium WORDS` once it has ended."""
    return finished(command("colluvium.cli", *words), **options)


def run_script(name, *words, **options):
    """The process of `python scripts/NAME WORDS` once it has ended."""
    return finished([sys.executable, ROOT / "scripts" / name, *words], **options)
