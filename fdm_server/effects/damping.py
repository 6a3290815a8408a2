"""Local damping: a force of the magnitude alpha |F| against the motion, with F the unbalanced force of a gridpoint.

    F_d = F - alpha |F| sign(v)         component by component

or kinetic damping, without any such force: all velocities begin again from zero at every peak of the kinetic energy
(fdm_server/step/momentum.py).

There is no damping force in equilibrium, body forces are not changed, and the damping does not depend on frequency: a vibration
loses the share 1 - (1 - alpha)/(1 + alpha) of its squared amplitude in every half period.
"""

from typing import ClassVar, Literal

from pydantic import model_validator

from coupler_protocol.scene.declare import Effect, quantity
from fdm_server.effects.rayleigh import RayleighTable

KINDS = ("local", "combined", "rayleigh", "kind")


class Damping(Effect):
    """Damping of gridpoints: local, combined, Rayleigh or kinetic (an empty table: local = 0.8; local = 0: none)"""

    source: ClassVar[str] = "Cundall, P. A. (1987), Distinct element models of rock and soil structure"
    local: float | None = quantity(None, meaning="local damping coefficient alpha", ge=0, lt=1)
    combined: float | None = quantity(None, meaning="coefficient alpha of combined damping, for steady motion", gt=0, lt=1)
    rayleigh: RayleighTable | None = quantity(None, meaning="Rayleigh damping (stages in real time)")

    kind: Literal["kinetic"] | None = quantity(
        None, meaning="kinetic: all velocities begin again from zero at every peak of the kinetic energy (static stages)"
    )

    @model_validator(mode="before")
    @classmethod
    def _local_if_nothing_else(cls, data):
        if isinstance(data, dict) and all(data.get(kind) is None for kind in KINDS):
            return {**data, "local": 0.8}
        return data

    @model_validator(mode="after")
    def _one_kind(self):
        given = [kind for kind in KINDS if getattr(self, kind) is not None]
        if len(given) > 1:
            raise ValueError(f"{' and '.join(given)} exclude each other: give one of them")
        return self


def damped(force, velocity, alpha):
    """Component of the damped force [N], from the same component of unbalanced force and velocity."""
    loss = alpha * abs(force)
    return force - (loss if velocity > 0.0 else (-loss if velocity < 0.0 else 0.0))
