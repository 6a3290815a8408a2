"""A disc on planes of 30 degrees and other angles rolls or slides.

It starts at rest with its weight on the plane (R = 0.03 m).

    rolls if mu >= tan(theta) / 3 (0.19245 at 30 degrees): a = 2/3 g sin(theta),   otherwise  a = g (sin(theta) - mu cos(theta))

With rolling resistance of coefficient mr, a = 2/3 g (sin(theta) - mr cos(theta)). The plane is a disc of 10 km radius, in
the scene a wall. The acceleration comes from the paths in two equal times: (path(2t) - 2 path(t)) / t^2.
"""

import numpy as np

from dem_server.effects.friction import Friction
from dem_server.effects.rolling import Rolling
from dem_server.step.cycle import advance, in_real_time
from verification.discrete import scenes
from verification.discrete.discs import KN, with_held
from verification.verdict_rows import row

NAME = "incline"
G, R, PLANE = 9.81, 0.03, 1.0e4  # the plane is a disc so large that it is flat over the way of the small one
SLOPE = np.radians(30.0)


def on_plane(slope, friction, rolling=None, damping=None):
    """Model and State of a disc at rest on the plane, pressed on by its weight."""
    normal = np.array([np.sin(slope), np.cos(slope)])  # down to the right
    press = 2000.0 * np.pi * R**2 * G * np.cos(slope) / KN
    changes = {"bond": None, "damping": damping, "friction": Friction(coefficient=friction)}
    changes["rolling"] = None if rolling is None else Rolling(coefficient=rolling)
    return with_held([-PLANE * normal], [PLANE], [(R - press) * normal], [R], **changes)


def acceleration(slope, friction, rolling=None):
    """Acceleration down the plane, from the ways in 0.2 and 0.4 s; and turn over way."""
    model, state = on_plane(slope, friction, rolling)
    model = in_real_time(model, state, 0.2)
    start, way = state.x[1].copy(), []
    for _ in range(2):
        time = advance(model, state, G, round(0.2 / state.next_dt))
        way.append(np.hypot(*(state.x[1] - start)))
    return (way[1] - 2.0 * way[0]) / time**2, -state.angle[1] * R / way[1]


def expected(slope, friction, rolling=0.0):
    """Acceleration of the closed form."""
    if friction >= np.tan(slope) / 3.0:
        return 2.0 / 3.0 * G * (np.sin(slope) - rolling * np.cos(slope))
    return G * (np.sin(slope) - friction * np.cos(slope))


def least_friction():
    """Least friction with which the disc turns by at least .999 of its way over R, to 1e-5 (it slips a little at the start)."""
    low, high = 0.1, 1.0
    while high - low > 1e-5:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if acceleration(SLOPE, middle)[1] > 0.999 else (middle, high)
    return high


def of_scene(friction, slope=SLOPE):
    """Acceleration down a wall, from two frames of equal distance in steps."""
    normal, along = np.array([np.sin(slope), np.cos(slope)]), np.array([np.cos(slope), -np.sin(slope)])
    press = 2000.0 * np.pi * R**2 * G * np.cos(slope) / KN
    discs = {"wall": [{"ends": [(-along).tolist(), (3.0 * along).tolist()]}]}
    discs["soil"] = scenes.SOIL | {"friction": {"coefficient": friction}}
    stage = {"name": "run", "kind": "discs", "time": "real", "gravity": G, "until": {"steps": 8000}}
    with scenes.of_file([[*((R - press) * normal), R]], "x,y,radius", [stage], discs, every=4000) as run:
        way = [np.hypot(*run.discs(frame).displacement[0]) for frame in (-2, -1)]
        return (way[1] - 2.0 * way[0]) / (4000 * run.info["stages"][1]["time_step"]) ** 2


def rows(fast):
    """Both motions, by hand and as scenes, and rolling resistance."""
    closed = "closed form"
    for friction in (0.1, 0.3, 1.0):
        found, turned = acceleration(SLOPE, friction)
        yield row(f"acceleration, mu {friction:g} [m/s2]", found, expected(SLOPE, friction), 1e-4, closed)
        if friction == 1.0:
            yield row("turn times R over way, mu 1", turned, 1.0, 1e-3, closed)
    yield row("least friction with which it rolls", least_friction(), np.tan(SLOPE) / 3.0, 5e-3, closed)
    found, _ = acceleration(SLOPE, 1.0, 0.1)
    yield row("acceleration, rolling resistance 0.1 [m/s2]", found, expected(SLOPE, 1.0, 0.1), 1e-3, closed)
    for friction in (0.1, 0.3):
        found = of_scene(friction)
        yield row(f"as a scene: acceleration, mu {friction:g} [m/s2]", found, expected(SLOPE, friction), 1e-4, closed)
    for degrees, friction in ((10.0, 0.02),) if fast else ((10.0, 0.02), (10.0, 0.5), (20.0, 0.1), (45.0, 0.4), (60.0, 0.3)):
        slope = np.radians(degrees)
        words = f"acceleration, {degrees:g} degrees, mu {friction:g} [m/s2]"
        yield row(f"as a scene: {words}", of_scene(friction, slope), expected(slope, friction), 1e-4, closed)
        yield row(words, acceleration(slope, friction)[0], expected(slope, friction), 1e-4, closed)
