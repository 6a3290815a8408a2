"""Our discs and other engines in the same box, in turns: what each does in a second, and whether it is the same work.

Every engine first takes the settings in which it is fastest: one after the other each is changed and kept if the engine gets
faster. Peers build no list during the timed steps, at rest none gets out of date; our own rate bears one build in 2,000 steps.
"""

from statistics import median

import numpy as np

from bench.dem import rows_of
from bench.peers.box import TRIAL_STEPS, box_of, case_of, stored_energy, trial_of
from bench.peers.engine import PeerError
from bench.timing_rows import row

SAME_MOTION, SAME_ENERGY = 0.02, 0.01  # largest differences that count as the same work
TRIES = 2  # runs of a setting, of which the faster counts


class Peer:
    """An engine on one box: how far its physics differs from ours, its fastest settings, its times.

    motion: rms difference of velocities at the end of the trial over their rms; energy: relative difference of what the normal
    springs store after the timed steps.
    """

    def __init__(self, engine, case, box, steps, tune):
        self.engine, self.box, self.steps, self.seconds = engine, box, steps, []
        choices = engine.choices(box.bonds is not None)
        self.settings = {name: options[0] for name, options in choices.items()}
        self.motion, self.energy = self.trial_difference(case), None
        if tune:
            self.tune(choices)

    def trial_difference(self, case):
        """`motion`."""
        start, ours = trial_of(case, **self.engine.TRIAL[case.model.law.bond is not None])
        theirs = self.engine.run(start, TRIAL_STEPS, self.settings, trial=True).velocity
        free = slice(start.held, None)
        return float(np.linalg.norm((theirs - ours)[free]) / np.linalg.norm(ours[free]))

    def tune(self, choices):
        """Keep the settings that make the engine faster."""
        best = self.quickest(self.settings)
        for name, options in choices.items():
            for option in options[1:]:
                tried = self.settings | {name: option}
                seconds = self.quickest(tried)
                if seconds < best:
                    best, self.settings = seconds, tried

    def quickest(self, settings):
        """Seconds of a step with `settings`; infinite if the engine does not take them."""
        try:
            return min(self.engine.run(self.box, max(3, self.steps // 4), settings).seconds for _ in range(TRIES))
        except PeerError:
            return np.inf

    def turn(self, ours):
        """Take the steps once; `ours` (n, 2): where our discs rest."""
        found = self.engine.run(self.box, self.steps, self.settings)
        self.seconds.append(found.seconds)
        expected = stored_energy(self.box, ours)
        self.energy = abs(stored_energy(self.box, found.xy) - expected) / expected

    def agrees(self):
        """Whether it did the same work as ours."""
        return self.motion <= SAME_MOTION and self.energy <= SAME_ENERGY

    def note(self):
        """Its settings, and how far its physics is from ours."""
        chosen = ", ".join(f"{name} {value or 'none'}" for name, value in self.settings.items())
        verdict = "" if self.agrees() else ": NOT THE SAME WORK"
        return f"{chosen}; motion {self.motion:.1e} and energy {self.energy:.1e} off ours{verdict}"

    def rows(self, name, ours, companion):
        """Its disc-steps a second, and ours over them turn by turn; ours: our rates."""
        theirs, size = [self.box.free / s for s in self.seconds], self.box.free
        ratios = [a / b for a, b in zip(ours, theirs, strict=True)]
        return [
            row(f"{self.engine.NAME}; {name}", size, theirs, "disc-steps/s", companion, self.note()),
            row(f"ours over {self.engine.NAME}; {name}", size, ratios, "-", companion, "turn by turn"),
        ]


def box_rows(size, bonded, engines, work, repeats, companion, tune):
    """Rows of one box, and what went wrong: (rows, engines that failed with their words, engines that disagree)."""
    name = "dense box, friction" + (", contact bonds" if bonded else "")
    case = case_of(size, bonded)
    box, steps, peers, failed = box_of(case), max(3, work // size), [], []
    for engine in engines:
        if engine.choices(bonded):
            try:
                peers.append(Peer(engine, case, box, steps, tune))
            except PeerError as error:
                failed.append(f"{engine.NAME}; {name}, {size}: {error}")
    seconds = []
    for _ in range(repeats):
        seconds.append(case.seconds(steps))
        for peer in list(peers):
            try:
                peer.turn(case.state.x)
            except PeerError as error:
                failed.append(f"{peer.engine.NAME}; {name}, {size}: {error}")
                peers.remove(peer)
    ours = rows_of(name, case, work, repeats, companion, seconds)[0]
    share = ours["value"] * median(seconds) / case.free  # of steps in our time, the rest are list builds
    rates = [share * case.free / s for s in seconds]
    rows = [ours | {"name": f"ours; {name}"}, *(r for peer in peers for r in peer.rows(name, rates, companion))]
    for peer in peers if tune else []:
        try:
            rows += rank_rows(peer, name, repeats, companion)
        except PeerError as error:
            failed.append(f"{peer.engine.NAME}, two MPI ranks; {name}, {size}: {error}")
    return rows, failed, [f"{peer.engine.NAME}; {name}, {size}" for peer in peers if not peer.agrees()]


def rank_rows(peer, name, repeats, companion):
    """A row with two MPI ranks, where the engine can."""
    run = getattr(peer.engine, "run_on_two", None)
    if run is None or not peer.engine.can_run_on_two():
        return []
    rates = [peer.box.free / run(peer.box, peer.steps, peer.settings).seconds for _ in range(repeats)]
    return [row(f"{peer.engine.NAME}, two MPI ranks; {name}", peer.box.free, rates, "disc-steps/s", companion, "", threads=2)]
