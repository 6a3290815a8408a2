"""Why a program ends: exit codes by whose fault it is, and the exceptions that carry them."""

from coupler_protocol.problems import SceneError

DONE, COMMAND_LINE, SCENE, ENVIRONMENT, PEER, PHYSICS, OURSELVES, INTERRUPTED = 0, 2, 3, 4, 5, 6, 7, 130

MEANING = {
    DONE: "done",
    COMMAND_LINE: "command line",
    SCENE: "scene",
    ENVIRONMENT: "environment (port, disk, permission, installation)",
    PEER: "the other side",
    PHYSICS: "physics (the computation blew up)",
    OURSELVES: "a fault of this program",
    INTERRUPTED: "interrupted",
}


def code_of(error):
    """Exit code of an exception: by whose fault, and ours where nothing says so."""
    return error.code if isinstance(error, RunEnded) else SCENE if isinstance(error, SceneError) else OURSELVES


class RunEnded(Exception):  # noqa: N818 (an end of a run, not always an error)
    """A run ends before its last stage; `code` says whose fault it is."""

    code = OURSELVES


class EnvironmentFailed(RunEnded):
    """A port, a file, a folder or what is installed cannot be used."""

    code = ENVIRONMENT


class PeerLost(RunEnded):
    """The other side was not heard for too long, failed, or speaks another language."""

    code = PEER


class PhysicsFailed(RunEnded):
    """Numbers grew without bounds, a zone turned inside out, or the like."""

    code = PHYSICS


class Interrupted(RunEnded):
    """Somebody asked the run to stop."""

    code = INTERRUPTED


def physics(work):
    """The result of `work()`; an ArithmeticError that a model raises ends the run as PhysicsFailed."""
    try:
        return work()
    except ArithmeticError as error:
        raise PhysicsFailed(str(error)) from error
