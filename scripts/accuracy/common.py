"""What the workloads share: medians of timings that never overlap and the picture of error against time.

A workload is a module beside this one, such as `accuracy/w1_holes.py`, with

    TITLE, READ, PICTURE, COLUMNS     heading, three sentences how to read it, name of its PNG, {key: heading} of its table
    run(fast) -> list of row dicts    draw(rows, path)

Rows have at least: case, method, error, seconds, spread, repeats, order, reference. `scripts/accuracy_cost.py` finds workloads by
their names, prints their tables, and writes their sections of docs/accuracy.md.
"""

import contextlib
import fcntl
import gc
import statistics
import tempfile
import time
from pathlib import Path

LOCK = Path(tempfile.gettempdir()) / "colluvium-timing.lock"


@contextlib.contextmanager
def alone():
    """Wait until nobody else on this machine takes a timing with these scripts; nobody will until this block ends."""
    with LOCK.open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def timed(compute, repeats=3):
    """Median of the seconds that `compute()` takes, (largest - smallest)/median, and what its last call returned.

    Call it once before on something small: the first use of a kernel compiles it or loads it from disk.
    """
    seconds = []
    with alone():
        for _ in range(repeats):
            gc.collect()
            begin = time.perf_counter()
            result = compute()
            seconds.append(time.perf_counter() - begin)
    middle = statistics.median(seconds)
    return middle, (max(seconds) - min(seconds)) / middle, result


def curves(axes, rows, label="method"):
    """Draw error [%] against seconds, both logarithmic, one curve for each value of `label`, in the order of the rows."""
    for name in dict.fromkeys(row[label] for row in rows):
        own = [row for row in rows if row[label] == name]
        seconds, errors = [row["seconds"] for row in own], [100.0 * abs(row["error"]) for row in own]
        axes.loglog(seconds, errors, marker="o", markersize=3.5, linewidth=1.2, label=name)
    from matplotlib.ticker import LogLocator, NullFormatter

    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("wall time [s]")
    axes.set_ylabel("error [%]")
    axes.grid(True, which="major", color="#e4e4e4", linewidth=0.6)
