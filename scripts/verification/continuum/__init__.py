"""The continuum against closed forms and published values."""

from verification.continuum import (
    beam,
    biaxial,
    column,
    cylinder,
    energy,
    footing,
    kirsch,
    oedometer,
    patch,
    rankine,
    salencon,
    slopes,
    softening,
    spin,
    strip_load,
    waves,
)

TITLE = "Continuum"
HEAD = """Plane strain, tension positive. Unless stated otherwise, the scene runs through the stages of the program, as in
`colluvium run`. Where a scene cannot describe the case, the script takes the steps with the same kernels: single
zones and shaken meshes (oedometer, patch, spin), holes in an infinite plate, and meshes without mixed discretisation."""
CASES = [
    oedometer,
    biaxial,
    patch,
    column,
    beam,
    strip_load,
    rankine,
    footing,
    kirsch,
    salencon,
    cylinder,
    softening,
    slopes,
    spin,
    waves,
    energy,
]
