"""Length of a vector in compiled loops, rounded as by numpy; numba's own `hypot` rounds otherwise.

Source: ISO/IEC 9899, hypot of the C library, which numpy calls as well.
"""

from typing import Any

import numpy as np
from numba import types

from coupler_protocol.compiled.ahead import ENABLED
from coupler_protocol.compiled.jit import jit

if ENABLED:
    _hypot: Any = types.ExternalFunction("hypot", types.float64(types.float64, types.float64))
else:
    _hypot = np.hypot


@jit(forceinline=True)
def hypot(x: float, y: float) -> float:
    """Length of (x, y)."""
    return _hypot(x, y)
