"""Python interface: reads scenes, runs them and reads their results. Large libraries are loaded when they are used."""

from typing import Any

__all__ = ["Scene", "__version__", "open_run", "read_scene", "resume", "run"]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        from importlib.metadata import version

        return version("colluvium")
    if name == "open_run":
        from colluvium.results.run import open_run

        return open_run
    if name == "read_scene":
        from coupler_protocol.scene.reader import read_scene

        return read_scene
    if name == "Scene":
        from colluvium.api import Scene

        return Scene
    if name in ("run", "resume"):
        from colluvium import api

        return getattr(api, name)
    raise AttributeError(f"module 'colluvium' has no attribute {name!r}")
