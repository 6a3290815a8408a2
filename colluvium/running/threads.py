"""The whole coupled run in one process: the same two sides in threads, connected by queues instead of TCP.

Results are bit-identical to those of separate processes; a debugger has access to both sides.
"""

import threading
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from coupler_protocol.exits import OURSELVES, PeerLost, RunEnded
from coupler_protocol.files import locks, saved_moments
from coupler_protocol.files.restart import Origin, processes
from coupler_protocol.files.run_json import name_the_cause
from coupler_protocol.process import status
from coupler_protocol.process.interrupt import StopRequest
from coupler_protocol.process.plugin import Plugin
from coupler_protocol.process.progress import Progress
from coupler_protocol.process.server import RunContext
from coupler_protocol.wire.link_inproc import transports


def run(
    scene: Any,
    out: str | Path,
    stop: StopRequest | None = None,
    report: Any = "none",
    origin: Origin | None = None,
    plugin: Plugin | None = None,
    checkpoint: float | None = None,
) -> None:
    """Computes `scene` into the existing folder `out`, from the stage end `origin` on. `report`: form of the progress.

    plugin: a coupler_protocol.process.plugin.Plugin that both sides call, or None.
    Raises the exception that ended the run, usually a RunEnded of coupler_protocol.exits.
    """
    stop = stop or StopRequest()
    names = processes(scene, len(scene.stage) - 1)
    with locks.held(out, names), ExitStack() as stack:
        contexts = {}
        for name in names:
            progress = Progress(int(name.rpartition("rank")[2]), report)
            stack.enter_context(status.shown(out, name, progress, scene))
            contexts[progress.rank] = RunContext(Path(out), progress, stop, origin, plugin, checkpoint)
        _run(scene, out, contexts.__getitem__)


def _run(scene: Any, out: str | Path, context: Callable[[int], RunContext]) -> None:
    """Computes with these contexts by rank."""
    if scene.grid is None:
        from dem_server.procedure import discs_alone

        return discs_alone.compute(scene, context(1))
    from dem_server.__main__ import compute as compute_discs
    from fdm_server.__main__ import compute as compute_grid

    hub, ends = transports(len(scene.window))
    failures: dict[int, BaseException] = {}

    def discs(rank: int, transport: Any) -> None:
        try:
            compute_discs(scene, rank, transport, context(rank))
        except BaseException as error:
            failures[rank] = error
        finally:
            transport.close()

    threads = [
        threading.Thread(target=discs, args=(rank, end), name=f"rank {rank}")
        for rank, end in enumerate(ends, start=1)
        if not saved_moments.finished(scene, out, f"dem.rank{rank}", False)  # of a run that was killed just before its end
    ]
    for thread in threads:
        thread.start()
    try:
        compute_grid(scene, hub, context(0))
    except BaseException as error:
        failures[0] = error
    finally:
        hub.close()
    for thread in threads:
        thread.join()
    if failures:
        cause = _first_cause(failures)
        name_the_cause(Path(out) / "run.json", getattr(cause, "code", OURSELVES))
        raise cause


def _first_cause(failures: dict[int, BaseException]) -> BaseException:
    """The failure that is not a consequence of another side's failure."""
    causes = [error for error in failures.values() if not isinstance(error, PeerLost)] or list(failures.values())
    return next((error for error in causes if not isinstance(error, RunEnded)), causes[0])
