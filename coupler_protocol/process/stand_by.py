"""Start of a server before its launcher knows the arguments: it loads its modules, then reads the arguments.

Modules and the class of scenes take most of the time until a server has read its scene, and the launcher takes as long to read
and check the same scene. `--stand-by` in place of all arguments makes a server do this work meanwhile. Its launcher then writes
the arguments to its standard input as one line of JSON, or closes it if nothing is to be computed.
"""

import json
import os
from collections.abc import Sequence
from contextlib import suppress
from importlib import import_module

OPTION = "--stand-by"


def prepare(modules: Sequence[str]) -> None:
    """Loads modules and the class of scenes; a failure is left to the run, which needs them too and says what is missing."""
    with suppress(Exception):
        for name in modules:
            import_module(name)
        from coupler_protocol.scene.scene import scene_class

        scene_class()


def arguments() -> list[str] | None:
    """The arguments on standard input; None if it was closed before they were there."""
    line = bytearray()
    while not line.endswith(b"\n"):
        part = os.read(0, 65536)  # the launcher writes nothing after this line
        if not part:
            return None
        line += part
    found: list[str] = json.loads(line)
    return found


def as_line(words: Sequence[str]) -> str:
    """What a launcher writes for these arguments."""
    return json.dumps(list(words)) + "\n"
