"""A run directory as the two servers would leave it, made of closed forms instead of physics."""

import json
from types import SimpleNamespace

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree

from coupler_protocol.files.recorder import FrameInfo, Recorder

ZONE = 0.5
LENGTH, HEIGHT, TOE, FOOT = 20.0, 12.0, 4.0, 4.0  # a 45-degree face from (TOE, FOOT) to (TOE + 8, HEIGHT)
WINDOW = (11.0, 5.0, 13.0, 10.0)  # x0, y0, x1, y1
RADIUS = 0.05
WEIGHT = 2700.0 * 9.81


def surface(x):
    return np.clip(FOOT + x - TOE, FOOT, HEIGHT)


def stress_at(xy):
    """K0 stress under the surface (n, 4): xx, yy, zz, xy [Pa]."""
    vertical = -WEIGHT * (surface(xy[:, 0]) - xy[:, 1])
    return np.column_stack((0.571 * vertical, vertical, 0.571 * vertical, 0.05 * vertical))


def slip_at(xy, amount):
    """Displacement (n, 2) of a body that slides along a circle about (4, 16), smeared over a band."""
    arm = xy - (4.0, 16.0)
    radius = np.hypot(*arm.T)
    inside = 0.5 * (1.0 - np.tanh((radius - 10.3) / 0.4))
    return amount * inside[:, None] * np.column_stack((arm[:, 1], -arm[:, 0])) / radius[:, None]


def slope_grid():
    """Coordinates (N, 2) and zones (Z, 4) of a slope with triangles on its face."""
    nx, ny = round(LENGTH / ZONE), round(HEIGHT / ZONE)
    x, y = np.meshgrid(np.arange(nx + 1) * ZONE, np.arange(ny + 1) * ZONE)
    xy = np.column_stack((x.ravel(), y.ravel()))
    i, j = (a.ravel() for a in np.meshgrid(np.arange(nx), np.arange(ny)))
    first = j * (nx + 1) + i
    zones = np.column_stack((first, first + 1, first + nx + 2, first + nx + 1))
    left, right = (surface((i + side) * ZONE) / ZONE for side in (0, 1))
    triangle = (left <= j + 1e-9) & (right >= j + 1 - 1e-9) & (left < right)
    zones[triangle, 3] = zones[triangle, 2]
    return xy, zones[(left >= j + 1 - 1e-9) | triangle]


def in_window(xy):
    x0, y0, x1, y1 = WINDOW
    return (xy[:, 0] > x0) & (xy[:, 0] < x1) & (xy[:, 1] > y0) & (xy[:, 1] < y1)


def ring_and_discs():
    """Centres of control discs on the window's edge, counter-clockwise, and of free discs inside it."""
    x0, y0, x1, y1 = WINDOW
    across, up = (np.arange(0.0, side - RADIUS, 2 * RADIUS) for side in (x1 - x0, y1 - y0))
    ring = np.concatenate(
        (
            np.column_stack((x0 + across, np.full(len(across), y0))),
            np.column_stack((np.full(len(up), x1), y0 + up)),
            np.column_stack((x1 - across, np.full(len(across), y1))),
            np.column_stack((np.full(len(up), x0), y1 - up)),
        )
    )
    i, j = (a.ravel() for a in np.meshgrid(np.arange(1, len(across)), np.arange(1, len(up))))
    return ring, (x0, y0) + 2 * RADIUS * np.column_stack((i, j))


def contacts_under(xy, free_from, factor):
    """Rows of touching discs of a square lattice and the forces (normal, shear) that carry the stress."""
    ends = np.array(sorted(cKDTree(xy).query_pairs(2.05 * RADIUS)))
    ends = ends[(ends >= free_from).any(axis=1)]
    normal = (xy[ends[:, 1]] - xy[ends[:, 0]]) / (2 * RADIUS)
    tangent = np.column_stack((-normal[:, 1], normal[:, 0]))
    xx, yy, _, shear = factor * stress_at(xy[ends].mean(axis=1)).T
    traction = np.column_stack((xx * normal[:, 0] + shear * normal[:, 1], shear * normal[:, 0] + yy * normal[:, 1]))
    force = -2 * RADIUS * traction
    return ends, (force * normal).sum(axis=1), (force * tangent).sum(axis=1)


def cracks_at(info, xy, ends):
    """Rows of the list of cracks for contacts that break at a moment, every third in tension."""
    a, b = ends.T
    return {
        "step": np.full(len(ends), info.step),
        "time": np.full(len(ends), info.time),
        "place": xy[ends].mean(axis=1),
        "normal": (xy[b] - xy[a]) / (2 * RADIUS),
        "size": np.full(len(ends), 2 * RADIUS),
        "disc_a": a,
        "disc_b": b,
        **{name: np.ones(len(ends), int) for name in ("material_a", "material_b")},
        "mode": np.where(np.arange(len(ends)) % 3, 3, 2),
        "bond": np.zeros(len(ends), int),
    }


STONES = tuple(np.array([[x, y], [x + 0.5, y], [x + 0.6, y + 0.4], [x, y + 0.5]]) for x in (11.2, 12.2) for y in (5.5, 7.0, 8.5))
STAGES = ("equilibrium", "couple", "overload")


def inside_stones(xy):
    """(n,) the stone that each point lies in, -1 outside."""
    found = np.full(len(xy), -1)
    for k, outline in enumerate(STONES):
        found[shapely.contains_xy(shapely.Polygon(outline), xy)] = k
    return found


def record_run(folder, stones=False):
    """Two frames of the continuum alone, then four of both sides while a body slides away."""
    xy, zones = slope_grid()
    hole = in_window(xy[zones].mean(axis=1))
    ring, free = ring_and_discs()
    centres = np.concatenate((ring, free))
    control = (np.arange(len(centres)) < len(ring)).astype(int)
    stone = {"stone": inside_stones(centres)} if stones else {}
    start = np.cumsum([0, *map(len, STONES)])
    constants = {"stone_corners": np.concatenate(STONES), "stone_start": start} if stones else None
    moments = [
        ("equilibrium", 0.0, 1.0),
        ("equilibrium", 0.0, 1.0),
        ("couple", 0.0, 1.0),
        ("couple", 0.002 if stones else 0.02, 1.0),
        ("overload", 0.3, 5.0),
        ("overload", 0.8, 9.0),
    ]
    fdm = Recorder(folder / "fdm.rank0.vtkhdf", "continuum", "a slope of closed forms", {"seed": 1})
    dem = Recorder(folder / "dem.rank1.vtkhdf", "discrete", "a slope of closed forms", {"seed": 1}, constants)
    with fdm, dem:
        for number, (stage, amount, factor) in enumerate(moments):
            info = FrameInfo(1000 * number, 1000.0 * number, stage, factor)
            for step in range(1000 * number, 1000 * number + 1000, 10):
                fdm.history(step, unbalanced_ratio=10 ** (-1 - step % 1000 / 250), gravity_factor=factor)
            active = zones if stage == "equilibrium" else zones[~hole]
            middles = xy[active].mean(axis=1)
            u = slip_at(xy, amount)
            strain = 1e-5 + amount * np.exp(-(((np.hypot(*(middles - (4, 16)).T) - 10.3) / 0.5) ** 2))
            fdm.frame(
                info,
                points=xy,
                cells=active,
                point_fields={"displacement": u, "velocity": 1e-3 * u},
                cell_fields={
                    "stress": stress_at(middles) * factor,
                    "shear_strain": strain,
                    "shear_strain_rate": 1e-3 * strain,
                    "plastic_state": np.where(strain > 0.1, 1, 0) + np.where(strain > 0.02, 4, 0),
                    "group": np.zeros(len(active), int),
                },
            )
            if stage == "equilibrium":
                continue
            ends, normal_force, shear_force = contacts_under(centres, len(ring), factor)
            moved = slip_at(centres, amount)
            broken = np.hypot(*(centres[ends].mean(axis=1) - (4, 16)).T) - 10.3
            dem.history(info.step, unbalanced_ratio=1e-3 / (number + 1), bonds_broken=100 * number**2)
            if stage == "overload":
                dem.cracks(cracks_at(info, centres, ends[np.abs(broken) < 0.3]))
            dem.frame(
                info,
                points=centres + moved,
                cells=ends,
                point_fields={
                    "id": np.arange(len(centres)),
                    "radius": np.full(len(centres), RADIUS),
                    "displacement": moved,
                    "velocity": 1e-3 * moved,
                    "spin": np.zeros(len(centres)),
                    "material": np.zeros(len(centres), int),
                    "control": control,
                    **stone,
                },
                cell_fields={
                    "disc_a": ends[:, 0],
                    "disc_b": ends[:, 1],
                    "normal_force": normal_force,
                    "shear_force": shear_force,
                    "bond_state": np.where((np.abs(broken) < 0.3) & (amount > 0.1), 3, 1),
                },
            )
    (folder / "run.json").write_text(json.dumps({"exit_code": 0, "reason": "done"}))
    scene = {"title": "a slope of closed forms", "seed": 1}
    if stones:
        scene["stones"] = {"size": {"mean": 0.5, "sigma": 0.2, "min": 0.2, "max": 1.0}}
        scene["stage"] = [{"name": name, "kind": name} for name in STAGES]
    (folder / "scene.json").write_text(json.dumps(scene))
    return folder


@pytest.fixture(scope="session")
def run_folder(tmp_path_factory):
    return record_run(tmp_path_factory.mktemp("slope"))


@pytest.fixture(scope="session")
def stony_folder(tmp_path_factory):
    """The same with six stones, and with the stages of its scene, so that the states of the band are found."""
    return record_run(tmp_path_factory.mktemp("stony"), stones=True)


@pytest.fixture(scope="session")
def slope():
    """The closed forms the run was made of."""
    return SimpleNamespace(
        stress_at=stress_at,
        slip_at=slip_at,
        grid=slope_grid,
        in_window=in_window,
        ring_and_discs=ring_and_discs,
        contacts_under=contacts_under,
    )
