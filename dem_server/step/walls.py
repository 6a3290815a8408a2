"""Walls: segments that confine discs, at rest, with a prescribed velocity, or with the pressure of a servo (servo.py).

With c the point of the segment nearest to the disc's centre x, d = |c - x|, n from the disc to the wall, t = (-ny, nx):

    g = d - r,   l = r + g/2,   slip = ((V - v).t - w l) dt                      (1)
    force on the wall Fn n + Fs t, on the disc the opposite and the moment -Fs l (2)

V: velocity of the wall. Springs, friction, rolling resistance (Rb = r) and dashpots (m = mass of the disc) act as between
discs; a wall has the material "ring", takes after the disc where the scene has no `ring` table, and is never bonded. Walls that
meet are one surface (wall_surface.py): a disc has one contact with it except in corners, and histories move from wall to wall.
"""

import numpy as np

from coupler_protocol.compiled.jit import jit
from dem_server.effects import RING
from dem_server.effects.pair_stiffness import pair_dashpots, pair_stiffness
from dem_server.effects.parameter_table import rows_of
from dem_server.model import FX, FY, MASS, MOMENT, RADIUS, SPIN, VX, VY, Walls, X, Y
from dem_server.step.compiled_laws import (
    clipped,
    normal_force,
    rolling_limit,
    rolling_moment,
    rolling_stiffness,
    shear_force,
    slip_limit,
    viscous_force,
)
from dem_server.step.servo import steer
from dem_server.step.wall_surface import elastic_rest, hand_on, mark_once, nearest, room_for, share_out

KN, KS = rows_of("spring")
(FRICTION,) = rows_of("friction")
(ROLLING,) = rows_of("rolling")
DASH_N, DASH_S, PULLS = rows_of("dashpot")


def make_walls(ends, velocity, model, servo=None):
    """Walls from `ends` (W, 4) [m] that move with `velocity` (W, 2); nothing touches them yet."""
    count, number, ends = len(ends), model.count, np.array(ends, dtype=float)
    rolled = np.zeros((number, count)) if model.law.rolling is not None else None
    history = np.zeros((number, count)), np.zeros((number, count))
    return Walls(ends, np.array(velocity, dtype=float), np.zeros((count, 2)), *history, rolled, ends.copy(), servo)


def wall_kinds(model):
    """Kind of pair of each material with a wall (materials,)."""
    return np.arange(model.materials, dtype=np.uint32) * model.materials + RING


def arguments(model, state):
    """What `wall_pass` takes beside discs and loads."""
    walls = state.walls
    return walls, walls.servo, model.material, model.materials, state.clumps, model.parameters, room_for(walls.ends)


@jit(borrows=True)
def move_walls(walls, servo, listed_at, leeway, dt):
    """One step of the walls; whether one is more than `leeway` [m] from where masses were set: then the list is out of date."""
    if servo is not None:
        steer(walls, servo, dt)
    strayed = False
    for w in range(len(walls.ends)):
        for end in range(4):
            walls.ends[w, end] += walls.velocity[w, end % 2] * dt
            strayed |= abs(walls.ends[w, end] - walls.summed_at[w, end]) > leeway
    if strayed:
        listed_at[0, 0] = np.inf
    return strayed


@jit
def wall_pass_of(disc, load, dt, walls, servo, material, materials, clumps, parameters, touching):
    """Open the parameters for `wall_pass`."""
    wall_pass(
        disc, load, dt, walls, servo, material, materials, clumps, parameters.values, parameters.friction, parameters.rolling,
        parameters.dashpot, touching,
    )  # fmt: skip


@jit
def wall_pass(disc, load, dt, walls, servo, material, materials, clumps, values, friction, rolling, dashpot, touching):
    """Eqs (1) and (2) for every disc at every wall, added to the loads; values: of Parameters; touching: scratch memory."""
    ends, velocity, force, before_n, before_s = walls.ends, walls.velocity, walls.force, walls.normal, walls.shear
    rolled, (wall, heir, share, overlap) = walls.rolled, touching
    for w in range(len(ends)):
        force[w, 0] = force[w, 1] = 0.0
        if servo is not None:
            servo.stiffness[w] = servo.dashpot[w] = 0.0
    for i in range(disc.shape[0]):
        x, y, r = disc[i, X], disc[i, Y], disc[i, RADIUS]
        count = 0
        for w in range(len(ends)):
            dx, dy = nearest(ends, w, x, y)
            if dx * dx + dy * dy < r * r or before_n[i, w] > 0.0:  # what a contact leaves may go to one that begins
                wall[count], share[count] = w, 1.0
                count += 1
        if count > 1:
            share_out(ends, x, y, r, count, wall, heir, share, overlap)
            hand_on(before_s, i, count, wall, heir, share, overlap)
            if rolling is not None:
                hand_on(rolled, i, count, wall, heir, share, overlap)
        k = material[i] * materials + RING
        for t in range(count):
            w, q = wall[t], share[t]
            dx, dy = nearest(ends, w, x, y)
            d2 = dx * dx + dy * dy
            if d2 >= r * r or q == 0.0:
                before_n[i, w] = before_s[i, w] = 0.0
                if rolling is not None:
                    rolled[i, w] = 0.0
                continue
            d = d2**0.5
            nx, ny = dx / d, dy / d
            arm = r + 0.5 * (d - r)
            du, dv = velocity[w, 0] - disc[i, VX], velocity[w, 1] - disc[i, VY]
            rate = dv * nx - du * ny - disc[i, SPIN] * arm
            Fn = q * normal_force(values[KN, k], d - r)
            if servo is not None:
                servo.stiffness[w] += q * values[KN, k]
            Fs, limit = shear_force(q * values[KS, k], rate * dt, before_s[i, w]), 0.0
            if friction is not None:
                limit = slip_limit(values[FRICTION, k], Fn)
            Fs = clipped(Fs, limit)
            before_n[i, w], before_s[i, w] = Fn, Fs
            if rolling is not None:
                mr = rolling_moment(q * rolling_stiffness(values[KS, k], r), -disc[i, SPIN] * dt, rolled[i, w])
                mr = clipped(mr, rolling_limit(values[ROLLING, k], r, Fn))
                rolled[i, w] = mr
                load[i, MOMENT] -= mr
            if dashpot is not None:
                root = disc[i, MASS] ** 0.5
                if clumps is not None:  # noqa: SIM102 (numba prunes this line only if it stands alone)
                    if clumps.body[i] >= 0:
                        root = clumps.motion[clumps.body[i], MASS] ** 0.5
                root *= q
                if servo is not None:
                    servo.dashpot[w] += values[DASH_N, k] * root
                Fn += viscous_force(values[DASH_N, k], root, du * nx + dv * ny)
                if values[PULLS, k] == 0.0:
                    Fn = max(Fn, 0.0)
                Fs = clipped(Fs + viscous_force(values[DASH_S, k], root, rate), limit)
            px, py = Fn * nx - Fs * ny, Fn * ny + Fs * nx
            load[i, FX] -= px
            load[i, FY] -= py
            load[i, MOMENT] -= Fs * arm
            force[w, 0] += px
            force[w, 1] += py


def near(state, reach):
    """Pairs of disc and wall closer than `reach` [m]: disc (m,), wall (m,), unit normal (m, 2), distance (m,)."""
    ends = state.walls.ends
    along = ends[:, 2:] - ends[:, :2]
    away = state.x[:, None, :] - ends[None, :, :2]
    share = np.clip((away * along).sum(axis=2) / (along**2).sum(axis=1), 0.0, 1.0)
    vector = share[:, :, None] * along - away
    distance = np.hypot(vector[..., 0], vector[..., 1])
    disc, wall = np.nonzero(distance - state.radius[:, None] < reach)
    distance = distance[disc, wall]
    return disc, wall, vector[disc, wall] / distance[:, None], distance


def near_once(state, reach):
    """`near` without walls that only take turns with a nearer one: past joints and around edges a disc touches one wall."""
    disc, wall, normal, distance = near(state, reach)
    counts = np.ones(len(disc), dtype=bool)
    mark_once(state.walls.ends, state.x, state.radius, disc, wall, distance, counts)
    return disc[counts], wall[counts], normal[counts], distance[counts]


def add_to_sums(model, state, found, reach, with_masses):
    """Add the walls closer than `reach` [m] to the Sums `found` of dem_server.step.stiffness."""
    state.walls.summed_at[:] = state.walls.ends
    law, (disc, _, normal, distance) = model.law, near_once(state, reach)
    kind = wall_kinds(model)[model.material[disc]]
    r = state.radius[disc]
    kn, ks, kr = pair_stiffness(kind, r, r, 0.0, law.spring, law.rolling, None)
    nx2, ny2 = normal[:, 0] ** 2, normal[:, 1] ** 2
    np.add.at(found.discs, disc, np.column_stack([kn * nx2 + ks * ny2, kn * ny2 + ks * nx2, ks * r * r + kr]))
    if law.dashpot is not None:
        cn, cs = pair_dashpots(kind, np.sqrt(_mass(state, disc)) if with_masses else 1.0, law.dashpot)
        cs = 2.0 * cs
        np.add.at(found.disc_dashpots, disc, np.column_stack([np.maximum(cn, cs), cs * r * r]))
    if state.clumps is None:
        return
    body = state.clumps.body[disc]
    own = body >= 0
    at = state.x[disc] + normal * distance[:, None] - state.clumps.motion[body, : Y + 1]
    lever = (at**2).sum(axis=1)
    larger = np.maximum(kn, ks)
    np.add.at(found.clumps, body[own], np.column_stack([larger, larger * lever + kr])[own])
    if law.dashpot is not None:
        np.add.at(found.clump_dashpots, body[own], (np.maximum(cn, cs)[:, None] * np.column_stack([lever**0, lever]))[own])


def _mass(state, disc):
    if state.clumps is None:
        return state.mass[disc]
    body = state.clumps.body[disc]
    return np.where(body >= 0, state.clumps.motion[body, MASS], state.mass[disc])


def stored(model, state):
    """Elastic energy of the contacts with walls [J]."""
    walls, law = state.walls, model.law
    kind = wall_kinds(model)[model.material]
    kn, ks = law.spring.normal[kind], law.spring.shear[kind]
    total = (walls.normal**2 / kn[:, None]).sum()
    if ks.all():
        total += (walls.shear**2 / ks[:, None]).sum()
        if walls.rolled is not None:
            total += (walls.rolled**2 / (ks[:, None] * state.radius[:, None] ** 2)).sum()
    rest = elastic_rest(state.disc, walls.ends, walls.normal, walls.shear, walls.rolled, kn, ks, room_for(walls.ends))
    return 0.5 * float(total) + rest
