"""Answer of a calibration: tables ready to paste, answers with their scatter, cost; and a copy of the scene with the tables."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from colluvium.calibration import verdict
from colluvium.calibration.laboratory import SampleTests
from colluvium.calibration.parameters import tables_of
from colluvium.calibration.search import Outcome
from colluvium.calibration.study import Plan
from colluvium.lab.strength import strength_of
from colluvium.lab.summary import strength_in_words
from coupler_protocol import exits

NAME, TABLES = "answer.json", "discs.toml"


def found(plan: Plan, scene: Any, outcome: Outcome, laboratory: SampleTests, seconds: float) -> dict[str, Any]:
    """The answer as plain data; `words`: lines to print, `toml`: tables to paste."""
    rows = verdict.rows_of(plan.targets.goals, outcome.answers)
    tables, spent = tables_of(scene, outcome.values), laboratory.spent()
    strength = _line(laboratory, outcome)
    cost = f"{spent.tests} tests in {len({str(t.values) for t in outcome.trials})} sets, {spent.processor:.0f} processor seconds"
    lost = [seed for seed in (*scene.calibrate.seeds, *scene.calibrate.check) if seed not in outcome.seeds]
    missing = [f"without seeds {', '.join(map(str, lost))}, whose tests failed: give calibrate.check others"] if lost else []
    words = [
        *missing,
        *verdict.lines(rows, outcome, plan.space),
        *([f"peak: {strength_in_words(strength)}"] if strength else []),
        cost,
    ]
    return {
        "reached": all(row.reached for row in rows),
        "ended": outcome.ended,
        "parameters": outcome.values,
        "goals": verdict.as_json(rows),
        "strength": strength,
        "seeds": list(outcome.seeds),
        "sample": plan.sample,
        "source": plan.targets.source,
        "tests": spent.tests,
        "seconds_of_runs": spent.seconds,
        "processor_seconds": spent.processor,
        "seconds": seconds,
        "sets": [
            {"number": t.number, "stage": t.stage, "parameters": t.values, "seeds": list(t.seeds), "merit": t.merit}
            for t in outcome.trials
        ],
        "tables": tables,
        "toml": toml_of(tables, plan, scene, rows),
        "words": words,
    }


def _line(laboratory: SampleTests, outcome: Outcome) -> dict[str, Any] | None:
    """c and phi of the tests of the answer, with their scatter."""
    own = [
        row["answers"] | {"seed": row["seed"], "pressure": row["pressure"]}
        for row in laboratory.used.values()
        if row["parameters"] == outcome.values and row["seed"] in outcome.seeds and not row["short"]
    ]
    return strength_of("biaxial", own, "peak") if own else None


def toml_of(tables: dict[str, dict[str, Any]], plan: Plan, scene: Any, rows: Sequence[verdict.Row]) -> str:
    """The tables as TOML, with the answers as a comment."""
    answers = ", ".join(f"{row.goal.label} {row.goal.words(row.mean)}" for row in rows)
    lines = [f"# {plan.sample}, radius {scene.discs.radius:g} m: {answers} (colluvium calibrate)"]
    for material, effects in tables.items():
        lines.append(f"[discs.{material}]")
        density = getattr(scene.discs, material).density
        lines.append(f"density = {density!r}")
        kept = getattr(scene.discs, material).model_dump(mode="json", exclude_none=True)
        for effect, keys in (effects | {name: keys for name, keys in kept.items() if name not in effects}).items():
            if isinstance(keys, dict):
                lines.append(f"{effect} = {{ {', '.join(f'{key} = {_number(value)}' for key, value in keys.items())} }}")
    return "\n".join(lines) + "\n"


def _number(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:.4g}".replace("e+0", "e").replace("e+", "e") if abs(value) >= 1e5 else f"{value:g}"
    return json.dumps(value)


def write(answer: dict[str, Any], out: Path) -> None:
    """Writes the answer and the tables into the folder of the calibration."""
    (out / NAME).write_text(json.dumps(answer, indent=1) + "\n", encoding="utf-8")
    (out / TABLES).write_text(answer["toml"], encoding="utf-8")


def toml_writer() -> Any:
    """The library that keeps the comments of a TOML file; raises EnvironmentFailed if it is not installed."""
    try:
        import tomlkit
    except ModuleNotFoundError:
        raise exits.EnvironmentFailed("tomlkit is missing: pip install 'colluvium[calibrate]'") from None
    return tomlkit


def write_scene(source: Path, overrides: Sequence[str], tables: dict[str, dict[str, Any]], target: Path) -> None:
    """Writes a copy of the scene at `source` with these tables of discs; comments and order of its keys stay.

    Relative paths of files change with the folder of the copy.
    """
    from coupler_protocol.scene.named_files import move_paths
    from coupler_protocol.scene.reader import override, read_scene

    tomlkit = toml_writer()
    document = tomlkit.parse(source.read_text(encoding="utf-8-sig"))
    override(document, overrides)
    move_paths(document, source.parent, target.parent)
    for material, effects in tables.items():
        for effect, keys in effects.items():
            place = document["discs"][material]
            if effect not in place:
                place[effect] = tomlkit.inline_table()
            for key, value in keys.items():
                place[effect][key] = tomlkit.parse(f"v = {_number(value)}")["v"]
    text = tomlkit.dumps(document)
    target.parent.mkdir(parents=True, exist_ok=True)
    target.write_text(text, encoding="utf-8")
    read_scene(target, needs_files=False)
