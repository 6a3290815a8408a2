"""Rows in the one form of all our benchmarks, repeated timings, and what the memory of this machine gives in the same run."""

import json
import time
from math import comb
from pathlib import Path
from statistics import median

import numpy as np

from coupler_protocol.compiled.jit import jit


def row(name, size, values, unit, companion, note="", threads=1):
    """One row: median and spread, (largest - smallest)/median, of `values`; `companion`: reference loops of the same run."""
    spread = (max(values) - min(values)) / median(values)
    return {
        "name": name, "size": size, "threads": threads, "value": median(values), "unit": unit, "repeats": len(values),
        "spread": spread, "companion": companion, "note": note,
    }  # fmt: skip


def ratio_row(name, size, ratios, companion, note=""):
    """Row of a ratio, whose note says how well its median is known."""
    low, high = bounds(ratios)
    known = f"95 % bounds of the median {low:.3f} .. {high:.3f}, {len(ratios)} turns"
    return row(name, size, ratios, "-", companion, f"{known}; {note}" if note else known) | {"low": low, "high": high}


def bounds(values):
    """Bounds (low, high) that contain the median with 95 %, whatever the distribution; the extremes of fewer than six values.

    The number of values below the median has a binomial distribution.
    """
    n, rank, below = len(values), 0, 2.0 ** -len(values)
    while below <= 0.025:
        rank += 1
        below += comb(n, rank) * 2.0**-n
    ordered, first = sorted(values), max(rank, 1)
    return ordered[first - 1], ordered[-first]


def show(rows):
    """Print rows, one a line."""
    for r in rows:
        value, unit = (r["value"] / 1e6, "M " + r["unit"]) if r["unit"].endswith("/s") else (r["value"], r["unit"])
        print(
            f"{r['size']:>9} {r['threads']} thread{'s' * (r['threads'] > 1):<2} {r['name']:<62} {value:8.2f} {unit:<15} "
            f"spread {100 * r['spread']:5.1f} %  {r['note']}",
            flush=True,
        )


def write(rows, path):
    """Write rows as a JSON list."""
    Path(path).write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")


def repeated(step, steps, repeats, warm_up=50):
    """Seconds a call of `step`, `repeats` times over `steps` calls, after a warm-up."""
    for _ in range(min(warm_up, steps)):
        step()
    found = []
    for _ in range(repeats):
        begin = time.perf_counter()
        for _ in range(steps):
            step()
        found.append((time.perf_counter() - begin) / steps)
    return found


def seconds_of_step(take, steps, clock=time.perf_counter):
    """Seconds of one step, from one call take(steps)."""
    begin = clock()
    take(steps)
    return (clock() - begin) / steps


def in_turns(measures, turns):
    """What each of `measures` (functions without arguments) gives, `turns` times.

    Every other turn goes backwards, so that a machine that becomes slower or faster favours none of them.
    """
    found = [[] for _ in measures]
    for turn in range(turns):
        for number in range(len(measures))[:: -1 if turn % 2 else 1]:
            found[number].append(measures[number]())
    return found


def over(a, b):
    """Ratios a/b turn by turn."""
    return [x / y for x, y in zip(a, b, strict=True)]


@jit(package="fdm_server")
def _triad(a, b, c):
    for i in range(a.shape[0]):
        a[i] = b[i] + 3.0 * c[i]


def triad(repeats, n=8_000_000):
    """Bandwidths [GB/s] of a = b + 3 c in one thread, over arrays far larger than the caches (24 bytes an element)."""
    b, c, a = np.ones(n), np.ones(n), np.zeros(n)
    return [24e-9 * n / seconds for seconds in repeated(lambda: _triad(a, b, c), 3, repeats)]
