"""Whole runs of small scenes of the grid alone, from tables."""

from colluvium import Scene, run

SOIL = {"name": "soil", "density": 2000.0, "elastic": {"bulk": 0.5e9, "shear": 0.15e9}}
ROLLERS = [{"on": "left", "fix": "x"}, {"on": "right", "fix": "x"}, {"on": "bottom", "fix": "y"}]


def column(width=2.0, height=6.0, zone_size=0.5):
    return {"kind": "box", "length": width, "height": height, "zone_size": zone_size}


def stage(name, kind="load", steps=20000, ratio=None, **more):
    until = {"steps": steps} | ({} if ratio is None else {"ratio": ratio})
    return {"name": name, "kind": kind, "until": until} | more


def tables(grid, *stages, boundary=ROLLERS, material=(SOIL,), **more):
    """All tables of a scene; results every 10 steps."""
    kept = {"damping": {"local": 0.8}, "record": {"every": 100_000, "history": 10}} | more
    return {"format": 1, "seed": 1, "grid": grid, "material": [*material], "boundary": [*boundary], "stage": [*stages]} | kept


def scene(*arguments, **more):
    return Scene(**tables(*arguments, **more))


def compute(out, *arguments, on_step=None, **more):
    """Results of a run; to be used with `with`."""
    return run(scene(*arguments, **more), out, on_step=on_step)
