"""Numbers spoilt in the middle of a stage: both sides stop, name them and save, and the run goes on from the last stage end."""

import json

import numpy as np
import pytest

import colluvium
from colluvium.running import threads
from coupler_protocol.exits import ENVIRONMENT, PHYSICS, RunEnded
from coupler_protocol.files import checkpoint
from coupler_protocol.files.restart import Origin
from coupler_protocol.process.plugin import from_functions
from coupler_protocol.scene.reader import build_scene
from coupler_protocol.wire import lanes
from tests.integration.test_plain_steps import CASES as CASES_OF_PLAIN_STEPS
from tests.integration.test_plain_steps import SHORT as SHORT_CASE
from tests.integration.test_plain_steps import scene
from tests.same_bits import differing

SIDES = ("fdm.rank0", "dem.rank1")
POINT = 20  # a gridpoint below the window
THERE = r"gridpoint 20 at \(2, 0\.5\)"
AT = 195  # step of the run at which numbers are spoilt; the last stage has steps 145 to 275
EVERY = {"one by one": 1, "plain steps": 15}
LAST = "more"


def data():
    """Tables of a scene in large strain, with clumps, whose kernels test_plain_steps.py compiles."""
    return scene(**CASES_OF_PLAIN_STEPS[SHORT_CASE])


@pytest.fixture(scope="module")
def straight(tmp_path_factory):
    """The undisturbed run."""
    out = tmp_path_factory.mktemp("straight")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(lanes, "EARLIEST", 0)
        colluvium.run(data(), out, on_step=(15, lambda moment: None)).close()
    return out


def set_nan(name, *place):
    def spoil(moment):
        getattr(moment.state, name)[place] = np.nan

    return spoil


def disc(moment):
    """The disc of the soil that is nearest to the middle of the window."""
    away = np.hypot(*(moment.state.x - [2.0, 2.0]).T)
    away[moment.state.clumps.body >= 0] = np.inf
    away[: moment.model.ring] = np.inf
    return int(away.argmin())


def nan_of_disc(name):
    def spoil(moment):
        getattr(moment.state, name)[disc(moment)] = np.nan

    return spoil


def invert(moment):
    """A gridpoint changes over to the other side of its zones."""
    moment.state.displacement[POINT] += [0.8, 0.8]


def escape(moment):
    moment.state.x[disc(moment)] = [0.2, 0.2]


def wrong_pair(moment):
    moment.state.second[3] = 4_000_000_000


def wrong_kind(moment):
    moment.state.kind[3] = 200


GRID, DISCS = 0, 1
FAULTS = {  # name: (rank, what spoils, words at once, words of the run itself)
    "velocity of a gridpoint": (
        GRID,
        set_nan("velocity", POINT),
        "velocity of " + THERE,
        r"gridpoints|rim",
    ),
    "force on a gridpoint": (
        GRID,
        set_nan("force", POINT),
        "force of zones of " + THERE,
        r"gridpoints|rim",
    ),
    "applied force": (GRID, set_nan("applied", POINT), "applied force of " + THERE, r"gridpoints|rim"),
    "stress of zones": (GRID, set_nan("stress", 0), r"stress of zone \d+ at \(.*more", r"gridpoints|rim"),
    "inverted zone": (GRID, invert, "zones are inverted.*the first is zone", "zones are inverted.*the first is zone"),
    "velocity of a disc": (DISCS, nan_of_disc("v"), r"velocity of disc \d+ near \(", r"disc \d+"),
    "position of a disc": (DISCS, nan_of_disc("x"), r"position of disc \d+ near \(", r"disc \d+"),
    "force on a disc": (DISCS, nan_of_disc("force"), r"force of disc \d+ near \(", r"disc \d+"),
    "escaped disc": (DISCS, escape, r"disc \d+ .* is at \(0\.2, 0\.2\)", r"disc \d+ .* is at \(0\.2, 0\.2\)"),
    "pair of no disc": (DISCS, wrong_pair, "list of pairs is damaged.*second holds 4000000000", None),
    "pair of no kind": (DISCS, wrong_kind, "list of pairs is damaged.*kind holds 200", None),
}
SHORT = ("velocity of a gridpoint", "force on a disc", "escaped disc", "pair of no disc")


def spoilt(out, rank, spoil, every, origin):
    """The error with which the run ends whose numbers are spoilt once, which is saved by both sides."""
    done = []

    def at(moment):
        if moment.rank == rank and moment.step == AT and not done:
            done.append(moment.step)
            spoil(moment)

    out.mkdir()
    scene = build_scene(data())
    with pytest.raises(RunEnded) as caught:
        threads.run(scene, out, origin=origin, plugin=from_functions(None, (every, at)))
    assert done
    info = json.loads((out / "run.json").read_text())
    assert info["exit_code"] == caught.value.code
    assert info["reason"].endswith(str(caught.value))
    assert AT <= info["steps"] <= AT + 20
    for side in SIDES:
        assert checkpoint.load(out / f"{side}.stopped.h5")
    return caught


def goes_on(out, straight):
    """The run goes on from the end of the stage before, without the fault, to the bits of the undisturbed one."""
    colluvium.resume(out, on_step=(15, lambda moment: None)).close()
    for side in SIDES:
        assert differing(straight / f"{side}.{LAST}.h5", out / f"{side}.{LAST}.h5") == []


def marks(name, way):
    """Four faults are short tests, the others long ones; step by step they are trials."""
    if way == "one by one":
        return (pytest.mark.long, pytest.mark.trial)
    return () if name in SHORT else (pytest.mark.long,)


CASES = [pytest.param(name, way, marks=marks(name, way)) for name in FAULTS for way in EVERY]


@pytest.mark.parametrize(("name", "way"), CASES)
def test_spoilt_numbers_end_the_run_by_name(tmp_path, straight, monkeypatch, name, way):
    monkeypatch.setattr(lanes, "EARLIEST", 0)
    rank, spoil, words, _ = FAULTS[name]
    caught = spoilt(tmp_path / "run", rank, spoil, EVERY[way], Origin(straight, "couple"))
    assert caught.value.code == (ENVIRONMENT if "list of pairs" in words else PHYSICS)
    assert caught.match(words)
    assert caught.match(f"stage '{LAST}'")
    goes_on(tmp_path / "run", straight)


RUN_ITSELF = [name for name, (*_, own) in FAULTS.items() if own is not None]


@pytest.mark.long
@pytest.mark.trial
@pytest.mark.parametrize("way", EVERY)
@pytest.mark.parametrize("name", RUN_ITSELF)
def test_numbers_that_go_wrong_by_themselves_are_noticed_by_the_next_look(tmp_path, straight, monkeypatch, name, way):
    """Without the check that follows functions of a user."""
    monkeypatch.setattr(lanes, "EARLIEST", 0)
    for package in ("fdm_server", "dem_server"):
        monkeypatch.setattr(f"{package}.procedure.soundness.check", lambda moment: None)
    rank, spoil, _, words = FAULTS[name]
    caught = spoilt(tmp_path / "run", rank, spoil, EVERY[way], Origin(straight, "couple"))
    assert caught.value.code == PHYSICS
    assert caught.match(words)
    assert caught.match(r"step \d+")
