"""Slopes at 0.99 and 1.01 of the mesh's own factor of safety.

`tests/hard/near_failure.toml`, searched as by `colluvium fos`: the middle F of the final bracket is the factor of the mesh. Two
trials follow: with the strength divided by 0.99 F the slope must rest, with 1.01 F it must fail, each by a verdict (not
"undecided") within the budget of steps that fos.json declares. The full form adds finer zones, psi = 0, and a slope of 2:1."""

import tempfile

from coupler_protocol.process.progress import Progress
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.reader import read_scene
from fdm_server.fos.ground import settle
from fdm_server.fos.study import Study
from fdm_server.fos.trial import run_trial
from fdm_server.fos.verdict import FAILS, RESTS
from verification.continuum.slopes import CONFIGS
from verification.hard.watched import SCENES
from verification.verdict_rows import row

NAME = "near failure"
OWN, LANE = SCENES / "near_failure.toml", CONFIGS / "griffiths_lane.toml"
SLOPES = {  # name: (file, changes)
    "45 degrees, zones of H/8": (OWN, []),
    "45 degrees, zones of H/12": (OWN, [f"grid.zone_size={10 / 12}", "fos.bracket=[1.0, 1.06]"]),
    "45 degrees, zones of H/8, psi = 0": (OWN, ['fos.flow="zero"', "fos.bracket=[0.9, 1.08]"]),
    "2:1, zones of H/10": (LANE, ["fos.zone_sizes=[1.0]", "fos.resolution=0.004"]),
}


class NeverStops:
    """A StopRequest that nobody asks."""

    def check(self):
        """Does nothing."""


def rows(fast):
    """Four searches (fast: one)."""
    for name, (file, changes) in list(SLOPES.items())[: 1 if fast else None]:
        scene = local(read_scene(file, changes))
        with tempfile.TemporaryDirectory() as folder:
            mesh = Study(scene, folder, Progress(0, "none"), NeverStops()).run()["meshes"][0]
        factor, ground = mesh["value"], settle(scene)
        for share, expected in ((0.99, RESTS), (1.01, FAILS)):
            trial = run_trial(scene, ground, share * factor)
            what = f"{name}, factor {factor:.4g}: at {share:g} of it {expected}"
            yield row(f"{what}, after {trial.steps} steps", trial.verdict == expected, 1.0, 0.0, "as asked for")
            yield row(f"{what}: steps over the budget", trial.steps / ground.budget, 1.0, [-1.0, 0.0], "as declared")
