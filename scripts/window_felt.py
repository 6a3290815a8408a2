"""How much a slope feels its window: the same slope coupled and as a continuum alone, each level of gravity held to rest.

    python scripts/window_felt.py [SCENE ..] [--set KEY=VALUE ..] [--seeds N ..] [--out DIR] [--json FILE] [--page FILE]
        [--picture FILE] [--last G] [--fast]

Gravity grows to 2, 3, .. g; each level is held until the unbalanced ratio is below 1e-5. A level moves if it does not rest in
40,000 steps, or if a gridpoint moves by more than 1 m. Between the last level at rest and the first that moves, the gravity at
failure is found by bisection in tenths of g. Each level continues from the level before (`colluvium run --from`), so that
nothing is computed twice. The same stages without windows are the continuum alone.

Prints, for each scene, means ± standard deviations over the seeds of the differences from the continuum alone: settlement of
the crest from 1 to 3 g, displacement of the rim (rms over rms), mean stress in the window (xx and yy over themselves, xy over
yy), the moduli of the window in the slope from 1 to 3 g, and the gravity at failure (middle between rest and motion).

Runs stay in DIR (default runs/window_felt): the same command continues a study that was interrupted. --page writes the table
into its section of a page (docs/window.md). --last: no gravity above, so failure is not sought (3 is enough for stress and
settlement). --fast: the coarse slope of configs/quick_slope.toml in one process, to 3 g."""

import argparse
import json
import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

from felt import tables
from felt.levels import Course, Hold, begun, continuum_alone, course, run_level
from felt.measures import compare, places_of, read, solid_between

from colluvium import Scene

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
SCENES = ("paper_slope", "calibrated_slope")
AT = 3.0  # [g] of the comparison
EVERY = 1000  # steps between frames
FAST = Hold(ramp=500, steps=3000, last=3, resolution=0.5)


def compute(scene: Any, folder: Path, before: Any, in_process: bool, clock: float) -> bool:
    """Computes a level and says how it ended."""
    rests = run_level(scene, folder, before, in_process)
    print(f"{time.perf_counter() - clock:6.0f} s  {folder}: {'at rest' if rests else 'moves'}", file=sys.stderr, flush=True)
    return rests


def row_of(alone: Course, coupled: Course, scene: Any, seed: int) -> dict[str, Any]:
    """Numbers of a coupled run."""
    found: dict[str, Any] = {"seed": seed, **limits(coupled)}
    levels = [level.gravity for level in coupled.resting if level.gravity.is_integer() and level.gravity > 1.0]
    common = [gravity for gravity in levels if gravity <= alone.rests_at]
    return found | {"levels": {f"{gravity:g}": compare(alone, coupled, places_of(scene), gravity) for gravity in common}}


def same_continuum(scene: Any, other: Any) -> bool:
    """Whether two scenes differ in windows, discs, seed and title only."""
    own, others = (continuum_alone(one).model_copy(update={"seed": 0, "title": ""}) for one in (scene, other))
    return own == others


def limits(found: Course) -> dict[str, Any]:
    """Gravity [g] of the last level at rest and of the first that moves."""
    return {"rests_at": found.rests_at, "moves_at": found.moves_at}


def main(argv: list[str] | None = None) -> int:
    """Runs the study; returns the exit code."""
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("scenes", nargs="*", type=Path, metavar="SCENE", help=f"coupled scenes (default: {' and '.join(SCENES)})")
    p.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override a key of every scene")
    p.add_argument("--seeds", type=int, nargs="+", default=[1, 2, 3], metavar="N")
    p.add_argument("--out", type=Path, default=Path("runs/window_felt"), metavar="DIR", help="keep the runs here")
    p.add_argument("--json", type=Path, metavar="FILE", help="every number of every run")
    p.add_argument("--page", type=Path, metavar="FILE", help="write the table into this page")
    p.add_argument("--picture", type=Path, metavar="FILE", help="draw settlements over gravity")
    p.add_argument("--last", type=int, default=Hold().last, metavar="G", help="highest level [g] (default %(default)s)")
    p.add_argument("--fast", action="store_true", help="the coarse slope instead")
    options = p.parse_args(argv)
    paths = options.scenes or [CONFIGS / f"{name}.toml" for name in (("quick_slope",) if options.fast else SCENES)]
    hold, clock = FAST if options.fast else Hold(last=options.last), time.perf_counter()
    step = partial(compute, in_process=options.fast, clock=clock)
    first = begun(Scene.read(paths[0], options.set), EVERY)
    alone = course(continuum_alone(first), options.out / "alone", hold, step)
    scenes: dict[str, list[Any]] = {path.stem: [] for path in paths}
    places = places_of(first)
    solid = solid_between(*(read(alone.level(gravity), places) for gravity in (1.0, AT)))
    results: dict[str, Any] = {"at": AT, "alone": limits(alone) | solid, "scenes": scenes}
    for seed in options.seeds:
        for path in paths:
            scene = begun(Scene.read(path, [*options.set, f"seed={seed}"]), EVERY)
            if not same_continuum(scene, first):
                p.error(f"{path} has another continuum than {paths[0]}: compare scenes that differ in their discs only")
            found = course(scene, options.out / path.stem / f"seed{seed}", hold, step)
            scenes[path.stem].append(row_of(alone, found, scene, seed))
            if options.json:  # complete after every run
                options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    print(tables.table(results))
    if options.page:
        tables.into_page(options.page, results)
    if options.picture:
        tables.draw(results, options.picture)
    return 0


if __name__ == "__main__":
    sys.exit(main())
