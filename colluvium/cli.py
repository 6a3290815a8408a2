"""Command line of `colluvium`: its commands, and those that compute one run or look at it."""

import argparse
import json
import signal
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.process import command_line, interrupt

# Modules that the end of a run imports, the slow ones in parts: for its tables, and for the band of a grid.
_OURS = ("colluvium.closing", "coupler_protocol.criteria.stable_step", "coupler_protocol.files.run_schema")
OF_TABLES = (*_OURS, "rich.console", "rich.table")
_SCIPY = ("scipy.sparse.csgraph", "scipy.special", "scipy.spatial")
OF_BAND = (*OF_TABLES, "colluvium.forecast.locate", "fdm_server.mesh.grid", *_SCIPY)


def parser() -> argparse.ArgumentParser:
    """Parser of all commands and their options."""
    p = argparse.ArgumentParser(prog="colluvium", description="Soil-rock slopes by two coupled processes.")
    p.add_argument("--version", action="version", version=f"%(prog)s {version('colluvium')}")
    commands = p.add_subparsers(dest="command", required=True, metavar="COMMAND")

    example = commands.add_parser("example", help="write a scene that comes with colluvium into a folder, or list these scenes")
    example.add_argument("name", metavar="NAME", nargs="?", help="name of the scene (default: list all)")
    example.add_argument("--out", metavar="DIR", default=".", help="folder for the files (default: the current one)")
    example.add_argument("--force", action="store_true", help="overwrite files of the same name")
    example.set_defaults(work=example_command)

    run = commands.add_parser("run", help="compute a scene: starts all processes and shows their progress")
    command_line.common_options(run)
    run.add_argument("--out", metavar="DIR", help="run directory (default runs/NAME)")
    _options_of_computing(run)
    run.set_defaults(work=run_command)

    resume = commands.add_parser("resume", help="continue a run from its last checkpoint that all processes have")
    resume.add_argument("run_dir", metavar="RUN_DIR")
    command_line.process_options(resume)
    _options_of_computing(resume)
    resume.set_defaults(work=resume_command)

    check = commands.add_parser("check", help="report the problems of a scene, or describe what it computes")
    check.add_argument("scene", metavar="SCENE", help="scene file (TOML)")
    check.add_argument("--set", metavar="KEY=VALUE", action="append", default=[], help="override a key of the scene")
    check.add_argument("--no-locate", action="store_true", help="do not compute the stage of kind locate (seconds)")
    check.add_argument("--no-limits", action="store_true", help="do not compute the limits of a coupled step (packs the windows)")
    check.add_argument("--exact", action="store_true", help="also compute the exact limit of a coupled step (Lanczos)")
    check.add_argument("--quiet", action="store_true", help="no progress")
    check.add_argument("--json", nargs="?", const="-", metavar="FILE", help="the answer as JSON to FILE or standard output")
    check.set_defaults(work=check_command)

    from colluvium.accuracy import command as accuracy
    from colluvium.calibration import command as calibration
    from colluvium.ensemble import command as ensemble
    from colluvium.lab import command as lab
    from colluvium.safety import command as safety

    safety.add_command(commands)
    lab.add_command(commands)
    accuracy.add_command(commands)
    calibration.add_command(commands)
    ensemble.add_command(commands)

    report = commands.add_parser("report", help="draw the pictures of a run")
    report.add_argument("run_dir", metavar="RUN_DIR")
    report.add_argument("run_dir_b", metavar="RUN_DIR_B", nargs="?", help="the other directory, where the servers wrote to two")
    report.add_argument("--out", metavar="DIR", help="folder of the pictures (default RUN_DIR/report)")
    report.set_defaults(work=report_command)

    export = commands.add_parser("export", help="write frames for other programs, or the discs of a frame to begin a scene with")
    export.add_argument("run_dir", metavar="RUN_DIR")
    export.add_argument(
        "--format",
        choices=("scene", "csv", "vtu", "pvd"),
        default="scene",
        help="scene: CSV of discs that a scene can begin with (default); csv: tables of a frame and of all histories with units; "
        "vtu: a frame for ParaView before 5.12 and other VTK programs; pvd: all frames for them, on one axis of time",
    )
    when = export.add_mutually_exclusive_group()
    when.add_argument("--frame", type=int, metavar="F", help="number of the frame, from the end if negative (default: the last)")
    when.add_argument("--stage", metavar="NAME", help="the last frame of this stage")
    export.add_argument(
        "--rank", type=command_line.positive, metavar="N", help="with --format scene: their window, from 1 (default 1)"
    )
    export.add_argument(
        "--out",
        metavar="PATH",
        help="with --format scene the file to write (default: standard output), otherwise the folder (default RUN_DIR/export)",
    )
    export.set_defaults(work=export_command)

    status = commands.add_parser("status", help="print where a run is, how fast, for whom it waits, or how it ended")
    status.add_argument("run_dir", metavar="RUN_DIR", help="folder of the run, or of one of its sides")
    status.add_argument(
        "--watch", nargs="?", const=2.0, type=command_line.not_negative, metavar="SECONDS", help="again until the end (default 2)"
    )
    status.add_argument(
        "--json", nargs="?", const="-", metavar="FILE", help="run.json and `processes` to FILE or standard output"
    )
    status.set_defaults(work=status_command)

    _add_doctor(commands)
    _add_keys(commands)
    return p


def _add_doctor(commands: Any) -> None:
    """Adds the command that examines a machine."""
    doctor = commands.add_parser("doctor", help="examine this machine, and whether it reaches the other side of a run")
    doctor.add_argument(
        "--other", "--endpoint", metavar="HOST:PORT", help="address of the continuum, or the file OUT/endpoint: is it reached"
    )
    doctor.add_argument("--key", metavar="FILE", help="key file of this machine, as for dem-server")
    doctor.add_argument("--keys", metavar="DIR", help="key folder, as for fdm-server")
    doctor.add_argument("--insecure", action="store_true", help="the continuum was started with --insecure")
    doctor.add_argument("--bind", metavar="ENDPOINT", help="address at which a continuum of this machine is to listen")
    doctor.add_argument("--out", metavar="DIR", default="runs", help="run directory (default runs)")
    doctor.add_argument("--json", nargs="?", const="-", metavar="FILE", help="the findings as JSON to FILE or standard output")
    doctor.set_defaults(work=doctor_command)


def _add_keys(commands: Any) -> None:
    """Adds the command for the keys of other machines."""
    group = commands.add_parser("keys", help="keys of other machines that may connect with a continuum of this user")
    actions = group.add_subparsers(dest="action", required=True, metavar="ACTION")
    new = actions.add_parser("new", help="make a key for another machine, and the file to copy there")
    new.add_argument("name", metavar="NAME", help="name of the key, as in logs")
    new.add_argument("--out", metavar="FILE", help="file for the other machine (default NAME.key)")
    listed = actions.add_parser("list", help="print the keys")
    revoke = actions.add_parser("revoke", help="revoke a key; a connection made with it is closed at once")
    revoke.add_argument("name", metavar="NAME")
    for action, work in ((new, new_key_command), (listed, list_keys_command), (revoke, revoke_key_command)):
        action.add_argument("--keys", metavar="DIR", help="key folder (default $COLLUVIUM_KEYS or ~/.config/colluvium/keys)")
        action.set_defaults(work=work)


def _options_of_computing(command: argparse.ArgumentParser) -> None:
    """Options of the commands that start both sides."""
    command.add_argument("--in-process", action="store_true", help="both sides in one process, for debugging; same bits")
    command_line.plugin_option(command)
    command.add_argument("--strict", action="store_true", help="exit code 8 if a stage that should rest did not come to rest")
    command.add_argument("--exact", action="store_true", help="also compute the exact step limits at the ends of coupled stages")
    command.add_argument("--json", nargs="?", const="-", metavar="FILE", help="run.json to FILE or standard output, no table")


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point; returns the exit code."""
    options = parser().parse_args(argv)
    code: list[int | None] = []
    ended = command_line.exit_code_of("colluvium", lambda: code.append(options.work(options)))
    return ended or next(iter(code), None) or exits.DONE  # a finished run ends without a code


def _console() -> Any:
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else 160, highlight=False)


def _write_json(content: Any, target: str | Path) -> None:
    text = json.dumps(content, indent=1)
    if target == "-":
        print(text)
    else:
        Path(target).write_text(text + "\n", encoding="utf-8")


def run_command(options: argparse.Namespace) -> int:
    """Computes a scene, from its start, from the end of a stage of an earlier run, or on where this run was; returns the code."""
    from colluvium.running import stand_bys

    command_line.set_threads(options.threads)
    options.scene = command_line.scene_file(options.scene)
    with stand_bys.StandBys([] if options.in_process else stand_bys.expected(options.scene)) as ahead:
        return _run(options, ahead)


def _run(options: argparse.Namespace, ahead: Any) -> int:
    """`run_command` with servers that stand by."""
    from colluvium import api
    from colluvium.running import processes
    from coupler_protocol.files import locks, restart
    from coupler_protocol.scene.reader import read_scene

    scene = read_scene(options.scene, options.set)
    wanted = Path(options.out or Path("runs") / Path(options.scene).stem)
    if options.origin:
        if options.origin.continues(wanted):
            raise exits.EnvironmentFailed(f"{wanted} is the run to branch from: choose another --out, or colluvium resume")
        restart.check(scene, options.origin)
    plugin, own = command_line.plugin(options), processes.own_files(wanted)
    if any(Path(options.scene).resolve() == (wanted / name).resolve() for name in own):
        raise exits.EnvironmentFailed(f"{options.scene} belongs to the run in {wanted}: choose another --out")
    out = command_line.make_folder(wanted)
    with locks.held(out, [processes.LOCK]):
        locks.refuse_all(out, [processes.LOCK])
        if options.force:
            command_line.prepare_folder(out, own, True, command_line.inputs_of(scene, options.scene, options.plugin))
        elif own:
            _say_where(options, api.to_go_on(out, plugin, scene)[1])
        _open(options, scene, out)
        if Path(options.scene).suffix != ".json":
            (out / "scene.toml").write_bytes(Path(options.scene).read_bytes())
        return _compute(options, scene, options.scene, out, [f"--set={pair}" for pair in options.set], ahead)


def _say_where(options: argparse.Namespace, where: str) -> None:
    """Prints where a run continues."""
    print(f"continuing {where}", file=sys.stderr)


def _open(options: argparse.Namespace, scene: Any, out: Path) -> None:
    """Prints, before a run, zones and areas of materials, and doubts about the scene, on standard error."""
    from colluvium.forecast import check

    for line in [] if options.quiet else check.opening(scene, out):
        print(line, file=sys.stderr)


def resume_command(options: argparse.Namespace) -> int:
    """Continues a run that did not reach its end; returns the exit code."""
    from colluvium import api
    from colluvium.running import processes
    from coupler_protocol.files import locks

    command_line.set_threads(options.threads)
    out, options.origin = Path(options.run_dir), None
    if not out.is_dir():
        raise exits.EnvironmentFailed(f"{out} is not a folder: nothing to continue")
    with locks.held(out, [processes.LOCK]):
        locks.refuse_all(out, [processes.LOCK])
        scene, where = api.to_go_on(out, command_line.plugin(options))
        _say_where(options, where)
        return _compute(options, scene, out / "scene.json", out, [])


def _compute(
    options: argparse.Namespace, scene: Any, path: str | Path, out: Path, passed: Sequence[str], ahead: Any = None
) -> int:
    """Computes in one process or several; `passed`: options for the servers besides those of all commands."""
    from colluvium.running import processes
    from colluvium.running.idle_imports import IdleImports
    from colluvium.running.progress_picture import picture

    show = picture(options.quiet)
    with show or _nothing():
        if options.in_process:
            code = _in_process(scene, out, show, options)
        else:
            for number in interrupt.signals():  # a kill stops the run as Ctrl-C does, also in the background of a script
                signal.signal(number, signal.default_int_handler)
            more = {
                "threads": options.threads,
                "from": options.origin,
                "plugin": options.plugin,
                "checkpoint": options.checkpoint,
            }
            passed = [*passed, *(f"--{name}={value}" for name, value in more.items() if value is not None)]
            with IdleImports(OF_BAND if scene.grid else OF_TABLES, show) as seen:
                code = processes.run_files(path, out, processes.windows_of(scene), passed, seen, ahead=ahead)
    if code == exits.DONE and scene.grid:
        _add_band(scene, out)
        if options.exact:
            _add_exact_limits(scene, out)
    if code == exits.DONE and options.strict:
        code = _strict_code(out)
    _conclude(out, options.json)
    return code


def _strict_code(out: Path) -> int:
    """Exit code of a completed run whose stages should all have come to rest; writes it into run.json."""
    from coupler_protocol.scene.rest import unrested

    info = run_json.read(out / run_json.NAME)
    stages = unrested(info)
    if not stages:
        return exits.DONE
    reason = f"{info['reason']}, but not at rest at the end: {', '.join(stages)}"
    run_json.write(out, info | {"exit_code": exits.NOT_AT_REST, "reason": reason})
    return exits.NOT_AT_REST


def _add_band(scene: Any, out: Path) -> None:
    """Adds the band of the grid alone, and the failure under overload, to run.json."""
    from colluvium.forecast import locate
    from colluvium.results import failure
    from colluvium.results.run import open_run

    with open_run(out) as run:
        found = {"locate": locate.band_and_windows(run, scene), "band": failure.summary(run)}
    found = {key: value for key, value in found.items() if value}
    if found:
        run_json.write(out, run_json.read(out / run_json.NAME) | found)


def _add_exact_limits(scene: Any, out: Path) -> None:
    """Adds the exact limits of the step at the ends of coupled stages to run.json."""
    from colluvium.forecast import step_limits

    exact = step_limits.exact_of_run(scene, out)
    info = run_json.read(out / run_json.NAME)
    for row in info["stages"]:
        if row["name"] in exact:
            row["limits"] = (row.get("limits") or {}) | {"exact": exact[row["name"]]}
    run_json.write(out, info)


def _in_process(scene: Any, out: Path, show: Any, options: argparse.Namespace) -> int:
    from colluvium.running import threads
    from coupler_protocol.process.interrupt import StopRequest, stop_on_signals

    stop = StopRequest()
    stop_on_signals(stop)

    def work() -> None:
        threads.run(scene, out, stop, show or "none", options.origin, command_line.plugin(options), options.checkpoint)

    return command_line.exit_code_of("colluvium", work)


def _nothing() -> AbstractContextManager[None]:
    from contextlib import nullcontext

    return nullcontext()


def _conclude(out: Path, target: str | Path | None) -> None:
    """Prints the closing tables of run.json, or writes run.json to `target`."""
    from colluvium import closing

    path = out / "run.json"
    if not path.exists():
        return
    info = run_json.read(path)
    if target:
        _write_json(info, target)
    else:
        closing.print_table(info, _console())
        print(f"results in {out}")


def check_command(options: argparse.Namespace) -> None:
    """Prints what a scene computes, its band if a stage locates it, and the limits of a coupled step; problems: exit code 3."""
    from colluvium.forecast import check, locate, step_limits
    from colluvium.running.progress_picture import picture
    from coupler_protocol.scene.reader import read_scene

    scene = read_scene(options.scene, options.set)
    found = check.describe(scene)
    if locate.stage_of(scene) is not None and not options.no_locate:
        show = picture(options.quiet)
        with show or _nothing():
            found["locate"] = locate.compute(scene, show)
    if step_limits.couples_discs(scene) and (options.exact or not options.no_limits):
        found["limits"] = step_limits.limits_of_scene(scene, options.exact)
    if options.json:
        _write_json(found, options.json)
    else:
        check.print_description(found, _console())


def example_command(options: argparse.Namespace) -> None:
    """Writes an example scene and prints how to compute it, or lists the scenes."""
    from colluvium import examples

    if options.name is None:
        for name, title in examples.titles().items():
            print(f"{name:20} {title}")
        return
    paths = examples.write(options.name, options.out, options.force)
    print(f"wrote {', '.join(map(str, paths))}\ncompute it with: colluvium run {paths[0]}")


def report_command(options: argparse.Namespace) -> None:
    """Draws the pictures of a run."""
    from colluvium import report

    lacking: dict[str, list[str]] = {}
    try:
        report.write(
            options.run_dir, options.out, other_path=options.run_dir_b, progress=print,
            skipped=lambda name, why: lacking.setdefault(why, []).append(name),
        )  # fmt: skip
    except ModuleNotFoundError as error:
        raise exits.EnvironmentFailed(f"{error.name} is missing: pip install 'colluvium[report]'") from None
    for why, names in lacking.items():
        print(f"not drawn, {why}: {', '.join(names)}", file=sys.stderr)


def export_command(options: argparse.Namespace) -> None:
    """Writes the discs of a frame as CSV, or frames for other programs."""
    from colluvium.results import export
    from colluvium.results.rank_file import NotRecordedError

    _check_export(options)
    try:
        if options.format == "scene":
            count = export.write(options.run_dir, options.frame, options.stage, options.rank or 1, options.out)
            print(f"{count} discs", file=sys.stderr)
        else:
            paths = export.write_folder(options.run_dir, options.format, options.frame, options.stage, options.out)
            print(f"{len(paths)} files in {paths[0].parent}", file=sys.stderr)
    except (FileNotFoundError, NotRecordedError, IndexError) as error:
        raise exits.EnvironmentFailed(str(error)) from None


def _check_export(options: argparse.Namespace) -> None:
    """Ends with exit code 2 for options that a format does not have."""
    if options.format != "scene" and options.rank is not None:
        parser().error(f"--rank belongs to --format scene; {options.format} has all ranks")
    if options.format == "pvd" and (options.frame is not None or options.stage is not None):
        parser().error("pvd has all frames; for one frame use --format vtu")


def status_command(options: argparse.Namespace) -> int:
    """Prints where a run is, or how it ended; with --watch again until its end."""
    from colluvium import status

    while True:
        info = status.of_folder(options.run_dir)
        if options.json:
            _write_json(info, options.json)
        else:
            print("\n".join(status.lines(options.run_dir, info)), flush=True)
        if options.watch is None or status.is_over(info):
            break
        time.sleep(max(options.watch, 0.1))
        if not options.json:
            print()
    if not options.json and status.is_over(info):
        _conclude(Path(options.run_dir), None)
    return exits.DONE


def doctor_command(options: argparse.Namespace) -> int:
    """Prints what an examination finds; returns ENVIRONMENT if a run will fail."""
    from colluvium.doctor import link, machine
    from colluvium.doctor.findings import any_wrong, lines
    from coupler_protocol.wire import keys, link_tcp

    parts = [machine.versions(), machine.cores(), machine.kernels(), machine.disk(Path(options.out)), machine.clock()]
    parts += [machine.names(), link.key_files(keys.folder_of(options.keys), options.key)]
    parts += [link.port(options.bind)] if options.bind else []
    parts += [link.other(link_tcp.endpoint_from(options.other, 0.0), options.key, options.insecure)] if options.other else []
    found = []
    for part in parts:
        for finding in part:
            found.append(finding)
            if not options.json:
                print(*lines([finding]), flush=True)
    if options.json:
        _write_json([finding._asdict() for finding in found], options.json)
    return exits.ENVIRONMENT if any_wrong(found) else exits.DONE


def new_key_command(options: argparse.Namespace) -> None:
    """Makes a key for another machine, and prints how to use its file."""
    from coupler_protocol.wire import keys

    folder, path = keys.folder_of(options.keys), Path(options.out or f"{options.name}.key")
    keys.new(folder, options.name, path)
    print(f"wrote {path}: move it to the other machine, for example with scp, and keep it secret")
    print(f"there:  dem-server SCENE --connect tcp://THIS_MACHINE:PORT --key {path.name} --out DIR")
    print("here:   fdm-server SCENE --bind tcp://0.0.0.0:PORT --out DIR" + (f" --keys {folder}" if options.keys else ""))


def list_keys_command(options: argparse.Namespace) -> None:
    """Prints the names of the keys, when they were made, and which are revoked; never a key."""
    from coupler_protocol.wire import keys

    folder = keys.folder_of(options.keys)
    found = keys.clients_of(folder)
    print(f"{len(found)} keys in {folder}")
    for client in found:
        print(f"{client.name:20} made {keys.made(folder, client)}{'  revoked' * client.revoked}")


def revoke_key_command(options: argparse.Namespace) -> None:
    """Revokes a key."""
    from coupler_protocol.wire import keys

    keys.revoke(keys.folder_of(options.keys), options.name)
    print(f"revoked {options.name}: running continua close its connections within a second")


if __name__ == "__main__":
    sys.exit(main())
