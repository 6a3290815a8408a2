"""Trials of a laboratory: one scene of discs alone for every sample, stress and seed.

fill    the discs are packed, without friction unless lab.press = "rough", and without bonds (but those inside of clusters)
press   servo walls bring the sample to its confining stress
bond    friction, rolling resistance and bonds of the scene begin; the sample comes to rest
test    walls move at the rate of the test
unload  (oedometer) the upper wall goes back by half of its way
"""

from typing import Any, NamedTuple

from colluvium.lab.loading import Loading, loading
from colluvium.lab.specimen import FASTEST, Specimen, specimen

FRICTION = ("friction", "rolling")  # effects that begin after a smooth press
BONDS = ("bond", "parallel_bond")  # effects that begin after every press
REST, PRESS_STEPS, BOND_STEPS = 1e-5, 60000, 20000  # ratio and budgets of the stages before the test
SEATED = 2e-3  # ratio of a Brazilian disc before the test, which only few discs hold on its plates
SOLID = ("radius", "spread", "grading", "packing", "porosity", "stiffness")  # keys of [discs] that samples have as well
STONES = ("content", "size", "vertices", "flatness", "gap", "azimuth", "shapes")  # keys of [stones] that samples have as well


class Trial(NamedTuple):
    """One test: `sample` (soil, clump, cluster), `pressure` [Pa], `seed`, its loading, body and the tables of its scene."""

    kind: str
    sample: str
    pressure: float
    seed: int
    factor: float
    loading: Loading
    body: Specimen
    tables: dict[str, Any]

    @property
    def name(self) -> str:
        """Name of the folder of the trial."""
        slow = f".rate{self.factor:g}" if self.factor != 1.0 else ""
        return f"{self.sample}.{self.pressure / 1e3:g}kPa.seed{self.seed}{slow}"

    @property
    def discs(self) -> float:
        """Estimated number of discs."""
        discs, grown = self.tables["discs"], self.body.width * self.body.height
        share = 0.785 if self.kind == "brazilian" else 1.0
        return share * grown * (1.0 - discs["porosity"]) / (3.1416 * discs["radius"] ** 2)

    @property
    def disc_steps(self) -> float:
        """Estimated work: discs times steps of test, press and packing."""
        return self.discs * (self.loading.steps * (1.5 if self.kind == "oedometer" else 1.0) + 12000.0)


def samples_of(scene: Any) -> list[str]:
    """Samples that the laboratory of a scene tests."""
    default = ["soil"] if scene.stones is None else ["soil", scene.stones.body]
    return list(scene.lab.samples or default)


def trials_of(kind: str, scene: Any, factors: tuple[float, ...] = (1.0,)) -> list[Trial]:
    """All trials of a test of a scene, for every factor of the rate; a Brazilian disc has no confining stress."""
    stresses = [0.0] if kind == "brazilian" else scene.lab.confinement
    return [
        trial(kind, scene, sample, pressure, seed, factor)
        for factor in factors
        for sample in samples_of(scene)
        for seed in scene.lab.seeds
        for pressure in stresses
    ]


def trial(kind: str, scene: Any, sample: str, pressure: float, seed: int, factor: float = 1.0) -> Trial:
    """The trial of one sample at one stress."""
    body = specimen(kind, scene.discs.radius, scene.lab)
    content = scene.stones.content if sample != "soil" else 0.0
    load = loading(kind, scene, body, pressure, content, factor)
    tables = {
        "format": 1,
        "title": f"{kind} test of {scene.title or 'discs'}, {sample}, {pressure / 1e3:g} kPa",
        "seed": seed,
        "units": scene.units,
        "window": [{"name": "sample", "polygon": body.outline}],
        "discs": _discs(scene, sample, load, body),
        "ring": {"spring": _plain(scene.discs.soil.spring)},
        "record": {"every": max(1, -(-load.steps // 10)), "history": max(1, load.steps // scene.lab.points)},
        "stage": _stages(kind, scene, sample, load, body),
    }
    if sample != "soil":
        tables["stones"] = {"body": sample} | {k: v for k, v in _plain(scene.stones).items() if k in STONES}
    return Trial(kind, sample, pressure, seed, factor, load, body, tables)


def _plain(table: Any) -> dict[str, Any]:
    return table.model_dump(mode="json", exclude_none=True)


def _later(scene: Any, of_stone: bool) -> tuple[str, ...]:
    """Effects of a material that begin after the press."""
    return (*(FRICTION if scene.lab.press == "smooth" else ()), *(() if of_stone else BONDS))


def _materials(scene: Any, sample: str) -> tuple[list[str], list[Any]]:
    """Materials of discs in a sample, and tables of pairs of them."""
    names = ["soil"] if sample == "soil" else ["soil", "stone"]
    return names, [pair for pair in scene.discs.pair if set(pair.between) <= set(names)]


def _discs(scene: Any, sample: str, load: Loading, body: Specimen) -> dict[str, Any]:
    """The table [discs] while a sample is packed and pressed."""
    names, pairs = _materials(scene, sample)
    plain = _plain(scene.discs)
    table = {key: plain[key] for key in SOLID if key in plain} | {"confinement": load.confinement, "damping": {"local": 0.7}}
    if table.get("grading"):
        del table["spread"]
    for name in names:
        later = _later(scene, name == "stone" and sample == "cluster")
        table[name] = {key: value for key, value in plain[name].items() if key not in later}
    kept = []
    for pair in pairs:
        later = _later(scene, set(pair.between) == {"stone"} and sample == "cluster")
        kept.append({key: value for key, value in _plain(pair).items() if key not in later})
    table["pair"] = [pair for pair in kept if set(pair) - {"between"}]
    walls = []
    for name, wall in body.walls.items():
        servo = {"servo": _servo(load, scene)} if wall.presses else {}
        walls.append({"name": name, "ends": wall.ends} | servo)
    return table | {"wall": walls}


def _servo(load: Loading, scene: Any) -> dict[str, float]:
    return {"pressure": load.pressure, "fastest": FASTEST * scene.discs.radius}


def _stages(kind: str, scene: Any, sample: str, load: Loading, body: Specimen) -> list[dict[str, Any]]:
    """The stages of a trial after those that the module lists."""
    press = {"name": "press", "kind": "discs", "until": {"ratio": REST, "steps": PRESS_STEPS}}
    begins = {"discs": found} if (found := _begins(scene, sample)) else {}
    rest = SEATED if kind == "brazilian" else REST
    bond = {"name": "bond", "kind": "discs", "until": {"ratio": rest, "steps": BOND_STEPS}} | begins
    speed = load.rate * body.height
    test = {"name": "test", "kind": "discs", "until": {"steps": load.steps}, "wall": _motion(body, scene, load, speed)}
    stages: list[dict[str, Any]] = [{"name": "fill"}, *([] if kind == "brazilian" else [press]), bond, test]
    if kind == "oedometer":
        back = _motion(body, scene, load, -speed)
        stages.append({"name": "unload", "kind": "discs", "until": {"steps": max(1, load.steps // 2)}, "wall": back})
    return stages


def _begins(scene: Any, sample: str) -> dict[str, Any]:
    """The table [stage.discs] with which friction and bonds begin, at all contacts with a gap up to lab.bond_gap."""
    names, pairs = _materials(scene, sample)
    plain = _plain(scene.discs)
    table: dict[str, Any] = {"bond_gap": scene.lab.bond_gap} if any(set(BONDS) & set(plain[name]) for name in names) else {}
    for name in names:
        later = _later(scene, name == "stone" and sample == "cluster")
        if changes := {key: plain[name][key] for key in later if key in plain[name]}:
            table[name] = changes
    found = []
    for pair in map(_plain, pairs):
        changes = {key: value for key, value in pair.items() if key in (*FRICTION, *BONDS)}
        found += [{"between": pair["between"]} | changes] if changes else []
    return table | ({"pair": found} if found else {})


def _motion(body: Specimen, scene: Any, load: Loading, speed: float) -> list[dict[str, Any]]:
    """The tables [[stage.wall]] of the walls that move in the test."""
    found: list[dict[str, Any]] = []
    for name, wall in body.walls.items():
        if wall.moves != (0.0, 0.0):
            found.append({"name": name, "velocity": [speed * share for share in wall.moves]})
        elif wall.presses and not wall.keeps:
            found.append({"name": name})
    return found
