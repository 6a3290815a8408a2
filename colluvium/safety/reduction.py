"""Strength of zones and discs divided by a factor F, as tables of the stage that a trial adds to the scene.

Zones: fdm_server/fos/reduction.py. Discs, at contacts between them and with control discs:

    mu_F = mu/F     mur_F = mur/F     strengths of bonds (force) and of parallel bonds (stress)/F

A broken bond does not heal, so a factor below 1 makes the remaining bonds stronger, not the broken ones.
"""

from typing import Any

from coupler_protocol.scene.changes import GRAINS, after_stage
from coupler_protocol.scene.declare import Effect
from fdm_server.fos.reduction import reduced

STRENGTHS = {
    "friction": ("coefficient",),
    "rolling": ("coefficient",),
    "bond": ("tension", "shear"),
    "parallel_bond": ("tension", "shear"),
}
NO_STRENGTH = ("spring", "damping", "dashpot")
OF_ZONES = {"mohr_coulomb": ("friction", "cohesion", "dilation"), "tension": ("strength",)}
RULE = "discs: friction, rolling resistance and strengths of bonds are divided by F, also at control discs"


def changes(scene: Any, factor: float) -> dict[str, Any]:
    """Tables `material`, `discs` and `ring` of a stage after the last one of a scene that divide its strength by `factor`."""
    now = after_stage(scene, len(scene.stage) - 1)
    found: dict[str, Any] = {"material": [], "discs": _of_holder(now.discs, factor)}
    for material in reduced(now.material, factor, scene.fos):
        found["material"].append({"name": material.name} | _of_material(material, scene.fos))
    if now.ring is not None:
        found["ring"] = _divided(now.ring, factor)
    return {key: tables for key, tables in found.items() if tables}


def reduced_discs(discs: Any, factor: float) -> Any:
    """The table [discs] with its strengths divided by `factor`."""
    update: dict[str, Any] = {name: _weaker(table, factor) for name in GRAINS if (table := getattr(discs, name)) is not None}
    return discs.model_copy(update=update | {"pair": [_weaker(pair, factor) for pair in discs.pair]})


def unknown(discs: Any, ring: Any) -> list[tuple[str, str]]:
    """(table, effect) of all effects of which it is not known what a factor divides: laws of other distributions."""
    holders = [(f"discs.{name}", getattr(discs, name)) for name in GRAINS]
    holders += [("discs.pair", pair) for pair in discs.pair] + [("discs", discs), ("ring", ring)]
    known = (*STRENGTHS, *NO_STRENGTH)
    return [
        (place, name)
        for place, table in holders
        if table is not None
        for name in type(table).model_fields
        if isinstance(getattr(table, name), Effect) and name not in known
    ]


def _of_holder(discs: Any, factor: float) -> dict[str, Any]:
    found: dict[str, Any] = {}
    for name in GRAINS:
        table = getattr(discs, name)
        if table is not None and (divided := _divided(table, factor)):
            found[name] = divided
    pairs = [{"between": list(pair.between)} | _divided(pair, factor) for pair in discs.pair]
    if pairs := [pair for pair in pairs if len(pair) > 1]:
        found["pair"] = pairs
    return found


def _divided(holder: Any, factor: float) -> dict[str, Any]:
    """{effect: {key: value}} of the strengths of a table over `factor`."""
    tables = {name: getattr(holder, name, None) for name in STRENGTHS}
    return {
        name: {key: getattr(table, key) / factor for key in STRENGTHS[name]}
        for name, table in tables.items()
        if table is not None
    }


def _weaker(holder: Any, factor: float) -> Any:
    update = {name: getattr(holder, name).model_copy(update=keys) for name, keys in _divided(holder, factor).items()}
    return holder.model_copy(update=update)


def _of_material(material: Any, table: Any) -> dict[str, Any]:
    """Strengths of a reduced material of zones; the tensile one where the factor divides it."""
    found = {}
    for name, keys in OF_ZONES.items():
        law = getattr(material, name)
        if law is not None and (name != "tension" or table.tension == "reduced"):
            found[name] = {key: getattr(law, key) for key in keys}
    if material.softening is not None:
        found["softening"] = material.softening.model_dump(mode="json", exclude_none=True)
    return found
