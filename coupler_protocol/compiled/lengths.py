"""Length of a vector in compiled loops, rounded as by numpy; numba's own `hypot` rounds otherwise.

Source: ISO/IEC 9899, hypot of the C library, which numpy calls as well.
"""

import numba
import numpy as np
from numba import types

if numba.config.DISABLE_JIT:

    def hypot(x: float, y: float) -> float:
        """Length of (x, y)."""
        return float(np.hypot(x, y))

else:
    hypot = types.ExternalFunction("hypot", types.float64(types.float64, types.float64))
