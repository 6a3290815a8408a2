"""How content, direction, shape and size of stones change the stability of a slope: ensembles of seeds, with intervals.

    python scripts/studies/stone_content_study.py [--seeds N] [--factors N] [--only SERIES ..] [--out DIR] [--workers N]
        [--json FILE] [--page FILE] [--pictures DIR] [--fast]

Every point of a series is computed with N seeds, each with stones and discs of its own, as `colluvium sweep` does: points share
the equilibrium of the grid, points that are done are read, an interrupted study goes on. Prints the failure gravity (rule of
docs/theory.md) and the rotation of the contact forces from the start of the overload to its end; for the first --factors seeds of
the series in FACTORS also the factor of safety of grid and discs. Differences have the 95 % interval of Welch's t.

calibrated   soil of configs/calibrated_slope.toml, fitted with 45 % of stones
printed      discs of the paper's Table 2 (configs/paper_slope.toml)
--fast       a coarse slope, two points of each series; shows that the script works
"""

import argparse
import json
import sys
import tomllib
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
SCENE = CONFIGS / "stone_content_study.toml"
FAILURE, FACTOR = "failure_gravity", "fos"
CONTENTS = (0.0, 0.15, 0.30, 0.45, 0.60)
ELONGATED = {"stones.content": 0.30, "stones.flatness": [2.0, 2.2]}
FAST = (  # the grid and the window of configs/quick_slope.toml, larger discs, a short ramp
    "grid.zone_size=0.6666666666666666",
    'window=[{name="band", columns=[16, 18], rows=[8, 14]}]',
    "discs.radius=0.075",
    "stones.size={mean=0.4, sigma=0.2, min=0.3, max=0.6}",
    'stage.overload={name="overload", large_strain=true, gravity_factor={to=20.0, over=2000}, until={steps=2000}}',
    "record.every=250",
    "fos.resolution=0.1",
)


class Series(NamedTuple):
    """Points whose stones differ in one property: `common` and each of `points` are keys of the scene and their values."""

    name: str
    what: str
    common: dict[str, Any]
    points: dict[str, dict[str, Any]]


def printed() -> dict[str, Any]:
    """Keys that give the window the discs of Table 2."""
    discs = tomllib.loads((CONFIGS / "paper_slope.toml").read_text(encoding="utf-8"))["discs"]
    return {
        f"discs.{kind}.{table}.{key}": value
        for kind in ("soil", "stone")
        for table in ("spring", "friction", "bond")
        for key, value in discs[kind][table].items()
    }


def contents(*values: float) -> dict[str, dict[str, Any]]:
    """Points of a series of contents."""
    return {f"{value:.2f}": {"stones.content": value} for value in values}


def all_series() -> list[Series]:
    """The series of the study."""
    turned = {f"{angle} deg": {"stones.azimuth.mean": angle, "stones.azimuth.spread": 10.0} for angle in (0, 45, 90, 135)}
    flat = {f"{low:g}": {"stones.flatness": [low, low + 0.2]} for low in (1.0, 2.0, 3.0)}
    corners = {
        f"{low} to {high}" if high > low else f"{low}": {"stones.vertices": [low, high]}
        for low, high in ((4, 4), (6, 8), (14, 18))
    }
    sizes = {
        f"{mean:.2f} m": {"stones.size.mean": mean, "stones.size.min": 0.48 * mean, "stones.size.max": 2.4 * mean}
        for mean in (0.15, 0.25, 0.40)
    }
    return [
        Series("calibrated clumps", "content of stones", {}, contents(*CONTENTS)),
        Series("calibrated clusters", "content of stones", {"stones.body": "cluster"}, contents(*CONTENTS[1:])),
        Series("printed clumps", "content of stones", printed(), contents(*CONTENTS)),
        Series("direction", "direction of the long axes", ELONGATED, turned),
        Series("aspect", "long axis over short axis", {"stones.content": 0.30}, flat),
        Series("angularity", "number of corners", {"stones.content": 0.30}, corners),
        Series("size", "mean size", {"stones.content": 0.30}, sizes),
    ]


FACTORS = ("calibrated clumps", "printed clumps")


def plan(series: Series, seeds: Sequence[int], scenes: Any) -> list[Any]:
    """Points of a sweep, seeds fastest."""
    from colluvium.ensemble.plan import Point

    return [Point(series.common | values, seed) for values in series.points.values() for seed in seeds]


def compute(chosen: Sequence[Series], quantities: Sequence[str], seeds: Sequence[int], options: argparse.Namespace) -> dict:
    """Results of the points of series by name, in their order; what is known is not computed again."""
    from colluvium.ensemble.cluster import client_of
    from colluvium.ensemble.scenes import Scenes
    from colluvium.ensemble.study import Sweep

    scenes = Scenes(SCENE, FAST if options.fast else ())
    points = {one.name: plan(one, seeds, scenes) for one in chosen}
    listed = [point for group in points.values() for point in group]
    checked = scenes.checked(listed)
    first: dict[str, int] = {}  # a scene that is in two series is computed once
    for number, scene in enumerate(checked):
        first.setdefault(scene.digest(), number)
    unique = list(first.values())
    sweep = Sweep([listed[i] for i in unique], [checked[i] for i in unique], quantities, options.out)
    left = len(unique) - len(sweep.done_before())
    print(f"{', '.join(quantities)}: {left} of {len(unique)} runs to compute", file=sys.stderr, flush=True)
    if left:
        with client_of(None, min(options.workers, left)) as client:
            found = sweep.compute(client, _progress)
    else:
        found = sweep.compute(None, _progress)
    of_scene = dict(zip(first, found, strict=True))
    results = iter([of_scene[scene.digest()] for scene in checked])
    return {name: [next(results) for _ in group] for name, group in points.items()}


def _progress(left: int, found: Any) -> None:
    values = ", ".join(f"{name} {value[0]:.4g}" for name, value in found.told["values"].items())
    lacking = "; ".join(f"no {name}: {why}" for name, why in found.told["lacking"].items())
    print(f"{left:5d} left: {found.point.name[-60:]}: {values or found.failed or lacking}", file=sys.stderr, flush=True)


def measure(folder: Path) -> dict[str, float]:
    """Direction of the contact forces [deg] at the start of the overload, and its rotation to the last frame, -90 to 90 [deg]."""
    import colluvium
    from colluvium.results import band_states

    with colluvium.open_run(folder) as run:
        rank = run.windows[0]
        first = next((run.last_frame(name) for name in run.stages_where(couples=True)), None)
        last = max(i for i in range(len(run.frames)) if run.has(i, rank))
        ends = [band_states.fabric(run, frame, rank) for frame in (first, last) if frame is not None]
        if len(ends) < 2 or None in ends:
            return {}
        begin, end = (whole.theta_n for whole, _ in ends)
        return {"theta_n": begin, "rotation": (end - begin + 90.0) % 180.0 - 90.0}


def row_of(series: Series, label: str, group: Sequence[Any]) -> dict[str, Any]:
    """A row of the table: failure gravity and rotation over the seeds of a point."""
    have = [one for one in group if FAILURE in one.told["values"]]
    turned = [measure(one.folder) for one in have]
    return {
        "series": series.name,
        "point": label,
        "failure": [float(one.told["values"][FAILURE][0]) for one in have],
        "rotation": [one["rotation"] for one in turned if one],
        "missing": [
            f"seed {one.point.seed}: {one.failed or one.told['lacking'].get(FAILURE, 'no value')}"
            for one in group
            if one not in have
        ],
        "seconds": [float(one.told["seconds"]) for one in have],
    }


def interval(values: Sequence[float]) -> tuple[float, float] | None:
    """(mean, half width of its 95 % interval by Student's t), None for fewer than two values."""
    from scipy import stats

    if len(values) < 2:
        return None
    return float(np.mean(values)), float(stats.t.ppf(0.975, len(values) - 1) * np.std(values, ddof=1) / np.sqrt(len(values)))


def difference(first: Sequence[float], second: Sequence[float]) -> tuple[float, float, float] | None:
    """(difference of the means, low and high end of its 95 % interval) by Welch (1947), Biometrika 34, 28-35."""
    from scipy import stats

    if min(len(first), len(second)) < 2 or np.std(first) + np.std(second) == 0.0:
        return None
    found = stats.ttest_ind(second, first, equal_var=False).confidence_interval(0.95)
    return float(np.mean(second) - np.mean(first)), float(found.low), float(found.high)


def sentences(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What the intervals of a series allow to be said: of each step from point to point, and of its two ends."""
    steps = [*pairwise(rows), *([(rows[0], rows[-1])] if len(rows) > 2 else [])]
    said = []
    for first, second in steps:
        found = difference(first["failure"], second["failure"])
        if found is None:
            continue
        change, low, high = found
        verdict = "a rise" if low > 0.0 else "a fall" if high < 0.0 else "no difference can be told"
        said.append(f"{first['point']} to {second['point']}: {change:+.2f} g (95 %: {low:+.2f} to {high:+.2f}): {verdict}.")
    return said


def table(rows: Sequence[dict[str, Any]], factors: dict[tuple[str, str], list[float]]) -> str:
    """Markdown: mean ± half width of the 95 % interval (standard deviation) of each point."""
    lines = ["| | seeds | failure gravity [g] | deviation | rotation [deg] | factor of safety |", "|---|---|---|---|---|---|"]
    for row in rows:
        factor = factors.get((row["series"], row["point"]), [])
        spread = f"{np.std(row['failure'], ddof=1):.2f}" if len(row["failure"]) > 1 else "-"
        cells = [row["point"], str(len(row["failure"])), _text(row["failure"], ".2f"), spread, _text(row["rotation"], ".0f")]
        lines.append("| " + " | ".join([*cells, _text(factor, ".3f")]) + " |")
    return "\n".join(lines)


def _text(values: Sequence[float], form: str) -> str:
    """Mean ± half width as text."""
    found = interval(values)
    if found is None:
        return f"{values[0]:{form}}" if len(values) else "-"
    return f"{found[0]:{form}} ± {found[1]:{form}}"


def section(series: Series, rows: Sequence[dict[str, Any]], factors: dict) -> str:
    """A series on the page."""
    lines = [table(rows, factors), ""]
    lines += [f"- {text}" for text in sentences(rows)]
    if missing := [f"{row['point']}, {text}" for row in rows for text in row["missing"]]:
        lines += ["", "Without a value: " + "; ".join(missing) + "."]
    return "\n".join(lines)


def draw(results: dict[str, list[dict[str, Any]]], folder: Path) -> None:
    """stone_content.png: failure gravity over content, seeds as dots, means with intervals; stone_shape.png: other series."""
    import matplotlib.pyplot as plt

    from colluvium.figures import style

    folder.mkdir(parents=True, exist_ok=True)
    what = {one.name: one.what for one in all_series()}
    of_content = [name for name in results if what[name] == what["calibrated clumps"]]
    others = [name for name in results if name not in of_content]

    @style.styled
    def drawn(groups: Sequence[Sequence[str]]) -> Any:
        figure, places = plt.subplots(1, len(groups), figsize=(style.PAGE, 2.6), layout="constrained", sharey=True, squeeze=False)
        for place, group in zip(places[0], groups, strict=True):
            for number, name in enumerate(group):
                _draw_series(place, name if len(group) > 1 else None, number, results[name])
            place.set_xlabel(what[group[0]])
        places[0, 0].set_ylabel("failure gravity [g]")
        return figure

    for file, groups in (("stone_content", [of_content] if of_content else []), ("stone_shape", [[name] for name in others])):
        if groups:
            figure = drawn(groups)
            figure.savefig(folder / f"{file}.png", dpi=100)
            plt.close(figure)


def _draw_series(place: Any, label: str | None, number: int, rows: Sequence[dict[str, Any]]) -> None:
    colour, numeric = f"C{number}", label is not None
    x = [float(row["point"]) if numeric else i for i, row in enumerate(rows)]
    for at, row in zip(x, rows, strict=True):
        place.plot([at] * len(row["failure"]), row["failure"], ".", color=colour, alpha=0.35, markersize=3)
    found = [(at, interval(row["failure"])) for at, row in zip(x, rows, strict=True)]
    known = [(at, *one) for at, one in found if one]
    if known:
        place.errorbar(
            *zip(*((at, mean) for at, mean, _ in known), strict=True),
            [half for *_, half in known],
            color=colour,
            label=label,
            capsize=2,
        )
    if numeric:
        place.legend()
    else:
        place.set_xticks(x, [row["point"] for row in rows])


def parser() -> argparse.ArgumentParser:
    """Options of the command line."""
    p = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    names = [one.name for one in all_series()]
    p.add_argument("--seeds", type=int, default=10, metavar="N", help="seeds of every point (default 10)")
    p.add_argument("--factors", type=int, default=0, metavar="N", help="seeds with a factor of safety (default 0)")
    p.add_argument("--only", nargs="+", choices=names, default=names, metavar="SERIES", help=f"some of: {', '.join(names)}")
    p.add_argument("--out", type=Path, default=Path("runs/stone_content"), metavar="DIR", help="keep the runs here")
    p.add_argument("--workers", type=int, default=1, metavar="N", help="runs at a time, of two processes each (default 1)")
    p.add_argument("--json", type=Path, metavar="FILE", help="every number")
    p.add_argument("--page", type=Path, metavar="FILE", help="rewrite the series' sections of this page")
    p.add_argument("--pictures", type=Path, metavar="DIR", help="draw stone_content.png and stone_shape.png")
    p.add_argument("--fast", action="store_true", help="a coarse slope and two points of each series")
    return p


def main(argv: Sequence[str] | None = None) -> int:
    """Runs the study; returns the exit code."""
    options = parser().parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    seeds = range(1, options.seeds + 1)
    chosen = [one for one in all_series() if one.name in options.only]
    if options.fast:
        ends = [dict([*one.points.items()][:: len(one.points) - 1]) for one in chosen]
        chosen = [one._replace(points=points) for one, points in zip(chosen, ends, strict=True)]
    found = compute(chosen, (FAILURE,), seeds, options)
    results = {
        one.name: [
            row_of(one, label, found[one.name][i * len(seeds) : (i + 1) * len(seeds)]) for i, label in enumerate(one.points)
        ]
        for one in chosen
    }
    factors: dict[tuple[str, str], list[float]] = {}
    searched = [one for one in chosen if one.name in FACTORS and options.factors]
    if searched:
        some = seeds[: options.factors]
        told = compute(searched, (FAILURE, FACTOR), some, options)
        for one in searched:
            for i, label in enumerate(one.points):
                group = told[one.name][i * len(some) : (i + 1) * len(some)]
                factors[one.name, label] = [
                    float(point.told["values"][FACTOR][0]) for point in group if FACTOR in point.told["values"]
                ]
    texts = {one.name: section(one, results[one.name], factors) for one in chosen}
    print("\n\n".join(f"{name}\n\n{text}" for name, text in texts.items()))
    write(options, results, factors, texts)
    return 0


def write(options: argparse.Namespace, results: dict, factors: dict, texts: dict[str, str]) -> None:
    """Files that were asked for."""
    if options.json:
        rows = {name: [row | {"fos": factors.get((name, row["point"]), [])} for row in group] for name, group in results.items()}
        options.json.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    if options.page:
        sys.path.insert(0, str(Path(__file__).resolve().parents[1]))
        import pages

        for name, text in texts.items():
            pages.write_section(options.page, name, text)
    if options.pictures:
        draw(results, options.pictures)


if __name__ == "__main__":
    sys.exit(main())
