"""A zone turned inside out: both sides stop, name it and save, and the last good state goes on.

`tests/hard/inverted_zone.toml`: the layer above the window, 0.5 m thick and 1e4 times softer than the rock, loses its height
after some 500 steps. Both sides must end with exit code 6 and leave whole checkpoints; the message must name a zone of the
layer. Then 100 steps of the stage are computed from the end of the stage before it, and in a run that was never driven
farther: arrays with other bits are counted."""

import re
import tempfile
from pathlib import Path

import colluvium
from colluvium.running import threads
from coupler_protocol.exits import PHYSICS
from coupler_protocol.files.restart import Origin
from verification.coupling.bits import differing
from verification.hard.runs import ended, saved
from verification.hard.watched import scene_of
from verification.verdict_rows import row

NAME = "inverted zone"
SOURCE = "as asked for"
PLACE = re.compile(r"the first is zone \d+ at \((?P<x>[-\d.]+), (?P<y>[-\d.]+)\)")
THICKNESS, SPEED = 0.5, 1e-3  # of the layer [m], of the top [m/step]


def rows(fast):
    """Seconds; the fast form is the same."""
    with tempfile.TemporaryDirectory() as name:
        bad, again, good = (Path(name) / folder for folder in ("bad", "again", "good"))
        found = ended(scene_of("inverted_zone"), bad)
        yield row("exit code", found.code, PHYSICS, 0.0, SOURCE)
        place = PLACE.search(found.said)
        inside = place is not None and 2.5 < float(place["y"]) < 3.5
        yield row("the message names a zone of the layer and its place", inside, 1.0, 0.0, SOURCE)
        pressed = found.row("press")["steps"] * SPEED / THICKNESS
        yield row("way of the top at that moment over the thickness of the layer", pressed, 1.0, 0.1, "geometry")
        yield row("sides that saved", saved(bad, "stopped"), 2.0, 0.0, SOURCE)
        gentle = colluvium.Scene(**scene_of("inverted_zone", press={"steps": 100}))
        again.mkdir()
        threads.run(gentle, again, origin=Origin(bad, "couple"))
        colluvium.run(gentle, good).close()
        yield row("from the last good state: arrays unlike those of a straight run", differing(again, good, "press"), 0.0, 0.0,
                  "identity")  # fmt: skip
