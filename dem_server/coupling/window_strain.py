"""What the window says of its strain where the continuum asks for it: a FORCE with the bins of the moment behind the forces."""

from coupler_protocol.criteria import strain_bins
from coupler_protocol.wire import messages
from coupler_protocol.wire.frames import StepFrame


class WindowStrain:
    """Strain of a window in bins of about `length` [m], and the frame of the FORCE that carries it.

    talk: the conversation; nodes: their number K on the rim; ring: number of control discs, which are the first of the state.
    """

    def __init__(self, length, state, ring, talk, nodes):
        self.length, self.ring = length, ring
        columns, rows = strain_bins.shape_over(self._start(state)[:ring], length)
        size = 3 * (nodes + columns * rows)
        self.frame = StepFrame(messages.FORCE, talk.session, talk.rank, len(messages.Answer._fields), size)

    def measure(self, state):
        """Middle and shear strain (B, 3) of each bin, to the bit what a report finds in the frame of this step."""
        start = self._start(state)
        bins = strain_bins.bins_over(start[: self.ring], self.length)
        return strain_bins.as_rows(start, state.displacement, bins)

    @staticmethod
    def _start(state):
        return state.x - state.displacement
