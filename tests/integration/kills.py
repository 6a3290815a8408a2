"""Sudden ends of a run in this process: as at a kill, no side saves, reports or says anything any more."""

from contextlib import contextmanager

import pytest

from colluvium.running import threads
from coupler_protocol.process import server
from dem_server.procedure.discs_alone import DiscsAlone
from dem_server.procedure.window_side import DiscreteSide
from fdm_server.procedure.grid_side import ContinuumSide


class Killed(BaseException):
    """Stands for SIGKILL."""


@contextmanager
def kill_where(cls, method, condition):
    """Ends a side before a call of its method when condition(side, *arguments) holds."""
    original = getattr(cls, method)

    def killing(self, *words, **more):
        if condition(self, *words):
            raise Killed
        return original(self, *words, **more)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cls, method, killing)
        patch.setattr(server, "after_failure", lambda work: None)
        yield


def kill_at(step, cls=ContinuumSide):
    """Ends the grid (DiscreteSide: the discs; DiscsAlone) at the end of this step, or of the next one that is seen."""
    method = "_chunk" if cls is DiscsAlone else "record"
    return kill_where(cls, method, lambda side, *words: side.steps >= step)


def killed_run(scene, out, killing, **options):
    """Computes a scene into a folder until it is killed."""
    out.mkdir(exist_ok=True)
    with killing, pytest.raises((Killed, Exception)) as found:
        threads.run(scene, out, **options)
    assert found.type is Killed, found.value


def goes_on(scene, out, **options):
    """Computes the scene again into the same folder, to its end."""
    threads.run(scene, out, **options)


__all__ = ["ContinuumSide", "DiscreteSide", "DiscsAlone", "Killed", "goes_on", "kill_at", "kill_where", "killed_run"]
