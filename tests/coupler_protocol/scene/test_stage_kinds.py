"""One row a kind of stage: every list follows from the rows, and both sides know every kind."""

from typing import get_args

from coupler_protocol.scene import stage_kinds
from coupler_protocol.scene.scene import scene_class
from coupler_protocol.scene.tables.stages import Stage
from fdm_server.procedure import kinds


def test_a_scene_takes_every_kind_and_says_what_it_is():
    field = Stage.model_fields["kind"]
    assert get_args(field.annotation) == stage_kinds.NAMES
    assert all(f"{kind.name}: {kind.meaning}" in field.description for kind in stage_kinds.KINDS)


def test_the_grid_has_a_function_for_every_kind_of_a_grid():
    assert tuple(kinds.KINDS) == stage_kinds.named(grid=True)


def test_discs_alone_are_made_once_and_then_take_steps():
    assert stage_kinds.named(alone=True, computes=False) == ("fill",)
    assert stage_kinds.named(alone=True, computes=True, grid=False) == ("discs",)


def test_tables_and_keys_of_a_kind_are_keys_of_a_stage():
    known = set(scene_class().model_fields["stage"].annotation.__args__[0].model_fields)
    for kind in stage_kinds.KINDS:
        assert {*kind.keys, *filter(None, [kind.table])} <= known, kind.name
        assert kind.needs in ("", *stage_kinds.NAMES)
