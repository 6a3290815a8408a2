"""Problems of a scene: all at once, each with its place, reason and remedy."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

IN_A_MESSAGE = re.compile(r"[:;] ((?:use|give|leave) .*)$")  # remedy at the end of a validator's message
KeyPath = tuple[Any, ...]  # names of tables and keys, numbers of list items


@dataclass(frozen=True)
class Problem:
    """One problem of a scene."""

    file: str
    line: int | None
    key: str
    reason: str
    remedy: str = ""

    def __str__(self) -> str:
        place = f"{self.file}:{self.line}" if self.line else self.file
        text = f"{place}: {self.key}: {self.reason}" if self.key else f"{place}: {self.reason}"
        return f"{text}\n    {self.remedy}" if self.remedy else text


def dotted(path: KeyPath) -> str:
    """A path of keys and numbers as in a scene: material[0].density."""
    text = ""
    for part in path:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else str(part)
    return text


def reason_and_remedy(message: str, remedy: str = "") -> tuple[str, str]:
    """Reason and remedy of a validator's message, which ends with its remedy; `remedy` if it does not."""
    said = IN_A_MESSAGE.search(message)
    return (message[: said.start()], said[1]) if said else (message, remedy)


def unfit(key: str, reason: str, remedy: str) -> "SceneError":
    """SceneError for a problem that is found only when the scene is built."""
    return SceneError([Problem("scene", None, key, reason, remedy)])


Finding = tuple[tuple[str | int, ...], str, str]  # of a rule: path of the key, problem, remedy


class SceneError(ValueError):
    """A scene that cannot be computed; `problems` lists all problems in the order of the file."""

    def __init__(self, problems: Sequence[Problem]) -> None:
        self.problems = sorted(problems, key=lambda p: (p.line or 0, p.key))
        count = len(self.problems)
        head = f"{count} problem{'s' if count > 1 else ''} in the scene"
        super().__init__("\n".join([head, *map(str, self.problems)]))
