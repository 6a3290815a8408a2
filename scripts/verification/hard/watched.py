"""Scenes computed with an eye on every step's energies and speeds."""

from pathlib import Path
from typing import NamedTuple

import numpy as np

from coupler_protocol.process.plugin import from_functions
from coupler_protocol.scene.reader import read_scene
from dem_server.observe import energy
from verification.discrete import scenes

SCENES = Path(__file__).resolve().parents[3] / "tests" / "hard"


class Watch(NamedTuple):
    """What was seen after every so many steps: stage, kinetic and stored energy [J], largest speed; all finite?"""

    stage: list
    kinetic: list
    stored: list
    speed: list

    def of(self, stage):
        """Arrays kinetic, stored, speed of one stage."""
        own = [i for i, name in enumerate(self.stage) if name == stage]
        return (np.array(column)[own] for column in self[1:])

    @property
    def finite(self):
        """Whether every number was one."""
        return bool(np.isfinite(np.array(self[1:])).all())


def look(watch, moment):
    """Note the energies and the largest speed."""
    model, state = moment.model, moment.state
    watch.stage.append(moment.stage)
    watch.kinetic.append(energy.kinetic(model, state))
    watch.stored.append(energy.stored(model, state))
    watch.speed.append(float(np.hypot(*state.v.T).max()))


def computed(scene, every=10, on_stage=None):
    """Watch and rows of run.json by stage of a scene's tables; on_stage(moment): what happens at the end of a stage."""
    watch = Watch([], [], [], [])

    def end(moment):
        if on_stage is not None:
            on_stage(moment)
        look(watch, moment)

    with scenes.of_tables(scene, from_functions(end, (every, lambda moment: look(watch, moment)))) as run:
        return watch, run.info["stages"]


def scene_of(name, **until):
    """Tables of a scene in tests/hard; until: new ends of stages by name."""
    tables = read_scene(SCENES / f"{name}.toml").model_dump(mode="json", exclude_none=True)
    for stage in tables["stage"]:
        if stage["name"] in until:
            stage["until"] = until[stage["name"]]
    return tables
