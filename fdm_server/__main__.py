"""Command line of the continuum server: `fdm-server SCENE --bind tcp://127.0.0.1:5555 --out DIR`."""

import sys
from contextlib import closing, contextmanager

from coupler_protocol.process import command_line, server

MODULES = ("coupler_protocol.scene.reader", "coupler_protocol.wire.admission", "fdm_server.procedure.grid_side")
ENDPOINT = "endpoint"  # file with the address at which the run listens
OPENS = (
    "--insecure: everybody who reaches {} can claim a free rank, steer this run and end it, and who can read the network reads "
    "scene and results; strangers cannot read files of this machine, and cannot run commands on it"
)


def parser():
    """Options of the command line."""
    p = command_line.server_parser("fdm-server", "Continuum side: computes the grid and conducts the stages of a scene.")
    p.add_argument(
        "--bind", default="tcp://127.0.0.1:5555", metavar="ENDPOINT", help="tcp://HOST:PORT (port 0: any free one), or local"
    )
    p.add_argument("--keys", metavar="DIR", help="folder of the keys that admit clients (colluvium keys; default of this user)")
    p.add_argument("--insecure", action="store_true", help="admit everybody who reaches the address, without encryption")
    return p


def main(argv=None):
    """Entry point; returns the exit code."""
    return server.main("fdm-server", parser(), serve, argv, needs_files=False, modules=MODULES)


def serve(scene, options, stop):
    """Listens if the scene has windows, and computes."""
    from coupler_protocol.wire import admission, link_tcp

    loopback = link_tcp.is_loopback(options.bind)
    rule = None
    if scene.window and options.bind != link_tcp.LOCAL:
        rule = admission.rule_of(options.bind, loopback, options.keys, options.insecure)
    with server.begun(options, scene, stop, 0, "fdm.rank0", (*server.OF_CONDUCTOR, ENDPOINT)) as context:
        (context.out / ENDPOINT).unlink(missing_ok=True)
        if not scene.window:
            return compute(scene, None, context)
        with closing(link_tcp.HubTransport(options.bind, rule)) as transport, announced(transport, context.out):
            command_line.show_warnings("fdm-server", "coupler_protocol.wire.gate")
            if options.insecure:
                print(f"fdm-server: {OPENS.format(transport.endpoint)}", file=sys.stderr)
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
    context.progress.wait = hub.waiting

    def side():
        return ContinuumSide(scene, hub, context.out, context.progress, context.origin, context.plugin, context.checkpoint)

    server.conduct_run(side, scene, context, hub.notify_all)


if __name__ == "__main__":
    sys.exit(main())
