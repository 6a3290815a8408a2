"""`colluvium fos` on a coupled scene: the factor of grid and discs beside that of the grid alone; other scenes: the grid."""

import argparse
import json
import signal
import sys
from pathlib import Path
from typing import Any

from colluvium.forecast import factor_of_safety
from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.problems import SceneError
from coupler_protocol.process import command_line

AT_ONCE = 2  # trials at the same time: these are the factors of a round, so the result does not depend on the cores
ALONE, LAB = "grid", "lab"  # folders in the one of the search
CONTINUES = "interrupted: the same command continues"
OWN = ("fos.json", "coupled.json", "coupled_mechanism.png")


def add_command(commands: Any) -> None:
    """Adds the command `fos` and its options to `commands` of a parser."""
    p = factor_of_safety.add_command(commands)
    p.add_argument("--grid", action="store_true", help="coupled scene: compute only the grid, without its windows")
    p.add_argument("--lab", action="store_true", help="coupled scene: c and phi of the reduced discs, by biaxial tests ([lab])")
    p.add_argument(
        "--at-once",
        metavar="N",
        type=command_line.positive,
        default=AT_ONCE,
        help=f"coupled scene: trials at the same time; the factors tried depend on it (default {AT_ONCE})",
    )
    p.set_defaults(work=command)


def command(options: argparse.Namespace) -> int:
    """Searches, prints the result and draws it; returns the exit code."""
    from colluvium.safety import scenes
    from coupler_protocol.scene.reader import read_scene

    options.scene = command_line.scene_file(options.scene)
    scene = read_scene(options.scene, options.set)
    if options.grid or not scenes.is_coupled(scene):
        return factor_of_safety.command(options)
    if problems := scenes.problems_of(scene, options.scene, options):
        raise SceneError(problems)
    changes = [*options.set, *([f'fos.flow="{options.flow}"'] if options.flow else [])]
    try:
        return _coupled(options, read_scene(options.scene, changes), changes)
    except KeyboardInterrupt:
        raise exits.Interrupted(CONTINUES) from None


def _coupled(options: argparse.Namespace, scene: Any, changes: list[str]) -> int:
    from colluvium.safety import macro
    from colluvium.safety.study import Search

    def say(text: str) -> None:
        if not options.quiet:
            print(text, file=sys.stderr, flush=True)

    out = command_line.make_folder(options.out or Path("runs") / f"{Path(options.scene).stem}.fos")
    if options.force:
        _clear(out)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops the search like Ctrl-C
    alone = _alone(options, scene, out / ALONE, changes, say)
    if alone is None:
        return exits.PHYSICS
    found = Search(scene, alone, out, options.at_once, options.threads, say).run()
    if options.lab:
        found["lab"] = macro.strengths(scene, found["value"], out / LAB, say)
    whole = alone | {"coupled": found}
    run_json.write_json(out / "fos.json", whole)
    if not options.no_pictures:
        _draw(out, found)
    if options.json:
        text = json.dumps(whole, indent=1)
        print(text) if options.json == "-" else Path(options.json).write_text(text + "\n", encoding="utf-8")
    else:
        lines = as_lines(whole) + (macro.as_lines(found["lab"], scene, found["value"]) if options.lab else [])
        print("\n".join([*lines, f"results in {out}"]))
    return exits.DONE


def _alone(options: argparse.Namespace, scene: Any, out: Path, changes: list[str], say: Any) -> dict[str, Any] | None:
    """fos.json of the grid alone, computed unless `out` has it for this scene; None where the search has failed."""
    path = out / "fos.json"
    if path.exists():
        found = run_json.read_search(path)
        if found.get("scene_hash") == scene.digest() and "value" in found["meshes"][-1]:
            say("the grid alone: computed before")
            return found
    own = command_line.prepare_folder(out, factor_of_safety.OWN, True)
    code = factor_of_safety.search(options, own, changes)
    if code in (exits.DONE, exits.PHYSICS):
        return run_json.read_search(path) if code == exits.DONE else None
    raise exits.Interrupted(CONTINUES) if code == exits.INTERRUPTED else _failed(code)


def _failed(code: int) -> exits.RunEnded:
    error = exits.RunEnded(f"the search on the grid alone ended with code {code} ({exits.MEANING.get(code, '?')})")
    error.code = code
    return error


def _clear(out: Path) -> None:
    """Removes the results of an earlier search."""
    import shutil

    from colluvium.safety.study import AT_REST, TRIALS

    for name in OWN:
        (out / name).unlink(missing_ok=True)
    for name in (ALONE, AT_REST, TRIALS, LAB):
        shutil.rmtree(out / name, ignore_errors=True)


def _draw(out: Path, found: dict[str, Any]) -> None:
    """Draws the mechanism if the libraries are installed."""
    try:
        from colluvium.safety import mechanism

        mechanism.write(out, found)
    except ModuleNotFoundError as error:
        print(f"no pictures: {error.name} is missing: pip install 'colluvium[report]'", file=sys.stderr)


def as_lines(whole: dict[str, Any]) -> list[str]:
    """Lines of text with the result of a coupled search beside that of the grid alone."""
    alone, found = whole["meshes"][-1], whole["coupled"]
    lines = [f"{whole['title'] or 'scene'}: factor of safety, coupled with {', '.join(found['windows'])}"]
    lines += [f"rule for {name}: {rule}" for name, rule in (whole["rules"] | found["rules"]).items()]
    lines.append(f"gravity: {found['gravity']:.4g} m/s2; the coupled slope came to rest by: {found['at_rest']}")
    lines.append(f"{'factor':>8} {'verdict':>9} {'steps':>7} {'ratio':>9} {'farthest [m]':>12} {'bonds broken':>12}")
    for row in sorted(found["trials"], key=lambda row: row["factor"]):
        ratio = "" if row["ratio"] is None else f"{row['ratio']:.2e}"
        lines.append(
            f"{row['factor']:8.4f} {row['verdict']:>9} {row['steps']:7d} {ratio:>9} {row['max_displacement']:12.4g} "
            f"{sum(row['bonds_broken']):12d}" + (f"  stopped: {row['stopped']}" if "stopped" in row else "")
        )
    for name, what in (("undecided", "no verdict at"), ("contradictions", "rests above the lowest failure:")):
        if found[name]:
            lines.append(f"{what} {', '.join(f'{f:.4f}' for f in found[name])}")
    for name, one in (("grid alone", alone), ("grid and discs", found)):
        lines.append(f"{name}: factor of safety {one['value']:.3f} (rests at {one['low']:.4f}, fails at {one['high']:.4f})")
    lines.append(f"the discs change the factor by {100.0 * (found['value'] / alone['value'] - 1.0):+.1f} %")
    return lines
