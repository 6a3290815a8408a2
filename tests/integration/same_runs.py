"""Whether two runs have the same results: frames, histories, checkpoints of stage ends, physical numbers of run.json."""

import json

import numpy as np

from colluvium import open_run
from tests.same_bits import differing

TIMES = (
    "start",
    "end",
    "seconds",
    "peak_memory_MB",
    "attempts",
    "begins_after",
    "host",
    "packing_seconds",
    "plain_steps",
    "one_by_one",
    "plain_steps_discrete",
    "one_by_one_discrete",
    "compiled",
    "run",
)


def assert_same_runs(a, b):
    """All results of the run in folder b are the bits of those in folder a."""
    ends = sorted(path.name for path in a.glob("*.h5") if "@" not in path.name)
    assert ends == sorted(path.name for path in b.glob("*.h5") if "@" not in path.name and "stopped" not in path.name)
    assert {name: differing(a / name, b / name) for name in ends if differing(a / name, b / name)} == {}
    with open_run(a) as one, open_run(b) as two:
        assert one.frames == two.frames
        assert sorted(one.files) == sorted(two.files)
        for rank, file in one.files.items():
            assert_same_files(file, two.files[rank])
    assert physical(a) == physical(b)


def assert_same_files(one, two):
    """Frames and histories of one rank."""
    assert one.frames == two.frames
    for row in range(len(one.frames)):
        places = [(one.points(row), two.points(row))]
        places += [(one.zones(row), two.zones(row))] if one.kind == "continuum" else [(one.contacts(row), two.contacts(row))]
        for x, y in places:
            assert x.names == y.names
            assert [name for name in x.names if x[name].tobytes() != y[name].tobytes()] == [], one.frames[row]
    assert sorted(one.history_names()) == sorted(two.history_names())
    for name in one.history_names():
        for mine, theirs in zip(one.history(name), two.history(name), strict=True):
            np.testing.assert_array_equal(mine, theirs, err_msg=name)


def physical(folder):
    """Content of run.json without times, places and memory."""
    return without(json.loads((folder / "run.json").read_text(encoding="utf-8")))


def without(value):
    """The same without the keys of TIMES."""
    if isinstance(value, dict):
        return {key: without(item) for key, item in value.items() if key not in TIMES}
    return [without(item) for item in value] if isinstance(value, list) else value
