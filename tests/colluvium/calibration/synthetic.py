"""A laboratory with a closed form: packings that are softer and weaker than the estimates, whose samples scatter."""

import numpy as np

from colluvium.calibration.parameters import space_of
from colluvium.calibration.search import Search
from colluvium.calibration.study import plan_of, prior_of, with_table
from colluvium.calibration.targets import strength_name
from coupler_protocol.scene.reader import build_scene

PRESSURES = (5e4, 1e5, 2e5)
SOIL = {
    "density": 2000.0,
    "spring": {"normal": 5e7, "shear": 2e7},
    "friction": {"coefficient": 0.55},
    "bond": {"tension": 1.5e3, "shear": 3.5e3},
}


def scene_of(calibrate=None, lab=None, **discs):
    """A scene of discs alone with [calibrate]."""
    return with_table(
        build_scene(
            {
                "format": 1,
                "seed": 1,
                "window": [{"name": "box", "polygon": [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]}],
                "discs": {"radius": 0.03, "soil": SOIL} | discs,
                "lab": {"confinement": list(PRESSURES)} | (lab or {}),
                "stage": [{"name": "fill"}, {"name": "rest", "kind": "discs", "until": {"steps": 10}}],
            }
            | ({"calibrate": calibrate} if calibrate is not None else {})
        )
    )


def exact(values):
    """Answers of an infinite sample: stiffness falls with friction's slip, friction saturates, rolling resistance adds to it."""
    ratio, mu, rolling = values["ratio"], values["friction"], values.get("rolling", 0.0)
    sine = 0.36 * mu / (mu + 0.25) + 1.2 * rolling
    passive = (1.0 + sine) / (1.0 - sine)
    tension = 9.0 * values["bond"] * (1.0 + 0.3 * np.log(mu / 0.3))
    strengths = {strength_name(p): (passive - 1.0) * (0.9 * p + tension) for p in PRESSURES}
    found = {"young": 0.34 * values["normal"] * ratio**0.22, "poisson": 0.33 - 0.2 * ratio**0.7}
    return found | strengths | {"dilation": 60.0 * sine - 8.0}


class Synthetic:
    """Tests with a closed form: each seed's sample deviates by `scatter`, each test by `noise` (relative)."""

    def __init__(self, scatter=0.08, noise=0.02, fails=None):
        self.scatter, self.noise, self.fails, self.calls = scatter, noise, fails, []

    def cost(self, short):
        return 1 if short else len(PRESSURES)

    def measure(self, values, seeds, short):
        self.calls.append((dict(values), tuple(seeds), short))
        found = {}
        for seed in seeds:
            if self.fails and self.fails(values, seed):
                continue
            mean = exact(values)
            sample = np.random.default_rng(seed)
            test = np.random.default_rng([seed, *np.round(1e6 * np.array(list(values.values()))).astype(int).tolist()])
            deviations = {name: np.exp(self.scatter * sample.normal() + self.noise * test.normal()) for name in sorted(mean)}
            names = ("young", "poisson") if short else mean
            found[seed] = {name: mean[name] * deviations[name] * (1.06 if short else 1.0) for name in names}
        return found


def searched(calibrate, laboratory, most=100, said=None, **discs):
    """Outcome of a search, and its plan."""
    scene = scene_of({"tests": most, "tolerance": 0.05} | calibrate, **discs)
    plan, problems = plan_of(scene, None)
    assert not problems
    say = said.append if said is not None else (lambda text: None)
    search = Search(plan.space, plan.targets.goals, prior_of(plan, scene), laboratory, most, say)
    return search.run(scene.calibrate.seeds, scene.calibrate.check), plan


__all__ = ["PRESSURES", "SOIL", "Synthetic", "exact", "scene_of", "searched", "space_of"]
