"""Shares of plain steps of the discs in other threads than the one that talks to the continuum (plain_loop.py)."""

import numpy as np

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.thread_crew import END, await_order, over_all_threads, part_of
from dem_server.effects.histories import PairHistory
from dem_server.effects.parameter_table import Parameters
from dem_server.model import Listed
from dem_server.step import scratch_rows
from dem_server.step.contact_pass import add_list
from dem_server.step.motion import move

MOTION, CONTACTS = 0.0, 1.0  # phases of work: `move` with gravity and the time of the forces; `add_list`


@jit
def help_discs(crew, motion, bodies, clumps, listed, history, parameters, counters):
    """Takes a share of all phases that the first thread orders; arguments as for `plain_loop`, counters (n,) of this thread."""
    disc, load, weight, angle, _ = bodies
    named, past, law = Listed(*listed), PairHistory(*history), Parameters(*parameters)
    dt, fastest, cap = motion.dt, motion.fastest, motion.cap
    first, last = part_of(crew, motion.ring, disc.shape[0])
    alpha, scratch = law.alpha, np.empty(scratch_rows.SIZE)
    while True:
        await_order(crew)
        phase, gravity, kick = crew.ordered[0], crew.ordered[1], crew.ordered[2]
        if phase == END:
            return
        if phase == MOTION:
            fast, quickest = move(first, last, disc, load, weight, angle, alpha, clumps, gravity, fastest, cap, kick, dt)
            over_all_threads(crew, fast, quickest, False)
        else:
            add_list(disc, load, named, past, law, dt, counters, crew, scratch)
