"""Process of the search for a factor of safety: `python -m fdm_server.fos SCENE --out DIR` (started by `colluvium fos`)."""

import sys

from coupler_protocol import exits
from coupler_protocol.process import command_line, server

NAME = "fdm_server.fos"


def main(argv=None):
    """Entry point; returns the exit code."""
    return server.main(NAME, command_line.server_parser(NAME, "Looks for the factor of safety of a scene's grid."), search, argv)


def search(scene, options, stop):
    """Searches for the factor of a scene and writes fos.json."""
    from fdm_server.fos.study import Study, ignored

    with server.begun_anew(options, scene, stop, 0, "fos", ("fos.json",)) as context:
        progress = context.progress
        for line in ignored(scene):
            progress("start", f"ignored: {line}", now=True)
        found = exits.end_as_physics(Study(scene, context.out, progress, stop).run)
        mesh = found["meshes"][-1]
        progress("done", f"{found['quantity']} {mesh['value']:.4g} ({mesh['low']:.4g} to {mesh['high']:.4g})", now=True)


if __name__ == "__main__":
    sys.exit(main())
