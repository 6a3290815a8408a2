"""Doubts about the initial stress: its sign, the height at which it holds, k0 as a percentage."""

from collections.abc import Iterator
from typing import Any

from coupler_protocol.geometry import spot_on
from coupler_protocol.problems import Finding
from coupler_protocol.scene.rules.units import as_written, height_of

SMALLEST_K0, LARGEST_K0 = 0.05, 6.0  # of ground under its weight; stress from mountain building included
NORMAL = ("xx", "yy", "zz")


def initial_tension(scene: Any) -> Iterator[Finding]:
    """Ground that begins in tension: a sign, or the height at which the stress holds, was forgotten."""
    table = scene.initial_stress
    if table is None:
        return
    heights = (0.0, height_of(scene)) if table.gradient is not None else (0.0,)
    at = {(name, y): _stress(table, name, y) for name in NORMAL for y in heights}
    (name, y), value = max(at.items(), key=lambda item: item[1])
    if value <= 1e-9 * max(map(abs, at.values())):
        return
    where = f" at y = {spot_on(y, scene.origin[1])} m" if table.gradient is not None else ""
    what = f"{name} is {as_written(value)} Pa{where}: tension"
    if getattr(table, name) > 0.0:
        remedy = f"compression is negative: did you mean {name} = {as_written(-getattr(table, name))}?"
    elif getattr(table.gradient, name) > 0.0:
        remedy = "compression is negative, also its growth with depth: change the sign of the gradient"
    else:
        remedy = f"the gradient counts from `level`: did you mean level = {spot_on(height_of(scene), scene.origin[1])}?"
    yield ("initial_stress",), what, remedy


def _stress(table: Any, name: str, y: float) -> float:
    """A normal stress [Pa] of the table at the height y, without the weight of the ground."""
    gradient = 0.0 if table.gradient is None else getattr(table.gradient, name)
    return getattr(table, name) + (table.level - y) * gradient


def unusual_k0(scene: Any) -> Iterator[Finding]:
    """k0 in percent."""
    k0 = scene.initial_stress.k0 if scene.initial_stress is not None else None
    if k0 and not SMALLEST_K0 <= k0 <= LARGEST_K0:
        what = f"k0 is {k0:g}: the horizontal stress is {k0:g} times the vertical one"
        meant = f"did you mean {k0 / 100:g} ({k0:g} %)?" if SMALLEST_K0 <= k0 / 100 <= LARGEST_K0 else "usual are 0.3 to 3"
        yield ("initial_stress", "k0"), what, meant


DOUBTS_OF_SIGNS = (initial_tension, unusual_k0)
