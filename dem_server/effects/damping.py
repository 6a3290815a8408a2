"""Local non-viscous damping: a force against the motion, proportional to the unbalanced force.

    Fd = -alpha |F| sign(v),    component by component, the moment likewise      (1)

Steady motion under balanced forces is not damped. Source: Cundall (1987), in: Analytical and Computational
Methods in Engineering Rock Mechanics, ch. 4; Itasca, PFC2D 3.1 Theory, "Mechanical damping".
"""

from typing import ClassVar, NamedTuple

from coupler_protocol.scene.declare import Effect, quantity


class Damping(Effect):
    """local damping of the motion of discs"""

    source: ClassVar[str] = "Cundall (1987), Distinct element models of rock and soil structure"
    local: float = quantity(0.7, meaning="alpha: damping force against the motion over unbalanced force", ge=0, lt=1)


class DampingTable(NamedTuple):
    """`local`: alpha of Eq (1) [-]."""

    local: float


def damped(force, velocity, alpha):
    """Unbalanced force (or moment) plus its damping force, Eq (1); with selects instead of branches."""
    sign = (1.0 if velocity > 0.0 else 0.0) - (1.0 if velocity < 0.0 else 0.0)
    return force - alpha * abs(force) * sign
