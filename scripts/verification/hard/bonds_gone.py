"""All bonds broken at once, gravity off .

`tests/hard/bonds_gone.toml`: a bonded oblique block with 200 kPa locked in comes to rest; then every bond breaks, and the
block bursts in real time without damping. Contacts in tension lose their energy, friction dissipates some, and nothing may add
any:

    kinetic + stored <= stored when the bonds broke, + 1 %
"""

import numpy as np

from dem_server.effects.bond import BONDED, BROKEN_TENSION
from verification.hard.watched import computed, scene_of
from verification.verdict_rows import row

NAME = "bonds gone"


def break_all(moment):
    """At the end of the stage hold."""
    if moment.stage == "hold":
        state = moment.state
        state.bond_state[state.bond_state == BONDED] = BROKEN_TENSION


def rows(fast):
    """20,000 steps of the burst (fast: 4,000)."""
    watch, _ = computed(scene_of("bonds_gone", burst={"steps": 4000 if fast else 20_000}), on_stage=break_all)
    _, held, _ = watch.of("hold")
    kinetic, stored, speed = watch.of("burst")
    start = held[-1]
    most = [-0.95, 0.01]  # at least a twentieth must move
    yield row("largest kinetic energy over what was stored", kinetic.max() / start, 1.0, most, "conservation")
    both = (kinetic + stored).max() / start
    yield row("largest kinetic and stored energy over what was stored", both, 1.0, most, "conservation")
    bound = (2.0 * start / (2000.0 * np.pi * (0.75 * 0.03) ** 2)) ** 0.5
    share = speed.max() / bound
    yield row("largest speed over that of the lightest disc with all the energy", share, 1.0, [-0.99, 0.01], "conservation")
    yield row("all numbers finite", watch.finite, 1.0, 0.0, "as asked for")
