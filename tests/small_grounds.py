"""Small scenes of a grid alone: text of sides that hold the ground and of a box of 16 zones, and tables of a box of 64 zones."""

TABLES = {
    "format": 1,
    "seed": 1,
    "grid": {"kind": "box", "length": 4.0, "height": 4.0, "zone_size": 0.5},
    "material": [{"name": "m", "density": 2000.0, "elastic": {"bulk": 5e7, "shear": 2e7}}],
    "boundary": [{"on": "bottom", "fix": "xy"}],
    "damping": {"local": 0.8},
}
REST = {"name": "rest", "kind": "equilibrium", "gravity": 9.81, "until": {"ratio": 1e-5, "steps": 2000}}

SIDES = """
[[boundary]]
on = "left"
fix = "x"
[[boundary]]
on = "right"
fix = "x"
[[boundary]]
on = "bottom"
fix = "xy"
[damping]
local = 0.8
"""
BOX = f"""
format = 1
seed = 1
grid = {{ kind = "box", length = 2.0, height = 2.0, zone_size = 0.5 }}
[[material]]
name = "m"
density = 2000.0
elastic = {{ bulk = 5e7, shear = 2e7 }}
{SIDES}"""
