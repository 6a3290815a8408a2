"""Plastic state of a zone: whether it yields now in shear or in tension, and whether it has yielded.

The sum of 1 shear now, 2 tension now, 4 shear past, 8 tension past. Mohr-Coulomb and the tension cut-off
use it.
"""

from coupler_protocol.scene.declare import History

SHEAR, TENSION = 1, 2  # now; the same two bits shifted by PAST: at an earlier step
NOW, PAST = SHEAR | TENSION, 2

PLASTIC = History(
    "plastic", "zone", "i8", meaning="1 shear now, 2 tension now, 4 shear past, 8 tension past (sum)", recorded="plastic_state"
)
