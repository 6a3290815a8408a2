"""Text of small scenes of a grid alone: sides that hold the ground, and a box of 16 zones without stages."""

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
