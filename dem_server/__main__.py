"""Command line of the discrete server: `dem-server SCENE --connect ENDPOINT --rank N --out DIR`."""

import sys
from contextlib import closing

from coupler_protocol import exits
from coupler_protocol.process import command_line, server

MODULES = ("coupler_protocol.scene.reader", "coupler_protocol.wire.admission", "dem_server.procedure.window_side")


def parser():
    """Options of the command line."""
    p = command_line.server_parser("dem-server", "Discrete side: one window of discs for a continuum process, or discs alone.")
    p.add_argument("--connect", metavar="ENDPOINT", help="tcp://HOST:PORT, or the file it is written to; none without a grid")
    p.add_argument("--key", metavar="FILE", help="key file of this machine, for a continuum on another one (colluvium keys new)")
    p.add_argument("--insecure", action="store_true", help="connect with a continuum that was started with --insecure")
    p.add_argument(
        "--rank", type=command_line.positive, default=1, metavar="N", help="which window of the scene, from 1 (default 1)"
    )
    return p


def main(argv=None):
    """Entry point; returns the exit code."""
    return server.main("dem-server", parser(), serve, argv, modules=MODULES)


def serve(scene, options, stop):
    """Connects if the scene has a grid, and computes."""
    from coupler_protocol.wire import admission, link_tcp

    if scene.grid is not None and options.connect is None:
        raise exits.EnvironmentFailed("the scene has a grid: give the address of its process with --connect")
    more = None if scene.grid else server.OF_CONDUCTOR
    with server.begun(options, scene, stop, options.rank, f"dem.rank{options.rank}", more) as context:
        if scene.grid is None:
            from dem_server.procedure import discs_alone

            return discs_alone.compute(scene, context)
        context.progress("start", f"connects with {options.connect}", now=True)
        endpoint = link_tcp.endpoint_from(options.connect, scene.link.arrival, stop.check)
        ticket = admission.pass_of(endpoint, link_tcp.is_loopback(endpoint), options.key, options.insecure)
        command_line.show_warnings("dem-server", "coupler_protocol.wire.passage")
        with closing(link_tcp.RankTransport(endpoint, ticket)) as transport:
            compute(scene, options.rank, transport, context)


def compute(scene, rank, transport, context):
    """Compute the window of `rank` over any transport; used by the command line and by the in-process twin.

    context: a coupler_protocol.process.server.RunContext. On failure the peer receives FAILURE, State is saved if there is one,
    and the exception is raised again.
    """
    from coupler_protocol.wire.clocks import Clocks
    from coupler_protocol.wire.lockstep import Conversation
    from dem_server.procedure.window_side import DiscreteSide

    conversation = Conversation(transport, rank, 0, Clocks(scene.link), context.stop)
    context.progress.wait = conversation.waiting

    def side():
        return DiscreteSide(scene, rank, conversation, context.out, context.progress, context.origin, context.plugin)

    server.run_side(side, context.progress, conversation.notify, "free discs moved, velocities awaited")


if __name__ == "__main__":
    sys.exit(main())
