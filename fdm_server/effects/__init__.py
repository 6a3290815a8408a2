"""The continuum's laws, one a file. `Law` lists those that act, in the order in which they act."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server.effects import elastic, mohr_coulomb, rayleigh, softening, tension


class Law(NamedTuple):
    """Parameters of the effects in acting order; None where no material (no table) asks for the effect.

    elastic, mohr_coulomb, tension, softening: (M, P) rows of P parameters for M materials; damping, combined: alpha [-].
    """

    elastic: NDArray[np.float64]
    mohr_coulomb: NDArray[np.float64] | None
    tension: NDArray[np.float64] | None
    softening: NDArray[np.float64] | None
    damping: float | None
    combined: float | None
    rayleigh: rayleigh.Rayleigh | None

    @property
    def plastic(self):
        """Whether stresses can be limited at all."""
        return self.mohr_coulomb is not None or self.tension is not None


def law_from(scene):
    """The law of `scene.material` and `scene.damping`.

    Where only some materials have a table, the others get infinite strength: the code runs for all zones, and
    does nothing in theirs.
    """
    materials = scene.material
    for m in materials:
        if m.elastic is None:
            raise ValueError(f"material {m.name!r} has no stiffness: add elastic = {{ bulk = .., shear = .. }}")
    has_mohr_coulomb = any(m.mohr_coulomb is not None for m in materials)
    has_tension = any(m.tension is not None for m in materials)
    has_softening = any(m.softening is not None for m in materials)
    return with_damping(
        Law(
            elastic=np.array([elastic.parameters(m.elastic) for m in materials]),
            mohr_coulomb=np.array([mohr_coulomb.parameters(m.mohr_coulomb, m.elastic) for m in materials])
            if has_mohr_coulomb
            else None,
            tension=np.array([tension.parameters(m.tension, m.mohr_coulomb, m.elastic) for m in materials])
            if has_tension
            else None,
            softening=softening.parameters(materials) if has_softening else None,
            damping=None,
            combined=None,
            rayleigh=None,
        ),
        scene.damping,
    )


def with_damping(law, table):
    """The law with the damping of a scene's table (a Damping); None, and local = 0: undamped."""
    return law._replace(
        damping=float(table.local) if table and table.local else None,
        combined=float(table.combined) if table and table.combined else None,
        rayleigh=rayleigh.parameters(table.rayleigh) if table and table.rayleigh else None,
    )
