"""Both servers complete a run with a peer that knows docs/protocol.md only (tests/peer.py), over the link and over a lane."""

import ast
import copy
import json
import math
import subprocess
import sys
from importlib.metadata import version

import h5py
import pytest

from coupler_protocol.wire import keys
from tests import peer
from tests.commands import ROOT, command
from tests.integration.short_runs import end, wait_for

STRESS = {"xx": -120e3, "yy": -200e3, "xy": 0.0}  # [Pa]
LOW, HIGH, ZONE = 1.0, 3.0, 0.5  # [m] corners of the window, size of the zones
RIM = [
    *((LOW + i * ZONE, LOW) for i in range(4)), *((HIGH, LOW + i * ZONE) for i in range(4)),
    *((HIGH - i * ZONE, HIGH) for i in range(4)), *((LOW, HIGH - i * ZONE) for i in range(4)),
]  # fmt: skip
SCENE = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 4.0, "height": 4.0, "zone_size": ZONE},
    "material": [{"name": "ground", "density": 2700.0, "elastic": {"bulk": 0.5e9, "shear": 0.15e9}}],
    "initial_stress": STRESS | {"zz": -130e3},
    "boundary": [{"on": side, "fix": "xy"} for side in ("left", "right", "bottom", "top")],
    "damping": {"local": 0.8},
    "window": [{"name": "hole", "columns": [2, 5], "rows": [2, 5]}],
    "discs": {
        "radius": 0.09,
        "damping": {"local": 0.7},
        "soil": {
            "density": 2000.0,
            "spring": {"normal": 5e7, "shear": 2e7},
            "friction": {"coefficient": 0.55},
            "bond": {"tension": 15e3, "shear": 35e3},
        },
    },
    "link": {"timeout": 0.5},
    "record": {"every": 20, "history": 5},
    "stage": [
        {"name": "equilibrium", "gravity": 0.0, "until": {"ratio": 1e-5, "steps": 50}},
        {"name": "fill"},
        {"name": "couple", "handover": 20, "until": {"steps": 40}},
        {
            "name": "press",
            "kind": "load",
            "boundary": [{"on": "top", "velocity": {"y": -1e-4}, "over": 1}],
            "until": {"steps": 60},
        },
    ],
}
WAYS = pytest.mark.parametrize("lane", [False, True], ids=["link", "lane"])


def test_the_peer_imports_nothing_of_this_project():
    allowed = {*sys.stdlib_module_names, "msgpack", "zmq"}
    found = list(ast.walk(ast.parse((ROOT / "tests" / "peer.py").read_text(encoding="utf-8"))))
    names = [name.name for node in found if isinstance(node, ast.Import) for name in node.names]
    names += [node.module for node in found if isinstance(node, ast.ImportFrom)]
    assert {name.partition(".")[0] for name in names} <= allowed


@pytest.fixture(scope="module")
def scene_path(tmp_path_factory):
    path = tmp_path_factory.mktemp("peer") / "scene.json"
    path.write_text(json.dumps(SCENE))
    return path


def server(name, scene, out, *more):
    arguments = command(name, scene, "--out", out, "--quiet", "--threads", "1", *more)
    return subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def run_of_discs(scene_path, out, lane, deaf_to=()):
    """(what happened to the discs of the document, they, run.json) in a run with the server of the grid."""
    process = server("fdm_server", scene_path, out, "--bind", "local" if lane else "tcp://127.0.0.1:0")
    try:
        files = [out / "scene.json", out / "endpoint"]
        wait_for(lambda: process.poll() is not None or all(file.exists() for file in files), 100, "the grid")
        assert process.poll() is None, process.stderr.read()
        endpoint = (out / "endpoint").read_text().strip()
        resolved, secret = (
            json.loads((out / "scene.json").read_text()),
            None if lane else keys.local_secret(keys.folder_of()),
        )
        discs = peer.Discs(endpoint, resolved, version("colluvium"), lane=lane, secret=secret)
        discs.alive = lambda: process.poll() is None
        discs.deaf_to = set(deaf_to)
        found = discs.run(stiffness=5e7)
        assert process.wait(60) == 0, process.stderr.read()
        discs.close()
    finally:
        end(process)
    return found, discs, json.loads((out / "run.json").read_text())


@WAYS
def test_discs_of_the_document_run_with_the_server_of_the_grid(tmp_path, scene_path, lane):
    """The bed of springs replaces uniformly stressed ground: nothing moves until the top does, and then the rim follows."""
    found, discs, info = run_of_discs(scene_path, tmp_path, lane, {3 + 90})  # an answer is lost: its bytes come again
    assert (found["reason"], info["reason"], info["exit_code"]) == ("all stages done", "all stages done", 0)
    start = RIM.index(discs.rim[0])
    assert discs.rim == RIM[start:] + RIM[:start]
    assert not discs.deaf_to
    assert sum(area for _, _, area, *_ in found["zones"]) == pytest.approx((HIGH - LOW) ** 2)
    assert all(zone[3:6] == pytest.approx((STRESS["xx"], STRESS["yy"], 0.0)) for zone in found["zones"])
    assert found["go"] | {"step": 50} == {"gravity": 0.0, "step": 50, "time": float(found["go"]["step"]), "stage": 2}
    first = found["go"]["step"] + 1
    assert [order[:2] for order in found["orders"]] == [(2 + (n >= 40), first + n) for n in range(100)]
    ends = [n for n, order in enumerate(found["orders"]) if order[2] & peer.END_OF_STAGE]
    assert ends == [39, 99]
    assert (discs.by_lane > 80) is lane
    top = [u for (x, y), u in zip(discs.rim, found["moved"], strict=True) if y == HIGH]
    bottom = [u for (x, y), u in zip(discs.rim, found["moved"], strict=True) if y == LOW]
    assert all(-0.006 < uy < -1e-4 for _, uy in top), top
    assert all(abs(uy) < 0.5 * abs(top[0][1]) for _, uy in bottom)
    row = next(row for row in info["stages"] if row["name"] == "couple")
    assert row["steps"] == 40
    assert row["ratio_continuum"] < 1e-9, "the forces of the document balance the ground"


def test_so_do_discs_at_the_ground_surface(tmp_path):
    """Ground pressed in x, without stress in y: an open rim balances it, and follows when a side moves."""
    scene = copy.deepcopy(SCENE) | {"initial_stress": {"xx": -120e3, "yy": 0.0, "zz": -30e3, "xy": 0.0}}
    scene["boundary"] = [{"on": side, "fix": "xy"} for side in ("left", "right", "bottom")]
    scene["window"][0]["rows"] = [4, 7]
    scene["stage"][3]["boundary"] = [{"on": "right", "velocity": {"x": -1e-4}, "over": 1}]
    path = tmp_path / "scene.json"
    path.write_text(json.dumps(scene))
    (tmp_path / "out").mkdir()
    found, discs, info = run_of_discs(path, tmp_path / "out", lane=True)
    assert info["exit_code"] == 0
    assert (discs.rim[0], discs.rim[-1]) == ((LOW, 4.0), (HIGH, 4.0))
    assert len(discs.rim) == 13
    assert discs.surface == [(2.5, 4.0), (2.0, 4.0), (1.5, 4.0)]
    row = next(row for row in info["stages"] if row["name"] == "couple")
    assert row["ratio_continuum"] < 1e-9, "the forces of the document balance the ground"
    right = [u for (x, _), u in zip(discs.rim, found["moved"], strict=True) if x == HIGH]
    assert all(ux < -1e-4 for ux, _ in right)


@WAYS
def test_a_grid_of_the_document_runs_with_the_server_of_the_discs(tmp_path, scene_path, lane):
    """The rim is pressed together in y, then moves as a whole: the forces of the discs follow."""
    grid = peer.Grid(RIM, timeout=0.5, lane=lane)
    process = server("dem_server", scene_path, tmp_path, "--connect", grid.endpoint)
    zones = [
        (LOW + (i + 0.5) * ZONE, LOW + (j + 0.5) * ZONE, ZONE**2, STRESS["xx"], STRESS["yy"], STRESS["xy"], 2700.0)
        for j in range(4)
        for i in range(4)
    ]
    still, pressed, down = ([(0.0, v(y)) for _, y in RIM] for v in (lambda y: 0.0, lambda y: -1e-5 * (y - 2.0), lambda y: -1e-6))
    grid.alive = lambda: process.poll() is None
    try:
        hello = grid.welcome()
        ready = grid.begin(zones, {"gravity": 0.0, "step": 50, "time": 50.0, "stage": 2, "bin": 0.5})
        _, force, sums, _ = grid.turn(still)
        before = mean_stress(force)
        for _ in range(20):
            grid.turn(still)
        for n in range(100):
            grid.turn(pressed, peer.RECORD | peer.STRAIN if n == 99 else 0)
        *_, strain = grid.turn(still, extra=16)
        for _ in range(30):
            _, force, _, _ = grid.turn(still)
        after = mean_stress(force)
        grid.turn(still, peer.RECORD | peer.END_OF_STAGE | peer.CHECKPOINT)
        grid.stage += 1
        for _ in range(50):
            scalars, force, _, _ = grid.turn(down)
        grid.deaf_to = {grid.sequence}  # FORCE is lost: its bytes come again
        (last, *_), farewell = grid.stop("all stages done")
        assert process.wait(60) == 0, process.stderr.read()
        grid.close()
    finally:
        end(process)
    assert hello["package"] == version("colluvium")
    assert hello["scene"]["discs"]["radius"] == SCENE["discs"]["radius"]
    assert len(grid.progress) > 0
    assert (grid.by_lane > 180) is lane
    inner = peer.numbers(ready["inner_mass"])
    assert len(inner) == len(RIM)
    assert min(inner) > 0.0
    assert min(sums) > 0.0
    assert before == pytest.approx((STRESS["xx"], STRESS["yy"]), rel=0.15)
    assert after[1] < 1.05 * before[1], "pressed in y, the discs press back"
    total = [sum(axis) for axis in zip(*force, strict=True)]
    assert math.hypot(*total) < 0.02 * sum(math.hypot(*f) for f in force)
    assert [middle[:2] for middle in strain[:5]] == [(1.25, 1.25), (1.75, 1.25), (2.25, 1.25), (2.75, 1.25), (1.25, 1.75)]
    seen = [value for *_, value in strain if value >= 0.0]
    assert sum(seen) / len(seen) == pytest.approx(100 * 1e-5, rel=0.5)
    assert scalars[0] < 1.0
    assert len(scalars) == len(last) == 9
    assert [stage["name"] for stage in farewell["stages"]][-2:] == ["couple", "press"]
    assert all(stage["computing"] >= 0.0 for stage in farewell["stages"])
    with h5py.File(tmp_path / "dem.rank1.vtkhdf") as file:
        assert int(file["VTKHDF/Steps"].attrs["NSteps"]) == 3


def mean_stress(force):
    """Stress xx, yy [Pa] of a window whose discs exert these forces on the nodes of the rim; tension positive."""
    area = (HIGH - LOW) ** 2
    return tuple(-sum(node[i] * f[i] for node, f in zip(RIM, force, strict=True)) / area for i in range(2))
