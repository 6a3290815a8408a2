"""What an examination finds: a level, what was looked at, what it is, and what to do."""

from collections.abc import Iterable, Iterator
from typing import NamedTuple

OK, LOOK, WRONG = "ok", "look", "wrong"


class Finding(NamedTuple):
    """One line. level: OK, LOOK (may be meant so) or WRONG (a run will fail); remedy: what to do, "" if all is well."""

    level: str
    what: str
    found: str
    remedy: str = ""


def lines(findings: Iterable[Finding]) -> Iterator[str]:
    """Yields each finding as a line of text."""
    for level, what, found, remedy in findings:
        yield f"{level:5}  {what:12}  {found}" + (f": {remedy}" if remedy else "")


def any_wrong(findings: Iterable[Finding]) -> bool:
    """Whether a run will fail."""
    return any(finding.level == WRONG for finding in findings)
