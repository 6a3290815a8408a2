"""The discs against closed forms and published values."""

from verification.discrete import (
    beam,
    block,
    bonds,
    box,
    chain,
    collision,
    conservation,
    gas,
    hang,
    hexagon,
    impact,
    incline,
    porosity,
    statistics,
    stickslip,
    stone,
    strength,
)

TITLE = "Discrete"
HEAD = """Discs of `dem_server` alone. Rows "as a scene" run through the stages of the program, as in `colluvium run` for a
scene without a grid; the others call the same kernels directly, with as few discs as the law needs. Unless stated otherwise,
kn = 2.5e7 and ks = 1e7 N/m (the soil of the paper's Table 2, springs of two discs in series) and R = 0.03 m."""
CASES = [
    collision, impact, conservation, gas, incline, block, stickslip, bonds, hang, beam, chain, hexagon, strength,
    stone, statistics, porosity, box,
]  # fmt: skip
