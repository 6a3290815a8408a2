"""Scenes that once gave wrong results without a message.

*Joint* (`tests/hard/joint.toml`): a disc on the joint of two pieces of a floor had two contacts; its restitution was 0.469. *Far
away*: `tests/hard/box.toml` at UTM coordinates must have the bits of the same box at the origin. *Soft ground*: the slope of
`tests/hard/near_failure.toml` with moduli a hundred and two hundred times smaller: no factor depends on stiffness, but elastic
settlement was taken for a failure (1.066 and 0.997 instead of 1.072 of a similar slope). *Sand layer*
(`tests/hard/sand_layer.toml`): flow at constant speed with a ratio of 1e-8 was no verdict. *Empty window*: discs that are near
nothing ended the run with a fault of the program."""

import tempfile
from pathlib import Path

from coupler_protocol.process.progress import Progress
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.reader import read_scene
from fdm_server.fos.ground import settle
from fdm_server.fos.study import Study
from fdm_server.fos.trial import run_trial
from fdm_server.fos.verdict import FAILS, RESTS
from verification.coupling.bits import differing
from verification.discrete import scenes
from verification.hard.near_failure import OWN, NeverStops
from verification.hard.runs import ended
from verification.hard.watched import SCENES, scene_of
from verification.verdict_rows import row

NAME = "wrong once"
UTM = (412345.0, 5300000.0)


def restitution():
    """Speed after the impact over that before it."""
    with scenes.of_tables(scene_of("joint")) as run:
        return float(run.discs(-1).velocity[0, 1]) / 0.1


def moved_away():
    """Number of arrays of the last stage with other bits than at the origin."""
    tables = scene_of("box", couple={"steps": 50}, load={"steps": 50})
    with tempfile.TemporaryDirectory() as name:
        near, far = Path(name) / "near", Path(name) / "far"
        ended(tables, near)
        tables["grid"]["origin"] = UTM
        tables["window"][0]["polygon"] = [[x + UTM[0], y + UTM[1]] for x, y in tables["window"][0]["polygon"]]
        ended(tables, far)
        return differing(near, far, "load")


def factor(stiffness):
    """Factor of the slope, its moduli multiplied by `stiffness`."""
    scene = read_scene(OWN, [f"material.0.elastic.bulk={100e6 * stiffness}", f"material.0.elastic.shear={30e6 * stiffness}"])
    with tempfile.TemporaryDirectory() as folder:
        return Study(scene, folder, Progress(0, "none"), NeverStops()).run()["meshes"][0]["value"]


def rows(fast):
    """Seconds (fast: without soft ground)."""
    yield row("joint: restitution", restitution(), 0.57174, 1e-3, "closed form")
    yield row("far away: arrays unlike those at the origin", moved_away(), 0.0, 0.0, "identity")
    if not fast:
        stiff = factor(1.0)
        for share in (1e-2, 5e-3):
            name = f"soft ground, moduli times {share:g}: factor over that of stiff ground"
            yield row(name, factor(share) / stiff, 1.0, 0.004, "dimensions")
    scene = local(read_scene(SCENES / "sand_layer.toml"))
    ground = settle(scene)
    for share, expected in ((1.2, RESTS), (1.225, FAILS)):
        trial = run_trial(scene, ground, share)
        yield row(f"sand layer at {share:g}: {expected}", trial.verdict == expected, 1.0, 0.0, "tan(30)/tan(25) = 1.238")
    yield row("sand layer at 1.225: last ratio over the first", trial.spans[-1].last_ratio / trial.spans[0].last_ratio, 0.0, 1e-4,
              "steady flow")  # fmt: skip
    with tempfile.TemporaryDirectory() as folder:
        found = ended(scene_of("fast_rim", fly={"steps": 20}), folder)
    yield row("empty window: exit code", found.code, 0.0, 0.0, "as asked for")
