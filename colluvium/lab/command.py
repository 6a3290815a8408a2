"""`colluvium lab KIND SCENE`: laboratory tests of the discs of a scene."""

import argparse
import json
import os
import signal
import sys
from pathlib import Path
from typing import Any

from colluvium.lab.specimen import KINDS
from coupler_protocol import exits
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.process import command_line

HELP = {
    "shear": "direct shear box: shear strength over normal stress",
    "biaxial": "axial shortening under constant side pressure: moduli, strength, dilation",
    "oedometer": "axial shortening without lateral strain: constrained modulus, K0",
    "brazilian": "disc between two plates: tensile strength",
}


def add_command(commands: Any) -> None:
    """Adds the command `lab` and its options to `commands` of a parser."""
    lab = commands.add_parser("lab", help="laboratory tests of the discs of a scene")
    kinds = lab.add_subparsers(dest="kind", required=True, metavar="KIND")
    for kind in KINDS:
        p = kinds.add_parser(kind, help=HELP[kind])
        p.add_argument("scene", metavar="SCENE", help="scene file (TOML) with [discs]; its table [lab] sets the tests")
        p.add_argument("--out", metavar="DIR", help="folder of the results (default runs/NAME.KIND)")
        p.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the scene")
        p.add_argument(
            "--window", metavar="NAME", help="test the discs of this window, by name or rank (default: those of [discs])"
        )
        p.add_argument("--half-rate", action="store_true", help="test all samples at half the rate as well, and compare")
        p.add_argument("--at-once", metavar="N", type=command_line.positive, help="processes at once (default: one a core)")
        p.add_argument("--dry-run", action="store_true", help="print the trials and what they would cost")
        p.add_argument("--no-pictures", action="store_true", help="draw no pictures")
        p.add_argument("--json", nargs="?", const="-", metavar="FILE", help="answers.json to FILE or standard output, no table")
        p.add_argument("--quiet", action="store_true", help="no progress")
        p.set_defaults(work=command)


def command(options: argparse.Namespace) -> int:
    """Runs the trials that are not done, evaluates all and prints the answers; returns the exit code."""
    from colluvium.lab import study
    from colluvium.lab.trials import trials_of
    from coupler_protocol.scene.reader import build_scene, read_scene

    options.scene = command_line.scene_file(options.scene)
    scene = chosen(read_scene(options.scene, options.set), options.window, options.scene)
    if problems := problems_of(scene, options.scene):
        raise SceneError(problems)
    name = ".".join([Path(options.scene).stem, *([options.window] if options.window else []), options.kind])
    out = Path(options.out or Path("runs") / name)
    trials = trials_of(options.kind, scene, (1.0, 0.5) if options.half_rate else (1.0,))
    for trial in trials:
        build_scene(trial.tables)  # reports problems before a process starts
    at_once = min(options.at_once or len(os.sched_getaffinity(0)), len(trials))
    if options.dry_run:
        print("\n".join(study.forecast(trials, out, at_once)))
        return exits.DONE
    command_line.make_folder(out)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops the laboratory like Ctrl-C
    failed = study.compute(trials, out, at_once, (lambda text: None) if options.quiet else _say)
    for one in failed:
        print(f"{one.name}: exit code {one.code}: {one.message}", file=sys.stderr)
    if len(failed) == len(trials):
        return failed[0].code
    found, curves = study.evaluate(options.kind, trials, out)
    if not options.no_pictures:
        _draw(options.kind, scene, found, trials, curves, out)
    _print(found, options.json, out)
    return failed[0].code if failed else exits.DONE


def chosen(scene: Any, window: str | None, path: str) -> Any:
    """The scene with the discs and stones of the window of this name or rank; raises SceneError if there is none."""
    from coupler_protocol.scene.of_window import of_window

    names = [one.name for one in scene.window]
    if window is None:
        return scene
    if window in names:
        return of_window(scene, names.index(window) + 1)
    if window.isdecimal() and 1 <= int(window) <= len(names):
        return of_window(scene, int(window))
    known = f"windows: {', '.join(names)}" if names else "leave out --window"
    raise SceneError([Problem(path, None, "--window", f"the scene has no window {window!r}", known)])


def problems_of(scene: Any, path: str) -> list[Problem]:
    """Reasons for which the discs of a scene cannot be tested."""
    found = []
    if scene.discs is None:
        found.append(("discs", "the scene has no discs to test", "add a [discs] table"))
    elif scene.discs.soil.spring is None:
        found.append(("discs.soil", "the discs have no stiffness", "add spring = { normal = .., shear = .. }"))
    stones = set(scene.lab.samples or ()) - {"soil"}
    if stones and (scene.stones is None or scene.stones.content is None):
        found.append(("lab.samples", "the scene has no [stones] with a content", 'add them, or samples = ["soil"]'))
    elif not scene.lab.samples and scene.stones is not None and scene.stones.content is None:
        found.append(("lab.samples", "mapped stones are no sample", 'samples = ["soil"]'))
    return [Problem(path, None, key, why, remedy) for key, why, remedy in found]


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _draw(kind: str, scene: Any, found: dict[str, Any], trials: Any, curves: Any, out: Path) -> None:
    """Draws the pictures and the page, if their libraries are installed."""
    try:
        from colluvium.lab import page, pictures

        paths = pictures.write(kind, found, trials, curves, out)
    except ModuleNotFoundError as error:
        print(f"no pictures: {error.name} is missing: pip install 'colluvium[report]'", file=sys.stderr)
    else:
        page.write(f"{kind} test: {scene.title or 'discs'}", found, paths, out / "report.html")


def _print(found: dict[str, Any], target: str | None, out: Path) -> None:
    from colluvium.lab.summary import as_lines

    if target:
        text = json.dumps(found, indent=1)
        print(text) if target == "-" else Path(target).write_text(text + "\n", encoding="utf-8")
    else:
        print("\n".join([*as_lines(found), f"results in {out}"]))
