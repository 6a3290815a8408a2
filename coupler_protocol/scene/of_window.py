"""The scene of one window: its discs and stones are those of the scene, with what the window's own tables say.

A window may have the table [window.discs], with the keys of [discs] that differ in this window, and [window.stones] in place of
[stones]. The discrete process of a window computes the scene that `of_window` returns: whoever reads `scene.discs` there reads
the discs of the window. Changes of later stages ([stage.discs]) act on the discs of every window.
"""

from typing import Any

from coupler_protocol.scene.changes import GRAINS, changes_in
from coupler_protocol.scene.local_origin import local

INSTEAD = {"spread": ("grading",), "grading": ("spread", "radius"), "file": ("file_hash",)}  # keys that a given one replaces
OWN = ("discs", "stones")  # tables of a window


def has_own_tables(window: Any) -> bool:
    """Whether a window has tables of discs or stones."""
    return any(getattr(window, key) is not None for key in OWN)


def of_window(scene: Any, rank: int) -> Any:
    """The local scene with discs and stones of the window of `rank`; the same object if this window has no tables of its own.

    Raises pydantic's ValidationError for tables that do not fit together, which no scene has that was read.
    """
    scene = local(scene)
    window = scene.window[rank - 1]
    if not has_own_tables(window):
        return scene
    update = {} if window.stones is None else {"stones": window.stones}
    if window.discs is not None:
        update["discs"] = discs_of(scene, window.discs)
    found = scene.model_copy(update=update)
    found.note_drawn(scene.drawn, scene.origin)
    return found


def of_windows(scene: Any) -> list[tuple[Any, Any]]:
    """(window, its scene) of all windows."""
    return [(window, of_window(scene, rank)) for rank, window in enumerate(scene.window, start=1)]


def scenes_of_discs(scene: Any) -> list[tuple[int | None, Any]]:
    """(rank, scene) for all different tables of discs and stones; rank None: those of the scene, if any window has them."""
    own = [rank for rank, window in enumerate(scene.window, start=1) if has_own_tables(window)]
    shared = [(None, scene)] if len(own) < len(scene.window) or not scene.window else []
    return [*shared, *((rank, of_window(scene, rank)) for rank in own)]


def discs_of(scene: Any, own: Any) -> Any:
    """The table [discs] of the scene with the keys of a window's table `own`; raises ValidationError as `of_window` does."""
    return type(scene.discs).model_validate(_merged(scene.discs.model_dump(exclude_none=True), own))


def _merged(plain: dict[str, Any], own: Any) -> dict[str, Any]:
    """Plain data of [discs] with the keys that a window gives."""
    tables = {*GRAINS, "pair", *changes_in(own)}
    given = own.model_dump(exclude_none=True, exclude=tables)
    for key in given:
        plain = {name: value for name, value in plain.items() if name not in INSTEAD.get(key, ())}
    plain = _with_effects(plain | given, own)
    for grain in GRAINS:
        table = getattr(own, grain)
        if table is not None:
            keys = table.model_dump(exclude_none=True, exclude=set(changes_in(table)))
            plain[grain] = _with_effects(plain.get(grain, {}) | keys, table)
    pairs = {frozenset(pair["between"]): pair for pair in plain.get("pair", ())}
    for pair in own.pair:
        names = frozenset(pair.between)
        pairs[names] = _with_effects(pairs.get(names, {"between": pair.between}), pair)
    return plain | {"pair": list(pairs.values())}


def _with_effects(plain: dict[str, Any], table: Any) -> dict[str, Any]:
    """Plain data of a table with the effects that the Changes in `table` give."""
    for name, change in changes_in(table).items():
        before = plain.get(name)
        plain = {key: value for key, value in plain.items() if key != name}
        if not change.absent:
            plain[name] = change.effect.after_change(before or {}, change.given())
    return plain
