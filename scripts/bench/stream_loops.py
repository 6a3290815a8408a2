"""Compiled loops of an exchange over a plain stream: as plain steps do it, and with nothing but `read` and `write`."""

from coupler_protocol.compiled.jit import jit
from coupler_protocol.compiled.lane import HERE, NOTHING, _believed, put, take
from coupler_protocol.compiled.system_calls import read
from coupler_protocol.compiled.waiting_words import give_way


@jit(package="fdm_server")
def lane_trips(wire, trips, answers):
    """Frames there and back as plain steps send them; `answers`: this end waits first. Returns the trips that were made."""
    for trip in range(trips):
        if answers and not heard(wire):
            return trip
        if not put(wire, 0) or (not answers and not heard(wire)):
            return trip
        wire.sequence[0] += 1
    return trips


@jit(package="fdm_server", borrows=True)
def heard(wire):
    """Whether a frame came: `take` gives up after it slept once, also in the middle of a large frame, and goes on when called."""
    found = take(wire, 0)
    while found == NOTHING:
        found = take(wire, 0)
    return found == HERE


@jit(package="fdm_server", borrows=True)
def arrives(wire, awake):
    """Reads until a frame is there, and checks it as a lane does; awake: looks again and again, the descriptor does not block.

    Each look gives the processor away (sched_yield): beside other work, ends that keep it would wait for each other's slices.
    """
    while wire.in_at[0] + wire.got[0] < wire.in_at[1]:
        number = read(wire.fd[0], wire.inbox, wire.in_at[0] + wire.got[0], wire.in_at[1])
        if number > 0:
            wire.got[0] += number
        elif number == 0 or not awake:
            return False
        else:
            give_way()
    return _believed(wire, 0)


@jit(package="fdm_server")
def raw_trips(wire, trips, answers, awake):
    """The same frames with the same checks, and nothing but `read` and `write` beside them."""
    for trip in range(trips):
        if answers and not arrives(wire, awake):
            return trip
        if not put(wire, 0) or (not answers and not arrives(wire, awake)):
            return trip
        wire.sequence[0] += 1
    return trips
