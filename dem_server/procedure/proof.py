"""What a Model and State of discs from a file must be: kernels follow their indices without looking.

Shapes fit the numbers of discs, pairs, clumps and walls; indices lie in range; positions are finite, radii and masses positive.
Whether the numbers are those that were saved, the seal of the file says (coupler_protocol/files/seal.py).
"""

import numpy as np

from coupler_protocol.files.proof import positive, require, shaped, within
from dem_server.effects import STONE, bond, histories
from dem_server.model import INERTIA, MASS
from dem_server.step import breaks


def prove(model, state):
    """Raises coupler_protocol.files.proof.UnprovenError unless steps can be taken with `model` and `state`."""
    of_model(model)
    n, m = model.count, len(state.first)
    shaped("disc", state.disc, (n, 8))
    positive("radius", state.radius)
    shaped("load", state.load, (n, 4))
    for name, columns in (("weight", ()), ("angle", ()), ("origin", (2,))):
        shaped(name, getattr(state, name), (n, *columns))
    shaped("counters", state.counters, (4,), "i")
    require(state.listed_at.shape == (n, 2) and not np.isnan(state.listed_at).any(), "listed_at does not fit the discs")
    require(state.dt >= 0.0 and state.next_dt >= 0.0, "dt or next_dt is negative, or NaN")
    single = np.arange(n) >= model.ring
    if state.clumps is not None:
        of_clumps(state.clumps, n)
        single &= state.clumps.body < 0
    if state.builds:  # before the first list there are no masses
        positive("mass", state.mass[single])
        positive("inertia", state.inertia[single])
    if state.stone is not None:
        shaped("stone", state.stone, (n,), "i")
        require((state.stone >= -1).all(), "stone holds numbers below -1")
    of_pairs(model, state, n, m)
    if state.walls is not None:
        of_walls(model, state.walls, n)
    if state.breaks is not None:
        shaped("breaks", state.breaks, (len(state.breaks), breaks.COLUMNS))
        within("discs of breaks", state.breaks[:, [breaks.FIRST, breaks.SECOND]], 0, n - 1)


def of_model(model):
    """Number of discs and materials, and parameters of every kind of pair."""
    n = len(model.material)
    shaped("material", model.material, (n,), "i")
    shaped("density", model.density, (n,))
    positive("density", model.density)
    require(0 <= model.ring <= n, f"{model.ring} of {n} discs are on the ring")
    require(np.isfinite(model.smallest_radius) and model.smallest_radius > 0.0, "smallest_radius is not positive")
    require(not model.in_real_time or 0.0 < model.real_time <= 1.0, "real_time is not a share of a step")
    kinds = len(model.law.spring.normal)
    require(model.materials**2 == kinds and 2 <= model.materials <= STONE + 1, f"{kinds} kinds of pairs belong to no materials")
    within("material", model.material, 0, model.materials - 1)
    for effect, table in model.law._asdict().items():
        for name, values in (table._asdict() if table is not None else {}).items():
            if isinstance(values, np.ndarray):
                shaped(f"{effect}.{name}", values, (kinds,), values.dtype.kind if values.dtype.kind in "fb" else "f")
            else:
                require(np.isfinite(values), f"{effect}.{name} is not finite")


def of_pairs(model, state, n, m):
    """Pairs first < second < n of a kind there is, in runs that cover the list, with all that the law remembers of a pair."""
    for name in ("first", "second", "kind"):
        shaped(name, getattr(state, name), (m,), "u")
    if m:
        within("second", state.second, 0, n - 1)
        require((state.first < state.second).all(), "first is not below second")
        within("kind", state.kind, 0, model.materials**2 - 1)
    runs = state.parts
    shaped("parts", runs, (len(runs), 2), "u")
    if len(runs):
        require((runs[:, 0] <= runs[:, 1]).all() and runs.max() <= m, "parts holds runs beyond the list of pairs")
        covered = np.sort(runs[runs[:, 0] < runs[:, 1]], axis=0).ravel()
        require(np.array_equal(covered[1:-1:2], covered[2::2]), "parts holds runs that leave gaps or overlap")
        require(int((runs[:, 1] - runs[:, 0]).sum()) == m, "parts does not hold every pair once")
    else:
        require(m == 0, "parts holds no runs")
    remembered(model, state, m)


def remembered(model, state, m):
    """The arrays that the law remembers of m pairs, and no others."""
    expected = histories.empty(model.law, reference_gap=state.reference_gap is not None)
    for name in histories.PairHistory._fields:
        value, like = getattr(state, name), expected.get(name)
        require((value is None) == (like is None), f"{name} is {'missing' if value is None else 'of no law that acts'}")
        parts = value._asdict() if isinstance(value, tuple) else {"": value}
        likes = like._asdict() if isinstance(like, tuple) else {"": like}
        for part, array in parts.items():
            if array is not None:
                shaped(f"{name}.{part}".rstrip("."), array, (m,), likes[part].dtype.kind)
    for states in (state.bond_state, None if state.parallel is None else state.parallel.state):
        if states is not None:
            within("state of bonds", states, bond.NONE, bond.BROKEN_SHEAR)


def of_clumps(clumps, n):
    """c clumps: which discs are their members, and which clump a disc belongs to."""
    c, members = len(clumps.motion), len(clumps.member)
    shaped("clumps.motion", clumps.motion, (c, 8))
    shaped("clumps.body", clumps.body, (n,), "i")
    shaped("clumps.start", clumps.start, (c + 1,), "i")
    shaped("clumps.member", clumps.member, (members,), "i")
    shaped("clumps.offset", clumps.offset, (members, 2))
    for name in ("reach", "gyration"):
        shaped(f"clumps.{name}", getattr(clumps, name), (c,))
    within("clumps.body", clumps.body, -1, c - 1)
    within("clumps.member", clumps.member, 0, n - 1)
    start = clumps.start
    require(start[0] == 0 and start[-1] == members and (np.diff(start) >= 0).all(), "clumps.start does not divide the members")
    owner = np.repeat(np.arange(c), np.diff(start))
    require(np.array_equal(clumps.body[clumps.member], owner), "clumps.member and clumps.body differ")
    require(np.count_nonzero(clumps.body >= 0) == members, "a disc of a clump is not among its members")
    held = np.diff(start) > 0
    positive("mass of clumps", clumps.motion[held, MASS])
    positive("inertia of clumps", clumps.motion[held, INERTIA])


def of_walls(model, walls, n):
    """W walls, what each remembers of the discs, and their servos."""
    w = len(walls.ends)
    for name, shape in (("ends", (w, 4)), ("velocity", (w, 2)), ("force", (w, 2)), ("normal", (n, w)), ("shear", (n, w))):
        shaped(f"walls.{name}", getattr(walls, name), shape)
    shaped("walls.summed_at", walls.summed_at, (w, 4))
    require((walls.rolled is not None) == (model.law.rolling is not None), "walls.rolled does not fit the law")
    if walls.rolled is not None:
        shaped("walls.rolled", walls.rolled, (n, w))
    for name, values in (walls.servo._asdict() if walls.servo is not None else {}).items():
        shaped(f"servo.{name}", values, (w, 2) if name == "inward" else (w,))
    if walls.servo is not None:
        require((walls.servo.average >= 1.0).all(), "servo.average is below one step")
