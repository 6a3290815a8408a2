"""Where the points of a sweep are computed: on workers of Dask, on this machine or on a cluster.

    None             worker processes on this machine, which end with this one
    tcp://HOST:PORT  a scheduler that runs already
    FILE             one that wrote its address there (dask scheduler --scheduler-file FILE)
    slurm            workers that Slurm starts, as ~/.config/dask/jobqueue.yaml says (dask-jobqueue)

Workers need the folder of the sweep under the same path, and this version of the project.
"""

import logging
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from importlib.metadata import version
from pathlib import Path
from typing import Any

from coupler_protocol import exits

ARRIVAL = 30.0  # [s] for the scheduler to answer, and for the first worker of this machine
INSTALL = "pip install 'colluvium[sweep]'"


@contextmanager
def client_of(where: str | None, workers: int) -> Iterator[Any]:
    """A client of Dask; raises EnvironmentFailed where there is no scheduler, or Dask is not installed."""
    try:
        import dask
        import distributed
    except ModuleNotFoundError as error:
        raise exits.EnvironmentFailed(f"{error.name} is missing: {INSTALL}") from None
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what matters is said by the sweep
    with ExitStack() as stack:
        stack.enter_context(dask.config.set({"logging.distributed": "critical"}))  # of workers that are started here
        if where is None:
            # One point a worker: a killed process ends one point. `dashboard_address`: no port for a page of Dask.
            where = stack.enter_context(
                distributed.LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    host="127.0.0.1",
                    dashboard_address=None,
                    silence_logs=logging.CRITICAL,
                )
            )
        elif where == "slurm":
            where = stack.enter_context(_slurm(workers))
        else:
            _refuse(where)
        given: dict[str, Any] = {"scheduler_file": where} if _is_file(where) else {"address": where}
        try:
            client = stack.enter_context(distributed.Client(**given, timeout=ARRIVAL, set_as_default=False))
        except (OSError, ValueError) as error:  # the time-out of Dask is an OSError
            raise exits.EnvironmentFailed(
                f"no scheduler of Dask answers at {where}: {error}. Is it running (dask scheduler), and is its port open?"
            ) from None
        _refuse_other_versions(client)
        yield client


def processors() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _is_file(where: Any) -> bool:
    return isinstance(where, str) and "://" not in where


def _refuse(where: str) -> None:
    if _is_file(where) and not Path(where).is_file():
        raise exits.EnvironmentFailed(
            f"--cluster {where}: there is no such file; give tcp://HOST:PORT, slurm, or the file of `dask scheduler"
            " --scheduler-file FILE`"
        )


def _slurm(workers: int) -> Any:
    """Workers that Slurm starts."""
    try:
        from dask_jobqueue import SLURMCluster
    except ModuleNotFoundError as error:
        raise exits.EnvironmentFailed(f"{error.name} is missing: {INSTALL}") from None
    try:
        cluster = SLURMCluster(scheduler_options={"dashboard": False, "dashboard_address": None})  # no port for a page of Dask
        cluster.scale(jobs=workers)
    except (ValueError, TypeError, OSError) as error:
        raise exits.EnvironmentFailed(
            f"Slurm cannot start workers: {error}. Set jobqueue.slurm in ~/.config/dask/jobqueue.yaml (docs/cluster.md)"
        ) from None
    return cluster


def _version_here() -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version("colluvium")
    except PackageNotFoundError:
        return "none"


def _refuse_other_versions(client: Any) -> None:
    """Raises EnvironmentFailed for workers that have another version of this project, or none."""
    own, found = version("colluvium"), client.run(_by_value(_version_here), on_error="return")
    wrong = {where: said for where, said in found.items() if said != own}
    if wrong:
        told = ", ".join(f"{where} has {said if isinstance(said, str) else repr(said)}" for where, said in wrong.items())
        raise exits.EnvironmentFailed(f"workers need colluvium {own}: {told}. Install the same version there")


def _by_value(function: Any) -> Any:
    """A function that a worker without this project can call: its code travels, not its name."""
    from types import FunctionType

    moved = FunctionType(function.__code__, {"__builtins__": __builtins__}, function.__name__)
    moved.__module__ = "__main__"
    return moved
