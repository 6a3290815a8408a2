"""Command line of the continuum server: `fdm-server SCENE --bind tcp://127.0.0.1:5555 --out DIR`."""

import sys

from coupler_protocol import exits
from coupler_protocol.process import command_line, server
from coupler_protocol.process.progress import Progress
from coupler_protocol.wire import messages

OWN_FILES = ("fdm.rank0.vtkhdf", "fdm.rank0.log", "fdm.rank0.trace.csv", "run.json", "scene.json", "endpoint")


def parser():
    """Options of the command line."""
    p = command_line.server_parser("fdm-server", "Continuum side: computes the grid and conducts the stages of a scene.")
    p.add_argument("--bind", default="tcp://127.0.0.1:5555", metavar="ENDPOINT", help="tcp://HOST:PORT; port 0: any free one")
    p.add_argument("--insecure", action="store_true", help="listen on an address others can reach, unencrypted")
    return p


def main(argv=None):
    """Entry point; returns the exit code."""
    return server.main("fdm-server", parser(), serve, argv)


def serve(options, stop):
    """Reads the scene, listens and computes."""
    from coupler_protocol.scene.reader import read_scene
    from coupler_protocol.wire import link_tcp

    scene = read_scene(options.scene, options.set)
    if not link_tcp.is_loopback(options.bind) and not options.insecure:
        raise exits.EnvironmentFailed(
            f"{options.bind} can be reached from other machines: anyone there could steer this run. "
            f"Say --insecure if the network is your own"
        )
    origin, plugin = options.origin, command_line.plugin(options)
    out = command_line.prepare_folder(options.out, OWN_FILES, options.force, origin)
    (out / "endpoint").unlink(missing_ok=True)
    command_line.log_to(out / "fdm.rank0.log")
    progress = Progress(0, "none" if options.quiet else options.progress)
    transport = link_tcp.HubTransport(link_tcp.any_port(options.bind)) if scene.window else None
    try:
        if transport is not None:
            (out / "endpoint.new").write_text(transport.endpoint + "\n", encoding="ascii")
            (out / "endpoint.new").replace(out / "endpoint")
            progress("start", f"listening on {transport.endpoint} for {len(scene.window)} discrete process(es)", now=True)
        compute(scene, transport, out, progress, stop, origin, plugin)
    finally:
        if transport is not None:
            transport.close()
            (out / "endpoint").unlink(missing_ok=True)


def compute(scene, transport, out, progress, stop, origin=None, plugin=None):
    """Computes the grid and conducts the stages over any transport; used by the command line and by the in-process twin.

    origin: the end of a stage after which to continue (coupler_protocol.files.restart.Origin); plugin: a
    coupler_protocol.process.plugin.Plugin or None.
    Writes run.json in any case. On failure the peers receive FAILURE, State is saved, and the exception is raised again.
    """
    from coupler_protocol.wire.lockstep import Clocks, Hub
    from fdm_server.procedure.grid_side import ContinuumSide

    hub = Hub(transport, range(1, len(scene.window) + 1), Clocks(scene.link), stop)

    def side():
        return ContinuumSide(scene, hub, out, progress, origin, plugin)

    def notify(reason):
        hub.notify_all(messages.FAILURE, {"reason": reason})

    server.run_side(side, scene, out, progress, origin, plugin, notify)


if __name__ == "__main__":
    sys.exit(main())
