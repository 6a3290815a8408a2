"""Materials of discs that a scene uses: `discs.stone` may wait for a scene with stones, and then acts on nothing."""

from typing import Any


def discs_used(scene: Any) -> Any:
    """The table of discs; without its material of stones where neither [stones] nor a file of discs alone has stones."""
    discs = scene.discs
    if discs.stone is None or scene.stones is not None or (scene.grid is None and discs.file is not None):
        return discs
    return discs.model_copy(update={"stone": None})
