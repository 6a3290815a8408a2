"""A power cut at any file operation of a run: the same command goes on to the same bits, or says which file is damaged.

tests/coupler_protocol/files/test_undo_log.py has the same for files of frames alone, with more seeds.
"""

import contextlib

import pytest

from colluvium import Scene, api, open_run
from coupler_protocol.exits import EnvironmentFailed, FinishedBefore
from tests.integration.kills import goes_on
from tests.integration.power_cuts import Disk, found_after_start, states
from tests.integration.same_runs import assert_same_runs
from tests.integration.test_checkpoints import EVERY, GROUND, STAGES, coupled

pytestmark = pytest.mark.long
COUPLED = coupled("static")
SCENES = {  # with every how many states are tried
    "grid": (GROUND | {"stage": [STAGES[0] | {"until": {"steps": 65}}], "record": EVERY}, 1),
    "coupled": (COUPLED, 12),
}


def cuts_of(scene, straight):
    """Power cuts of an undisturbed run into the folder `straight`."""
    straight.mkdir()
    with Disk(straight) as disk:
        goes_on(scene, straight)
    return disk.cuts


def refused(scene, straight, found, tmp_path):
    """Reasons of those that do not go on after the cuts `found`; all others have the bits of the run in `straight`."""
    reasons = {}
    for number, (what, state) in enumerate(found):
        out = tmp_path / str(number)
        found_after_start(out, state)
        try:
            looked_at(out)
            with contextlib.suppress(FinishedBefore):
                api.to_go_on(out, scene=scene)  # as `colluvium run` does; a server alone asks the same of its own files
            goes_on(scene, out)
        except EnvironmentFailed as error:
            reasons[what] = str(error)
        else:
            assert_same_runs(straight, out)
    return reasons


def looked_at(out):
    """Reads all frames before the run goes on, if a file has any for certain."""
    with contextlib.suppress(FileNotFoundError, EnvironmentFailed), open_run(out) as run:
        for number in range(len(run.frames)):
            for fields in run.bodies(number):
                assert len(fields.velocity) == len(fields.xy)


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.trial] if name == "coupled" else []) for name in SCENES])
def test_a_run_goes_on_after_a_power_cut(tmp_path, name):
    tables, every = SCENES[name]
    scene, straight = Scene(**tables), tmp_path / "straight"
    found = list(states(cuts_of(scene, straight)))[::every]
    assert len(found) > 15
    assert refused(scene, straight, found, tmp_path) == {}, "nothing that a run needs is lost"


def test_a_run_goes_on_after_a_power_cut_of_one_machine_of_two(tmp_path):
    """The files of one side are those of a disk, the files of the other one are whole: a few cuts of either side."""
    scene, straight = Scene(**COUPLED), tmp_path / "straight"
    cuts = cuts_of(scene, straight)
    for side in ("fdm.", "dem."):
        found = [*states(cuts, side=side)]
        assert len(found) > 100
        (tmp_path / side).mkdir()
        assert refused(scene, straight, found[7 :: len(found) // 4], tmp_path / side) == {}, "nothing that a run needs is lost"
