"""A disc strikes a wall at an angle: it sticks, slides, or both in turn.

R = 0.03 m, kn = 2.5e7 N/m of the contact, no damping; the wall is turned by 25 degrees. Normal to the wall, the contact lasts
half a wave, Fn = kn (vn / wn) sin(wn t), wn = sqrt(kn / m), and leaves at vn. Along the tangent, the point of contact has the
mass m / 3 (m and I = m R^2 / 2 of the disc at lever R), so during sticking Fs = ks (s / wt) sin(wt t), wt = sqrt(3 ks / m),
with s the speed of the point of contact (Maw, Barber & Fawcett 1976 use Hertz's springs; linear ones are elementary):

    ks = kn / 3:     wt = wn, Fs / Fn constant, sticks to the end where s / vn <= 3 mu:     s -> -s
    ks = 4 kn / 3:   wt = 2 wn, |Fs / Fn| <= 4 s / 3 vn, sticks where that is below mu:    s -> s
    slides all the time (s >> mu vn):    v -> v - 2 mu vn,   spin -> spin - 4 mu vn / R (against s),   s -> s - 6 mu vn
    otherwise phase by phase, each an arc of a sine (`slider`).
"""

import numpy as np

from verification.discrete import scenes
from verification.verdict_rows import row

NAME = "impact"
R, KN, DENSITY, TURNED = 0.03, 2.5e7, 2000.0, np.radians(25.0)
MASS = DENSITY * np.pi * R**2
NORMAL = 1e-3  # speed towards the wall [m/s]: overlap 1.6e-5 R
SOURCE = "closed form"


def struck(slip, share, friction, spin=0.0):
    """Tangential speed of the centre, spin times R and slip after the impact, over the normal speed; ks = share kn.

    slip: speed of the point of contact along the wall before, over the normal speed; spin: spin times R likewise.
    """
    along, up = np.array([np.cos(TURNED), np.sin(TURNED)]), np.array([-np.sin(TURNED), np.cos(TURNED)])
    speed = NORMAL * (slip - spin)  # of the centre; counter-clockwise spin moves the point of contact along the wall
    place, velocity = 1.0001 * R * up, speed * along - NORMAL * up
    discs = {"stiffness": "contact", "wall": [{"ends": [(-along).tolist(), along.tolist()]}]}
    discs["soil"] = {"density": DENSITY, "spring": {"normal": KN, "shear": share * KN}, "friction": {"coefficient": friction}}
    stage = {"name": "hit", "kind": "discs", "time": "real", "until": {"time": 6e-3}, "step_factor": 5e-4}
    rows = [[*place, R, *velocity, spin * NORMAL / R]]
    with scenes.of_file(rows, "x,y,radius,vx,vy,spin", [stage], discs, every=10**9) as run:
        found = run.discs(-1)
        v, w = found.velocity[0] @ along / NORMAL, found.spin[0] * R / NORMAL
        return v, w, v + w, found.velocity[0] @ up / NORMAL


def slider(slip, share, friction):
    """Slip after the impact over the normal speed, piece by piece, with kn = m = vn = 1: Fn = sin(t), s' = -3 Fs.

    sticking: Fs' = share s,   sliding: Fs = +-mu sin(t) while the spring asks for more, +-share s > mu cos(t)
    """
    w, time, s, force = np.sqrt(3.0 * share), 0.0, slip, 0.0
    sliding, sign = share * abs(slip) > friction, np.sign(slip)
    while time < np.pi:
        t = np.linspace(time, np.pi, 200_001)[1:]
        if sliding:
            speed, forces = s - 3.0 * sign * friction * (np.cos(time) - np.cos(t)), sign * friction * np.sin(t)
            over = sign * share * speed < friction * np.cos(t)
        else:
            c, d = np.cos(w * (t - time)), np.sin(w * (t - time))
            speed, forces = s * c - 3.0 * force / w * d, force * c + share * s / w * d
            over = np.abs(forces) > friction * np.sin(t)
        end = np.argmax(over) if over.any() else len(t) - 1
        time, s, force, sliding = t[end], speed[end], forces[end], not sliding
        sign = np.sign(force)
    return s


def rows(fast):
    """Four regimes; slip both ways, with and without spin before."""
    for slip, spin in ((1.0, 0.0), (-0.8, 0.5)):
        v, _, after, normal = struck(slip, 1.0 / 3.0, 0.55, spin)
        yield row(f"sticks, ks = kn/3, slip {slip:g} vn, spin {spin:g} vn/R: slip after, over vn", after, -slip, 2e-3, SOURCE)
        yield row("the same: speed along the wall after, over vn", v, slip - spin - 2.0 * slip / 3.0, 2e-3, SOURCE)
    yield row("the same: speed from the wall, over vn", normal, 1.0, 1e-4, SOURCE)
    after = struck(0.3, 4.0 / 3.0, 0.55)[2]
    yield row("sticks, ks = 4 kn/3, slip 0.3 vn: slip after, over vn", after, 0.3, 2e-3, SOURCE)
    for friction, slip in ((0.1, 2.0), (0.3, -5.0)):
        v, w, _, _ = struck(slip, 0.4, friction)
        sign = np.sign(slip)
        words = f"slides, mu {friction:g}, slip {slip:g} vn: speed along the wall after, over vn"
        yield row(words, v, slip - 2.0 * sign * friction, 1e-3, SOURCE)
        yield row("the same: spin times R, over vn", w, -4.0 * sign * friction, 1e-3, SOURCE)
    for slip in () if fast else (0.2, 0.5, 0.9):
        found, expected = struck(slip, 0.4, 0.3)[2], slider(slip, 0.4, 0.3)
        yield row(f"sticks and slides, ks = 0.4 kn, mu 0.3, slip {slip:g} vn: slip after", found, expected, 2e-3, SOURCE)
