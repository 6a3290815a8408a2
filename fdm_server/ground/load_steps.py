"""How far a load has come in a stage: step by step, or by parts that wait until the ground is at rest (staged relaxation).

Step by step, in step n of the ramp (from 0) of `over` steps: s = min(1, (n + 1)/over).

Ground that yields keeps the displacement that its momentum adds. Local damping takes nothing from a steady motion, so that a
ground relieved steadily runs past its equilibrium, and twice as many steps need not show it. Therefore a load that comes on
while a stage waits for rest goes by parts: of what is left at the beginning of a part, the share `KEPT` is left at its end, and
the next part begins once the unbalanced ratio was below its limit at `SUSTAINED` looks. In the K parts of a ramp s goes
linearly, over/K steps each (`over` is rounded up to a multiple of K):

    s = 1 - KEPT^k at the end of part k < K,    1 at the end of part K, where KEPT^(K - 1) < LAST

Where the grid is alone, its momentum goes as well, by kinetic damping (fdm_server/step/momentum.py). Discs keep theirs, which
their own damping takes.

If the ground does not come to rest under a part, the load stays there: it is what the ground bears, and the stage says so.
"""

from math import ceil, log

from coupler_protocol.files.kept import Kept
from coupler_protocol.scene.schedule import acting_boundaries
from coupler_protocol.scene.stage_kinds import of

KEPT = 0.7
LAST = 1e-3
PARTS = ceil(log(LAST) / log(KEPT)) + 1
RATIO = 3e-4  # unbalanced ratio below which a part has come to rest
LOOK, SUSTAINED = 10, 3  # steps between looks at the ratio, and looks in a row
OVER = 500  # steps of a ramp that waits, if its table has none


class Ramp(Kept):
    """The share of a load in a stage; ratio: limit for the next part to begin, 0: step by step."""

    KEPT = ("ratio", "part", "over", "done", "moves", "_calm")

    def __init__(self, over, ratio=0.0):
        self.ratio = ratio
        self.part = ceil(over / PARTS) if ratio else over  # steps of one part
        self.over = self.part * PARTS if ratio else over
        self.done = 0  # steps of the ramp that have been taken
        self.moves = True  # whether the coming step's share is another than that of the step before
        self._calm = 0  # looks in a row at which the ground was at rest

    @classmethod
    def of(cls, saved):
        """The Ramp that `saved` describes."""
        ramp = cls(1)
        ramp.restore(saved)
        return ramp

    @property
    def share(self):
        """Share of the load in the coming step [-]."""
        if self.complete or not self.ratio:
            return min(1.0, (self.done + 1) / self.over)
        part, step = divmod(self.done + 1, self.part)
        left, next_left = KEPT**part, KEPT ** (part + 1) if part + 1 < PARTS else 0.0
        return 1.0 - (left + (next_left - left) * (step / self.part))

    @property
    def complete(self):
        """Whether the whole load acts, in the coming step or already."""
        return self.done + 1 >= self.over

    @property
    def waits(self):
        """Whether the next part begins only at rest."""
        at_end = self.ratio and (self.done + 1) % self.part == 0
        return bool(at_end) and not self.complete and self._calm < SUSTAINED

    def between(self, start, end):
        """What lies at the share between two values; exactly the last one at the end."""
        return end if self.complete else start + self.share * (end - start)

    def step_done(self):
        """Go on by a step, unless the ramp waits or is over."""
        self.moves = not self.complete and not self.waits
        if self.moves:
            self.done += 1
            self._calm = 0

    def see(self, ratio):
        """Take note of the unbalanced ratio of all codes while the ramp waits."""
        self._calm = self._calm + 1 if ratio <= self.ratio else 0


def waits_for_rest(stage):
    """Whether a stage is on its way to rest: static, and ended by a ratio."""
    return not stage.in_real_time and stage.until is not None and stage.until.ratio is not None


def ramp_of(scene, index, law, over, ratio=None, gradual=True):
    """The Ramp of a load that changes in a stage; over, ratio: of its table; law: of the grid (fdm_server.effects.Law).

    Without `over` the load takes OVER steps if it waits and is `gradual`, else it acts at once.

    Elastic ground without discs comes to the same rest by any way, and ground that is driven to none: step by step.
    """
    stage, gradual = scene.stage[index], gradual or bool(ratio)
    if ratio is None:
        depends = law.path_dependent or any(of(s).couples for s in scene.stage[: index + 1])
        driven = any(b.velocity is not None and any((b.velocity.x, b.velocity.y)) for b in acting_boundaries(scene, index))
        ratio = max(RATIO, stage.until.ratio) if depends and waits_for_rest(stage) and not driven else 0.0
    if over is None:
        over = OVER if ratio and gradual else 1
    return Ramp(over, ratio if over > 1 else 0.0)
