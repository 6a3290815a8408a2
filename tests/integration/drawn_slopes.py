"""A small slope with a window, with places in every table that has any, drawn anywhere."""

SOIL = {
    "density": 2000.0,
    "spring": {"normal": 5e7, "shear": 2e7},
    "friction": {"coefficient": 0.5},
    "bond": {"tension": 1e5, "shear": 1e5},
}
GROUND = {"density": 2000.0, "elastic": {"bulk": 5e7, "shear": 2e7}, "mohr_coulomb": {"friction": 30.0, "cohesion": 50e3}}


def slope_with_a_window(x=0.0, y=0.0):
    """A slope with places in every table that has any, drawn from (x, y) on."""

    def at(*points):
        return [[px + x, py + y] for px, py in points]

    sides = [{"on": side, "fix": "xy" if side == "bottom" else "x"} for side in ("left", "right", "bottom")]
    gradient = {"xx": -8e3, "yy": -2e4, "zz": -8e3}
    return {
        "format": 1,
        "seed": 2,
        "grid": {
            "length": 12.0,
            "height": 7.5,
            "zone_size": 0.5,
            "fit": "profile",
            "profile": at((0.0, 4.0), (2.5, 4.0), (6.0, 7.5), (12.0, 7.5)),
        },
        "material": [
            {"name": "soil"} | GROUND,
            {"name": "clay", "top": at((0.0, 1.0), (6.0, 1.5), (12.0, 1.0))} | GROUND,
            {"name": "sand", "region": at((9.0, 5.0), (11.0, 5.0), (11.0, 6.5), (9.0, 6.5))} | GROUND,
        ],
        "boundary": [
            *sides,
            {"on": "top", "x": [9.0 + x, 11.0 + x], "pressure": 5e3},
            {"on": "left", "y": [y, y + 2.0], "fix": "y"},
        ],
        "initial_stress": {"level": 6.0 + y, "gradient": gradient},
        "window": [{"name": "w", "polygon": at((4.0, 1.9), (8.1, 1.9), (8.1, 4.6), (4.0, 4.6))}],
        "discs": {"radius": 0.12, "damping": {"local": 0.7}, "soil": SOIL},
        "damping": {"local": 0.8},
        "record": {"every": 20, "history": 10},
        "stage": [
            {"name": "equilibrium", "gravity": 9.81, "until": {"steps": 40}},
            {
                "name": "pit",
                "kind": "excavate",
                "excavate": {"polygon": at((0.1, 3.4), (1.6, 3.4), (1.6, 4.1), (0.1, 4.1)), "over": 10, "ratio": 0.0},
                "until": {"steps": 20},
            },
            {
                "name": "load",
                "kind": "surcharge",
                "surcharge": {"x": [7.0 + x, 9.0 + x], "pressure": 1e4},
                "until": {"steps": 20},
            },
            {"name": "fill"},
            {"name": "couple", "handover": 10, "until": {"steps": 40}},
        ],
    }
