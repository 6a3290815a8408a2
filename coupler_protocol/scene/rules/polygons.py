"""Every polygon of a scene is the outline of an area."""

from collections.abc import Iterator
from typing import Any

from coupler_protocol.geometry import outline_fault
from coupler_protocol.problems import Finding, KeyPath


def polygons_of(scene: Any) -> Iterator[tuple[KeyPath, str, list[tuple[float, float]]]]:
    """(path, what it is, corners) of every polygon in a scene."""
    for i, material in enumerate(scene.material):
        if material.region is not None:
            yield ("material", i, "region"), f"the region of {material.name!r}", material.region
    for i, window in enumerate(scene.window):
        if window.polygon is not None:
            yield ("window", i, "polygon"), f"the polygon of window {window.name!r}", window.polygon
    for i, measure in enumerate(scene.measure):
        if measure.polygon is not None:
            yield ("measure", i, "polygon"), f"the polygon of region {measure.name!r}", measure.polygon
    for i, stage in enumerate(scene.stage):
        if stage.excavate is not None and stage.excavate.polygon is not None:
            yield ("stage", i, "excavate", "polygon"), f"the polygon of excavation {stage.name!r}", stage.excavate.polygon


def polygons_are_outlines(scene: Any) -> Iterator[Finding]:
    """No polygon crosses itself, touches itself or is without area."""
    for path, what, corners in polygons_of(scene.drawn):
        fault = outline_fault(corners)
        if fault:
            yield path, f"{what} {fault}", "list its corners in order, once around"
