"""Stones of a coupled window that become ten thousand times as stiff as the soil under the stress of the ground.

`tests/hard/stones_switched.toml`: the stones (bonded clusters) have the springs of the soil until the window carries the weight
of the ground above it. Then their springs are 1e4 times as stiff from one step to the next, gravity grows by a fifth, and both
codes continue in real time without damping. Contacts keep their forces by reference gaps; the mass rule of the rim and the
masses of the discs follow the new springs."""

import tempfile

import numpy as np

from dem_server.observe import energy
from verification.hard.runs import ended
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "stones switched on"
RADIUS = 0.06  # [m]


class Seen:
    """What the sides show after every tenth step, by stage."""

    def __init__(self):
        self.energy, self.ring, self.moved, self.finite = {}, {}, {}, True

    def __call__(self, moment):
        """Note of the discs energies, the forces on the ring and the positions."""
        state, stage = moment.state, moment.stage
        self.finite &= bool(np.isfinite(state.v if moment.rank else state.velocity).all())
        if moment.rank:
            self.energy.setdefault(stage, []).append([energy.kinetic(moment.model, state), energy.stored(moment.model, state)])
            forces = state.force[: moment.model.ring].copy()
            self.ring.setdefault(stage, [forces])[1:] = [forces]
            self.moved.setdefault(stage, [state.x.copy()])[1:] = [state.x.copy()]


def rows(fast):
    """Some 10,000 steps (fast: a tenth of those in real time, gravity stays)."""
    seen, tables = Seen(), scene_of("stones_switched", free={"steps": 400 if fast else 4000})
    loads = () if fast else (("more", 1e-3),)
    tables["stage"] = [stage for stage in tables["stage"] if not (fast and stage["name"] == "more")]
    with tempfile.TemporaryDirectory() as folder:
        found = ended(tables, folder, on_step=(10, seen))
    yield row("exit code", found.code, 0.0, 0.0, "as asked for")
    before, after = seen.ring["couple"][1], seen.ring["switch"][0]
    jump = np.abs(after - before).max() / np.abs(before).mean()
    name = "switched: largest change of a force on the ring in ten steps, over the mean one"
    yield row(name, jump, 0.0, 1e-2, "contacts keep their forces")
    start, end = seen.moved["switch"][0], seen.moved["switch"][-1]
    moved = np.abs(end - start).max() / RADIUS
    yield row("switched: largest motion of a disc until both codes rest, over R", moved, 0.0, 1e-4, "it rests")
    for stage, limit in (("couple", 1e-5), ("switch", 1e-5), *loads):
        about = found.row(stage)
        ratio = max(about["ratio_continuum"], *about["ratio_discrete"])
        yield row(f"{stage}: unbalanced ratio of both codes after {about['steps']} steps", ratio, 0.0, limit, "as asked for")
    kinetic, stored = np.array(seen.energy["free"]).T
    share = kinetic.max() / stored[0]
    yield row("real time: largest kinetic energy of the discs over stored energy", share, 0.0, 1e-6, "it rests")
    yield row("real time: stored energy at the end over that at the start", stored[-1] / stored[0], 1.0, 1e-2, "it rests")
    yield row("all numbers finite", seen.finite, 1.0, 0.0, "as asked for")
