"""`colluvium sweep SCENE --vary KEY=VALUES --seeds N --of QUANTITY`: many runs of one scene, and what they say together."""

import argparse
import json
import signal
import sys
import time
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.files import locks
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.process import command_line

ANSWER, LOCK = "sweep.json", "sweep"


def add_command(commands: Any) -> None:
    """Adds the command `sweep` and its options to `commands` of a parser."""
    p = commands.add_parser("sweep", help="many runs of a scene: values of its keys and seeds, here or on a cluster")
    p.add_argument("scene", metavar="SCENE", help="scene file (TOML)")
    p.add_argument(
        "--vary", metavar="KEY=VALUES", action="append", default=[], help="key of the scene and its values V1,V2,.. or LOW..HIGH"
    )
    p.add_argument("--points", metavar="FILE", help="CSV file with the points: keys in its first row, in place of --vary")
    p.add_argument("--samples", metavar="N", type=command_line.positive, help="points of a Latin hypercube over the ranges")
    p.add_argument("--seeds", metavar="N", type=command_line.positive, default=1, help="runs of each setting (default 1)")
    p.add_argument(
        "--of",
        metavar="QUANTITY",
        action="append",
        required=True,
        help="fos, failure_gravity, HISTORY[@STAGE], RANK:HISTORY or FIELD(x, y)[@STAGE]; the first one is drawn",
    )
    p.add_argument("--below", metavar="VALUE", type=float, help="also say which share of the seeds is below this value")
    p.add_argument("--out", metavar="DIR", help="folder of the sweep (default runs/NAME.sweep)")
    p.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the scene")
    p.add_argument(
        "--workers", metavar="N", type=command_line.positive, help="points at a time (default: processors over processes)"
    )
    p.add_argument(
        "--cluster", metavar="WHERE", help="tcp://HOST:PORT, slurm, or the scheduler file of Dask (default: this machine)"
    )
    p.add_argument("--no-branch", action="store_true", help="compute first stages that points share for each of them")
    p.add_argument("--reports", action="store_true", help="draw the report of every run, for links and comparison")
    p.add_argument("--no-pictures", action="store_true", help="draw nothing")
    p.add_argument("--dry-run", action="store_true", help="print the points")
    p.add_argument("--json", nargs="?", const="-", metavar="FILE", help="sweep.json to FILE or standard output, no table")
    p.add_argument("--quiet", action="store_true", help="no progress")
    p.set_defaults(work=command)


def command(options: argparse.Namespace) -> int:
    """Computes the points that are not known, prints table and answer; returns the exit code."""
    from colluvium.ensemble import answer
    from colluvium.ensemble.cluster import client_of
    from colluvium.ensemble.scenes import Scenes
    from colluvium.ensemble.study import PLAN, TABLE, Sweep, write_plan, write_table

    options.scene = command_line.scene_file(options.scene)
    scenes = Scenes(options.scene, options.set)
    points = _points(options, scenes)
    if options.dry_run:
        print("\n".join(point.name for point in points))
        return exits.DONE
    checked = scenes.checked(points)
    _refuse_quantities(options.of, checked[0])
    out = Path(options.out or Path("runs") / f"{Path(options.scene).stem}.sweep")
    command_line.make_folder(out)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops the sweep like Ctrl-C
    with locks.held(out, [LOCK]):
        write_plan(points, out / PLAN)
        sweep = Sweep(points, checked, options.of, out, not options.no_branch)
        progress = Progress(len(points), len(sweep.done_before()), options.quiet)
        workers = options.workers or _workers(checked[0])
        if progress.left:
            with client_of(options.cluster, min(workers, progress.left)) as client:
                found = sweep.compute(client, progress)
        else:
            found = sweep.compute(None, progress)
        write_table(found, options.of, out / TABLE)
        settings = answer.settings_of(found, options.of[0], options.below)
        said = [*answer.sentences(settings, options.of[0], options.below), *answer.ended_early(found)]
        content = {"scene": options.scene, "of": options.of, "settings": answer.as_dict(settings), "said": said}
        (out / ANSWER).write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
        if not options.no_pictures:
            _draw(options, found, settings, said, out)
    _print(options, content, [*answer.as_lines(settings, options.of[0]), *said, f"results in {out}"])
    return exits.DONE if any(one.found for one in settings) else exits.PHYSICS


class Progress:
    """A line for every point that ends, with what is left."""

    def __init__(self, total: int, known: int, quiet: bool) -> None:
        self.total, self.left, self.quiet, self._begin, self._known = total, total - known, quiet, time.monotonic(), known
        if known and not quiet:
            _say(f"{known} of {total} points are known")

    def __call__(self, left: int, found: Any) -> None:
        """Reports the end of a point; left: number of points that remain."""
        self.left = left
        if self.quiet:
            return
        done = self.total - left
        values = ", ".join(f"{name} {value[0]:.4g}" for name, value in found.told["values"].items())
        lacking = "; ".join(f"no {name}: {why}" for name, why in found.told.get("lacking", {}).items())
        ended = f"then ended: {found.told['ended']}" if found.told.get("ended") else ""
        text = (found.failed and f"failed: {found.failed}") or "; ".join(part for part in (values, lacking, ended) if part)
        each = (time.monotonic() - self._begin) / max(1, done - self._known)
        _say(f"{done} of {self.total}: {found.point.name}: {text}" + (f" (about {_duration(each * left)} left)" if left else ""))


def _points(options: argparse.Namespace, scenes: Any) -> list[Any]:
    """The points of the plan; raises SceneError for options that do not go together."""
    from colluvium.ensemble import plan

    axes = plan.axes_of(options.vary)
    ranges = [axis.key for axis in axes if axis.span is not None]
    problems = []
    if axes and options.points:
        problems.append(Problem("--points", None, options.points, "--vary is given too", "use one of both"))
    if not axes and not options.points and options.seeds < 2:
        problems.append(Problem("--vary", None, "", "there is nothing to vary", "for example --vary stones.content=0,.15,.3"))
    if ranges and options.samples is None:
        problems.append(
            Problem("--samples", None, ", ".join(ranges), "a range needs a number of points", "for example --samples 20")
        )
    if options.samples is not None and not ranges:
        problems.append(
            Problem("--samples", None, str(options.samples), "no --vary has a range", "for example stones.content=0..0.6")
        )
    if problems:
        raise SceneError(problems)
    first = scenes.seed
    seeds = range(first, first + options.seeds)
    if options.points:
        return plan.without_doubles(plan.listed(options.points, seeds))
    if ranges:
        return plan.hypercube(axes, options.samples, seeds, first)
    return plan.grid(axes, seeds)


def _refuse_quantities(texts: list[str], scene: Any) -> None:
    """Raises SceneError for quantities that no run of the scene has."""
    from colluvium.accuracy.quantity import quantity_of
    from colluvium.ensemble.point import FAILURE
    from coupler_protocol.scene import stage_kinds

    for text in texts:
        if text == FAILURE:
            if not any(stage_kinds.of(stage).overloads for stage in scene.stage):
                raise SceneError(
                    [Problem("--of", None, text, "the scene has no stage of kind overload", "add one, or name a history")]
                )
        else:
            quantity_of(text, scene)


def _workers(scene: Any) -> int:
    """Points that are computed at a time on this machine: each has a process for the grid and one for every window."""
    from colluvium.ensemble.cluster import processors
    from colluvium.running.processes import windows_of

    return max(1, processors() // (1 + (windows_of(scene) or 0)))


def _draw(options: argparse.Namespace, found: list[Any], settings: list[Any], said: list[str], out: Path) -> None:
    """Draws pictures and page, if their library is installed."""
    try:
        from colluvium import report
        from colluvium.ensemble import page, pictures

        if options.reports:
            for one in found:
                if not one.failed and not (one.folder / "report" / "report.html").is_file():
                    report.write(one.folder, None)
        drawn = pictures.write(found, settings, options.of[0], out)
    except ModuleNotFoundError as error:
        print(f"no pictures: {error.name} is missing: pip install 'colluvium[report]'", file=sys.stderr)
    else:
        page.write(f"Sweep of {Path(options.scene).stem}", said, settings, found, options.of[0], drawn, out / "report.html")


def _print(options: argparse.Namespace, content: dict[str, Any], lines: list[str]) -> None:
    if options.json:
        text = json.dumps(content, indent=1)
        print(text) if options.json == "-" else Path(options.json).write_text(text + "\n", encoding="utf-8")
    else:
        print("\n".join(lines))


def _duration(seconds: float) -> str:
    return f"{seconds:.0f} s" if seconds < 100 else f"{seconds / 60:.0f} min" if seconds < 6000 else f"{seconds / 3600:.1f} h"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
