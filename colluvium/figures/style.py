"""Common style of all figures: type, colour maps, units, titles."""

from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from coupler_protocol.files.vtkhdf import FrameInfo

RC = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "savefig.dpi": 160,
    "legend.frameon": False,
}
MAPS = {  # F. Crameri, Scientific colour maps, zenodo.org/records/1243862
    "stress": "lapaz",
    "change": "vik",
    "displacement": "batlow_r",
    "rate": "lajolla_r",
    "strain": "acton_r",
}
INK, PALE = "#1a1a1a", "#c8c8c8"
_PREFIXES = {  # smallest value for a unit with a prefix, its name, its size
    "Pa": ((1e6, "MPa", 1e6), (1e3, "kPa", 1e3), (0.0, "Pa", 1.0)),
    "N": ((1e6, "MN", 1e6), (1e3, "kN", 1e3), (0.0, "N", 1.0)),
    "m": ((0.5, "m", 1.0), (5e-4, "mm", 1e-3), (0.0, "µm", 1e-6)),
}


def styled(draw: Callable[..., Any]) -> Callable[..., Any]:
    """Makes a drawing function draw in the common style, without a screen."""

    @wraps(draw)
    def in_style(*args: Any, **options: Any) -> Any:
        import matplotlib

        matplotlib.use("Agg")
        with matplotlib.rc_context(dict[Any, Any](RC)):
            return draw(*args, **options)

    return in_style


def colour_map(what: str) -> Any:
    """Colour map of a kind of quantity (a key of MAPS)."""
    from cmcrameri import cm

    return getattr(cm, MAPS[what])


def readable(unit: str, *values: np.ndarray) -> tuple[float, str]:
    """Factor and unit with which values in Pa, N or m have few digits; other units are unchanged."""
    largest = max((float(np.nanmax(np.abs(v))) for v in values if np.isfinite(v).any()), default=0.0)
    for threshold, name, size in _PREFIXES.get(unit, ()):
        if largest >= threshold:
            return 1.0 / size, name
    return 1.0, unit


def limits(*values: np.ndarray, part: float = 0.005) -> tuple[float, float]:
    """Limits of one colour scale for all values, without the outermost `part` at both ends."""
    together = np.concatenate([np.ravel(v) for v in values])
    together = together[np.isfinite(together)]
    if not len(together):
        return 0.0, 1.0
    low, high = np.quantile(together, (part, 1.0 - part))
    return (float(low), float(high)) if high > low else (float(low), float(low) + 1.0)


def moment(info: FrameInfo) -> str:
    """Text of stage, step and gravity of a frame, for titles."""
    gravity = f", {info.gravity_factor:.3g} g" if info.gravity_factor != 1.0 else ""
    return f"{info.stage}, step {info.step:,}{gravity}"
