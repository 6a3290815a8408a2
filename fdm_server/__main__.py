"""Command line of the continuum server: `fdm-server SCENE --bind tcp://127.0.0.1:5555 --out DIR`."""

import sys
from contextlib import closing, contextmanager

from coupler_protocol import exits
from coupler_protocol.process import command_line, server

ENDPOINT = "endpoint"  # file with the address at which the run listens


def parser():
    """Options of the command line."""
    p = command_line.server_parser("fdm-server", "Continuum side: computes the grid and conducts the stages of a scene.")
    p.add_argument("--bind", default="tcp://127.0.0.1:5555", metavar="ENDPOINT", help="tcp://HOST:PORT; port 0: any free one")
    p.add_argument("--insecure", action="store_true", help="listen on an address others can reach, unencrypted")
    return p


def main(argv=None):
    """Entry point; returns the exit code."""
    return server.main("fdm-server", parser(), serve, argv)


def serve(scene, options, stop):
    """Listens if the scene has windows, and computes."""
    from coupler_protocol.wire import link_tcp

    if not link_tcp.is_loopback(options.bind) and not options.insecure:
        raise exits.EnvironmentFailed(
            f"{options.bind} can be reached from other machines: anyone there could steer this run. "
            f"Use --insecure if the network is your own"
        )
    with server.begun(options, scene, stop, 0, "fdm.rank0", (*server.OF_CONDUCTOR, ENDPOINT)) as context:
        (context.out / ENDPOINT).unlink(missing_ok=True)
        if not scene.window:
            return compute(scene, None, context)
        with closing(link_tcp.HubTransport(link_tcp.any_port(options.bind))) as transport, announced(transport, context.out):
            context.progress("start", f"listening on {transport.endpoint} for {len(scene.window)} discrete process(es)", now=True)
            compute(scene, transport, context)


@contextmanager
def announced(transport, out):
    """While this lasts, the run directory has the file by which discrete processes find the transport."""
    (out / f"{ENDPOINT}.new").write_text(transport.endpoint + "\n", encoding="ascii")
    (out / f"{ENDPOINT}.new").replace(out / ENDPOINT)
    try:
        yield
    finally:
        (out / ENDPOINT).unlink(missing_ok=True)


def compute(scene, transport, context):
    """Computes the grid and conducts the stages over any transport; used by the command line and by the in-process twin.

    context: a coupler_protocol.process.server.RunContext. Writes run.json in any case. On failure the peers receive FAILURE,
    State is saved, and the exception is raised again.
    """
    from coupler_protocol.wire.clocks import Clocks
    from coupler_protocol.wire.lockstep import Hub
    from fdm_server.procedure.grid_side import ContinuumSide

    hub = Hub(transport, range(1, len(scene.window) + 1), Clocks(scene.link), context.stop)

    def side():
        return ContinuumSide(scene, hub, context.out, context.progress, context.origin, context.plugin, context.checkpoint)

    server.conduct_run(side, scene, context, hub.notify_all)


if __name__ == "__main__":
    sys.exit(main())
