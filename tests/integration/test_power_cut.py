"""A power cut at any file operation of a run: the same command goes on to the same bits, or says which file is damaged.

tests/coupler_protocol/files/test_undo_log.py has the same for files of frames alone, with more seeds.
"""

import pytest

from colluvium import Scene
from coupler_protocol.exits import EnvironmentFailed
from tests.integration.kills import goes_on
from tests.integration.power_cuts import Disk, found_after_start, states
from tests.integration.same_runs import assert_same_runs
from tests.integration.test_checkpoints import EVERY, GROUND, STAGES, coupled

pytestmark = pytest.mark.long
SCENES = {  # with every how many states are tried
    "grid": (GROUND | {"stage": [STAGES[0] | {"until": {"steps": 65}}], "record": EVERY}, 1),
    "coupled": (coupled("static"), 12),
}


@pytest.mark.parametrize("name", [pytest.param(name, marks=[pytest.mark.trial] if name == "coupled" else []) for name in SCENES])
def test_a_run_goes_on_after_a_power_cut(tmp_path, name):
    tables, every = SCENES[name]
    scene, straight = Scene(**tables), tmp_path / "straight"
    straight.mkdir()
    with Disk(straight) as disk:
        goes_on(scene, straight)
    found = list(states(disk.cuts))[::every]
    assert len(found) > 15
    refused = {}
    for number, (what, state) in enumerate(found):
        out = tmp_path / str(number)
        found_after_start(out, state)
        try:
            goes_on(scene, out)
        except EnvironmentFailed as error:
            refused[what] = str(error)
        else:
            assert_same_runs(straight, out)
    assert refused == {}, "nothing that a run needs is lost"
