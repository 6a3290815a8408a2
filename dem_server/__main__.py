"""Command line of the discrete server: `dem-server SCENE --connect ENDPOINT --rank N --out DIR`."""

import logging
import sys

from coupler_protocol import exits
from coupler_protocol.process import command_line, server
from coupler_protocol.process.progress import Progress
from coupler_protocol.wire import messages


def parser():
    """Options of the command line."""
    p = command_line.server_parser("dem-server", "Discrete side: one window of discs for a continuum process, or discs alone.")
    p.add_argument("--connect", metavar="ENDPOINT", help="tcp://HOST:PORT, or the file it is written to; none without a grid")
    p.add_argument(
        "--rank", type=command_line.positive, default=1, metavar="N", help="which window of the scene, from 1 (default 1)"
    )
    return p


def main(argv=None):
    """Entry point; returns the exit code."""
    return server.main("dem-server", parser(), serve, argv)


def serve(options, stop):
    """Reads the scene, connects and computes."""
    from coupler_protocol.scene.reader import read_scene
    from coupler_protocol.wire import link_tcp

    scene = read_scene(options.scene, options.set)
    own = [f"dem.rank{options.rank}.{ending}" for ending in ("vtkhdf", "log", "trace.csv")]
    plugin = command_line.plugin(options)
    own += [] if scene.grid else ["run.json", "scene.json"]
    out = command_line.prepare_folder(options.out, own, options.force, options.origin)
    command_line.log_to(out / own[1])
    progress = Progress(options.rank, "none" if options.quiet else options.progress)
    if scene.grid is None:
        from dem_server.procedure import discs_alone

        return discs_alone.compute(scene, out, progress, stop, options.origin, plugin)
    if options.connect is None:
        raise exits.EnvironmentFailed("the scene has a grid: give the address of its process with --connect")
    transport = link_tcp.RankTransport(link_tcp.endpoint_from(options.connect, scene.link.give_up))
    try:
        reason = compute(scene, options.rank, transport, out, progress, stop, options.origin, plugin)
        progress("done", reason, now=True)
    finally:
        transport.close()


def compute(scene, rank, transport, out, progress, stop, origin=None, plugin=None):
    """Compute the window of `rank` over any transport; used by the command line and by the in-process twin.

    origin: the end of a stage after which to continue (coupler_protocol.files.restart.Origin); plugin: a
    coupler_protocol.process.plugin.Plugin or None.
    On failure the peer receives FAILURE, State is saved if there is one, and the exception is raised again.
    """
    from coupler_protocol.wire.lockstep import Clocks, Conversation
    from dem_server.procedure.window_side import DiscreteSide

    conversation = Conversation(transport, rank, 0, Clocks(scene.link), stop)
    side = DiscreteSide(scene, rank, conversation, out, progress, origin, plugin)
    try:
        return exits.end_as_physics(side.run)
    except BaseException as error:
        conversation.notify(messages.FAILURE, {"reason": server.reason_of(error)})
        if side.state is not None:
            path = side.save(server.STOPPED, "free discs moved, velocities awaited")
            logging.getLogger("dem-server").info("state saved to %s", path)
        raise


if __name__ == "__main__":
    sys.exit(main())
