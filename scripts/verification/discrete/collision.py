"""Two discs collide: dashpots give a coefficient of restitution.

Half a damped wave, of m y'' + 2 beta sqrt(m kn) y' + kn y = 0 with the reduced mass m. Where the dashpot may pull, the contact
ends when the gap closes, otherwise when the force is zero:

    e = exp(-beta pi / r)     or     e = exp(-beta / r (pi - atan2(2 beta r, 1 - 2 beta^2))),     r = sqrt(1 - beta^2)

Discs of R = .03 m (and .018 m, oblique) meet at 1 m/s; the step is 1e-4 of the stable one. Scenes read their discs from a file.
At a wall m is the disc's own mass and e is the same.
"""

import numpy as np

from dem_server.effects.dashpot import Dashpot
from dem_server.step.cycle import advance, in_real_time
from verification.discrete import scenes
from verification.discrete.discs import KN, loose_discs
from verification.verdict_rows import row

NAME = "collision"
SOURCE = "Schwager & Poeschel (2007), Granular Matter 9, 465-469"
R, FRACTION = 0.03, 1e-4


def restitution(beta, tension):
    """Closed form for beta < 1."""
    root = np.sqrt(1.0 - beta**2)
    angle = np.pi if tension else np.pi - np.arctan2(2.0 * beta * root, 1.0 - 2.0 * beta**2)
    return np.exp(-beta / root * angle)


def collided(beta, tension, radius=(R, R), turned=0.0, fraction=FRACTION):
    """Model and State of two discs after their collision at 1 m/s, and the unit vector between them."""
    along = np.array([np.cos(turned), np.sin(turned)])
    changes = {"bond": None, "friction": None, "damping": None}
    dashpot = Dashpot(normal=beta, tension=tension)
    model, state = loose_discs([[0.0, 0.0], sum(radius) * along], radius, dashpot=dashpot, **changes)
    model = in_real_time(model, state, fraction)
    state.v[:] = 0.5 * along, -0.5 * along
    mass = state.mass.prod() / state.mass.sum()
    advance(model, state, 0.0, round(3.5 / np.sqrt(KN / mass * (1.0 - beta**2)) / state.next_dt))
    return model, state, along


def leaving(*collision):
    """Speed at which the discs part [m/s]."""
    _, state, along = collided(*collision)
    return (state.v[1] - state.v[0]) @ along


def of_scene(beta):
    """Speed at which the discs of a scene part [m/s] (no tension), and the seconds its stage took."""
    discs = [[0.0, 0.0, R, 0.5, 0.0, 0.0], [2.0 * R, 0.0, R, -0.5, 0.0, 0.0]]
    soil = scenes.SOIL | {"dashpot": {"normal": beta}}
    stage = {"name": "hit", "kind": "discs", "time": "real", "until": {"time": 2e-3}, "step_factor": FRACTION}
    with scenes.of_file(discs, "x,y,radius,vx,vy,spin", [stage], {"soil": soil}, every=10**9) as run:
        v = run.discs(-1).velocity
        return v[1, 0] - v[0, 0], run.info["stages"][1]["seconds_simulated"]


def at_wall(beta, tension, turned=0.6):
    """Speed at which a disc leaves an oblique wall, and along it [m/s]; it comes with 1 m/s, and .2 m/s along it."""
    along, up = np.array([np.cos(turned), np.sin(turned)]), np.array([-np.sin(turned), np.cos(turned)])
    place, velocity = 1.00001 * R * up, 0.2 * along - up
    soil = scenes.SOIL | {"dashpot": {"normal": beta, "tension": tension}}
    del soil["friction"]
    stage = {"name": "hit", "kind": "discs", "time": "real", "until": {"time": 2e-3}, "step_factor": FRACTION}
    discs = {"soil": soil, "wall": [{"ends": [(-along).tolist(), along.tolist()]}]}
    with scenes.of_file([[*place, R, *velocity]], "x,y,radius,vx,vy", [stage], discs, every=10**9) as run:
        v = run.discs(-1).velocity[0]
        return v @ up, v @ along


def rows(fast):
    """The published ones, unequal discs at an angle, and a scene; all in seconds."""
    for tension, words in ((True, "tension"), (False, "no tension")):
        for beta in (0.1, 0.5):
            yield row(f"e, beta {beta:g}, {words}", leaving(beta, tension), restitution(beta, tension), 1e-4, SOURCE)
        for beta in () if fast else (0.03, 0.3, 0.7, 0.9):
            found = leaving(beta, tension, (R, 0.6 * R), 0.7)
            yield row(f"e, beta {beta:g}, {words}, unequal, at 40 degrees", found, restitution(beta, tension), 1e-3, SOURCE)
    for beta in (0.1,) if fast else (0.1, 0.05, 0.2, 0.6):
        yield row(f"as a scene: e, beta {beta:g}, no tension", of_scene(beta)[0], restitution(beta, False), 1e-4, SOURCE)
    for beta, tension in ((0.2, False),) if fast else ((0.2, False), (0.2, True), (0.6, False), (0.02, True)):
        found, along = at_wall(beta, tension)
        words = f"as a scene: e at an oblique wall, beta {beta:g}, {'' if tension else 'no '}tension"
        yield row(words, found, restitution(beta, tension), 1e-4, SOURCE)
    yield row("the last: speed along the wall over that before", along / 0.2, 1.0, 1e-9, "closed form")
