"""The [grid] table: every kind takes its own keys, and says which."""

import pytest
from pydantic import ValidationError

from coupler_protocol.scene.tables.grid import Graded, Grid

SLOPE = {"length": 20.0, "height": 12.0, "zone_size": 0.5, "profile": [(0, 4), (8, 12), (20, 12)]}
BOX = {"kind": "box", "length": 20.0, "height": 12.0, "zone_size": 0.5}
RING = {"kind": "ring", "inner": 1.0, "outer": 5.0, "around": 32}
GRADED = {"x": (2.0, 4.0), "ratio": 1.1}


@pytest.mark.parametrize(
    "table", [SLOPE, SLOPE | {"fit": "profile", "graded": GRADED}, BOX, BOX | {"graded": GRADED}, RING | {"part": "half"}]
)
def test_every_kind_takes_its_keys_and_reads_back_what_it_resolved_to(table):
    grid = Grid(**table)
    assert Grid(**grid.model_dump(mode="json")) == grid
    assert grid.regular == (table in (SLOPE, BOX))


@pytest.mark.parametrize(
    ("table", "words"),
    [
        (SLOPE | {"profile": None}, 'kind = "slope" needs profile'),
        ({"kind": "slope"}, "needs length, height, zone_size, profile"),
        (BOX | {"profile": [(0, 4), (20, 4)]}, 'kind = "box" takes no profile'),
        (BOX | {"fit": "profile"}, 'kind = "box" takes no fit'),
        (RING | {"zone_size": 1.0}, 'kind = "ring" takes no zone_size'),
        (RING | {"outer": 0.5}, "must be larger than the inner one, 1 m"),
        (SLOPE | {"graded": GRADED}, 'use fit = "profile" with graded'),
        (SLOPE | {"inner": 1.0}, 'kind = "slope" takes no inner'),
    ],
)
def test_keys_of_another_kind_are_refused(table, words):
    with pytest.raises(ValidationError, match=words):
        Grid(**table)


def test_a_graded_rectangle_has_an_extent():
    with pytest.raises(ValidationError, match="give x"):
        Graded(ratio=1.1)
    with pytest.raises(ValidationError, match="first < last"):
        Graded(y=(3.0, 3.0), ratio=1.1)
