"""W1: circular holes, elastic (Kirsch) and plastic (Salencon), against zone size, mixed discretisation and unbalanced ratio.

Both holes as in scripts/verification/continuum; the Salencon hole is relieved at once, so that only the ratio says when to
stop, and once more gently, in 200 steps for each zone to the right angle. The error is the norm of the stress error over the
pressure. Without mixed discretisation zones are overlaid triangles, which the code computes at four times the cost; their
seconds are steps times the seconds a step takes with it on the same quadrilaterals.
"""

from math import pi

from verification.continuum import kirsch, salencon
from verification.orders import order

from accuracy.common import curves, timed
from colluvium.figures.style import styled

TITLE = "circular holes: zone size, mixed discretisation, unbalanced ratio"
PICTURE = "accuracy_w1.png"
READ = """Zone size decreases to the right. Halving it costs about eight times as much (four times the zones, twice the steps),
so a curve of order 2 falls by 4 where time grows by 8. A curve that levels off has reached a floor: its ratio (a smaller ratio
is cheap, because steps grow only with its logarithm) or, in yielding rock, the path of unloading. After sudden unloading the
hole overshoots its equilibrium and keeps the plastic part; the dotted curve removes the support gradually and continues to
fall. The dashed curve is for the same quadrilaterals without mixed discretisation: the same order with a larger error for the
elastic hole, ten times the error for the plastic one, which is locking."""
COLUMNS = {
    "case": "case",
    "method": "method",
    "zone": ("zone at the wall / a", lambda v: f"{v:.4f}"),
    "zones": "zones",
    "steps": "steps",
    "error": ("error [%]", lambda v: f"{100 * v:.3f}"),
    "seconds": ("seconds", lambda v: f"{v:.3f}"),
    "spread": ("spread", lambda v: "-" if v is None else f"{v:.2f}"),
    "repeats": "repeats",
    "order": ("order", lambda v: "-" if v is None else f"{v:.2f}"),
    "reference": "reference",
}
RATIOS = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7)
SIZES = (6, 12, 24, 48, 72)
WITHOUT = "without mixed discretisation, 1e-7"
GENTLY, GENTLE_STEPS = "ratio 1e-07, relieved gently", 200


def relieved(n, ratio, mixed):
    """The Salencon hole relieved at once, and the steps that took."""
    return salencon.solve(n, 0, ratio=ratio, mixed=mixed, left=lambda s: 0.0)


def relieved_gently(n, ratio, mixed):
    """The same with a support that fades as (1 - s)^2."""
    return salencon.solve(n, GENTLE_STEPS * n, ratio=ratio, mixed=mixed)


CASES = {
    "Kirsch": (kirsch.solve, kirsch.error, "Kirsch (1898)"),
    "Salencon": (relieved, salencon.error, "Salencon (1969)"),
}


def run(fast):
    """Rows of both holes; fast: two sizes, three ratios, one repeat."""
    sizes, ratios, repeats = (SIZES[:2], RATIOS[::2], 1) if fast else (SIZES, RATIOS, 3)
    rows = []
    for case, (solve, error, source) in CASES.items():
        solve(6, 1e-3, True)  # compiles
        for ratio in ratios:
            found = [measured(solve, error, n, ratio, repeats) for n in sizes]
            rows += finished(case, f"ratio {ratio:.0e}", source, found)
        if case == "Salencon":
            gently = [measured(relieved_gently, error, n, RATIOS[-1], repeats) for n in sizes]
            rows += finished(case, GENTLY, source, gently)
        step = {row["zones"]: row["seconds"] / row["steps"] for row in found}
        plain = [without(solve, error, n, RATIOS[-1], step) for n in sizes]
        rows += finished(case, WITHOUT, source, plain)
    return rows


def measured(solve, error, n, ratio, repeats):
    """What one mesh takes and how wrong it is."""
    seconds, spread, (ring, steps) = timed(lambda: solve(n, ratio, True), repeats)
    return about(ring, n, steps, error(ring)) | {"seconds": seconds, "spread": spread, "repeats": repeats}


def without(solve, error, n, ratio, step):
    """The same without mixed discretisation; step {zones: seconds a step takes}."""
    ring, steps = solve(n, ratio, False)
    row = about(ring, n, steps, error(ring))
    return row | {"seconds": steps * step[row["zones"]], "spread": None, "repeats": 1}


def about(ring, n, steps, error):
    """Size of the problem and its error."""
    return {"zone": 0.5 * pi / n, "zones": len(ring.quads), "steps": steps, "error": error}


def finished(case, method, source, rows):
    """Rows of one curve, with its observed order."""
    observed = order([row["zone"] for row in rows], [row["error"] for row in rows])
    return [{"case": case, "method": method, **row, "order": observed, "reference": source} for row in rows]


@styled
def draw(rows, path):
    """Error against wall time, one panel a hole."""
    import matplotlib.pyplot as plt

    figure, panels = plt.subplots(1, len(CASES), figsize=(7.6, 3.8), layout="constrained")
    for axes, case in zip(panels, CASES, strict=True):
        own = [row for row in rows if row["case"] == case]
        curves(axes, own)
        for line in axes.lines:
            if line.get_label() in (WITHOUT, GENTLY):
                line.set_linestyle("--" if line.get_label() == WITHOUT else ":")
                line.set_color("#606060" if line.get_label() == WITHOUT else "C4")
        axes.set_title(f"{case} hole, stress error over the pressure")
    figure.legend(*panels[-1].get_legend_handles_labels(), loc="outside lower center", ncols=4, fontsize=7.5)
    figure.savefig(path)
    plt.close(figure)
