"""A small box with a window of discs whose coupled steps are quick: for faults that last for seconds."""

import copy

BOX = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 4.0, "height": 4.0, "zone_size": 0.5},
    "material": [{"name": "ground", "density": 2700.0, "elastic": {"bulk": 0.5e9, "shear": 0.15e9}}],
    "boundary": [{"on": side, "fix": "xy"} for side in ("left", "right", "bottom")],
    "damping": {"local": 0.8},
    "window": [{"name": "hole", "columns": [2, 5], "rows": [2, 5]}],
    "discs": {
        "radius": 0.09,
        "damping": {"local": 0.7},
        "soil": {"density": 2000.0, "spring": {"normal": 5e7, "shear": 2e7}, "friction": {"coefficient": 0.55}},
    },
    "link": {"timeout": 1.0, "give_up": 60.0},
    "record": {"every": 100},
    "stage": [
        {"name": "equilibrium", "gravity": 9.81, "until": {"steps": 200}},
        {"name": "fill"},
        {"name": "couple", "handover": 100},
    ],
}
FILES = ("fdm.rank0.vtkhdf", "dem.rank1.vtkhdf", "fdm.rank0.couple.h5", "dem.rank1.couple.h5")


def box(steps, **record):
    """Tables of the box with that many coupled steps, and keys of [record]."""
    tables = copy.deepcopy(BOX)
    tables["stage"][2]["until"] = {"steps": steps}
    tables["record"] |= record
    return tables
