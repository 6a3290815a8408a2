"""Combined damping: like local damping, but half of it asks for the change of the unbalanced force F instead of the velocity.

    F_d = F + alpha/2 |F| (sign(dF/dt) - sign(v))         component by component

A vibration about a steady motion never turns its velocity round, so that local damping only slows the motion and leaves the
vibration; its force turns round, so combined damping takes energy out of it. About rest both are the same, because a vibration's
force falls where its velocity is positive. F may grow by 1 + alpha at most, as with local damping.

Source: Itasca (2011), FLAC 7.0 Theory and Background, mechanical damping.
"""

from coupler_protocol.scene.declare import History

HISTORIES = (
    History("previous_force", "gridpoint", unit="N", meaning="unbalanced force F a step ago", components=2, of_stage=True),
)


def damped(force, change, velocity, half):
    """Component of the unbalanced force [N] that accelerates; change [N] since the last step, half: alpha/2 [-]."""
    size = half * abs(force)
    rise = size if change > 0.0 else (-size if change < 0.0 else 0.0)
    loss = size if velocity > 0.0 else (-size if velocity < 0.0 else 0.0)
    return force + (rise - loss)
