"""Data of the page for every frame: positions, displacements, fields of both domains, contacts, and colour scales.

Fields of zones are those recorded, but the stress is averaged at gridpoints (colluvium.results.smoothed_stress). Fields of a
window are means over bins as large as a zone (colluvium.results.window_fields), so that discs can be coloured in the scale of the
zones. Displacements belong to gridpoints and discs.
"""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from colluvium.figures import chains, domain, frames, plastic, style
from colluvium.html.histories import Axis
from colluvium.html.packing import Packing
from colluvium.results import stones, walls, window_fields
from colluvium.results.run import Run
from coupler_protocol.files.quantities import PER_STEP

DECADES = 3  # of a logarithmic scale
POSITIVE = ("from zero", "logarithmic")
SAME_PLACE = 1e-6  # [m] initial positions that differ by less are the same


class Quantity(NamedTuple):
    """A quantity by which zones and discs can be coloured."""

    key: str
    name: str
    unit: str
    colours: str  # key of style.MAPS
    scale: str  # "even", "about zero", "from zero", or "logarithmic": from zero and logarithmic at first


QUANTITIES = (
    Quantity("displacement", "displacement", "m", "displacement", "from zero"),
    Quantity("shear_strain", "shear strain", "-", "strain", "logarithmic"),
    Quantity("shear_strain_rate", "shear strain rate", "1/s", "rate", "logarithmic"),
    Quantity("syy", "vertical stress syy, tension +, averaged at gridpoints", "Pa", "stress", "even"),
    Quantity("sxx", "horizontal stress sxx, tension +, averaged at gridpoints", "Pa", "stress", "even"),
    Quantity("sxy", "shear stress sxy, averaged at gridpoints", "Pa", "change", "about zero"),
)
STRESS = {"sxx": (0, 0), "syy": (1, 1), "sxy": (3, 2)}  # columns: of the zones' stress, of the bins'


class Contents:
    """Frames of a run in `packing`; `description()` describes them for the page."""

    def __init__(self, run: Run, packing: Packing) -> None:
        self.run, self.packing = run, packing
        self._starts: dict[int, np.ndarray] = {}  # by rank: initial positions of its discs
        self._axis = Axis(run)
        self._values: dict[str, list[list[np.ndarray]]] = {q.key: [] for q in QUANTITIES}  # by frame
        seen = frames.before_run_out(run) if frames.has_true_positions(run) else [0]
        self._box = [domain.gridpoints_now(run, i) for i in seen if run.has(i, 0)]
        self._box += [run.discs(i, rank).xy for i in seen for rank in run.windows if run.has(i, rank)]

    def description(self) -> dict[str, Any]:
        """Frames, colour scales and the position of every array."""
        told = [self._frame(i) for i in range(len(self.run.frames))]
        together = np.concatenate(self._box)
        calm = len(frames.before_run_out(self.run))
        quantities = []
        for quantity in QUANTITIES:
            values = self._values[quantity.key]
            if not any(values):
                continue
            colours = np.rint(255 * style.colour_map(quantity.colours)(np.linspace(0.0, 1.0, 256))[:, :3]).astype(int)
            quantities.append(
                {
                    "key": quantity.key,
                    "name": quantity.name,
                    "positive": quantity.scale in POSITIVE,
                    "logarithmic": quantity.scale == "logarithmic",
                    "colours": "".join(f"{r:02x}{g:02x}{b:02x}" for r, g, b in colours),
                    "run": _envelope(quantity, values[:calm], self._unit(quantity, range(calm))),
                    "frames": [_scale(quantity, frame, self._unit(quantity, [i])) for i, frame in enumerate(values)],
                }
            )
        return {
            "box": [*together.min(axis=0).tolist(), *together.max(axis=0).tolist()],
            "calm": calm - 1,
            "decades": DECADES,
            "motion": "true" if frames.has_true_positions(self.run) else "capped",
            "quantities": quantities,
            "wall": domain.WALL,
            "plastic": {"states": plastic.STATES, "elastic": plastic.ELASTIC},
            "chains": {"compression": chains.COMPRESSION, "tension": chains.TENSION, "run": _widest(told[:calm])},
            "frames": told,
            "arrays": self.packing.arrays,
        }

    def _unit(self, quantity: Quantity, shown: Sequence[int]) -> str:
        """Unit in some frames: rates are per step in static stages."""
        rate = quantity.unit in PER_STEP
        static = {self.run.in_real_time(self.run.frames[i].stage) is False for i in shown} if rate else {False}
        return " or ".join(PER_STEP[quantity.unit] if one else quantity.unit for one in sorted(static))

    def _frame(self, i: int) -> dict[str, Any]:
        info = self.run.frames[i]
        farthest = frames.farthest(self.run, i)
        for found in self._values.values():
            found.append([])
        return {
            "step": info.step,
            "across": self._axis.across(info.step),
            "stage": info.stage,
            "gravity_factor": info.gravity_factor,
            "farthest": farthest if np.isfinite(farthest) else None,
            "drawn": frames.capped_part(self.run, i),
            "walls": [ends.ravel().tolist() for ends in walls.ends(self.run, i).values()],
            "grid": self._grid(i) if self.run.has(i, 0) else None,
            "windows": [self._window(i, rank) for rank in self.run.windows if self._is_somewhere(i, rank)],
        }

    def _is_somewhere(self, i: int, rank: int) -> bool:
        """Whether a window was recorded and the positions of its discs are finite: after a blow-up they are not."""
        return self.run.has(i, rank) and bool(np.isfinite(self.run.discs(i, rank).displacement).all())

    def _grid(self, i: int) -> dict[str, Any]:
        zones, gridpoints = self.run.zones(i), self.run.gridpoints(i)
        told = self._body(gridpoints.xy, gridpoints.displacement)
        told["corners"] = [self.packing.whole(column) for column in zones.corners.T]
        told["border"] = [self.packing.whole(column) for column in _border(zones.corners).T]
        told["fields"] = {key: self._field(key, value) for key, value in _of_zones(zones, self.run.smoothed_stress(i))}
        if "plastic_state" in zones:
            told["fields"]["plastic"] = self.packing.whole(zones.plastic_state)
        return told

    def _window(self, i: int, rank: int) -> dict[str, Any]:
        run, keep = self.run, self.packing
        discs, grid = run.discs(i, rank), window_fields.bins(run, i, rank)
        start = self._start(rank, window_fields.starting_places(discs))
        told = self._body(start, discs.displacement)
        told["rank"] = rank
        told["radius"] = keep.reals(discs.radius, 4)
        told["bin"] = keep.whole(grid.of(start))
        told["fields"] = {key: self._field(key, value) for key, value in _of_bins(run, i, rank, grid)}
        if "stone" in discs:
            told["stone"] = keep.whole(discs.stone)
        if run.stones(rank):
            told["stones"] = self._stones(i, rank)
        contacts = run.contacts(i, rank)
        order = np.lexsort(contacts.ends.T[::-1])  # by the first disc: compresses better
        told["contacts"] = {
            "ends": [keep.whole(column) for column in contacts.ends[order].T],
            "force": keep.reals(contacts.normal_force[order]),
            "widest": _strong(contacts.normal_force),
        }
        if "bond_state" in contacts:
            told["contacts"]["bond"] = keep.whole(contacts.bond_state[order])
        return told

    def _stones(self, i: int, rank: int) -> dict[str, Any]:
        """Corners of all stones, one stone after the other, and the number of corners of each."""
        placed = self.run.stones(rank)
        start, now = np.concatenate(placed), np.concatenate(stones.outlines(self.run, i, rank))
        return self._motion(start, now - start) | {"corners": self.packing.whole(np.array([len(outline) for outline in placed]))}

    def _body(self, start: np.ndarray, displacement: np.ndarray) -> dict[str, Any]:
        size = np.hypot(*displacement.T)
        self._values["displacement"][-1].append(size[np.isfinite(size)])
        return self._motion(start, displacement)

    def _motion(self, start: np.ndarray, displacement: np.ndarray) -> dict[str, Any]:
        return {
            "start": [self.packing.reals(column, 4) for column in start.T],
            "displacement": [self.packing.reals(column) for column in displacement.T],
        }

    def _field(self, key: str, value: np.ndarray) -> int:
        self._values[key][-1].append(value[np.isfinite(value)])
        return self.packing.reals(value, logarithmic=key.startswith("shear_strain"))

    def _start(self, rank: int, start: np.ndarray) -> np.ndarray:
        """Initial positions of the discs, with the same bits in every frame if they differ by round-off only."""
        kept = self._starts.get(rank)
        if kept is None or kept.shape != start.shape or np.abs(kept - start).max(initial=0.0) > SAME_PLACE:
            self._starts[rank] = start
        return self._starts[rank]


def _of_zones(zones: Any, stress: np.ndarray) -> Iterator[tuple[str, np.ndarray]]:
    for key in ("shear_strain", "shear_strain_rate"):
        if key in zones:
            yield key, zones[key]
    for key, (column, _) in STRESS.items():
        yield key, stress[:, column]


def _of_bins(run: Run, i: int, rank: int, grid: window_fields.Bins) -> Iterator[tuple[str, np.ndarray]]:
    yield "shear_strain", window_fields.shear_strain(run, i, grid, rank)
    yield "shear_strain_rate", window_fields.shear_strain(run, i, grid, rank, "velocity")
    stress = window_fields.mean_stress(run, i, grid, rank)
    for key, (_, column) in STRESS.items():
        yield key, stress[:, column]


def _border(corners: np.ndarray) -> np.ndarray:
    """(E, 2) gridpoints of the edges that belong to one zone only."""
    edges = np.sort(np.stack((corners, np.roll(corners, -1, axis=1)), axis=2).reshape(-1, 2), axis=1)
    edges, count = np.unique(edges[edges[:, 0] != edges[:, 1]], axis=0, return_counts=True)
    return edges[count == 1]


def _scale(quantity: Quantity, values: list[np.ndarray], unit: str) -> dict[str, Any] | None:
    """Colour scale of one frame: its ends in SI units, and the factor to the displayed unit."""
    if not values:
        return None
    return _readable(quantity, *_ends(values), unit)


def _envelope(quantity: Quantity, values: list[list[np.ndarray]], unit: str) -> dict[str, Any] | None:
    """One scale that contains those of all frames."""
    ends = np.array([_ends(frame) for frame in values if frame])
    return _readable(quantity, ends[:, 0].min(), ends[:, 1].max(), unit) if len(ends) else None


def _ends(values: list[np.ndarray]) -> tuple[float, float]:
    """Smallest and largest value without a few outliers; both equal if all values are equal."""
    together = np.concatenate(values)
    low, high = (together.min(), together.max()) if len(together) else (0.0, 0.0)
    return style.limits(*values) if high > low else (float(low), float(high))


def _readable(quantity: Quantity, low: float, high: float, unit: str) -> dict[str, Any]:
    if quantity.scale == "about zero":
        high = max(abs(low), abs(high))
        low = -high
    elif quantity.scale in POSITIVE:
        low = 0.0
    if not high > low:
        high = low + 1.0
    factor, unit = style.readable(unit, np.array([low, high]))
    return {"low": float(low), "high": float(high), "factor": factor, "unit": unit}


def _strong(force: np.ndarray) -> float:
    """Force that only few contacts exceed [N]."""
    known = np.abs(force[np.isfinite(force)])
    return float(np.quantile(known, chains.PART)) if known.any() else 1.0


def _widest(told: list[dict[str, Any]]) -> float:
    """Force [N] with the widest line if all frames share a scale."""
    return max((window["contacts"]["widest"] for frame in told for window in frame["windows"]), default=1.0)
