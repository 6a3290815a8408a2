"""Common style of all figures: type, colour maps, units, titles."""

import textwrap
from collections.abc import Callable
from functools import wraps
from typing import Any

import numpy as np

from coupler_protocol.files.vtkhdf import FrameInfo

PAGE = 7.48  # [in], 190 mm: the widest picture, so that nothing is reduced in print
SMALLEST = 7.0  # [pt], of any text
RC = {
    "font.size": 7.5,
    "axes.titlesize": 7.5,
    "legend.fontsize": 7.0,
    "xtick.labelsize": 7.0,
    "ytick.labelsize": 7.0,
    "axes.titlelocation": "left",
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,  # coordinates far from zero in full
    "axes.formatter.limits": (-5, 8),
    "figure.dpi": 160,  # belongs to the figure: "savefig.dpi" would end with the context
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
            figure = draw(*args, **options)
            if figure is not None:  # a function that writes its picture itself returns none
                fit_page(figure)
                wrap_titles(figure)
            return figure

    return in_style


def fit_page(figure: Any) -> None:
    """Makes a figure as wide as a page if it is wider, in proportion; texts keep their size."""
    width, height = figure.get_size_inches()
    if width > PAGE:
        figure.set_size_inches(PAGE, height * PAGE / width)


def wrap_titles(figure: Any) -> None:
    """Breaks lines of titles that would reach the next axes or the edge of the figure; layouts reserve no width for titles."""
    changed = True
    for _ in range(2):  # more lines change the layout
        if not changed:
            return
        changed = False
        figure.draw_without_rendering()
        boxes = [axes.get_window_extent() for axes in figure.axes]
        for axes, box in zip(figure.axes, boxes, strict=True):
            beside = [other.x0 for other in boxes if other.x0 >= box.x1 and other.y0 < box.y1 and other.y1 > box.y0]
            for title in _titles(axes):
                room = _room(title, box, min([*beside, figure.bbox.x1]))
                if title.get_window_extent().width > room:
                    title.set_text(_wrapped(title, room))
                    changed = True


def _titles(axes: Any) -> list[Any]:
    return [text for text in (axes.title, axes._left_title, axes._right_title) if text.get_text()]


def _room(title: Any, box: Any, end: float) -> float:
    """Width [pixels] that a title may have: from its axes to `end`; a centred one on both sides alike."""
    gap = 0.6 * title.get_fontsize()
    return float(max(end - box.x0 if title.get_ha() == "left" else 2.0 * (end - 0.5 * (box.x0 + box.x1)), box.width) - gap)


def _wrapped(title: Any, room: float) -> str:
    lines = title.get_text().split("\n")
    letters = max(10, int(max(map(len, lines)) * room / title.get_window_extent().width))
    return "\n".join(part for line in lines for part in textwrap.wrap(line, letters, break_long_words=False))


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
