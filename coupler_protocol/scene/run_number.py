"""Number of a run: the same on both sides, in all their files and lines of logs, and after the run was continued.

The continuum draws it at the first start and gives it to the discs in WELCOME; checkpoints keep it. A run that branches off
another one (`--from` into another folder) gets a new one. It is not a secret, unlike the session of a conversation.
"""

import secrets

BITS = 48
UNKNOWN = "-"  # text before the number is known


def new() -> int:
    """A new number, not 0."""
    return secrets.randbits(BITS) or 1


def as_text(number: int) -> str:
    """Text of a number: 12 hexadecimal digits."""
    return f"{number:0{BITS // 4}x}"
