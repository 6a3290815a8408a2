"""The process that looks for a factor of safety: `python -m fdm_server.fos SCENE --out DIR` (started by `colluvium fos`)."""

import sys

from coupler_protocol import exits
from coupler_protocol.process import command_line, server
from coupler_protocol.process.progress import Progress

OWN_FILES = ("fos.json", "fos.log")


def main(argv=None):
    """Entry point; returns the exit code."""
    name = "fdm_server.fos"
    parser = command_line.server_parser(name, "Looks for the factor of safety of a scene's grid.")
    return server.main(name, parser, search, argv)


def search(options, stop):
    """Read the scene, search, leave fos.json."""
    from coupler_protocol.scene.reader import read_scene
    from fdm_server.fos.study import Study, ignored

    scene = read_scene(options.scene, options.set)
    out = command_line.prepare_folder(options.out, OWN_FILES, options.force)
    command_line.log_to(out / "fos.log")
    progress = Progress(0, "none" if options.quiet else options.progress)
    for line in ignored(scene):
        progress("start", f"ignored: {line}", now=True)
    found = exits.end_as_physics(Study(scene, out, progress, stop).run)
    mesh = found["meshes"][-1]
    progress("done", f"{found['quantity']} {mesh['value']:.4g} ({mesh['low']:.4g} to {mesh['high']:.4g})", now=True)


if __name__ == "__main__":
    sys.exit(main())
