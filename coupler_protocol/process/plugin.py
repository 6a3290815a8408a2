"""Functions of a user that are called while a side computes, and may read and change its model and state.

    on_step(moment)     after every so many steps
    on_stage(moment)    at the end of each stage, before its State is saved

A `Moment` is one side after a step: the grid (rank 0) or a window (from 1). The run continues with the changes of the functions.
If on_step returns a text for the grid, the next step is the last one of the stage, and the text is the reason for its end.
In one process they are called in the thread of each side, so two calls may run at the same time.
"""

import importlib.util
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from coupler_protocol.exits import EnvironmentFailed, RunEnded
from coupler_protocol.files.restart import FUNCTIONS


class Moment(NamedTuple):
    """One side after a step. model, state: of fdm_server.model or dem_server.model; their arrays may be changed.

    origin: point [m] of the scene from which their positions count.
    """

    rank: int
    stage: str
    step: int  # since the run began
    model: Any
    state: Any
    origin: tuple[float, float] = (0.0, 0.0)


Function = Callable[[Moment], Any]


def unchecked(moment: Moment) -> None:
    """Asks nothing of what a function has left."""


class Plugin(NamedTuple):
    """Functions that are called; `every`: steps between calls of on_step."""

    name: str
    on_step: Function | None = None
    on_stage: Function | None = None
    every: int = 1

    def step(self, moment: Moment, check: Function = unchecked) -> str:
        """Calls on_step if it is due, and then check(moment); returns the text of on_step, or "".

        Raises EnvironmentFailed if on_step fails.
        """
        if self.on_step is None or moment.step % self.every:
            return ""
        said = self._call(self.on_step, moment)
        check(moment)
        return said if isinstance(said, str) else ""

    def stage(self, moment: Moment, check: Function = unchecked) -> None:
        """Calls on_stage, and then check(moment). Raises EnvironmentFailed if on_stage fails."""
        if self.on_stage is not None:
            self._call(self.on_stage, moment)
            check(moment)

    def _call(self, function: Function, moment: Moment) -> Any:
        try:
            return function(moment)
        except RunEnded:
            raise
        except Exception as error:
            where = f"{self.name}, rank {moment.rank}, step {moment.step}, stage {moment.stage!r}"
            raise EnvironmentFailed(f"the plugin failed ({where}): {type(error).__name__}: {error}") from error


def interval_of(plugin: Plugin | None) -> int:
    """Steps between calls of on_step; 0: it is never called."""
    return 0 if plugin is None or plugin.on_step is None else plugin.every


def from_functions(on_stage: Function | None = None, on_step: tuple[int, Function] | None = None) -> Plugin | None:
    """Plugin of `colluvium.run`, None without functions: on_stage a function, on_step a pair (steps between calls, function)."""
    if on_stage is None and on_step is None:
        return None
    every, function = on_step or (1, None)
    if not _is_count(every):
        raise ValueError(f"on_step is (steps between calls, function), at least 1 step, not {on_step!r}")
    return Plugin(FUNCTIONS, function, on_stage, every)


def _is_count(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 1


def from_file(path: str | Path) -> Plugin:
    """Plugin of a Python file: functions on_step and on_stage, or one of them, and EVERY, the steps between calls (1).

    Raises EnvironmentFailed if the file cannot be run, or has neither function.
    """
    spec = importlib.util.spec_from_file_location("colluvium_plugin", path)
    try:
        if spec is None or spec.loader is None:
            raise ImportError("no Python file by its name")
        module = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(module)
    except Exception as error:
        raise EnvironmentFailed(f"the plugin {path} cannot be run: {type(error).__name__}: {error}") from error
    on_step, on_stage = (getattr(module, name, None) for name in ("on_step", "on_stage"))
    every = getattr(module, "EVERY", 1)
    if not (callable(on_step) or callable(on_stage)):
        raise EnvironmentFailed(f"the plugin {path} has neither on_step nor on_stage")
    if not _is_count(every):
        raise EnvironmentFailed(f"the plugin {path}: EVERY is a whole number of steps from 1, not {every!r}")
    return Plugin(str(path), on_step, on_stage, every)
