"""W6: the coupled slope against its number of discs: failure gravity, anisotropy, direction, seconds.

The slope of `configs/stone_content_study.toml`: gravity grows until a band joins toe and crest. *calibrated*: soil fitted to the
zones with 45 % of stones; *printed*: discs of the paper's Table 2. Every setting is computed with the same seeds, which draw
stones and discs. failure: gravity over g at which the band is complete; a, theta: anisotropy and direction of the contact normals
at rest under g, before gravity grows. ±: half the 95 % interval of the mean over seeds (Student's t); of theta that of the
deviations about the mean axis. error: of the mean failure gravity from that of the most discs with a full set of seeds. Seconds
are those of all stages of the first seed, computed alone with compiled kernels; other seeds run side by side. Settings stay in
the folder of --out by the hash of their scene: the same command continues.
"""

import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from scipy import stats

from colluvium.accuracy.knobs import Setting
from colluvium.accuracy.quantity import quantity_of, value_of
from colluvium.accuracy.study import Study
from colluvium.figures.style import styled
from colluvium.running.processes import as_toml
from coupler_protocol.scene.reader import read_scene

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
SCENE, PAPER = CONFIGS / "stone_content_study.toml", CONFIGS / "paper_slope.toml"
TITLE = "the coupled slope: number of discs, stones, calibration"
PICTURE = "accuracy_w6.png"
READ = """Every point is a mean over seeds with its 95 % interval, at the seconds of one run; along a curve the discs get smaller.
Where intervals of neighbours overlap, more discs buy nothing that the seeds would not hide: the cheapest such setting with more
seeds is the better one. The grey line is the continuum alone: where it lies within the interval of the most discs, it would have
done for the failure gravity, but it has no a and no theta."""
RADII = {1000: 0.0545, 3000: 0.0315, 10_000: 0.01725, 30_000: 0.01}  # by about how many discs they give [m]
MOST = 30_000  # discs that are computed with one seed
SEEDS, CONTENTS, MAIN = 5, (0.0, 0.60), 0.45  # other contents have about 3,000 discs
FAST_RADII, FAST_SEEDS = {140: 0.09, 220: 0.075}, 2
FAST = (  # the grid and the window of configs/quick_slope.toml, larger discs, a short ramp
    "grid.zone_size=0.6666666666666666",
    'window=[{name="band", columns=[16, 18], rows=[8, 14]}]',
    "stones.size={mean=0.4, sigma=0.2, min=0.3, max=0.6}",
    'stage.overload={name="overload", large_strain=true, gravity_factor={to=20.0, over=2000}, until={steps=2000}}',
    "record.every=100",
)
FAILURE, SHAPE = "failure_gravity", ("fabric_a@couple", "fabric_theta_a@couple")
COLUMNS = {
    "case": "case",
    "method": "stones",
    "discs": ("discs", lambda v: "0" if not v else f"{v}"),
    "seeds": "seeds",
    "failure": ("failure [g]", lambda v: _number(v, ".2f")),
    "failure_half": ("±", lambda v: _number(v, ".2f")),
    "a": ("a", lambda v: _number(v, ".3f")),
    "a_half": ("±", lambda v: _number(v, ".3f")),
    "theta": ("theta [deg]", lambda v: _number(v, ".1f")),
    "theta_half": ("±", lambda v: _number(v, ".1f")),
    "error": ("error [%]", lambda v: _number(v and 100.0 * v, ".1f")),
    "seconds": ("seconds", lambda v: _number(v, ".1f")),
    "failed": ("failed", lambda v: v or "-"),
}


def _number(value, form):
    return "-" if value is None else f"{value:{form}}"


def printed():
    """Overrides that give the window the discs of Table 2."""
    discs = tomllib.loads(PAPER.read_text(encoding="utf-8"))["discs"]
    return tuple(
        f"discs.{kind}.{table}.{key}={value}"
        for kind in ("soil", "stone")
        for table in ("spring", "friction", "bond")
        for key, value in discs[kind][table].items()
    )


def settings(fast):
    """[(case, stone content, number of discs aimed at, seeds, overrides)]."""
    found = []
    for case, changes in (("calibrated", ()), ("printed", printed())):
        for about, radius in (FAST_RADII if fast else RADII).items():
            seeds = FAST_SEEDS if fast else 1 if about == MOST else SEEDS
            for content in (MAIN, *(CONTENTS if about == 3000 else ())):
                own = (*changes, f"discs.radius={radius}", f"stones.content={content}")
                found.append((case, content, about, seeds, own))
    return found


def run(fast, out=None, at_once=2):
    """Rows of all settings, kept in the folder `out`; fast: a coarse slope, two radii, two seeds."""
    if out is None:
        with tempfile.TemporaryDirectory() as folder:
            return run(fast, Path(folder), at_once)
    out = Path(out)
    out.mkdir(parents=True, exist_ok=True)
    chosen, given = settings(fast), list(FAST) if fast else []
    scene = read_scene(str(SCENE), given)
    study = Study(str(SCENE), given, quantity_of(FAILURE, scene), out, lambda text: print(text, flush=True))
    groups = [[_seeded(changes, seed) for seed in range(1, seeds + 1)] for *_, seeds, changes in chosen]
    first = study.compute([group[0] for group in groups], 1)
    others = [one for group in groups for one in group[1:]]
    with ThreadPoolExecutor(at_once) as pool:
        rest = iter(list(pool.map(lambda one: study.result(one, False), others)))
    rows = []
    for (case, content, about, *_, seeds, _), group, one in zip(chosen, groups, first, strict=True):
        results = [one, *(next(rest) for _ in range(seeds - 1))]
        rows.append({"case": case, "method": f"{100 * content:.0f} %", "about": about} | _row(study, group, results))
    return _judged([*rows, continuum(out, given)])


def _seeded(changes, seed):
    return Setting({"setting": " ".join(changes[-2:]), "seed": seed}, (*changes, f"seed={seed}"))


def continuum(out, given):
    """The row of the grid alone: the same slope without window, discs and stones."""
    tables = read_scene(str(SCENE), given).model_dump(mode="json", exclude_none=True)
    for name in ("window", "discs", "stones", "fos", "coupling"):
        tables.pop(name, None)
    tables["stage"] = [stage for stage in tables["stage"] if stage["name"] in ("equilibrium", "overload")]
    path = out / "continuum.toml"
    path.write_text(as_toml(tables), encoding="utf-8")
    quantity = quantity_of(FAILURE, read_scene(str(path)))
    study = Study(str(path), [], quantity, out, lambda text: print(text, flush=True))
    (found,) = study.compute([Setting({"setting": "continuum alone"}, ())], 1)
    row = {"case": "continuum", "method": "-", "about": 0, "discs": 0, "seeds": 1, "failure": found.value}
    return row | {"seconds": found.seconds, "steps": found.steps, "failed": found.failed}


def _row(study, group, results):
    """Means and half widths over the seeds of a setting."""
    good = [(setting, one) for setting, one in zip(group, results, strict=True) if not one.failed]
    shapes, discs = [], 0
    for setting, _ in good:
        folder = study.folder(read_scene(study.path, [*study.given, *setting.changes]))
        shapes.append([value_of(quantity_of(text, study_scene(study)), folder)[0] for text in SHAPE])
        discs = discs or _count(folder)
    row = {"discs": discs, "seeds": len(good), "seconds": results[0].seconds, "steps": results[0].steps}
    row["failed"] = "; ".join(dict.fromkeys(one.failed for one in results if one.failed))
    row["failure"], row["failure_half"] = mean_and_half([one.value for _, one in good])
    row["a"], row["a_half"] = mean_and_half([a for a, _ in shapes])
    row["theta"], row["theta_half"] = axis_and_half([theta for _, theta in shapes])
    row["values"] = [one.value for _, one in good]
    return row


def study_scene(study):
    """The scene of a study without the changes of a setting."""
    return read_scene(study.path, study.given)


def _count(folder):
    """Number of discs in the last frame, without those of the ring."""
    from colluvium import open_run

    with open_run(folder) as found:
        return int((np.asarray(found.discs(len(found.frames) - 1).control) == 0).sum())


def mean_and_half(values):
    """(mean, half width of its 95 % interval by Student's t); None for what too few values do not have."""
    if not values:
        return None, None
    if len(values) < 2:
        return float(values[0]), None
    half = stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values))
    return float(np.mean(values)), float(half)


def axis_and_half(angles):
    """The same of directions [deg] that repeat after 180 degrees."""
    if not angles:
        return None, None
    axis = np.degrees(np.angle(np.exp(2j * np.radians(angles)).mean())) / 2.0
    away, half = mean_and_half([(angle - axis + 90.0) % 180.0 - 90.0 for angle in angles])
    return float((axis + away) % 180.0), half


def _judged(rows):
    """Rows with their errors against the most discs of their case that have a full set of seeds."""
    for row in rows:
        own = [one for one in rows if one["case"] == row["case"] and one.get("failure_half") is not None]
        best = max((one for one in own if one["method"] == f"{100 * MAIN:.0f} %"), key=lambda one: one["about"], default=None)
        comparable = best is not None and row is not best and row["method"] == best["method"] and row["failure"] is not None
        row["error"] = abs(row["failure"] / best["failure"] - 1.0) if comparable else None
        row |= {"order": None, "spread": None, "repeats": 1, "reference": "mean of the most discs with all seeds"}
    return rows


def said(rows):
    """When the continuum alone would have done, one sentence a case."""
    alone = next(row for row in rows if row["case"] == "continuum")
    if alone["failure"] is None:
        return [f"The continuum alone has no failure gravity: {alone['failed']}."]
    found = []
    for case in dict.fromkeys(row["case"] for row in rows if row is not alone):
        own = [row for row in rows if row["case"] == case and row["method"] == f"{100 * MAIN:.0f} %" and row.get("failure_half")]
        if not own:
            found.append(f"*{case}*: fewer than two seeds failed, nothing can be said.")
            continue
        best = max(own, key=lambda row: row["about"])
        text = (
            f"{best['failure']:.2f} ± {best['failure_half']:.2f} g with {best['discs']} discs, {alone['failure']:.2f} g without"
        )
        away = alone["failure"] - best["failure"]
        cost = ""
        if alone["seconds"] and best["seconds"]:
            cost = f" at 1/{best['seconds'] / alone['seconds']:.0f} of the seconds"
        if abs(away) <= best["failure_half"]:
            found.append(f"*{case}*: the continuum alone would have done for the failure gravity ({text}){cost}.")
        else:
            found.append(f"*{case}*: the continuum alone is off by {100 * away / best['failure']:+.0f} % ({text}).")
    return found


@styled
def draw(rows, path):
    """Failure gravity, a and theta with their intervals against seconds; failed settings are named."""
    import matplotlib.pyplot as plt
    from matplotlib.ticker import LogLocator, NullFormatter

    figure, panels = plt.subplots(1, 3, figsize=(10.2, 3.4), layout="constrained")
    alone = next(row for row in rows if row["case"] == "continuum")
    names = ("failure", "failure gravity [g]"), ("a", "a at rest under g"), ("theta", "theta [deg]")
    for axes, (key, label) in zip(panels, names, strict=True):
        for case, method in dict.fromkeys((row["case"], row["method"]) for row in rows if row is not alone):
            own = [row for row in rows if (row["case"], row["method"]) == (case, method)]
            own = [row for row in own if row[key] is not None and row["seconds"]]
            half = [row[f"{key}_half"] or 0.0 for row in own]
            if own:
                points = [row["seconds"] for row in own], [row[key] for row in own]
                axes.errorbar(*points, half, fmt="o-", markersize=3.5, capsize=2, label=f"{case}, {method}")
        axes.set(xscale="log", xlabel="seconds of a run", ylabel=label)
        axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.xaxis.set_major_formatter("{x:g}")
        axes.xaxis.set_minor_formatter(NullFormatter())
        axes.grid(True, which="major", color="#e4e4e4", linewidth=0.6)
    if alone["failure"] is not None:
        panels[0].axhline(alone["failure"], color="0.6", label="continuum alone")
    panels[0].legend(fontsize=7.0)
    failed = [f"{row['case']} {row['method']} {row['about']}" for row in rows if row["failed"]]
    if failed:
        figure.suptitle(f"failed: {'; '.join(failed)}", fontsize=8, color="#b03a2e")
    figure.savefig(path)
    plt.close(figure)
