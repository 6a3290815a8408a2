"""Whatever the interval between exchanges: one process or two, over a lane or without one, the same bits.

The load lets new lists of contacts fall on steps that no exchange follows: sums of the mass rule must belong to those steps.
"""

import copy
import tomllib

import pytest

import colluvium
from coupler_protocol.files import checkpoint
from coupler_protocol.wire import lanes
from tests.same_bits import differing

RUNS = {"lane": (True, None), "link": (True, False), "two": (False, None), "two, link": (False, False)}  # in one process, lane
CASES = [
    pytest.param(every, name, marks=() if (every, name) == (10, "link") else pytest.mark.long)
    for every in (1, 2, 5, 10, 50)
    for name in list(RUNS)[1:]
    if name == "link" or every == 5
]


@pytest.fixture(autouse=True)
def _from_the_first_step(monkeypatch):
    """Plain steps begin at once, not only in long runs."""
    monkeypatch.setattr(lanes, "EARLIEST", 0)


@pytest.fixture(scope="module")
def tables(configs):
    """The quick slope under gravity that grows to six times its value; bonds that do not break."""
    data = tomllib.loads((configs / "quick_slope.toml").read_text(encoding="utf-8"))
    data["record"] = {"every": 100, "history": 10}
    data["discs"]["soil"]["bond"] = {"tension": 1e9, "shear": 1e9}
    data["stage"][0]["until"] = {"steps": 600}
    data["stage"][2] |= {"handover": 100, "until": {"steps": 300}}
    data["stage"][3] |= {"gravity_factor": {"to": 6.0, "over": 300}, "until": {"steps": 400}}
    return data


def computed(tables, every, name, out):
    """Folder of a run."""
    alone, lane = RUNS[name]
    own = copy.deepcopy(tables) | {"coupling": {"exchange_every": every}} | ({} if lane is None else {"link": {"lane": lane}})
    with colluvium.run(colluvium.Scene(**own), out, in_process=alone) as run:
        return run.folders[0], [row for row in run.info["stages"] if "plain_steps" in row]


@pytest.mark.parametrize(("every", "name"), CASES)
def test_bits_do_not_depend_on_how_steps_are_taken(tables, every, name, tmp_path):
    first, rows = computed(tables, every, "lane", tmp_path / "a")
    second, others = computed(tables, every, name, tmp_path / "b")
    files = sorted(p.name for p in first.iterdir() if p.suffix in (".h5", ".vtkhdf") and "@" not in p.name)
    assert len(files) >= 6
    assert [(file, found) for file in files for found in differing(first / file, second / file)] == []
    assert all(row["plain_steps"] > 0.8 * row["steps"] for row in rows)
    if name == "link":
        assert all(row["plain_steps"] == 0 for row in others)
    assert [row.get("exchanges") for row in rows] == [row.get("exchanges") for row in others]
    if every > 1:
        assert all(row["exchanges"] < row["steps"] for row in rows)
        builds = [int(checkpoint.load(first / f"dem.rank1.{stage}.h5")[0]["rim"]["builds"]) for stage in ("couple", "overload")]
        assert builds[1] > builds[0] + 1  # lists that are new between exchanges
