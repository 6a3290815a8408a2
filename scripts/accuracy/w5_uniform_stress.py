"""W5: a uniform stress through the interface, against discs a segment, their offset from it, and the mapping.

A block at 29 degrees with a window of discs (accuracy/uniform.py) under four strains: compression and shear along the
segments, and both at 29 degrees to them. Errors are root mean squares over the strains, and over three packings: of the stress
of the zones beside the rim; of P/l of its gridpoints over sigma n; of moment and power from discs to gridpoints, segment by
segment, over sum |P| l and over the sum of the discs' powers. Seconds are those of steps to rest, four strains, one packing."""

from itertools import product

import numpy as np
from verification.orders import order

from accuracy import uniform
from accuracy.common import curves, timed
from colluvium.figures.style import styled

TITLE = "a uniform stress through the interface: discs a segment, their offset, the mapping"
PICTURE = "accuracy_w5.png"
READ = """Away from corners, a matched lattice passes a uniform stress to round-off ([verification](verification.md), case
*uniform stress*). The remaining error is that of the four corners, each of which lacks the traction on half a disc: errors of
zones and P/l are of order 1 in the radius of the discs, and with one disc a segment (which the program does not build) the
error of P/l is more than a third. In packings the granularity adds to this: twice the errors of the lattice, of the same
order. An offset of R/2 or R hardly changes them with the work-consistent mapping, which loses neither moment nor power at any
position of the discs. The paper's mapping drops the moments of contacts about the centres of control discs: a loss of order 1,
and in the lattice an error of P/l larger by a fifth, and by half with discs at R. Off the segments it also loses power."""


def _percent(value):
    return "< 1e-12" if value < 1e-14 else f"{100.0 * value:.2f}"


COLUMNS = {
    "case": "window",
    "method": "control discs, mapping",
    "per_segment": "discs a segment",
    "discs": "discs",
    "steps": "steps",
    "error": ("zones [%]", _percent),
    "traction": ("P/l [%]", _percent),
    "moment": ("moment [%]", _percent),
    "power": ("power [%]", _percent),
    "seconds": ("seconds", lambda v: f"{v:.3f}"),
    "spread": ("spread", lambda v: f"{v:.2f}"),
    "order": ("order", lambda v: f"{v:.2f}"),
    "traction_order": ("order of P/l", lambda v: f"{v:.2f}"),
}
QUANTITIES = ("error", "traction", "moment", "power")
OFFSETS = {0.0: "on the segment", 0.5: "R/2 outside", 1.0: "R outside"}
SEEDS = {"lattice": (None,), "packing": (1, 2, 3)}
REFERENCE = "uniform stress of the matched zones"


def run(fast):
    """Rows of all curves; fast: up to 4 discs a segment, one packing, offsets 0 and R, one repeat."""
    offsets, repeats = ((0.0, 1.0), 1) if fast else (OFFSETS, 3)
    uniform.errors(None, 2, 0.0, "work-consistent")  # compiles
    rows = []
    for case, offset, mapping in product(SEEDS, offsets, ("work-consistent", "paper")):
        alone = case == "lattice" and offset == 0.0  # discs on gridpoints only cannot stand off a segment
        sizes = (*((1,) if alone else ()), 2, 4, *(() if fast else (8, 16)))
        own = [_point(SEEDS[case][: 1 if fast else None], n, offset, mapping, repeats) for n in sizes]
        observed = {
            "order": order(sizes, [row["error"] for row in own]),
            "traction_order": order(sizes, [row["traction"] for row in own]),
        }
        rows += [{"case": case, "method": f"{OFFSETS[offset]}, {mapping}"} | row | _positive(observed) for row in own]
    return rows


def _point(seeds, per_segment, offset, mapping, repeats):
    """One row: errors over all seeds, steps and seconds of the first."""
    found = []
    for seed in seeds:
        if seed is not None:
            uniform.packed(seed, per_segment)  # is not timed
        if found:
            found.append(uniform.errors(seed, per_segment, offset, mapping))
        else:
            seconds, spread, one = timed(lambda s=seed: uniform.errors(s, per_segment, offset, mapping), repeats)
            found.append(one)
    errors = np.sqrt(np.mean([np.square(one[0]) for one in found], axis=0))
    _, steps, discs = found[0]
    cost = {"seconds": seconds, "spread": spread, "repeats": repeats, "reference": REFERENCE}
    values = dict(zip(QUANTITIES, errors.tolist(), strict=True))
    return {"per_segment": per_segment, "discs": discs, "steps": steps} | values | cost


def _positive(orders):
    """Orders in the radius: errors fall as discs a segment grow."""
    return {key: -value for key, value in orders.items()}


@styled
def draw(rows, path):
    """Stress of zones and P/l against wall time; moment and power that the paper's mapping loses against discs a segment."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, 3, figsize=(10.2, 3.8), layout="constrained")
    by_case = {case: [row for row in rows if row["case"] == case] for case in SEEDS}
    curves(panels[0], by_case["lattice"])
    panels[0].set_title("lattice: stress of the zones")
    curves(panels[1], [row | {"error": row["traction"]} for row in by_case["packing"]])
    panels[1].set_title("packing: P/l")
    panels[1].legend(fontsize=7.0)
    _losses(panels[2], by_case["packing"])
    figure.savefig(path)
    plt.close(figure)


def _losses(axes, rows):
    """Moment and power lost on the way to the gridpoints; what is round-off is not drawn."""
    for name in dict.fromkeys(row["method"] for row in rows):
        own = [row for row in rows if row["method"] == name]
        sizes = [row["per_segment"] for row in own]
        for quantity, line in (("moment", "-"), ("power", "--")):
            values = [100.0 * row[quantity] for row in own]
            if max(values) > 1e-9:
                axes.loglog(sizes, values, line, marker="o", markersize=3.5, linewidth=1.2, label=f"{quantity}, {name}")
    axes.set_xticks(sizes, [str(size) for size in sizes])
    axes.minorticks_off()
    axes.set_title("packing: lost; all others < 1e-12 %")
    axes.set_xlabel("discs a segment")
    axes.set_ylabel("lost [%]")
    axes.grid(True, which="major", color="#e4e4e4", linewidth=0.6)
    axes.legend(fontsize=7.0)
