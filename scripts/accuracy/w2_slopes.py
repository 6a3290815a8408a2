"""W2: factors of safety of three slopes against zone size, width of the bracket, and budget of a trial.

Dawson's slope has a reference from limit analysis. The others flow without dilation, for which there is none: their reference
is what their own meshes go to, with the grid convergence index to say how well that is known. Bracket and budget are varied on
one mesh; their error is half the bracket that is left, trials without a verdict inside it included."""

from itertools import pairwise
from math import log
from pathlib import Path

import numpy as np
from verification.orders import order

from accuracy.common import curves, timed
from colluvium.figures.style import styled
from coupler_protocol.scene.reader import read_scene
from fdm_server.fos.bracket import NoBracket, search
from fdm_server.fos.extrapolation import extrapolate
from fdm_server.fos.ground import settle, with_zone_size
from fdm_server.fos.trial import run_trial

TITLE = "factors of safety: zone size, bracket, budget of a trial"
PICTURE = "accuracy_w2.png"
READ = """Halving the zones halves the error, because a slip line is as wide as a zone, and costs about eight times as much.
Columns along the face (`fit = "face"`) are equivalent to smaller zones, and extrapolation from coarse meshes (stars) is more
accurate than any fine mesh. A narrower bracket costs one or two trials for each halving, more near the factor itself where
verdicts take long; it is worthwhile until the bracket is a few times narrower than the error of the mesh. A small budget
leaves trials without a verdict and therefore a wider bracket, with the factor still inside; where its curve is level, more
budget gains nothing."""
COLUMNS = {
    "case": "case",
    "method": "method",
    "parameter": "zone [m], width or steps",
    "zones": "zones",
    "trials": "trials",
    "value": ("factor", lambda v: "-" if v is None else f"{v:.4f}"),
    "error": ("error [%]", lambda v: "-" if v is None else f"{100 * v:.2f}"),
    "seconds": ("seconds", lambda v: "-" if v is None else f"{v:.2f}"),
    "spread": ("spread", lambda v: "-" if v is None else f"{v:.2f}"),
    "order": ("order", lambda v: "-" if v is None else f"{v:.2f}"),
    "gci": ("GCI [%]", lambda v: "-" if v is None else f"{100 * v:.2f}"),
    "to_one_percent": ("seconds to 1 %", lambda v: "-" if v is None else f"{v:.2g}"),
    "reference": "reference",
}
CONFIGS = Path(__file__).resolve().parents[2] / "configs"
NEAR = "fos.resolution=0.002"
FACE, DIAGONALS = 'grid.fit="face"', 'grid.fit="diagonals"'
MESHES = (  # case, scene, what is changed, zone sizes [m], reference (None: what the meshes go to)
    ("Dawson", "dawson_slope", (FACE,), (10 / 6, 10 / 8, 10 / 12, 10 / 16, 10 / 24), 1.0),
    ("Dawson", "dawson_slope", (DIAGONALS,), (10 / 8, 10 / 12, 10 / 16, 10 / 24), 1.0),
    ("Griffiths-Lane", "griffiths_lane", (FACE,), (2.5, 5 / 3, 1.25, 5 / 6), None),
    ("paper slope", "paper_slope", (FACE, "fos.bracket=[2.3,2.7]"), (2 / 3, 4 / 9, 1 / 3, 2 / 9), None),
)
COARSE = {
    "paper slope": (4 / 3, 1.0, 2 / 3)
}  # zone sizes of the fast form, where the first three of MESHES are not coarse enough
WIDTHS = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002)
BUDGETS = (2_000, 4_000, 8_000, 16_000, 32_000, 64_000)
ONE_MESH = (("Dawson", "dawson_slope", 10 / 12), ("Griffiths-Lane", "griffiths_lane", 1.25))
SOURCES = {"Dawson": "limit analysis, Dawson et al. (1999)"}


def run(fast):
    """Rows of all curves; fast: two or three points of each, one repeat."""
    repeats = 1 if fast else 3
    _search(_scene("dawson_slope", (), 10 / 4))  # compiles, or loads what is compiled
    rows = []
    for case, scene, changes, sizes, reference in MESHES:
        rows += _meshes(case, scene, (*changes, NEAR), COARSE.get(case, sizes[:3]) if fast else sizes, reference, repeats)
    for case, scene, size in ONE_MESH[: 1 if fast else None]:
        widths, budgets = (WIDTHS[::2], BUDGETS[1:4:2]) if fast else (WIDTHS, BUDGETS)
        rows += _varied(case, "bracket", [(w, _scene(scene, (f"fos.resolution={w}",), size)) for w in widths], repeats)
        rows += _varied(case, "budget", [(b, _scene(scene, (NEAR, f"fos.steps={b}"), size)) for b in budgets], repeats)
    return rows


def _scene(name, changes, size):
    """A scene of configs/ with zones of `size` [m]; windows, which no search looks at, would not fit every mesh."""
    scene = read_scene(CONFIGS / f"{name}.toml", [c for c in changes if c not in (FACE, DIAGONALS)])
    fit = {FACE: "face", DIAGONALS: "diagonals"}
    grid = scene.grid.model_copy(update={"fit": next((fit[c] for c in changes if c in fit), scene.grid.fit)})
    return with_zone_size(scene.model_copy(update={"grid": grid}), size)


def _search(scene):
    """Zones and Bracket of a scene; None where no trial fails, or none rests, within the budget."""
    ground = settle(scene)
    try:
        return len(ground.model.zone), search(
            lambda f: run_trial(scene, ground, f).verdict, scene.fos.bracket, scene.fos.resolution
        )
    except NoBracket:
        return len(ground.model.zone), None


def _point(parameter, scene, repeats):
    """One timed search."""
    seconds, spread, (zones, bracket) = timed(lambda: _search(scene), repeats)
    half = None if bracket is None else 0.5 * (bracket.high - bracket.low)
    return {
        "parameter": parameter,
        "zones": zones,
        "trials": None if bracket is None else len(bracket.tried),
        "value": None if bracket is None else bracket.middle,
        "half": half,
        "seconds": seconds,
        "spread": spread,
        "repeats": repeats,
    }


def _meshes(case, name, changes, sizes, reference, repeats):
    """Rows of one curve over zone sizes."""
    rows = [_point(size, _scene(name, changes, size), repeats) for size in sizes]
    limit = extrapolate(sizes, [r["value"] for r in rows], [r["half"] for r in rows])
    aim = next(a for a in (reference, limit.value, rows[-1]["value"]) if a is not None)
    for row in rows:
        row["error"] = abs(row["value"] - aim) / aim
    method = "columns along the face" if FACE in changes else "triangles on the face"
    rows[-1]["gci"] = limit.gci
    together = {
        "parameter": None,
        "zones": None,
        "trials": None,
        "value": limit.value,
        "half": limit.from_brackets,
        "error": None if limit.value is None else max(abs(limit.value - aim), limit.from_brackets) / aim,
        "seconds": sum(r["seconds"] for r in rows),
        "spread": None,
        "repeats": repeats,
    }
    where = "of the finest mesh: too low an order to extrapolate" if limit.value is None else "extrapolated from these meshes"
    source = SOURCES[case] if reference is not None else f"{aim:.4f}, {where}"
    found = _finished(case, f"zone size, {method}", source, rows, sizes)
    if reference is not None:
        found += _finished(case, f"extrapolated, {method}", source, [together], [1.0])
    return found


def _varied(case, what, scenes, repeats):
    """Rows of one curve on one mesh; the error is half of the bracket that is left."""
    rows = [_point(value, scene, repeats) for value, scene in scenes]
    for row in rows:
        row["error"] = None if row["value"] is None else row["half"] / row["value"]
    kept = [row for row in rows if row["error"] is not None]
    return _finished(case, what, "half of the bracket, same mesh", kept, None)


def _finished(case, method, source, rows, sizes):
    observed = order(sizes, [row["error"] for row in rows]) if sizes is not None and len(rows) > 1 else None
    to = _seconds_to(0.01, rows)
    return [
        {"case": case, "method": method, "gci": None, **row, "order": observed, "to_one_percent": to, "reference": source}
        for row in rows
    ]


def _seconds_to(error, rows):
    """Seconds at which a curve reaches an error, between its points on logarithmic scales; None where it does not."""
    points = sorted((r["seconds"], r["error"]) for r in rows if r["error"] is not None)
    for (t0, e0), (t1, e1) in pairwise(points):
        if e0 > error >= e1 > 0.0:
            return float(np.exp(log(t0) + log(e0 / error) / log(e0 / e1) * log(t1 / t0)))
    return points[0][0] if points and points[0][1] <= error else None


@styled
def draw(rows, path):
    """Error against wall time, a panel for zone sizes and one for what is varied on one mesh."""
    import matplotlib.pyplot as plt

    def named(row):
        return {**row, "label": f"{row['case']}: {row['method'].partition(', ')[2] or row['method']}"}

    figure, panels = plt.subplots(1, 2, figsize=(9.0, 3.6), layout="constrained")
    curves(panels[0], [named(r) for r in rows if r["method"].startswith("zone size")], "label")
    for row in rows:
        if row["method"].startswith("extrapolated") and row["error"] is not None:
            panels[0].plot(row["seconds"], 100.0 * row["error"], "*", color="#303030", markersize=7)
    panels[0].plot([], [], "*", color="#303030", label="extrapolated, all meshes")
    curves(panels[1], [named(r) for r in rows if r["method"] in ("bracket", "budget")], "label")
    for axes, title in zip(panels, ("zone size", "bracket and budget, one mesh"), strict=True):
        axes.axhline(1.0, color="#a0a0a0", linewidth=0.6)
        axes.set_title(title)
        axes.legend(fontsize=7.0)
    figure.savefig(path)
    plt.close(figure)
