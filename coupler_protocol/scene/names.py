"""Names that a scene gives. Those of stages, windows, walls and boundaries become names of files, groups and histories."""

import re
from typing import Annotated

from pydantic import AfterValidator, Field

BYTES = 64  # of a name, in UTF-8: as many as a frame has for the name of its stage
_STRANGE = re.compile(r"[^\w .+-]")


def _name(value: str) -> str:
    """A name that fits into names of files, groups and histories."""
    strange = _STRANGE.search(value)
    if strange:
        raise ValueError(f"a name has letters, digits, spaces and . + - _, but no {strange[0]!r}")
    if not re.search(r"\w", value) or value != value.strip():
        raise ValueError("a name has a letter or a digit, and does not begin or end with a space")
    return _short(value)


def _label(value: str) -> str:
    """A name that is only shown."""
    if not value.isprintable() or not value.strip():
        raise ValueError("a name has visible characters only")
    return _short(value)


def _short(value: str) -> str:
    size = len(value.encode())
    if size > BYTES:
        raise ValueError(f"a name has at most {BYTES} bytes in UTF-8, this one has {size}")
    return value


def _text(value: str) -> str:
    if "\0" in value:
        raise ValueError("files of results cannot hold a zero byte")
    if any("\ud800" <= letter <= "\udfff" for letter in value):
        raise ValueError("files of results cannot hold half of a character (a surrogate)")
    return value


Name = Annotated[str, AfterValidator(_name)]
Label = Annotated[str, AfterValidator(_label)]
Title = Annotated[str, AfterValidator(_text)]
Hash = Annotated[str, Field(pattern=r"^[0-9a-f]{64}$")]


def hash_meaning(key: str) -> str:
    """Meaning of the key with the hash of the file that `key` names."""
    return f"BLAKE2b hash of the contents of `{key}`, written into scene.json; none: any contents"
