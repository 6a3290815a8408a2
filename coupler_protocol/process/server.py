"""Common parts of the main functions of servers: start of a process, run of its side, run.json if it conducts the stages."""

import argparse
import logging
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from coupler_protocol import exits
from coupler_protocol.files import locks, run_json, saved_moments, status_file
from coupler_protocol.files.restart import Origin
from coupler_protocol.process import command_line, stand_by, status
from coupler_protocol.process.interrupt import StopRequest, stop_on_signals, stop_with_parent
from coupler_protocol.process.plugin import Plugin
from coupler_protocol.process.progress import Progress
from coupler_protocol.scene.tables.stages import STOPPED
from coupler_protocol.wire import messages

OWN_FILES = ("vtkhdf", "vtkhdf.undo", "vtkhdf.damaged", "log", "trace.csv", "json")  # endings of files that every process writes
OF_CONDUCTOR = ("run.json", "run.earlier.json", "scene.json")  # further files of the process that conducts the stages

log = logging.getLogger(__name__)


class RunContext(NamedTuple):
    """Arguments of `compute` of every server besides the scene and its link."""

    out: Path  # run directory, which exists
    progress: Progress
    stop: StopRequest
    origin: Origin | None = None  # end of a stage after which to continue
    plugin: Plugin | None = None
    checkpoint: float | None = None  # [s] wall time between checkpoints inside of a stage; None: that of the scene


def main(
    name: str,
    parser: argparse.ArgumentParser,
    serve: Callable[[Any, argparse.Namespace, StopRequest], object],
    argv: Sequence[str] | None = None,
    needs_files: bool = True,
    modules: Sequence[str] = (),
) -> int:
    """Entry point of the server `name`: runs serve(scene, options, stop) on the scene of its options; returns the exit code.

    needs_files: whether it uses files that a scene names; modules: those that it loads while it stands by (stand_by.py).
    """
    stop = StopRequest()
    stop_on_signals(stop)
    words = sys.argv[1:] if argv is None else argv
    if list(words) == [stand_by.OPTION]:
        stand_by.prepare(modules)
        given = stand_by.arguments()
        if given is None:
            return exits.DONE
        words = given
    options = parser.parse_args(words)
    command_line.set_threads(options.threads)
    if options.tether:
        stop_with_parent(stop)

    def work() -> None:
        from coupler_protocol.scene.reader import read_scene

        serve(read_scene(options.scene, options.set, needs_files), options, stop)

    return command_line.exit_code_of(name, work)


@contextmanager
def begun(
    options: argparse.Namespace, scene: Any, stop: StopRequest, rank: int, process: str, more: Sequence[str] | None = None
) -> Iterator[RunContext]:
    """The RunContext of a process, which holds the lock of its name in the run directory and writes its log there.

    process: name with which its files begin ("fdm.rank0"); more: names of other files that it writes, None for a process that
    does not conduct the stages. Without --force the process continues what is there. Raises FinishedBefore if nothing remains to
    be computed, EnvironmentFailed or SceneError if the results there are not of this scene.
    """
    plugin = command_line.plugin(options)
    out = command_line.make_folder(options.out)
    with locks.held(out, [process]):
        if options.force:
            origin = options.origin and options.origin.path(process)
            inputs = command_line.inputs_of(scene, options.scene, options.plugin, origin)
            command_line.prepare_folder(out, [*files_of(out, process), *(more or ())], True, inputs)
        elif sentence := saved_moments.finished(scene, out, process, more is not None):
            raise exits.FinishedBefore(sentence)
        saved_moments.refuse_other_scene(scene, out, process)
        progress = Progress(rank, "none" if options.quiet else options.progress)
        command_line.log_to(out / f"{process}.log", progress)
        with status.shown(out, process, progress, scene):
            yield RunContext(out, progress, stop, options.origin, plugin, options.checkpoint)


@contextmanager
def begun_anew(
    options: argparse.Namespace, scene: Any, stop: StopRequest, rank: int, process: str, more: Sequence[str] = ()
) -> Iterator[RunContext]:
    """As `begun`, for a process that never continues: without --force it refuses a directory with its results."""
    out = command_line.make_folder(options.out)
    with locks.held(out, [process]):
        inputs = command_line.inputs_of(scene, options.scene, options.plugin)
        command_line.prepare_folder(out, [*files_of(out, process), *more], options.force, inputs)
        progress = Progress(rank, "none" if options.quiet else options.progress)
        command_line.log_to(out / f"{process}.log", progress)
        yield RunContext(out, progress, stop, options.origin, None, None)


def files_of(out: Path, process: str) -> list[str]:
    """Names of the files that a process of this name has written: parts and checkpoints, which readers and resume would take."""
    endings = (*(ending for ending in OWN_FILES if ending.startswith("vtkhdf")), "h5")
    found = [path.name for ending in endings for path in sorted(out.glob(f"{process}.*.{ending}"))]
    return [*(f"{process}.{ending}" for ending in (*OWN_FILES, status_file.ENDING)), *found]


def run_side(
    make_side: Callable[[], Any],
    progress: Progress,
    notify: Callable[[int, dict[str, str]], object] = lambda kind, content: None,
    phase: str = STOPPED,
) -> str:
    """Makes a side and runs it to its end; returns the reason.

    make_side() returns the side: run() gives the reason for the end, save(stage, phase) the path of its State; `state` is None
    if there is nothing to save; `compiled` becomes the Compiled of this thread. On failure notify(FAILURE, reason) reaches the
    peers, State is saved (`phase`: the part of a step that it belongs to) and the exception is raised again.
    """
    from coupler_protocol.compiled.ahead import watched

    side = None
    try:
        with watched(progress.note) as compiled:
            side = make_side()
            side.compiled = compiled
            progress.follow(side)
            reason = exits.end_as_physics(side.run, lambda: f" (stage {progress.stage!r}, after step {progress.steps})")
        progress("done", reason, now=True)
        return reason
    except BaseException as error:
        notify(messages.FAILURE, {"reason": reason_of(error)})
        if side is not None and side.state is not None and not isinstance(error, exits.Interrupted):
            stopped = side
            after_failure(lambda: log.info("state saved to %s", stopped.save(STOPPED, phase)))
        raise


def reason_of(error: BaseException) -> str:
    """Text of the reason for the end of a run."""
    return str(error) or type(error).__name__


def conduct_run(
    make_side: Callable[[], Any],
    scene: Any,
    context: RunContext,
    notify: Callable[[int, dict[str, str]], object] = lambda kind, content: None,
) -> None:
    """`run_side` of the side that conducts the stages; writes scene.json, and run.json in any case.

    summary() of the side is its part of run.json; context: the RunContext of its process.
    """
    from coupler_protocol.scene.rules.between_tables import listed_doubts

    start = time.perf_counter()
    run_json.keep_room(context.out)
    sides: list[Any] = []
    about = run_json.describe(scene) | run_json.history_content(context.out, context.plugin)
    about |= {"doubts": found} if (found := listed_doubts(scene)) else {}
    for doubt in found:
        logging.getLogger(__name__).warning("%s: %s; %s", *doubt.values())
    code, reason = exits.OURSELVES, ""

    def made() -> Any:
        sides.append(make_side())
        run_json.write_json(context.out / "scene.json", scene.resolved())
        return sides[0]

    try:
        reason, code = run_side(made, context.progress, notify), exits.DONE
    except BaseException as error:
        reason, code = reason_of(error), exits.code_of(error)
        raise
    finally:
        about |= {"end": run_json.now(), "seconds": time.perf_counter() - start}
        about |= {"exit_code": code, "reason": reason, "peak_memory_MB": run_json.peak_memory()}

        def conclude() -> None:
            run_json.write(context.out, about | (sides[0].summary() if sides else {"stages": []}))

        if code == exits.DONE:
            conclude()
        else:
            after_failure(conclude)


def after_failure(work: Callable[[], object]) -> None:
    """Runs `work()` after a failure; a second failure goes into the log only, so that the first one is reported."""
    try:
        work()
    except Exception as error:
        log.info("after the failure also: %s", error)
