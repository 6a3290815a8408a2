"""Local damping: every gridpoint's unbalanced force F loses a share alpha of its size against the motion.

    F_d = F - alpha |F| sign(v)         component by component

Nothing happens at rest in equilibrium, body forces are not touched, and the damping does not depend on
frequency.
"""

from typing import ClassVar

from coupler_protocol.declare import Effect, quantity


class Damping(Effect):
    """Local damping of gridpoints"""

    source: ClassVar[str] = "Cundall, P. A. (1987), Distinct element models of rock and soil structure"
    local: float = quantity(0.8, meaning="local damping coefficient alpha", ge=0, lt=1)


def damped(force, velocity, alpha):
    """Component of the unbalanced force [N] that accelerates, for the same component of velocity."""
    loss = alpha * abs(force)
    return force - (loss if velocity > 0.0 else (-loss if velocity < 0.0 else 0.0))
