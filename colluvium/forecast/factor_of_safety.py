"""`colluvium fos`: the factor of safety of a scene's grid by strength reduction, or its gravity factor at collapse."""

import argparse
import json
import signal
import sys
from math import pi
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.problems import Problem, SceneError
from coupler_protocol.process import command_line

OWN = ("fos.json", "fos.log", "scene.toml", "mechanism.png", "plastic_zones.png", "trials.png", "meshes.png")
FLOWS = {"zero": "psi_0", "associated": "psi_phi"}  # of --flow both, with their folders


def add_command(commands: Any) -> argparse.ArgumentParser:
    """Adds the command `fos` and its options to `commands` of a parser; returns the parser of the command."""
    p: argparse.ArgumentParser = commands.add_parser(
        "fos", help="factor of safety by strength reduction, or the gravity factor at collapse"
    )
    p.add_argument("scene", metavar="SCENE", help="scene file (TOML); its table [fos] sets the search, its stages set the loads")
    p.add_argument("--by", choices=("strength", "gravity"), help="what the factor acts on (fos.by of the scene)")
    p.add_argument(
        "--meshes", metavar="N", type=command_line.positive, help="number of meshes: the grid's zone size divided by 1, 2, .. N"
    )
    p.add_argument(
        "--flow",
        choices=("scene", *FLOWS, "both"),
        help="dilation: the scene's psi, psi = 0, psi = phi (associated), or a search with each of the last two (fos.flow)",
    )
    p.add_argument("--out", metavar="DIR", help="run directory (default runs/NAME.fos)")
    p.add_argument("--json", nargs="?", const="-", metavar="FILE", help="fos.json to FILE or standard output, no table")
    p.add_argument("--no-pictures", action="store_true", help="draw no pictures")
    p.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the scene")
    p.add_argument("--quiet", action="store_true", help="no progress")
    p.add_argument("--threads", metavar="N", type=command_line.positive, default=1, help="threads (default 1)")
    p.add_argument("--force", action="store_true", help="write into OUT even if results are there")
    return p


def command(options: argparse.Namespace) -> int:
    """Searches, prints the result and draws it; returns the exit code."""
    from coupler_protocol.scene.reader import read_scene

    options.scene = command_line.scene_file(options.scene)
    scene = read_scene(options.scene, options.set)
    if scene.grid is None:
        raise SceneError([Problem(options.scene, None, "grid", "discs alone have no factor of safety", "add a [grid] table")])
    changes = list(options.set)
    if options.by:
        changes.append(f'fos.by="{options.by}"')
    if options.meshes:
        changes.append(f"fos.zone_sizes={[zone_size_of(scene.grid) / n for n in range(1, options.meshes + 1)]}")
    flows = FLOWS if options.flow == "both" else {options.flow or scene.fos.flow: ""}
    for flow in flows:
        read_scene(options.scene, [*changes, f'fos.flow="{flow}"'])  # reports all problems before a process starts
    out = command_line.prepare_folder(options.out or Path("runs") / f"{Path(options.scene).stem}.fos", OWN, options.force)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # SIGTERM stops the search like Ctrl-C
    found = {}
    for flow, folder in flows.items():
        own = command_line.prepare_folder(out / folder, OWN, options.force)
        code = search(options, own, [*changes, f'fos.flow="{flow}"'])
        if code != exits.DONE:
            return code
        found[flow] = run_json.read_search(own / "fos.json")
        if not options.no_pictures:
            _draw(own)
    whole = {"flows": found} if len(flows) > 1 else next(iter(found.values()))
    if len(flows) > 1:
        (out / "fos.json").write_text(json.dumps(whole, indent=1) + "\n", encoding="utf-8")
    if options.json:
        text = json.dumps(whole, indent=1)
        print(text) if options.json == "-" else Path(options.json).write_text(text + "\n", encoding="utf-8")
    else:
        lines = [line for one in found.values() for line in as_lines(one)]
        print("\n".join([*lines, *beside_each_other(found)]))
        print(f"results in {out}")
    return exits.DONE


def search(options: argparse.Namespace, out: Path, changes: list[str]) -> int:
    """Runs one search in a process that writes its files to `out`; returns the exit code."""
    from colluvium.running import processes
    from colluvium.running.progress_picture import picture

    arguments = ["fdm_server.fos", options.scene, "--out", out, "--force", f"--threads={options.threads}"]
    arguments += [f"--set={c}" for c in changes]
    show = picture(options.quiet)
    if show is None:
        return processes.run_alone("fdm_server.fos", arguments)
    with show:
        return processes.run_alone("fdm_server.fos", arguments, show)


def zone_size_of(grid: Any) -> float:
    """Size in x of the zones of the table [grid], in a ring along the wall of the hole (fdm_server/fos/ground.py)."""
    if grid.kind != "ring":
        return grid.zone_size[0]
    return {"full": 2.0, "half": 1.0, "quarter": 0.5}[grid.part] * pi * grid.inner / grid.around


def _draw(out: Path) -> None:
    """Draws the pictures if their libraries are installed."""
    try:
        from colluvium.figures import fos as figures

        figures.write(out)
    except ModuleNotFoundError as error:
        print(f"no pictures: {error.name} is missing: pip install 'colluvium[report]'", file=sys.stderr)


def as_lines(found: dict[str, Any]) -> list[str]:
    """Lines of text with the result of a search."""
    lines = [f"{found['title'] or 'scene'}: {found['quantity']}"]
    lines += [f"ignored: {what}" for what in found["ignored"]]
    lines.append(f"gravity: {found['meshes'][-1]['gravity']:.4g} m/s2")
    lines += [f"rule for {name}: {rule}" for name, rule in found["rules"].items()]
    lines += [f"worth a second look: mesh {d['mesh']}: {d['key']}: {d['what']}; {d['remedy']}" for d in found.get("doubts", [])]
    ratio, budget = found["criterion"]["ratio"], max(m["budget"] for m in found["meshes"])
    lines.append(
        f"a trial rests at ratio {ratio:g} without motion and fails in steady flow, within {budget:,} steps (docs/theory.md)"
    )
    lines.append(f"{'zone [m]':>9} {'zones':>7} {'trials':>6} {'rests at':>9} {'fails at':>9} {'factor':>8} {'seconds':>8}")
    for m in found["meshes"]:
        lines.append(
            f"{m['zone_size']:9.4g} {m['zones']:7d} {len(m['trials']):6d} {m['low']:9.4f} {m['high']:9.4f} "
            f"{m['value']:8.4f} {m['seconds']:8.1f}"
        )
        for name, what in (("undecided", "no verdict at"), ("contradictions", "rests above the lowest failure:")):
            if m[name]:
                lines.append(f"          {what} {', '.join(f'{f:.4f}' for f in m[name])}")
    if found.get("extrapolation"):
        lines.append(_extrapolated(found["extrapolation"]))
    finest = found["meshes"][-1]
    lines.append(f"{found['quantity']} {finest['value']:.3f} (rests at {finest['low']:.4f}, fails at {finest['high']:.4f})")
    return lines


def _extrapolated(extra: dict[str, Any]) -> str:
    """Value at zone size 0, its interval, or the reason why there is neither; extra: `extrapolation` of fos.json."""
    order = "assumed" if extra["observed_order"] is None or extra["order"] != extra["observed_order"] else "observed"
    if extra["value"] is not None:
        return (
            f"extrapolated to zone size 0: {extra['value']:.4f} (order {extra['order']:.2f} {order}; brackets add "
            f"± {extra['from_brackets']:.4f}; GCI of the finest mesh {100 * extra['gci']:.2f} %)"
        )
    why = f"the observed order, {extra['order']:.2f}, is too low for a value: add finer meshes"
    if extra["low"] is None:
        return f"no extrapolation to zone size 0: {why}"
    return f"at zone size 0: between {extra['low']:.4f} and {extra['high']:.4f} ({why})"


def beside_each_other(found: dict[str, Any]) -> list[str]:
    """One line for each flow rule if there are several; found: {flow: content of fos.json}."""
    if len(found) < 2:
        return []
    lines = []
    for one in found.values():
        finest, extra = one["meshes"][-1], one.get("extrapolation")
        line = f"{one['rules']['flow']}: {one['quantity']} {finest['value']:.4f} on zones of {finest['zone_size']:.4g} m"
        if extra:
            line += f"; {_extrapolated(extra).partition(' (')[0]}"
        lines.append(line)
    return lines
