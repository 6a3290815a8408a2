"""Loads on ground that is dug away leave with it: what the bottom carries is the weight and the loads that are left.

A block 4 m wide and high has a pit of 1 x 1 m dug from its surface, in zones of 0.5 m: sum of the reactions = weight of what is
left + load on the surface that is left, to rounding.
"""

import pytest
from run_cases import ROLLERS, compute, stage

from coupler_protocol.scene.reader import build_scene
from fdm_server.fos.ground import settle

P, GRAVITY = 100e3, 10.0
GROUND = {"name": "soil", "density": 2000.0, "elastic": {"bulk": 5e7, "shear": 2e7}}
BLOCK = {"kind": "box", "length": 4.0, "height": 4.0, "zone_size": 0.5}
BEFORE, PIT = 4.0 * 4.0 * 2000.0 * GRAVITY, 1.0 * 2000.0 * GRAVITY
DIG = {"columns": [3, 4], "rows": [6, 7]}  # x from 1.5 to 2.5 m


def rested(name, kind, **more):
    return stage(name, kind, ratio=1e-8, **more)


def loaded(**load):
    return rested("press", "load", boundary=[{"on": "top", **load}])


def covered(first, last):
    return rested("cover", "surcharge", surcharge={"x": [first, last], "pressure": P})


REST, PIT_DUG = rested("rest", "equilibrium", gravity=GRAVITY), rested("dig", "excavate", excavate=DIG)
DEEPER = rested("dig more", "excavate", excavate={"columns": [3, 4], "rows": [5, 5]})
CASES = [
    ([REST, loaded(pressure=P), PIT_DUG], BEFORE - PIT + 3.0 * P),
    ([REST, loaded(stress={"yy": -P}), PIT_DUG], BEFORE - PIT + 3.0 * P),
    ([REST, loaded(pressure=P, x=[1.7, 2.3]), PIT_DUG], BEFORE - PIT),
    ([REST, loaded(pressure=P, x=[1.25, 2.3]), PIT_DUG], BEFORE - PIT + 0.25 * P),
    ([REST, covered(0.0, 4.0), PIT_DUG], BEFORE - PIT + 3.0 * P),
    ([REST, covered(1.0, 2.0), PIT_DUG, DEEPER], BEFORE - 1.5 * PIT + 0.5 * P),
    ([REST, PIT_DUG, covered(0.0, 4.0), DEEPER], BEFORE - 1.5 * PIT + 3.0 * P),
    ([REST, loaded(pressure=P), PIT_DUG, rested("less", "load", boundary=[{"on": "top", "pressure": 0.5 * P}])],
     BEFORE - PIT + 1.5 * P),
    ([REST, loaded(pressure=P), PIT_DUG | {"boundary": [{"on": "top", "pressure": 0.5 * P}]}], BEFORE - PIT + 1.5 * P),
    ([REST, loaded(pressure=P), PIT_DUG | {"boundary": [{"on": "top", "x": [0.0, 1.0], "pressure": P}]}], BEFORE - PIT + 4.0 * P),
]  # fmt: skip


@pytest.mark.parametrize(("stages", "left"), CASES)
def test_the_bottom_carries_what_is_left(tmp_path, stages, left):
    with compute(tmp_path / "run", BLOCK, *stages, material=[GROUND]) as run:
        assert run.info["stages"][-1]["reactions"]["bottom"]["y"] == pytest.approx(left, rel=1e-7)


def test_a_search_for_a_factor_loads_what_is_left():
    """The surcharge of the ground that is dug away later is not on the floor of the pit."""
    soil = GROUND | {"mohr_coulomb": {"friction": 30.0, "cohesion": 2e5}}
    tables = {"format": 1, "seed": 1, "grid": BLOCK, "material": [soil], "boundary": ROLLERS, "damping": {"local": 0.8}}
    ground = settle(build_scene(tables | {"stage": [REST, covered(0.0, 4.0), PIT_DUG]}))
    assert ground.state.applied[:, 1].sum() == pytest.approx(-3.0 * P, rel=1e-12)
