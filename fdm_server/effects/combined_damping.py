"""Combined damping: like local damping, but half of it depends on the change of the unbalanced force F, not on the velocity.

    F_d = F + alpha/2 |F| (sign(dF/dt) - sign(v))         component by component

In a vibration about a steady motion the velocity keeps its sign, so local damping only slows the motion. The rate of the force
changes its sign, so combined damping dissipates the vibration. About rest both are the same, because the force of a vibration
decreases while its velocity is positive. F may grow by 1 + alpha at most, as with local damping.

Source: Itasca (2011), FLAC 7.0 Theory and Background, mechanical damping.
"""

from coupler_protocol.scene.declare import History

HISTORIES = (
    History("previous_force", "gridpoint", unit="N", meaning="unbalanced force F a step ago", components=2, of_stage=True),
)


def damped(force, change, velocity, half):
    """Component of the damped force [N], from the unbalanced force, its change [N] since the last step, and half: alpha/2 [-]."""
    size = half * abs(force)
    rise = size if change > 0.0 else (-size if change < 0.0 else 0.0)
    loss = size if velocity > 0.0 else (-size if velocity < 0.0 else 0.0)
    return force + (rise - loss)
