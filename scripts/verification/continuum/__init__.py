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
HEAD = """Plane strain, tension positive. Where nothing else is said the scene goes through the product's own stages, as
`colluvium run` would compute it. Steps are taken by hand, with the same kernels, where no scene can say what is wanted: single
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
