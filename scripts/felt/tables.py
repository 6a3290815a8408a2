"""Table and picture of scripts/window_felt.py."""

from pathlib import Path
from typing import Any

import numpy as np
from pages import write_section

from colluvium.figures import style

HEAD = (
    "| window | crest, {at} [%] | rim, rms, {at} [%] | mean xx [%] | yy [%] | xy [%] | E [MPa] | nu | at rest [g] | moves [g] | "
    "failure [%] |"
)
COLOURS = ("#c1502e", "#3b6fa0", "#5b9a54", "#8c6bb1")


def spread(values: list[float], form: str) -> str:
    """Mean ± standard deviation over the seeds; "-" without values."""
    if not values:
        return "-"
    text = f"{np.mean(values):{form}}"
    return text if len(values) == 1 else f"{text} ± {np.std(values, ddof=1):{form.lstrip('+')}}"


def failure(limits: dict[str, Any]) -> float | None:
    """Gravity at failure [g]: the middle between rest and motion; None if no level moves."""
    return None if limits["moves_at"] is None else 0.5 * (limits["rests_at"] + limits["moves_at"])


def line_of(name: str, rows: list[dict[str, Any]], results: dict[str, Any]) -> str:
    """The row of a scene."""
    at = f"{results['at']:g}"
    found = [row["levels"][at] for row in rows if at in row["levels"]]
    percent = [spread([100.0 * row[key] for row in found], "+.1f") for key in ("crest", "rim", "xx", "yy", "xy")]
    percent[1] = percent[1].lstrip("+")
    ends = [spread([row[key] for row in rows if row[key] is not None], ".2f") for key in ("rests_at", "moves_at")]
    alone, failed = failure(results["alone"]), [value for row in rows if (value := failure(row)) is not None]
    last = spread([100.0 * (value / alone - 1.0) for value in failed], "+.1f") if alone else "-"
    solid = [spread([row["E"] / 1e6 for row in found], ".0f"), spread([row["nu"] for row in found], ".2f")]
    return "| " + " | ".join([name, *percent, *solid, *ends, last]) + " |"


def table(results: dict[str, Any]) -> str:
    """Markdown: one row a scene, after that of the continuum alone."""
    alone = results["alone"]
    moves = f"{alone['moves_at']:.2f}" if alone["moves_at"] is not None else "-"
    lines = [HEAD.format(at=f"1 to {results['at']:g} g"), "|---" * 11 + "|"]
    E, nu = f"{alone['E'] / 1e6:.0f}", f"{alone['nu']:.2f}"
    lines.append(f"| none: the continuum alone | 0 | 0 | 0 | 0 | 0 | {E} | {nu} | {alone['rests_at']:.2f} | {moves} | 0 |")
    lines += [line_of(name, rows, results) for name, rows in results["scenes"].items()]
    return "\n".join(lines)


def into_page(page: Path, results: dict[str, Any]) -> None:
    """Writes the table and the number of seeds into its section of a page."""
    seeds = ", ".join(str(row["seed"]) for row in next(iter(results["scenes"].values())))
    write_section(page, "window felt", f"{table(results)}\n\nMeans ± standard deviations over seeds {seeds}.")


@style.styled
def figure(results: dict[str, Any]) -> Any:
    """Settlement of the crest and difference of the rim over gravity; each seed a line, a cross where it last rests."""
    import matplotlib.pyplot as plt

    drawn, (left, right) = plt.subplots(1, 2, figsize=(7.0, 2.8), layout="constrained")
    for (name, rows), colour in zip(results["scenes"].items(), COLOURS, strict=False):
        for row in rows:
            gravity = [1.0, *map(float, row["levels"])]
            crest, rim = ([0.0, *(level[key] for level in row["levels"].values())] for key in ("crest_coupled", "rim"))
            label = name if row is rows[0] else None
            left.plot(gravity, [1e3 * value for value in crest], color=colour, linewidth=0.9, marker=".", label=label)
            right.plot(gravity[1:], [100.0 * value for value in rim[1:]], color=colour, linewidth=0.9, marker=".", label=label)
            left.axvline(row["rests_at"], color=colour, linewidth=0.5, linestyle=":")
    longest = max((row["levels"] for rows in results["scenes"].values() for row in rows), key=len)
    crest = [0.0, *(1e3 * level["crest_alone"] for level in longest.values())]
    left.plot([1.0, *map(float, longest)], crest, color=style.INK, linewidth=1.2, label="continuum alone")
    left.axvline(results["alone"]["rests_at"], color=style.INK, linewidth=0.5, linestyle=":")
    left.set_ylabel("settlement of the crest since 1 g [mm]")
    right.set_ylabel("difference of the rim, rms [%]")
    right.set_ylim(bottom=0.0)
    for axes in (left, right):
        axes.set_xlabel("gravity, held [g]")
    left.legend()
    return drawn


def draw(results: dict[str, Any], path: Path) -> None:
    """Writes the picture as PNG."""
    import matplotlib.pyplot as plt

    drawn = figure(results)
    path.parent.mkdir(parents=True, exist_ok=True)
    drawn.savefig(path, dpi=100)
    plt.close(drawn)
