"""Rim zones stretched to five times their length: the mapping stays exact, and the run gives a warning.

*Strip*: the grid of `free_body.py` in large strain, its gridpoints moved apart across an oblique strip through the middle of
the window, 1 m wide, until the strip is five times as wide; the rest moves rigidly. Two of its four sides are stretched with
it, and discs (static mode, damped, breaking bonds) follow. Compared: force, moment and power of the contact forces at the
nodes and at the control discs. *Scene*: `tests/hard/stretched_rim.toml`, a weak layer above a window, stretched by the top of
the grid."""

import tempfile

import numpy as np

import colluvium
from coupler_protocol.scene.reader import read_scene
from dem_server.step.contact_pass import contact_forces
from dem_server.step.motion import move_free
from fdm_server.coupling.rim_stretch import StretchWatch
from fdm_server.step.present_shape import begin_large_strain, present
from fdm_server.step.zone_pass import advance
from verification.hard.coupled_system import system
from verification.hard.free_body import SIZE, SMALL, Carried, discs_that_break
from verification.hard.watched import SCENES
from verification.verdict_rows import row

NAME = "stretched rim"
STRETCH, WIDTH, ACROSS = 5.0, 1.0, 0.9  # of the strip: how far, how wide [m], its direction [rad]


def torn(steps):
    """Watch of the rim's zones, its warnings, what the mapping lost, largest motion of a disc in one of so many steps."""
    discs = discs_that_break(1e4, 0.7, friction={"coefficient": 0.55})
    found = system(1.0, SIZE, 0.7, oblique=True, discs=discs, **SMALL)
    (window,), state = found.windows, found.state
    begin_large_strain(found.model, state)
    drawn, carried, fastest = found.model.grid.xy, Carried(), 0.0
    watch, said = StretchWatch(found.model, window.nodes), []
    direction = np.array([np.cos(ACROSS), np.sin(ACROSS)])
    place = np.clip((drawn - window.rim.nodes.mean(axis=0)) @ direction / WIDTH, -0.5, 0.5)
    way = (STRETCH - 1.0) * WIDTH * place[:, None] * direction
    for n in range(1, steps + 1):
        state.velocity[:] = drawn + way * n / steps - present(found.model, state)
        move_free(window.model, window.state, 0.0)
        window.rim.move(window.state, state.velocity[window.nodes])
        advance(found.model, state)
        contact_forces(window.model, window.state)
        fastest = max(fastest, float(np.abs(window.state.v).max()))
        if n % 10 == 0:
            carried.look(window.rim, window.state)
            said += [text] if (text := watch.check(state.displacement)) else []
    return watch, said, carried, fastest


def run():
    """Row of run.json of the scene's last stage, and the reason for the end."""
    with tempfile.TemporaryDirectory() as folder, colluvium.run(read_scene(SCENES / "stretched_rim.toml"), folder) as found:
        return found.info["stages"][-1], found.info["reason"]


def rows(fast):
    """The strip in 20,000 steps (fast: 4,000), and the scene."""
    steps = 4000 if fast else 20_000
    watch, said, carried, fastest = torn(steps)
    yield row("strip: largest stretch of a zone on the rim", watch.worst.stretch, STRETCH, 0.05, "as asked for")
    yield row("strip: warnings that name it", sum("zone" in text for text in said), 1.0, 0.0, "as asked for")
    yield from carried.rows("strip: ")
    yield row("strip: largest motion of a disc in a step, over R", fastest / SIZE, 0.0, 0.1, "bounded")
    stage, reason = run()
    told = stage.get("rim_stretched") or {"stretch": np.nan, "place": [np.nan, np.nan]}
    yield row("scene: ends as asked for", reason == "all stages done", 1.0, 0.0, "as asked for")
    yield row("scene: stretch of the zone that the run warns of", told["stretch"], 5.0, 0.05, "closed form")
    above = 3.0 < told["place"][1] < 3.0 + 5.0 * 0.5
    yield row("scene: that zone is one above the window", above, 1.0, 0.0, "as asked for")
