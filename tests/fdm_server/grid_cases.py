"""The paper's slope and its window, and small scenes for tests of the grid."""

from types import SimpleNamespace

from coupler_protocol.scene.tables.boundary import Boundary
from coupler_protocol.scene.tables.grid import Grid
from fdm_server.effects.damping import Damping
from fdm_server.effects.elastic import Elastic
from fdm_server.effects.mohr_coulomb import MohrCoulomb
from fdm_server.effects.tension import Tension

PROFILE = ((0.0, 4.0), (3.6666667, 4.0), (11.6666667, 12.0), (20.0, 12.0))
ELASTIC = Elastic(bulk=0.5e9, shear=0.15e9)
MOHR_COULOMB = MohrCoulomb(friction=30.0, cohesion=50e3)
TENSION = Tension(strength=100.0)


def material(
    name="srm",
    region=None,
    elastic=ELASTIC,
    mohr_coulomb=MOHR_COULOMB,
    tension=TENSION,
    softening=None,
    density=2700.0,
    top=None,
):
    """A material of a scene; the paper's soil where nothing else is said."""
    return SimpleNamespace(
        name=name,
        density=density,
        region=region,
        top=top,
        elastic=elastic,
        mohr_coulomb=mohr_coulomb,
        tension=tension,
        softening=softening,
    )


def slope(zone_size=1 / 3, profile=PROFILE, materials=None, **kept):
    """The paper's slope, 20 x 12 m, with any zone size; `kept` goes to the grid table."""
    grid = {"kind": "slope", "length": 20.0, "height": 12.0, "zone_size": zone_size, "profile": profile}
    held = {"left": "x", "right": "x", "bottom": "xy"}
    return SimpleNamespace(
        grid=Grid(**(grid | kept)),
        material=[material()] if materials is None else materials,
        boundary=[Boundary(on=side, fix=fix) for side, fix in held.items()],
        damping=Damping(local=0.8),
    )


def window(columns=(33, 38), rows=(15, 31), polygon=None):
    """The paper's window in the 60 x 36 grid."""
    return SimpleNamespace(name="band", columns=columns, rows=rows, polygon=polygon)
