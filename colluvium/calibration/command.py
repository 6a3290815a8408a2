"""`colluvium calibrate SCENE`: parameters of the discs of a scene that give a target soil."""

import argparse
import json
import os
import signal
import sys
import time
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.process import command_line, interrupt


def add_command(commands: Any) -> None:
    """Adds the command `calibrate` and its options to `commands` of a parser."""
    p = commands.add_parser("calibrate", help="find parameters of the discs of a scene that give a target soil")
    p.add_argument("scene", metavar="SCENE", help="scene file (TOML) with [discs]; its table [calibrate] sets targets and tests")
    p.add_argument("--out", metavar="DIR", help="folder of the results (default runs/NAME.calibrate)")
    p.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the scene")
    p.add_argument("--at-once", metavar="N", type=command_line.positive, help="processes at once (default: one a core)")
    p.add_argument("--dry-run", action="store_true", help="print targets, start and cost, and compute nothing")
    p.add_argument("--write", metavar="FILE", help="write a copy of the scene with the parameters found")
    p.add_argument("--strict", action="store_true", help="exit code 8 if a target is missed")
    p.add_argument("--json", nargs="?", const="-", metavar="FILE", help="answer.json to FILE or standard output, no table")
    p.add_argument("--quiet", action="store_true", help="no progress")
    p.set_defaults(work=command)


def command(options: argparse.Namespace) -> int:
    """Searches, prints the answer and writes its files; returns the exit code."""
    from colluvium.calibration import answer, study
    from colluvium.calibration.laboratory import SampleTests
    from coupler_protocol.scene.reader import read_scene

    options.scene = command_line.scene_file(options.scene)
    scene = study.with_table(read_scene(options.scene, options.set))
    plan, problems = study.plan_of(scene, Path(options.scene).parent)
    problems += _of_the_copy(options)
    if problems or plan is None:
        raise SceneError([Problem(options.scene, None, *problem) for problem in problems])
    out = Path(options.out or Path("runs") / f"{Path(options.scene).stem}.calibrate")
    at_once = options.at_once or len(os.sched_getaffinity(0))
    say = (lambda text: None) if options.quiet else _say
    laboratory = SampleTests(scene, plan.sample, plan.targets, out, at_once, _say)
    print("\n".join(study.opening(plan, scene)), file=sys.stdout if options.dry_run else sys.stderr)
    if options.dry_run:
        print("\n".join(study.forecast(plan, scene, laboratory, at_once)))
        return exits.DONE
    command_line.make_folder(out)
    for number in interrupt.signals():  # a kill stops the search as Ctrl-C does, also in the background of a script
        signal.signal(number, signal.default_int_handler)
    began = time.monotonic()
    outcome = study.search(plan, scene, laboratory, say)
    if outcome is None:
        return laboratory.failed[0].code if laboratory.failed else exits.PHYSICS
    found = answer.found(plan, scene, outcome, laboratory, time.monotonic() - began)
    answer.write(found, out)
    if options.write:
        answer.write_scene(Path(options.scene), options.set, found["tables"], Path(options.write))
    _print(found, options, out)
    return exits.NOT_AT_REST if options.strict and not found["reached"] else exits.DONE


def _of_the_copy(options: argparse.Namespace) -> list[tuple[str, str, str]]:
    """The problem of --write, if there is one, before anything is computed; raises EnvironmentFailed without its library."""
    from colluvium.calibration.answer import toml_writer

    if not options.write:
        return []
    toml_writer()
    if Path(options.scene).suffix.lower() == ".json":
        return [("--write", "comments and order are kept of a scene in TOML, this is JSON", "give the TOML file of the scene")]
    if Path(options.write).exists() and Path(options.write).samefile(options.scene):
        return [("--write", "this is the scene itself", "give another file")]
    return []


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _print(found: dict[str, Any], options: argparse.Namespace, out: Path) -> None:
    if options.json:
        text = json.dumps(found, indent=1)
        print(text) if options.json == "-" else Path(options.json).write_text(text + "\n", encoding="utf-8")
        return
    print("\n".join([*found["words"], "", found["toml"], f"results in {out}"]))
    if options.write:
        print(f"wrote {options.write}")
