"""The continuum's laws, one a file. `Law` lists those that act, in the order in which they act."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fdm_server.effects import added_laws, elastic, histories, mohr_coulomb, nodal_mixing, rayleigh, softening, tension


class Law(NamedTuple):
    """Parameters of the effects in acting order; None for an effect that no material and no table has.

    elastic, mohr_coulomb, tension, softening: (M, P) rows of P parameters for M materials; added: one named tuple of arrays (M,)
    for each law of another distribution (added_laws.py); damping, combined: alpha [-]; nodal: True.
    """

    nodal: bool | None
    elastic: NDArray[np.float64]
    mohr_coulomb: NDArray[np.float64] | None
    tension: NDArray[np.float64] | None
    softening: NDArray[np.float64] | None
    added: tuple[Any, ...] | None
    damping: float | None
    combined: float | None
    rayleigh: rayleigh.Rayleigh | None

    @property
    def plastic(self):
        """Whether a law of this Law limits stresses and sets a plastic state."""
        return self.mohr_coulomb is not None or self.tension is not None

    @property
    def path_dependent(self):
        """Whether what zones come to depends on the way there: all laws but elasticity."""
        return self.plastic or self.softening is not None or self.added is not None

    @property
    def histories(self):
        """Histories of the acting laws: {name: coupler_protocol.scene.declare.History}."""
        found = histories.declared({name: law for name, law in histories.EFFECTS.items() if getattr(self, name) is not None})
        for law in self.added or ():
            found |= {history.name: history for history in added_laws.histories(type(law))}
        return found


def law_from(scene):
    """The law of `scene.material` and `scene.damping`.

    If only some materials have a table, the others get infinite strength: the code runs for all zones, without
    effect in theirs.
    """
    materials = scene.material
    for m in materials:
        if m.elastic is None:
            raise ValueError(f"material {m.name!r} has no stiffness: add elastic = {{ bulk = .., shear = .. }}")

    def asked(name):
        return any(getattr(m, name) is not None for m in materials)

    def rows(name, of_material):
        return np.array([of_material(m) for m in materials]) if asked(name) else None

    return with_damping(
        Law(
            nodal=nodal_mixing.parameters(scene.grid),
            elastic=rows("elastic", lambda m: elastic.parameters(m.elastic)),
            mohr_coulomb=rows("mohr_coulomb", lambda m: mohr_coulomb.parameters(m.mohr_coulomb, m.elastic)),
            tension=rows("tension", lambda m: tension.parameters(m.tension, m.mohr_coulomb, m.elastic)),
            softening=softening.parameters(materials) if asked("softening") else None,
            added=added_laws.parameters(materials),
            damping=None,
            combined=None,
            rayleigh=None,
        ),
        scene.damping,
    )


def with_damping(law, table):
    """The law with the damping of a scene's table (a Damping); undamped for None and for local = 0."""
    return law._replace(
        damping=float(table.local) if table and table.local else None,
        combined=float(table.combined) if table and table.combined else None,
        rayleigh=rayleigh.parameters(table.rayleigh) if table and table.rayleigh else None,
    )
