"""The main function of servers, and run.json of the runs that they conduct, for the grid and for discs alone."""

import argparse
import logging
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.files.restart import Origin
from coupler_protocol.process import command_line
from coupler_protocol.process.interrupt import StopRequest, stop_on_signals, stop_with_parent
from coupler_protocol.process.plugin import Plugin
from coupler_protocol.process.progress import Progress

STOPPED = "stopped"  # stage and phase of the State that is saved if a run fails


def main(
    name: str,
    parser: argparse.ArgumentParser,
    serve: Callable[[argparse.Namespace, StopRequest], None],
    argv: Sequence[str] | None = None,
) -> int:
    """Entry point of the server `name`: runs serve(options, stop); returns the exit code."""
    options = parser.parse_args(argv)
    command_line.set_threads(options.threads)
    stop = StopRequest()
    stop_on_signals(stop)
    if options.tether:
        stop_with_parent(stop)
    return command_line.exit_code_of(name, lambda: serve(options, stop))


def reason_of(error: BaseException) -> str:
    """Text of the reason for the end of a run."""
    return str(error) or type(error).__name__


def run_side(
    make_side: Callable[[], Any],
    scene: Any,
    out: str | Path,
    progress: Progress,
    origin: Origin | None = None,
    plugin: Plugin | None = None,
    notify: Callable[[str], Any] = lambda reason: None,
) -> None:
    """Runs the side that conducts the stages of a scene; writes scene.json, and run.json in any case.

    make_side() returns the side: run() gives the reason for the end, save(stage, phase) the path of its State, summary() its part
    of run.json; `state` is None if there is nothing to save. origin, plugin: as of the side; notify(reason) tells others of a
    failure. On failure State is saved and the exception is raised again.
    """
    out, begin = Path(out), time.perf_counter()
    about = run_json.describe(scene) | run_json.origin_content(out, origin, plugin)
    side, code, reason = None, exits.OURSELVES, ""
    try:
        side = make_side()
        run_json.write_json(out / "scene.json", scene.resolved())
        reason, code = exits.end_as_physics(side.run), exits.DONE
        progress("done", reason, now=True)
    except BaseException as error:
        reason, code = reason_of(error), exits.code_of(error)
        notify(reason)
        if side is not None and side.state is not None:
            logging.getLogger(__name__).info("state saved to %s", side.save(STOPPED, STOPPED))
        raise
    finally:
        about |= {"end": run_json.now(), "seconds": time.perf_counter() - begin}
        about |= {"exit_code": code, "reason": reason, "peak_memory_MB": run_json.peak_memory()}
        run_json.write(out, about | (side.summary() if side is not None else {"stages": []}))
