"""`colluvium accuracy SCENE --of QUANTITY --knob ...`: what accuracy costs in time, for any scene."""

import argparse
import json
import re
import signal
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.process import command_line

ANSWER = "accuracy.json"
UNITS = {"s": 1.0, "min": 60.0, "h": 3600.0}


def add_command(commands: Any) -> None:
    """Adds the command `accuracy` and its options to `commands` of a parser."""
    p = commands.add_parser("accuracy", help="error of a quantity against time, over settings of a scene")
    p.add_argument("scene", metavar="SCENE", help="scene file (TOML)")
    p.add_argument("--of", metavar="QUANTITY", required=True, help="fos, HISTORY[@STAGE], RANK:HISTORY, or FIELD(x, y)[@STAGE]")
    p.add_argument(
        "--knob",
        metavar="KEY=V1,V2,..",
        action="append",
        default=[],
        help="key of the scene (or zone_size, radius, ratio, dt, exchange_every) and its values from coarse to fine; /N divides "
        "the scene's value; without values the budget decides",
    )
    p.add_argument("--seeds", metavar="N", type=command_line.positive, default=1, help="mean over N seeds, with its interval")
    p.add_argument("--target", metavar="PERCENT", default="1%", help="error that is asked for (default 1%%)")
    p.add_argument(
        "--reference",
        metavar="VALUE",
        type=float,
        help="the right value, --reference=-1.5e5 if negative (default: [accuracy] of the scene, else extrapolated)",
    )
    p.add_argument("--source", metavar="TEXT", default="", help="where the reference comes from")
    p.add_argument(
        "--collapse", action="store_true", help="the quantity is a collapse load: order 1 in the zones, as a factor of safety"
    )
    p.add_argument("--budget", metavar="TIME", help="such as 90s, 10min or 1h: chooses the settings itself")
    p.add_argument("--out", metavar="DIR", help="folder of the results (default runs/NAME.accuracy)")
    p.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the scene")
    p.add_argument("--at-once", metavar="N", type=command_line.positive, default=1, help="settings side by side (default 1)")
    p.add_argument("--dry-run", action="store_true", help="print the settings")
    p.add_argument("--no-pictures", action="store_true", help="draw no picture")
    p.add_argument("--json", nargs="?", const="-", metavar="FILE", help="accuracy.json to FILE or standard output, no table")
    p.add_argument("--quiet", action="store_true", help="no progress")
    p.set_defaults(work=command)


def command(options: argparse.Namespace) -> int:
    """Computes the settings that are not known, prints table and answer; returns the exit code."""
    from colluvium.accuracy import answer
    from colluvium.accuracy.knobs import SEED, knobs_of, seeded, settings_of
    from colluvium.accuracy.quantity import quantity_of
    from colluvium.accuracy.study import Study
    from coupler_protocol.scene.reader import read_scene

    options.scene = command_line.scene_file(options.scene)
    scene = read_scene(options.scene, options.set)
    target, budget = _share(options.target), None if options.budget is None else _seconds(options.budget)
    quantity = quantity_of(options.of, scene)
    knobs = knobs_of(options.knob, scene)
    _refuse(options, knobs, budget)
    if options.seeds > 1:
        knobs.append(seeded(scene, options.seeds))
    if options.dry_run:
        print("\n".join(setting.name for setting in settings_of(knobs)))
        return exits.DONE
    out = Path(options.out or Path("runs") / f"{Path(options.scene).stem}.accuracy")
    command_line.make_folder(out)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops the study like Ctrl-C
    study = Study(options.scene, options.set, quantity, out, (lambda text: None) if options.quiet else _say)
    results, knobs = _computed(study, knobs, options.at_once, budget)
    points = answer.points_of(results)
    given, source = closed_form(options, scene)
    reference = answer.reference_of(points, knobs, given, source, collapse=quantity.is_factor or options.collapse)
    points = answer.judged(points, reference)
    found = {"quantity": quantity.text, "target": target, "reference": asdict(reference), "settings": [asdict(p) for p in points]}
    found["answer"] = answer.sentences(points, reference, target)
    (out / ANSWER).write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    if not options.no_pictures:
        _draw(quantity.text, points, [knob for knob in knobs if knob.name != SEED], target, out)
    if options.json:
        text = json.dumps(found, indent=1)
        print(text) if options.json == "-" else Path(options.json).write_text(text + "\n", encoding="utf-8")
    else:
        print("\n".join([*answer.as_lines(quantity.text, points, reference, target), f"results in {out}"]))
    return exits.DONE if any(point.value is not None for point in points) else exits.PHYSICS


def closed_form(options: argparse.Namespace, scene: Any) -> tuple[float | None, str]:
    """(value, source) of the reference of the command line, else of the scene; (None, "") for none."""
    from colluvium.accuracy.measured import ENERGY
    from colluvium.accuracy.quantity import quantity_of

    if options.reference is not None:
        return options.reference, options.source
    named = None if scene.accuracy is None else scene.accuracy.reference_of(options.of)
    if named is None and quantity_of(options.of, scene).name == ENERGY:
        return 0.0, "energy is conserved"
    if named is None:
        return None, options.source
    changed = [text for text in options.set if not text.startswith("accuracy.")]
    return named.value, named.source + (f"; if it is not changed by {', '.join(changed)}" if changed else "")


def _computed(study: Any, knobs: list[Any], at_once: int, budget: float | None) -> tuple[list[Any], list[Any]]:
    """Results, and the knobs with the values that were tried."""
    from colluvium.accuracy.budget import explore
    from colluvium.accuracy.knobs import settings_of

    if budget is None:
        return study.compute(settings_of(knobs), at_once), knobs

    def compute(setting: Any) -> tuple[Any, float]:
        begin = time.monotonic()
        (found,) = study.compute([setting], 1)
        return found, time.monotonic() - begin

    return explore(knobs, budget, compute)


def _refuse(options: argparse.Namespace, knobs: list[Any], budget: float | None) -> None:
    """Raises SceneError for options that do not go together."""
    problems = []
    if not knobs:
        problems.append(Problem("--knob", None, "", "there is nothing to vary", "for example --knob zone_size=/1,/2,/4"))
    if budget is None:
        problems += [
            Problem("--knob", None, knob.name, "has no values", "give them, or a --budget that decides")
            for knob in knobs
            if knob.open_ended
        ]
    elif options.at_once > 1 or options.seeds > 1:
        problems.append(
            Problem("--budget", None, options.budget, "takes one setting after the other", "leave out --at-once and --seeds")
        )
    if problems:
        raise SceneError(problems)


def _share(text: str) -> float:
    """A share from a text such as 1% or 0.5 %."""
    found = re.fullmatch(r"\s*([0-9.eE+-]+)\s*%?\s*", text)
    try:
        value = float(found[1]) / 100.0 if found else 0.0
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1.0:
        raise SceneError([Problem("--target", None, text, "is no share between 0 and 100 %", "for example 1%")])
    return value


def _seconds(text: str) -> float:
    """Seconds from a text such as 90s, 10min or 1h."""
    found = re.fullmatch(r"\s*([0-9.]+)\s*(s|min|h)\s*", text)
    if not found or not float(found[1]) > 0.0:
        raise SceneError([Problem("--budget", None, text, "is no time", "for example 90s, 10min or 1h")])
    return float(found[1]) * UNITS[found[2]]


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _draw(quantity: str, points: list[Any], knobs: list[Any], target: float, out: Path) -> None:
    """Draws the picture, if its library is installed."""
    try:
        from colluvium.accuracy import pictures
    except ModuleNotFoundError as error:
        print(f"no picture: {error.name} is missing: pip install 'colluvium[report]'", file=sys.stderr)
    else:
        pictures.write(quantity, points, knobs, target, out / "accuracy.png")
