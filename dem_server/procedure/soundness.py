"""What a State of discs must be after functions of a user: finite, with a list of pairs that kernels can follow.

Compiled code does not check indices: a wrong one would read or write memory of others.
"""

from coupler_protocol.exits import EnvironmentFailed, PhysicsFailed
from coupler_protocol.files.proof import UnprovenError
from dem_server.observe.not_finite import first_not_finite
from dem_server.procedure.proof import of_pairs


def check(moment):
    """Raises PhysicsFailed for numbers of a coupler_protocol.process.plugin.Moment that are NaN or infinite.

    Raises EnvironmentFailed for lists of pairs or states of bonds that cannot be.
    """
    model, state = moment.model, moment.state
    when = f"after step {moment.step} of stage {moment.stage!r}"
    if found := first_not_finite(model, state, moment.origin):
        raise PhysicsFailed(f"{found} {when}")
    try:
        of_pairs(model, state, model.count, len(state.first))
    except UnprovenError as error:
        raise EnvironmentFailed(
            f"the list of pairs is damaged {when}: {error}; the functions of the plugin must not change it"
        ) from error
