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
HEAD = """Discs of `dem_server` alone. Rows "as a scene" go through the product's own stages, as `colluvium run` would compute a
scene without a grid; the others step the same kernels by hand, as few discs as the law needs. Where nothing else is said
kn = 2.5e7 and ks = 1e7 N/m (the soil of the paper's Table 2, springs of two discs in series) and R = .03 m."""
CASES = [
    collision, impact, conservation, gas, incline, block, stickslip, bonds, hang, beam, chain, hexagon, strength,
    stone, statistics, porosity, box,
]  # fmt: skip
