"""Summary of a laboratory: means and scatter over seeds of every number, strengths, and tests at two rates beside each other."""

from collections.abc import Sequence
from math import sqrt
from typing import Any

import numpy as np

from colluvium.lab.strength import deviation, strength_of

SMALL = 0.02  # change of an answer that counts as none, as few seeds can agree by chance
NO_RATE = ("side_bias", "side_error", "kinetic_share")  # numbers about the test itself, which follow the rate
PLACE = ("name", "sample", "pressure", "seed", "factor")  # keys of a row that are no answer


def summary(kind: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Answers by sample; rows: one a trial, with the keys PLACE and the numbers of `colluvium.lab.answers`."""
    full = [row for row in rows if row["factor"] == 1.0]
    found: dict[str, Any] = {"kind": kind, "samples": {}, "trials": list(rows)}
    for sample in dict.fromkeys(row["sample"] for row in full):
        own = [row for row in full if row["sample"] == sample]
        found["samples"][sample] = {"means": _by_pressure(own)} | _strengths(kind, own)
    slower = [row for row in rows if row["factor"] != 1.0]
    if slower:
        found["rates"] = rates(full, slower)
    return found


def _by_pressure(rows: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Mean, standard deviation and number of samples of every answer at each stress."""
    found = []
    for pressure in sorted({row["pressure"] for row in rows}):
        own = [row for row in rows if row["pressure"] == pressure]
        entry: dict[str, Any] = {"pressure": pressure, "samples": len(own)}
        for name in own[0]:
            if name not in PLACE:
                values = [row[name] for row in own]
                entry[name] = {"mean": float(np.mean(values)), "sd": deviation(values)}
        found.append(entry)
    return found


def _strengths(kind: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    if kind not in ("biaxial", "shear"):
        return {}
    return {when: strength_of(kind, rows, when) for when in ("peak", "residual")}


def rates(full: Sequence[dict[str, Any]], slower: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """For every answer and sample: mean difference of the same trials at two rates, and the scatter over seeds."""
    found = []
    for sample in dict.fromkeys(row["sample"] for row in slower):
        for name in [key for key in slower[0] if key not in (*PLACE, *NO_RATE)]:
            pairs = [(row[name], other[name], row["pressure"]) for row in slower for other in full if _same(row, other, sample)]
            if not pairs:
                continue
            slow, fast = np.array([pair[:2] for pair in pairs]).T
            scatter = _pooled([row for row in full if row["sample"] == sample], name)
            entry = {"sample": sample, "answer": name, "full": float(fast.mean()), "slower": float(slow.mean())}
            change = float((slow - fast).mean())
            found.append(entry | {"change": change, "scatter": scatter, "within": _within(change, scatter, entry["full"])})
    return found


def _within(change: float, scatter: float | None, value: float) -> bool | None:
    """Whether a change is within two standard deviations over seeds, or SMALL of the value; None without a scatter."""
    return None if scatter is None else abs(change) <= max(2.0 * scatter, SMALL * abs(value))


def _same(row: dict[str, Any], other: dict[str, Any], sample: str) -> bool:
    return row["sample"] == sample and all(row[key] == other[key] for key in ("sample", "pressure", "seed"))


def _pooled(rows: Sequence[dict[str, Any]], name: str) -> float | None:
    """Standard deviation over seeds, pooled over stresses; None for a single seed."""
    groups = [[row[name] for row in rows if row["pressure"] == p] for p in {row["pressure"] for row in rows}]
    parts = [(len(values) - 1, deviation(values)) for values in groups]
    freedom = sum(n for n, _ in parts)
    return sqrt(sum(n * sd * sd for n, sd in parts if sd is not None) / freedom) if freedom else None


# -- in words --------------------------------------------------------------------------------------------------------------

UNITS = {  # answer: its unit, what it is divided by, digits
    "E": ("MPa", 1e6, 1), "nu": ("", 1.0, 3), "E2": ("MPa", 1e6, 1), "nu2": ("", 1.0, 3), "K2": ("MPa", 1e6, 1),
    "G": ("MPa", 1e6, 1), "peak_axial": ("kPa", 1e3, 1), "residual_axial": ("kPa", 1e3, 1), "peak_strain": ("%", 0.01, 2),
    "dilation": ("deg", 1.0, 1), "stiffness": ("MPa", 1e6, 1), "M": ("MPa", 1e6, 1), "M_unload": ("MPa", 1e6, 1),
    "K0": ("", 1.0, 3), "tension": ("kPa", 1e3, 2), "stored_share": ("% of work", 0.01, 1), "lost_share": ("% of work", 0.01, 1),
    "side_bias": ("%", 0.01, 2), "bonds_broken": ("", 1.0, 0),
}  # fmt: skip


def as_lines(found: dict[str, Any]) -> list[str]:
    """The summary as lines of text."""
    lines = [f"{found['kind']} test"]
    for sample, own in found["samples"].items():
        for when in ("peak", "residual"):
            if own.get(when):
                lines.append(f"{sample}: {when} {strength_in_words(own[when])}")
        for entry in own["means"]:
            parts = [f"{name} {value_in_words(name, entry[name])}" for name in UNITS if name in entry]
            place = f" at {entry['pressure'] / 1e3:g} kPa" if entry["pressure"] else ""
            lines.append(f"{sample}{place}: {', '.join(parts)}")
    if found.get("rates"):
        lines += rates_in_words(found["rates"])
    return lines


def rates_in_words(rows: Sequence[dict[str, Any]]) -> list[str]:
    """What half the rate changes, as lines of text; rows: those of `rates`."""
    own = [row for row in rows if row["answer"] in UNITS]
    lines = []
    for row in own:
        if row["within"] is False:
            what = f"{row['answer']} changes by {row['change']:.3g}, scatter over seeds {row['scatter']:.3g}"
            lines.append(f"{row['sample']}: half the rate changes more than the scatter: {what}: lower lab.rate")
    if lines:
        return lines
    known = any(row["within"] for row in rows)
    return ["half the rate changes no answer by more than twice its scatter" if known else "half the rate: one seed, no scatter"]


def strength_in_words(found: dict[str, Any]) -> str:
    """A strength with its scatter and window."""
    scatter = [
        f" ± {value:.2g}" if value is not None else "" for value in (found["c_sd"] and found["c_sd"] / 1e3, found["phi_sd"])
    ]
    low, high = (value / 1e3 for value in found["window"])
    return (
        f"c {found['c'] / 1e3:.1f}{scatter[0]} kPa, phi {found['phi']:.1f}{scatter[1]} deg from {low:.0f} to {high:.0f} kPa "
        f"({found['samples']} seeds, largest misfit {abs(100.0 * found['misfit']):.0f} %)"
    )


def value_in_words(name: str, entry: dict[str, Any]) -> str:
    """Mean, scatter and unit of an answer."""
    unit, size, digits = UNITS[name]
    scatter = f" ± {entry['sd'] / size:.{digits}f}" if entry["sd"] is not None else ""
    return f"{entry['mean'] / size:.{digits}f}{scatter}{' ' + unit if unit else ''}"
