"""Numbers as compact bytes for the page of a run.

An array is a row of codes of 1, 2 or 4 bytes: value = low + step * code (logarithmic: 10 to this power). The largest code means
NaN. Codes with step 0 are float32, for values that need all their digits beside much larger ones. Bytes are stored in planes, all
lowest bytes first, because this compresses better.
"""

import base64
import zlib

import numpy as np

FLOOR = 1e-9  # share of the largest value of a logarithmic array below which values are not distinguished


class Packing:
    """Arrays one after the other; equal arrays are stored once. `arrays` gives position and encoding of each."""

    def __init__(self) -> None:
        self.arrays: list[list[float]] = []  # [first byte, count, bytes a code, low, step, logarithmic]
        self._bytes = bytearray()
        self._known: dict[tuple, int] = {}

    def reals(self, values: np.ndarray, width: int = 2, logarithmic: bool = False) -> int:
        """Stores real numbers (n,) to half a step of (largest - smallest) / 2^(8 width); returns the number of the array."""
        values = np.asarray(values, dtype=np.float64)
        if logarithmic:
            largest = np.nanmax(values, initial=0.0)
            values = np.log10(np.maximum(values, FLOOR * largest)) if largest > 0.0 else np.full(len(values), np.nan)
        known = np.isfinite(values)
        low, high = (values[known].min(), values[known].max()) if known.any() else (0.0, 0.0)
        nothing = 256**width - 1
        step = (high - low) / (nothing - 1) or 1.0
        codes = np.rint((np.where(known, values, low) - low) / step)
        return self._keep(np.where(known, codes, nothing), width, low, step, logarithmic)

    def whole(self, values: np.ndarray) -> int:
        """Stores whole numbers (n,) exactly; returns the number of the array."""
        values = np.asarray(values, dtype=np.int64)
        low, high = (int(values.min()), int(values.max())) if len(values) else (0, 0)
        width = next(width for width in (1, 2, 4) if high - low < 256**width - 1)
        return self._keep(values - low, width, low, 1, False)

    def floats(self, values: np.ndarray) -> int:
        """Stores real numbers (n,) as float32; returns the number of the array."""
        return self._keep(np.asarray(values, dtype="<f4").view("<u4"), 4, 0.0, 0.0, False)

    def text(self) -> str:
        """All bytes, deflated, in base 64."""
        return base64.b64encode(zlib.compress(bytes(self._bytes), 6)).decode("ascii")

    def _keep(self, codes: np.ndarray, width: int, low: float, step: float, logarithmic: bool) -> int:
        planes = codes.astype("<u4").view(np.uint8).reshape(-1, 4)[:, :width].T.tobytes()
        key = (planes, width, low, step, logarithmic)
        if key not in self._known:
            self._known[key] = len(self.arrays)
            self.arrays.append([len(self._bytes), len(codes), width, float(low), float(step), int(logarithmic)])
            self._bytes += planes
        return self._known[key]
