"""Quantities that are measured in the frames of a run: fabric, mean stress, failure gravity, error of energies."""

from typing import Any

import numpy as np
import shapely

from colluvium.results import averages, band_states, failure
from colluvium.results.run import Run

FABRIC = ("fabric_a", "fabric_theta_a", "fabric_a_n", "fabric_theta_n")
FAILURE, ENERGY = "failure_gravity", "energy.error"
STRESS = {"stress_xx": 0, "stress_yy": 1, "stress_xy": 2}  # columns of a mean over discs
OF_ZONES = {"stress_xx": 0, "stress_yy": 1, "stress_zz": 2, "stress_xy": 3}


def knows(quantity: Any) -> bool:
    """Whether a colluvium.accuracy.quantity.Quantity is measured here."""
    return quantity.name in (*FABRIC, FAILURE, ENERGY) or (quantity.place is not None and len(quantity.place) > 2)


def fault_of_place(name: str, place: tuple[float, ...], rank: int | None) -> str:
    """What is wrong with a place of a field, or ""."""
    if len(place) == 2:
        return "" if rank is None else "discs have a mean stress in a circle (x, y, radius) or a polygon (x1, y1, x2, y2, ..)"
    if name not in (OF_ZONES if rank is None else STRESS):
        return "a point (x, y) is needed; only stresses have means in a region"
    if rank is not None and len(place) == 3:
        return "" if place[2] > 0.0 else "the radius is not above 0"
    if len(place) < 6 or len(place) % 2:
        return "a polygon has the coordinates of three or more corners"
    corners = shapely.Polygon(np.reshape(place, (-1, 2)))
    return "" if corners.is_valid and corners.area > 0.0 else "the polygon crosses itself or has no area"


def value_of(quantity: Any, run: Run) -> tuple[float, float]:
    """(value, half width of what is known of it); raises LookupError."""
    if quantity.name == FAILURE:
        return failure_gravity(run)
    if quantity.name == ENERGY:
        return _energy_error(run, quantity.rank), 0.0
    frame = len(run.frames) - 1 if quantity.stage is None else run.last_frame(quantity.stage)
    if quantity.name in FABRIC:
        return _of_fabric(run, frame, quantity.rank or 1, quantity.name.removeprefix("fabric_"))
    return _mean_stress(run, frame, quantity), 0.0


def failure_gravity(run: Run) -> tuple[float, float]:
    """(gravity factor at which the slope fails, half the distance of the frames it lies between); raises LookupError."""
    found = failure.summary(run)
    if found is None:
        raise LookupError("the scene has no stage of kind overload with frames")
    if found["failed_at"] is None:
        raise LookupError(f"not failed up to {found['not_failed_at']:.4g} g")
    low = found["not_failed_at"] if found["not_failed_at"] is not None else found["failed_at"]
    return 0.5 * (low + found["failed_at"]), 0.5 * (found["failed_at"] - low)


def _of_fabric(run: Run, frame: int, rank: int, name: str) -> tuple[float, float]:
    """A parameter of the fabric with the half width of its 95 % interval (another packing of the same kind)."""
    if rank not in run.windows:
        raise LookupError(f"the run has no discs of rank {rank}")
    found = band_states.fabric(run, frame, rank)
    if found is None:
        raise LookupError("there are too few contacts for a fabric")
    fabric, _ = found
    half = (
        getattr(fabric, f"{name}_error")
        if name.startswith("theta")
        else getattr(fabric, f"{name}_interval")[1] - getattr(fabric, name)
    )
    return float(getattr(fabric, name)), float(half)


def _mean_stress(run: Run, frame: int, quantity: Any) -> float:
    """Mean stress [Pa] in a region: of the discs of a rank, or of the zones whose centres are inside, by their areas."""
    place, rank = quantity.place, quantity.rank
    region = np.array(place) if len(place) == 3 else np.reshape(place, (-1, 2))
    if rank is not None:
        if rank not in run.windows:
            raise LookupError(f"the run has no discs of rank {rank}")
        value = averages.average_stress(run.discs(frame, rank), run.contacts(frame, rank), region)[STRESS[quantity.name]]
        if not np.isfinite(value):
            raise LookupError("no disc reaches into the region")
        return float(value)
    zones = run.zones(frame)
    corners = run.gridpoints(frame).xy[:, :2][zones.corners]
    inside = shapely.contains_xy(shapely.Polygon(region), *corners.mean(axis=1).T)
    if not inside.any():
        raise LookupError("no zone has its centre in the polygon")
    return float(
        np.average(zones.stress[inside, OF_ZONES[quantity.name]], weights=shapely.area(shapely.polygons(corners[inside])))
    )


def _energy_error(run: Run, rank: int | None) -> float:
    """Largest |energy_error| over the largest |energy| of the ledger; of the worst side unless a rank is named."""
    shares = []
    for one in (0, *run.windows) if rank is None else (rank,):
        names = [name for name in run.files[one].history_names() if name.startswith("energy_")]
        if "energy_error" not in names:
            continue
        largest = {name: float(np.abs(run.history(name, one)[1]).max(initial=0.0)) for name in names}
        error = largest.pop("energy_error")
        shares.append(error / (max(largest.values()) or 1.0))
    if not shares:
        raise LookupError("the run has no energy_error: set record.energy = true")
    return max(shares)
