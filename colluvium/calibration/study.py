"""Plan of a calibration: sample, targets, free parameters; its search and what it would cost."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from colluvium.calibration.laboratory import SampleTests
from colluvium.calibration.parameters import KEYS, Space, Values, estimate_of, space_of
from colluvium.calibration.search import NoAnswerError, Outcome, Search, in_words
from colluvium.calibration.targets import Targets, targets_of
from colluvium.forecast.packing_moduli import solid_of_plane
from colluvium.lab.study import SPEED
from coupler_protocol.scene.tables.calibrate import Calibrate

Finding = tuple[str, str, str]  # key, problem, remedy
GUESS = 8  # sets of a search, for the estimate of its cost: four with short tests, four with full ones


class Plan(NamedTuple):
    """What is fitted: the sample and its content of stones, targets, free parameters."""

    sample: str
    content: float
    targets: Targets
    space: Space


def with_table(scene: Any) -> Any:
    """The scene with the table [calibrate], that of defaults if it has none."""
    return scene if scene.calibrate is not None else scene.model_copy(update={"calibrate": Calibrate()})


def plan_of(scene: Any, folder: Path) -> tuple[Plan | None, list[Finding]]:
    """The plan of a scene, or None, and its problems; curves are read from `folder`."""
    table, problems = scene.calibrate, _of_discs(scene)
    sample = table.sample or ("soil" if scene.stones is None else scene.stones.body)
    if sample != "soil" and (scene.stones is None or scene.stones.content is None):
        problems.append(("calibrate.sample", "the scene has no [stones] with a content", 'add them, or sample = "soil"'))
    targets, found = targets_of(scene, folder)
    problems += found
    if problems:
        return None, problems
    if len([goal for goal in targets.goals if goal.pressure]) == 1 and {"friction", "bond"} <= set(table.vary):
        why = "one stress does not tell cohesion from friction"
        return None, [("lab.confinement", why, "give two stresses or more, or remove friction or bond from calibrate.vary")]
    content = scene.stones.content if sample != "soil" else 0.0
    return Plan(sample, content, targets, space_of(scene, targets, content)), []


def _of_discs(scene: Any) -> list[Finding]:
    """Reasons for which parameters of the discs cannot be varied."""
    if scene.discs is None:
        return [("discs", "the scene has no discs", "add a [discs] table")]
    if scene.discs.soil.spring is None:
        return [("discs.soil", "the discs have no stiffness", "add spring = { normal = .., shear = .. }")]
    found: list[Finding] = []
    vary = set(scene.calibrate.vary)
    if scene.discs.soil.parallel_bond is not None and "bond" in vary:
        found.append(
            ("discs.soil.parallel_bond", "calibrate fits contact bonds", "remove the table, or 'bond' from calibrate.vary")
        )
    for number, pair in enumerate(scene.discs.pair):
        own = [KEYS[name] for name in vary if getattr(pair, KEYS[name], None) is not None]
        if set(pair.between) == {"soil"} and own:
            why = f"its {own[0]} replaces that of discs.soil, which varies"
            found.append((f"discs.pair[{number}]", why, "move its values to discs.soil"))
    return found


def prior_of(plan: Plan, scene: Any) -> Callable[[Values], np.ndarray]:
    """Estimated scaled answers of the goals at a set of parameters."""

    def prior(values: Values) -> np.ndarray:
        found = estimate_of(scene, values, plan.content)
        poisson = (found.bulk - found.shear) / (found.bulk + found.shear)
        solid = solid_of_plane(found.young_plane, poisson)
        plain = {"young": solid.young, "poisson": solid.poisson, "dilation": 0.0}
        return np.array(
            [goal.scaled(found.strength(goal.pressure) if goal.pressure else plain[goal.name]) for goal in plan.targets.goals]
        )

    return prior


def search(plan: Plan, scene: Any, laboratory: SampleTests, say: Callable[[str], None]) -> Outcome | None:
    """The result of the search; None if no test of the start has answers."""
    table = scene.calibrate
    found = Search(plan.space, plan.targets.goals, prior_of(plan, scene), laboratory, table.tests, say)
    try:
        return found.run(table.seeds, table.check)
    except NoAnswerError:
        return None


def opening(plan: Plan, scene: Any) -> list[str]:
    """What is fitted, as lines of text."""
    goals = ", ".join(f"{goal.label} {goal.words(goal.value)}" for goal in plan.targets.goals)
    sample = plan.sample if plan.sample == "soil" else f"{plan.sample}s, content {plan.content:g}"
    return [
        f"targets: {goals} ({plan.targets.source})",
        f"sample: {sample}, radius {scene.discs.radius:g} m, porosity {scene.discs.porosity:g}",
        f"start: {in_words(plan.space.start)}; varies: {', '.join(plan.space.names)}",
    ]


def forecast(plan: Plan, scene: Any, laboratory: SampleTests, at_once: int) -> list[str]:
    """What a search would cost, as lines of text."""
    table, seeds = scene.calibrate, len(scene.calibrate.seeds)
    start = plan.space.start
    work = {
        short: sum(laboratory.trial(start, p, table.seeds[0], short).disc_steps for p in laboratory.pressures_of(short)) / SPEED
        for short in (True, False)
    }
    has_strength = any(goal.pressure for goal in plan.targets.goals)
    sets = GUESS // 2
    parts = [(sets * seeds, True)] + [(sets * seeds + len(table.check), False)] * has_strength
    tests = sum(count * laboratory.cost(short) for count, short in parts)
    seconds = sum(count * work[short] for count, short in parts)
    kept = f"; {len(laboratory.rows)} are kept" if laboratory.rows else ""
    return [
        f"about {tests} tests, at most {table.tests}{kept}; {at_once} at once",
        f"about {seconds / at_once:.0f} s on {at_once} idle cores, without compilation ({SPEED:.0e} disc-steps a second)",
    ]
