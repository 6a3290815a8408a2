"""Free parameters of a calibration: coordinates, bounds, start from physics, and the tables of a scene with them.

| name | parameter | of |
|---|---|---|
| normal | normal stiffness kn [N/m] | soil; the springs of stones keep their ratio to it |
| ratio | ks / kn | soil |
| friction | friction coefficient mu | soil |
| bond | tensile strength of a bond [N] | soil; its shear strength keeps its ratio to it |
| rolling | rolling coefficient mur | soil and stone |

The start inverts the estimates of packing_moduli for the targets E2, nu2, c, phi, with a content C of stones:

    K2 = a kn,  G = a (kn + ks) / 2:   r = ks/kn = 2 G / K2 - 1 within its bounds,   kn = E2 (3 + r) / (4 a (1 + r))       (1)
    sin phi = (1 - C) 0.85 sin(atan mu) + C                                                                              (2)
    Fnb = pt / b,    pt = c / tan(phi)                                                                                   (3)

with a the stiffness K2 for a unit spring and b the tension pt for a unit bond. Coordinates are logarithms, that of
`rolling` is linear: one unit of each changes a packing about as much.
"""

from math import asin, exp, log, radians, sin, tan
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from colluvium.calibration.targets import Targets
from colluvium.forecast.packing_moduli import ROLLING, Estimate, estimate

NAMES = ("normal", "ratio", "friction", "bond", "rolling")
UNITS = {"normal": "N/m", "ratio": "", "friction": "", "bond": "N", "rolling": ""}
SYMBOLS = {"normal": "kn", "ratio": "ks/kn", "friction": "mu", "bond": "bond", "rolling": "rolling"}
KEYS = {"normal": "spring", "ratio": "spring", "friction": "friction", "bond": "bond", "rolling": "rolling"}
FAR = 30.0  # default bounds of stiffness and bonds, as a factor of their start
DIGITS = 3  # of a parameter
BRITTLE = 2.0  # shear over tensile strength of bonds that a scene does not have
START_FRICTION = 0.5  # where rolling resistance varies as well
ROLLED = 0.2  # rolling coefficient of one unit of its coordinate

Values = dict[str, float]  # parameters by name; those that a scene lacks are missing


class Space(NamedTuple):
    """Free parameters of a scene: `names` of those that vary, `bounds` of all, and the `start`."""

    names: tuple[str, ...]
    bounds: dict[str, tuple[float, float]]
    start: Values

    def coordinates(self, values: Values) -> np.ndarray:
        """(d,) coordinates of the parameters that vary."""
        return np.array([to_coordinate(name, values[name]) for name in self.names])

    def box(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds (d,) of the coordinates."""
        low, high = np.array([[to_coordinate(name, end) for end in self.bounds[name]] for name in self.names]).T
        return low, high

    def exact_values(self, coordinates: np.ndarray) -> Values:
        """Parameters at coordinates (d,)."""
        return self.start | {name: from_coordinate(name, float(x)) for name, x in zip(self.names, coordinates, strict=True)}

    def values(self, coordinates: np.ndarray) -> Values:
        """Parameters at coordinates (d,), with few digits, within the bounds."""
        found = self.exact_values(coordinates)
        for name in self.names:
            low, high = self.bounds[name]
            found[name] = min(max(float(f"{found[name]:.{DIGITS}g}"), low), high)
        return found

    def at_bound(self, values: Values, name: str) -> str:
        """'lower' or 'upper' if a parameter that varies is at this bound, else ''."""
        if name not in self.names:
            return ""
        low, high = (to_coordinate(name, end) for end in self.bounds[name])
        x = to_coordinate(name, values[name])
        return "lower" if x - low < 0.02 else "upper" if high - x < 0.02 else ""


def to_coordinate(name: str, value: float) -> float:
    """Coordinate of a parameter."""
    return value / ROLLED if name == "rolling" else log(value)


def from_coordinate(name: str, coordinate: float) -> float:
    """The parameter of a coordinate."""
    return ROLLED * coordinate if name == "rolling" else exp(coordinate)


def space_of(scene: Any, targets: Targets, content: float) -> Space:
    """Free parameters of a scene with their start; `content` of stones of the sample."""
    own = values_of(scene)
    table, bounds = scene.calibrate, {}
    start = dict(own) | {name: value for name, value in _physics(scene, targets, content).items() if name in table.vary}
    for name in table.vary:
        given = getattr(table.bounds, name)
        bounds[name] = given or (start[name] / FAR, start[name] * FAR)
        start[name] = float(f"{min(max(start[name], bounds[name][0]), bounds[name][1]):.{DIGITS}g}")
    return Space(tuple(name for name in NAMES if name in table.vary), bounds, start)


def values_of(scene: Any) -> Values:
    """Parameters that a scene has now."""
    soil = scene.discs.soil
    found = {"normal": soil.spring.normal, "ratio": soil.spring.shear / soil.spring.normal}
    found |= {"friction": soil.friction.coefficient} if soil.friction else {}
    found |= {"bond": soil.bond.tension} if soil.bond else {}
    return found | ({"rolling": soil.rolling.coefficient} if soil.rolling else {})


def _physics(scene: Any, targets: Targets, content: float) -> Values:
    """The start of Eqs (1) to (3); a parameter without a target stays as it is, or begins at a common value."""
    table, own = scene.calibrate, values_of(scene)
    low, high = table.bounds.ratio
    unit = estimate_of(scene, {"normal": 1.0, "ratio": 0.0, "bond": 1.0}, content)
    young, poisson = targets.value("young"), targets.value("poisson")
    found = {"friction": own.get("friction", START_FRICTION), "bond": own.get("bond") or 0.0, "rolling": own.get("rolling", 0.0)}
    ratio = own["ratio"]
    if poisson is not None:
        plane = poisson / (1.0 - poisson)
        ratio = min(max((1.0 - 3.0 * plane) / (1.0 + plane), low), high)
    found["ratio"] = ratio
    found["normal"] = own["normal"]
    if young is not None:
        nu = poisson if poisson is not None else 0.25
        found["normal"] = young / (1.0 - nu * nu) * (3.0 + ratio) / (4.0 * unit.bulk * (1.0 + ratio))
    if targets.friction is not None and any(goal.pressure for goal in targets.goals):
        sine = min(max((sin(radians(targets.friction)) - content) / (1.0 - content) / ROLLING, 0.05), 0.95)
        bounded = table.bounds.friction
        found["friction"] = START_FRICTION if "rolling" in table.vary else min(max(tan(asin(sine)), bounded[0]), bounded[1])
        if targets.cohesion:
            found["bond"] = targets.cohesion / tan(radians(targets.friction)) / unit.tension
    if found["bond"] <= 0.0:  # without a target of c: a tension of the mean stress
        found["bond"] = float(np.mean(scene.lab.confinement)) / unit.tension
    return found


def estimate_of(scene: Any, values: Values, content: float) -> Estimate:
    """Estimated moduli and strength of the packing with these parameters."""
    tables = {effect: SimpleNamespace(**keys) for effect, keys in tables_of(scene, values)["soil"].items()}
    soil = SimpleNamespace(**({"friction": None, "bond": None} | tables))
    discs = scene.discs
    kept = SimpleNamespace(soil=soil, pair=[], stiffness=discs.stiffness, porosity=discs.porosity, radius=discs.radius)
    return estimate(kept, content)


def tables_of(scene: Any, values: Values) -> dict[str, dict[str, Any]]:
    """Tables of `soil`, and of `stone` if there is one, that have these parameters: {material: {effect: keys}}."""
    soil, stone = scene.discs.soil, scene.discs.stone
    normal = values["normal"]
    found: dict[str, dict[str, Any]] = {"soil": {"spring": {"normal": normal, "shear": short(normal * values["ratio"])}}}
    if "friction" in values:
        found["soil"]["friction"] = {"coefficient": values["friction"]}
    if "bond" in values:
        ratio = soil.bond.shear / soil.bond.tension if soil.bond and soil.bond.tension > 0.0 else BRITTLE
        found["soil"]["bond"] = {"tension": values["bond"], "shear": short(values["bond"] * ratio)}
    rolling = {"rolling": {"coefficient": values["rolling"]}} if "rolling" in values else {}
    found["soil"] |= rolling
    if stone is not None:
        factor = normal / soil.spring.normal
        springs = {"normal": short(stone.spring.normal * factor), "shear": short(stone.spring.shear * factor)}
        found["stone"] = {"spring": springs} | rolling
    return found


def short(value: float) -> float:
    """A value with as many digits as tables need."""
    return float(f"{value:.{DIGITS + 1}g}")


def scene_with(scene: Any, values: Values) -> Any:
    """The scene whose discs have these parameters."""
    changes: dict[str, Any] = {}
    for material, tables in tables_of(scene, values).items():
        now = getattr(scene.discs, material)
        plain = now.model_dump(mode="json", exclude_none=True)
        changes[material] = type(now).model_validate(plain | tables)
    return scene.model_copy(update={"discs": scene.discs.model_copy(update=changes)})
