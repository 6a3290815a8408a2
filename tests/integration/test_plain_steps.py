"""Plain steps in one compiled call have the bits of the loop step by step, in every form of coupling that takes them."""

import copy

import pytest

from colluvium import open_run
from colluvium.results.timeline import intervals
from colluvium.running.threads import run
from coupler_protocol.compiled import threads
from coupler_protocol.process.plugin import from_functions, interval_of
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.wire import lanes
from coupler_protocol.wire.lanes import Lanes
from dem_server.step import thread_shares
from fdm_server.coupling import exchange_pauses
from fdm_server.step import thread_parts
from tests.integration.measured_frames import assert_histories_are_those_of_frames
from tests.same_bits import differing
from tests.window_scenes import BOX, uniform

SMALL = [[1.0, 1.0], [3.0, 1.0], [3.0, 3.0], [1.0, 3.0]]
OTHER = [[4.5, 3.5], [6.5, 3.5], [6.5, 5.0], [4.5, 5.0]]
STONES = {"content": 0.2, "size": {"mean": 0.5, "sigma": 0.1, "min": 0.4, "max": 0.6}, "gap": 0.05, "body": "clump"}
TRACED = 100  # steps of every stage
STONE = {"density": 2700.0, "spring": {"normal": 1e8, "shear": 1e8}, "friction": {"coefficient": 1.0}}


@pytest.fixture(autouse=True)
def _from_the_first_step(monkeypatch):
    """Plain steps begin at once, not only in long runs."""
    monkeypatch.setattr(lanes, "EARLIEST", 0)


def scene(**more):
    """Uniform ground with a window of discs; then a third more gravity at once, so that both codes move."""
    data = uniform(copy.deepcopy(BOX), SMALL, radius=0.08)
    data["material"][0] |= {"mohr_coulomb": {"cohesion": 60e3, "friction": 30.0}}
    data["record"] = {"every": 60, "history": 10}
    data["stage"][0]["until"] = {"steps": 50}
    data["stage"][2] |= {"handover": 40, "until": {"steps": 95}}
    data["stage"].append({"name": "more", "kind": "overload", "gravity": 2.0, "until": {"steps": 130}})
    for path, value in more.items():
        place = data
        *tables, key = path.split("__")
        for name in tables:
            place = place[int(name)] if name.isdigit() else place.setdefault(name, {})
        place[key] = value
    return data


def both_ways(tmp_path, data, plugin=None, sizes=(1, 1)):
    """Runs of a scene in one process, over a lane and without one: the first one's rows of coupled stages in run.json.

    sizes: number of threads of each run.
    """
    for (name, lane), size in zip((("lane", None), ("link", False)), sizes, strict=True):
        (tmp_path / name).mkdir()
        own = copy.deepcopy(data)
        if lane is not None:
            own["link"] = {"lane": lane}
        threads.set_size(size)
        try:
            run(build_scene(own), tmp_path / name, plugin=plugin)
        finally:
            threads.set_size(1)
    with open_run(tmp_path / "lane") as found, open_run(tmp_path / "link") as other:
        rows, plain = ([row for row in one.info["stages"] if "plain_steps" in row] for one in (found, other))
    assert all(row["plain_steps"] == 0 and row["one_by_one"] for row in plain)
    for name in ("steps", "ended_by", "exchanges", "fell_back"):
        assert [row.get(name) for row in rows] == [row.get(name) for row in plain], name
    return rows


def same_files(tmp_path):
    """Names of datasets of frames, histories and checkpoints that differ."""
    # a machine that compiles for long saves checkpoints inside of stages, by its clock
    names = sorted(p.name for p in (tmp_path / "lane").iterdir() if p.suffix in (".h5", ".vtkhdf") and "@" not in p.name)
    assert len(names) >= 6
    return [(name, found) for name in names for found in differing(tmp_path / "lane" / name, tmp_path / "link" / name)]


def waits_are_traced(folder):
    """Each side of a run waited once in every traced step of its last stage, and its intervals do not overlap."""
    with open_run(folder) as found:
        of_sides = intervals(found)
    for side, traced in of_sides.items():
        own = traced.where(traced.stage == "more")
        waits = own.where(own.activity == "waiting")
        assert waits.step.tolist() == list(range(TRACED)), side
        assert (own.begin[1:] >= own.end[:-1]).all(), side
        assert (own.activity == "recording").sum() < TRACED // 2, side


SHORT = "large strain, clumps, regions"
REGIONS = {"core": (2.1, 2.0, 0.6), "edge": [[1.1, 1.1], [2.9, 1.3], [2.0, 2.8]]}
MEASURE = [{"name": "core", "centre": [2.1, 2.0], "radius": 0.6}, {"name": "edge", "polygon": REGIONS["edge"]}]
SIDES = "averages at gridpoints, quiet sides, a side that moves"
SHAKEN = "energies, a rigid and a compliant side that shake"
QUIET = [{"on": "left", "quiet": True}, {"on": "bottom", "quiet": True}]
CASES = {
    "two windows, paper's mapping, combined damping, histories of every third step": {
        "window": [{"name": "a", "polygon": SMALL}, {"name": "b", "polygon": OTHER}],
        "coupling__mapping": "paper",
        "damping": {"combined": 0.8},
        "record__history": 3,
    },
    SHORT: {"grid__large_strain": True, "stones": STONES, "discs__stone": STONE, "record__trace": TRACED}
    | {
        "measure": MEASURE,
        "record__measure": 45,
    },
    SIDES: {
        "grid__mixed": "nodal",
        "stage__2__time": "real",
        "stage__2__boundary": [*QUIET, {"on": "top", "velocity": {"x": 2e-3, "y": -3e-3}, "over": 90}],
        "stage__3__time": "real",
        "stage__3__boundary": [{"on": "top", "velocity": {"x": 0.0, "y": 1e-3}, "over": 70}],
    },
    SHAKEN: {
        "record__energy": True,
        "stage__3__time": "real",
        "stage__3__boundary": [
            {"on": "bottom", "shaking": {"file": "base.csv", "base": "compliant", "x": 0.01, "y": 1e-3}},
            {"on": "left", "shaking": {"file": "base.csv", "base": "rigid", "x": 0.02}},
        ],
    },
    "large strain, averages of elastic zones at gridpoints": {
        "grid__large_strain": True,
        "grid__mixed": "nodal",
        "material__0__mohr_coulomb": None,
    },
    "quiet sides, Rayleigh damping": {
        "stage__3__time": "real",
        "stage__3__boundary": QUIET,
        "stage__3__damping": {"rayleigh": {"fraction": 0.05, "frequency": 20.0}},
    },
    "sides that move one after the other, come back and rest, histories of every step": {
        "record__history": 1,
        "stage__2__boundary": [
            {"on": "top", "x": [2.0, 5.0], "name": "plate", "velocity": {"y": -2e-6}, "over": 30},
            {"on": "left", "velocity": {"x": 1e-6, "y": 0.0}},
        ],
        "stage__3__boundary": [{"on": "left", "fix": "xy"}, {"on": "top", "name": "plate", "velocity": {"y": 1e-6}, "over": 50}],
    },
    "real time, Rayleigh damping, large strain": {
        "grid__large_strain": True,
        "stage__3__time": "real",
        "stage__3__damping": {"rayleigh": {"fraction": 0.05, "frequency": 20.0}},
    },
    "real time, three sub-steps of the discs, clumps": {
        "stage__3__time": "real",
        "coupling__substeps": 3,
        "stones": STONES,
        "discs__stone": STONE,
    },
    "energies, averages at gridpoints, a side that moves, two windows, histories of every third step": {
        "window": [{"name": "a", "polygon": SMALL}, {"name": "b", "polygon": OTHER}],
        "record__energy": True,
        "record__history": 3,
        "grid__mixed": "nodal",
        "stage__3__boundary": [{"on": "left", "velocity": {"x": 1e-6, "y": 0.0}}],
    },
    "up to ten steps between exchanges, two windows, energies, gravity that rises": {
        "window": [{"name": "a", "polygon": SMALL}, {"name": "b", "polygon": OTHER}],
        "coupling__exchange_every": 10,
        "record__energy": True,
        "stage__3__gravity_factor": {"to": 3.0, "over": 120},
    },
    "two steps between exchanges, large strain, clumps, histories of every third step": {
        "coupling__exchange_every": 2,
        "grid__large_strain": True,
        "stones": STONES,
        "discs__stone": STONE,
        "record__history": 3,
    },
    "energies, real time, Rayleigh damping, three sub-steps of the discs, clumps": {
        "record__energy": True,
        "stage__3__time": "real",
        "stage__3__damping": {"rayleigh": {"fraction": 0.05, "frequency": 20.0}},
        "coupling__substeps": 3,
        "stones": STONES,
        "discs__stone": STONE,
    },
}


LONG = [case for case in CASES if case not in (SHORT, SIDES, SHAKEN)]
MOST_PLAIN = 0.8  # share of plain steps: a compiled call also ends by the clock, more often on a busy machine


def with_motion(data, folder):
    """A scene whose sides shake by a file in the folder, if they shake."""
    for boundary in data["stage"][3].get("boundary", []):
        if "shaking" in boundary:
            boundary["shaking"] |= {"file": str(folder / "base.csv")}
            (folder / "base.csv").write_text("time,x,y\n0,0,0\n0.002,1,-1\n0.006,-1,1\n0.01,0,0\n")
    return data


@pytest.mark.parametrize(
    "case",
    [
        SHORT,
        *(pytest.param(case, marks=pytest.mark.long) for case in (SIDES, *LONG[::2])),
        *(pytest.param(case, marks=[pytest.mark.long, pytest.mark.trial]) for case in (SHAKEN, *LONG[1::2])),
    ],
)
def test_the_bits_are_those_of_the_loop_step_by_step(tmp_path, case):
    data = with_motion(scene(**CASES[case]), tmp_path)
    rows = both_ways(tmp_path, data)
    assert same_files(tmp_path) == []
    history = CASES[case].get("record__history", 10)
    seen = 6 + (8 if "measure" in CASES[case] else 0)  # steps that begin a stage, or that measuring sees
    for row in rows:
        assert "one_by_one" not in row
        assert row["plain_steps"] >= MOST_PLAIN * row["steps"] - seen, (row, history)
        assert "one_by_one_discrete" not in row
        assert all(plain >= MOST_PLAIN * row["steps"] - seen for plain in row["plain_steps_discrete"]), row
    if every := CASES[case].get("coupling__exchange_every"):
        assert all(row["steps"] / every <= row["exchanges"] < 0.7 * row["steps"] and not row["fell_back"] for row in rows), rows
    if "record__trace" in CASES[case]:
        waits_are_traced(tmp_path / "lane")
    if "measure" in CASES[case]:
        with open_run(tmp_path / "lane") as found:
            assert assert_histories_are_those_of_frames(found, REGIONS) >= 8
            steps, _ = found.history("sliding:core", 1)
            assert set(range(90, 276, 45)) <= set(steps.tolist())


@pytest.mark.parametrize("every", [1, pytest.param(10, marks=pytest.mark.long)])
@pytest.mark.parametrize("until", [{"ratio": 3e-2, "steps": 900}, {"displacement": 8.5e-5, "steps": 900}])
def test_a_stage_ends_by_what_compiled_code_has_seen_as_step_by_step(tmp_path, until, every):
    """Compiled looks compare ratios and displacement with the limits of the stage; the end is that of the loop step by step.

    With several steps between exchanges they compare in the first step under new forces.
    """
    rows = both_ways(tmp_path, scene(stage__3__until=until, record__every=1000, coupling__exchange_every=every))
    assert same_files(tmp_path) == []
    assert rows[-1]["ended_by"].partition(" ")[0] in until
    assert rows[-1]["plain_steps"] >= MOST_PLAIN * rows[-1]["steps"] - 6
    assert 30 < rows[-1]["steps"] < 900


@pytest.mark.long
def test_plain_steps_return_to_an_exchange_in_every_step(tmp_path, monkeypatch):
    """A limit of the stiffness ratio so low that the stages fall back with the first forces."""
    monkeypatch.setattr(exchange_pauses, "STIFFEST", 1e-3)
    rows = both_ways(tmp_path, scene(coupling__exchange_every=10))
    assert same_files(tmp_path) == []
    assert "times as stiff" in rows[-1]["fell_back"]
    assert all(row["plain_steps"] >= MOST_PLAIN * row["steps"] - 6 for row in rows)


def test_plain_steps_follow_a_load_that_has_come_to_its_end(tmp_path):
    """A pit is dug beside the window over 40 steps of the last stage: those are taken one by one, the others are plain."""
    pit = {"polygon": [[4.5, 4.0], [6.0, 4.0], [6.0, 5.0], [4.5, 5.0]], "over": 40, "ratio": 0.0}
    data = scene(record__every=1000)
    data["stage"][3] = {"name": "dig", "kind": "excavate", "excavate": pit, "until": {"steps": 130}}
    rows = both_ways(tmp_path, data)
    assert same_files(tmp_path) == []
    assert 80 <= rows[-1]["plain_steps"] <= 90
    assert "one_by_one" not in rows[-1]


@pytest.mark.trial
@pytest.mark.long
@pytest.mark.parametrize("case", ["static", "real time, clumps, large strain"])
def test_several_threads_share_plain_steps(tmp_path, monkeypatch, case):
    """Plain steps of two threads on both sides have the bits of one thread step by step.

    The scene has three runs of discs and three strips, in which two threads gain nothing.
    """
    for module in (thread_shares, thread_parts):
        monkeypatch.setattr(module, "FEWEST", 1)
    more = {"grid__length": 15.0, "grid__height": 13.0, "grid__zone_size": 0.25, "discs__radius": 0.0155}
    if case != "static":
        more |= {"grid__large_strain": True, "stage__3__time": "real", "coupling__substeps": 2}
        more |= {"stones": STONES, "discs__stone": STONE}
    rows = both_ways(tmp_path, scene(**more), sizes=(2, 1))
    assert same_files(tmp_path) == []
    for row in rows:
        assert "one_by_one" not in row
        assert "one_by_one_discrete" not in row
        assert all(plain > row["steps"] - 12 for plain in (row["plain_steps"], *row["plain_steps_discrete"])), row


def test_a_lane_that_breaks_leaves_its_steps_to_the_link(tmp_path, monkeypatch):
    """The connection is closed at the third look of a side: the run goes on over the link, with the same bits."""
    taken = []
    said = Lanes.said

    def break_once(lanes, row):
        taken.append(row)
        if len(taken) == 7:
            lanes.sockets[row].shutdown(2)
        return said(lanes, row)

    monkeypatch.setattr(Lanes, "said", break_once)
    rows = both_ways(tmp_path, scene(link__timeout=0.2, **CASES[SHORT]))
    assert same_files(tmp_path) == []
    assert 0 < sum(row["plain_steps"] for row in rows) < 150


@pytest.mark.parametrize(("every", "pause"), [(7, 1), (1, 1), pytest.param(7, 10, marks=pytest.mark.long)])
def test_a_plugin_is_called_between_plain_steps(tmp_path, every, pause):
    """It sees and changes the same states after the same steps; if it is called after every step, there are no plain ones."""
    assert interval_of(from_functions(on_stage=print)) == interval_of(None) == 0
    seen = {0: [], 1: []}

    def push(moment):
        state = moment.state
        seen[moment.rank].append((moment.step, moment.stage, state.velocity.sum() if moment.rank == 0 else state.v.sum()))
        if moment.rank == 0:
            state.applied[30] += (5.0, -20.0)
        else:
            state.load[-1, :3] += (0.0, -3.0, 0.1)

    rows = both_ways(tmp_path, scene(coupling__exchange_every=pause), from_functions(on_step=(every, push)))
    assert same_files(tmp_path) == []
    for rank, calls in seen.items():
        half = len(calls) // 2
        assert calls[:half] == calls[half:], rank
        coupled = [step for step, stage, _ in calls[:half] if stage in ("couple", "more")]
        assert coupled == [step for step in range(51, 276) if step % every == 0], rank
    for row in rows:
        most = row["steps"] - row["steps"] // every if every > 1 else 0
        for plain in (row["plain_steps"], *row["plain_steps_discrete"]):
            assert most - 10 <= plain <= most
        said = [row.get("one_by_one"), *row.get("one_by_one_discrete", [None])]
        assert said == [None if every > 1 else "a plugin is called after every step"] * 2
