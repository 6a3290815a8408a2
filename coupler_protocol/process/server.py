"""The main function of servers, and run.json of the runs that they conduct, for the grid and for discs alone."""

import logging
import time
from pathlib import Path

from coupler_protocol import exits
from coupler_protocol.files import run_json
from coupler_protocol.process import command_line
from coupler_protocol.process.interrupt import StopRequest, stop_on_signals, stop_with_parent

STOPPED = "stopped"  # stage and phase of the State that is saved if a run fails


def main(name, parser, serve, argv=None):
    """Entry point of the server `name`: runs serve(options, stop); returns the exit code."""
    options = parser.parse_args(argv)
    command_line.set_threads(options.threads)
    stop = StopRequest()
    stop_on_signals(stop)
    if options.tether:
        stop_with_parent(stop)
    return command_line.exit_code_of(name, lambda: serve(options, stop))


def reason_of(error):
    """Text of the reason for the end of a run."""
    return str(error) or type(error).__name__


def run_side(make_side, scene, out, progress, origin=None, plugin=None, notify=lambda reason: None):
    """Runs the side that conducts the stages of a scene; writes scene.json, and run.json in any case.

    make_side() returns the side: run() gives the reason for the end, save(stage, phase) the path of its State, summary() its part
    of run.json; `state` is None if there is nothing to save. origin, plugin: as of the side; notify(reason) tells others of a
    failure. On failure State is saved and the exception is raised again.
    """
    from coupler_protocol.scene.rules.between_tables import listed_doubts

    out, begin = Path(out), time.perf_counter()
    about = run_json.describe(scene) | run_json.origin_content(out, origin, plugin)
    about |= {"doubts": found} if (found := listed_doubts(scene)) else {}
    for doubt in found:
        logging.getLogger(__name__).warning("%s: %s; %s", *doubt.values())
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
