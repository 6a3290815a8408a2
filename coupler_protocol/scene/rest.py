"""Stages that should end at rest, and what is said where one of them ends by its steps or its time in motion.

A static stage should end at rest if

- `until` has a ratio, which is then the limit; or
- its kind brings ground or discs to rest (`rests` in stage_kinds.py), `until` expects no failure (displacement, band), and
  nothing is moved on purpose: no side, no wall, nothing by a function of the user (docs/plugins.md). The limit is then LIMIT.

All others may end in motion: overload until the slope fails, a stage that locates the band, loading at a given velocity, stages
in real time.
"""

from collections.abc import Mapping
from typing import Any

from coupler_protocol.scene.schedule import acting_boundaries
from coupler_protocol.scene.stage_kinds import of

LIMIT = 1e-3  # unbalanced force ratio of a stage that should rest, if `until` has none
NAME = "not at rest"  # of the warning in run.json


def limit(scene: Any, index: int, driven: bool = False) -> float | None:
    """The unbalanced force ratio that the stage with this number should end with, or None for a stage that may end in motion.

    driven: whether a function of the user acts between steps.
    """
    stage, until = scene.stage[index], scene.stage[index].until
    if stage.in_real_time or until is None:
        return None
    if until.ratio is not None:
        return until.ratio
    foreseen = until.displacement is not None or until.band is not None
    return None if driven or foreseen or not of(stage).rests or _moved(scene, index) else LIMIT


def _moved(scene: Any, index: int) -> bool:
    """Whether a side or a wall moves in the stage with this number."""
    sides = any(b.velocity is not None and (b.velocity.x or b.velocity.y) for b in acting_boundaries(scene, index))
    walls = {str(number): wall for number, wall in enumerate(scene.discs.wall, start=1)} if scene.discs else {}
    walls = {wall.name or number: wall for number, wall in walls.items()}
    for stage in scene.stage[: index + 1]:
        walls |= {wall.name: wall for wall in stage.wall}
    return sides or any(wall.moves for wall in walls.values())


def shortfall(scene: Any, index: int, ended_by: str, ratio: float, plugin: Any = None) -> str:
    """Text of the warning if a stage that ended by its steps or time should have ended below this `ratio`; else ""."""
    wanted = limit(scene, index, driven=plugin is not None and plugin.on_step is not None)
    if wanted is None or ratio <= wanted:
        return ""
    return (
        f"the stage ended after {ended_by} at a ratio of {ratio:.2g}, above {wanted:.2g}: it moves on, or fails. Give it more "
        "steps; if it should fail, end it by until.displacement or until.band"
    )


def unrested(info: Mapping[str, Any]) -> list[str]:
    """Names of the stages of a run.json that should have come to rest and did not."""
    return [warning["stage"] for warning in info.get("warnings") or () if warning["name"] == NAME]
