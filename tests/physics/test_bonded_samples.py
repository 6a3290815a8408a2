"""Samples that are pressed first and get friction and bonds then, from a stage on: no bond breaks in the press."""

import pytest
from test_servo import box
from verification.discrete import scenes

PRESSURE = 1e5
STIFF = {"density": 2000.0, "spring": {"normal": 1e9, "shear": 1e8}}
BEGINS = {"friction": {"coefficient": 0.5}, "bond": {"tension": 3e3, "shear": 7e3}}
REST = {"kind": "discs", "until": {"ratio": 1e-6, "steps": 30000}}


def sample(soil, stages):
    """The run of a box with servos on all sides, walls one radius inside the packing."""
    polygon, walls = box(0.0, (PRESSURE, PRESSURE), inside=0.05)
    for wall in walls:
        wall["servo"]["fastest"] = 1e-5
    discs = {"radius": 0.05, "confinement": 1e5, "wall": walls, "damping": {"local": 0.7}, "soil": soil}
    ring = {"spring": STIFF["spring"]}
    return scenes.of_tables(scenes.tables(stages, discs, window=[{"name": "box", "polygon": polygon}], ring=ring))


def test_bonds_that_begin_after_the_press_are_whole():
    bonded = {"discs": {"soil": BEGINS}}
    with sample(STIFF, [REST | {"name": "press"}, REST | {"name": "bond"} | bonded]) as run:
        press, bond = run.info["stages"][1:]
        count = len(run.discs(run.last_frame("bond")).radius)
        pressure = run.history("wall_pressure:1")[1]
    assert press["ended_by"].startswith("ratio")
    assert bond["ended_by"].startswith("ratio")
    assert press["bonds_broken"] == bond["bonds_broken"] == [0]
    assert bond["changes"]["bonds_made"] == pytest.approx(1.65 * count, rel=0.1)  # contacts between discs; many touch a wall
    assert pressure[-1] == pytest.approx(PRESSURE, rel=1e-4)


def test_bonds_made_at_the_packing_break_in_the_press():
    """The same sample bonded at the end of `fill`: walls half a radius inside press it so hard that bonds break."""
    with sample(STIFF | BEGINS, [REST | {"name": "press"}]) as run:
        assert run.info["stages"][1]["bonds_broken"][0] > 50


def test_friction_that_begins_after_the_press_acts():
    """A box pressed smooth and then squeezed from two sides: without friction it yields at once, with friction later."""
    strength = []
    for changes in ({}, {"discs": {"soil": {"friction": {"coefficient": 0.5}}}}):
        squeeze = {"name": "squeeze", "kind": "discs", "until": {"steps": 3000}} | changes
        down = [{"name": "1"}, {"name": "3", "velocity": [0.0, -1e-6]}]
        with sample(STIFF, [REST | {"name": "press"}, squeeze | {"wall": down}]) as run:
            steps, axial = run.history("wall_pressure:3")
            later = steps > run.frames[run.last_frame("press")].step
            strength.append(float((axial / run.history("wall_pressure:2")[1])[later].max()))
    assert strength[1] > 1.2 * strength[0]
