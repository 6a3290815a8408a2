"""Why a program ends: exit codes by whose fault it is, and the exceptions that carry them."""

from collections.abc import Callable
from typing import TypeVar

from coupler_protocol.problems import SceneError

Result = TypeVar("Result")

DONE, COMMAND_LINE, SCENE, ENVIRONMENT, PEER, PHYSICS, OURSELVES, NOT_AT_REST, INTERRUPTED = 0, 2, 3, 4, 5, 6, 7, 8, 130

MEANING = {
    DONE: "done",
    COMMAND_LINE: "command line",
    SCENE: "scene",
    ENVIRONMENT: "environment (port, disk, permission, installation)",
    PEER: "the other side",
    PHYSICS: "physics (the computation blew up)",
    OURSELVES: "a fault of this program",
    NOT_AT_REST: "done, but a stage did not come to rest, or a target of a calibration was missed (only with --strict)",
    INTERRUPTED: "interrupted",
}


def code_of(error: BaseException) -> int:
    """Exit code of an exception, by whose fault it is; OURSELVES for all exceptions without a code."""
    if isinstance(error, RunEnded):
        return error.code
    return SCENE if isinstance(error, SceneError) else ENVIRONMENT if isinstance(error, OSError) else OURSELVES


class RunEnded(Exception):  # noqa: N818 (an end of a run, not always an error)
    """End of a run before its last stage; `code` gives whose fault it is."""

    code = OURSELVES


class FinishedBefore(RunEnded):
    """The run in a folder is finished: there is nothing to compute."""

    code = DONE


class EnvironmentFailed(RunEnded):
    """A port, a file, a folder or what is installed cannot be used."""

    code = ENVIRONMENT


class PeerLost(RunEnded):
    """The other side was silent for too long, failed, or has another version of the protocol."""

    code = PEER


class PhysicsFailed(RunEnded):
    """The computation is unstable, a zone turned inside out, or the like."""

    code = PHYSICS


class Interrupted(RunEnded):
    """A user or the launcher asked the run to stop."""

    code = INTERRUPTED


def end_as_physics(work: Callable[[], Result]) -> Result:
    """Returns `work()`; raises PhysicsFailed for an ArithmeticError of a model."""
    try:
        return work()
    except ArithmeticError as error:
        raise PhysicsFailed(str(error)) from error
