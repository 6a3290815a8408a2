"""Rules for a window's own tables of discs and stones, and rules about discs and stones in all windows."""

from collections.abc import Callable, Iterator
from functools import wraps
from typing import Any

from pydantic import ValidationError

from coupler_protocol.problems import Finding, KeyPath, reason_and_remedy
from coupler_protocol.scene.changes import GRAINS, changes_in
from coupler_protocol.scene.of_window import OWN, discs_of, scenes_of_discs
from coupler_protocol.scene.tables.changes import Change
from coupler_protocol.scene.tables.stones import Stones


def in_all_windows(rule: Callable[[Any], Iterator[Any]]) -> Callable[[Any], Iterator[Any]]:
    """A rule about discs and stones, for the tables of the scene and of every window: each finding once, at the window's table.

    The rule gets scenes as of `scenes_of_discs`. Its findings are tuples that begin with the path of the key.
    """

    @wraps(rule)
    def found(scene: Any) -> Iterator[Any]:
        seen = set()
        for rank, own in scenes_of_discs(scene):
            for row in rule(own):
                moved = row if rank is None else _moved(row, rank, scene.window[rank - 1])
                if moved not in seen:
                    seen.add(moved)
                    yield moved

    return found


def in_no_window(rule: Callable[[Any], Iterator[Finding]]) -> Callable[[Any], Iterator[Finding]]:
    """A rule about tables of the scene that act on discs or stones, broken if it is broken with the discs of every window."""

    @wraps(rule)
    def found(scene: Any) -> Iterator[Finding]:
        first, *others = [list(rule(own)) for _, own in scenes_of_discs(scene)]
        yield from (row for row in first if all(row in rows for rows in others))

    return found


def _moved(row: Any, rank: int, window: Any) -> Any:
    """A finding at the window's own table if its key, or a key inside, is given there."""
    path = row[0]
    table = getattr(window, path[0], None) if path[0] in OWN else None
    if table is None or not _given(table, path[1:]):
        return row
    moved = ("window", rank - 1, *(path[:2] if path[1:2] == ("pair",) else path))
    return row._replace(path=moved) if hasattr(row, "_replace") else (moved, *row[1:])


def _given(own: Any, path: KeyPath) -> bool:
    """Whether a window's table gives the key at `path`, or the table around it; that of stones gives all of them."""
    if isinstance(own, Stones):
        return True
    if path[:1] == ("pair",):
        return bool(own.pair)
    for part in path[:2]:
        own = getattr(own, part, None)
    return own is not None


def own_tables_fit(scene: Any) -> Iterator[Finding]:
    """Tables of a window have a table that they change, set something, and leave what the effects accept."""
    for i, window in enumerate(scene.window):
        for key in OWN if scene.grid is None else ():
            if getattr(window, key) is not None:
                yield ("window", i, key), "discs alone fill one window", f"give this in [{key}]"
        if window.discs is None or scene.grid is None:
            continue
        if scene.discs is None:
            yield ("window", i, "discs"), "there is no [discs] table whose keys this one replaces", "add [discs]"
            continue
        yield from _idle(("window", i, "discs"), window.discs, scene.discs)
        try:
            discs_of(scene, window.discs)
        except ValidationError as error:
            yield from (_finding(("window", i, "discs"), one) for one in error.errors())


def _idle(at: KeyPath, own: Any, before: Any) -> Iterator[Finding]:
    """Findings about tables of a window that change nothing."""
    given = own.model_dump(exclude_none=True)
    if not given or given == {"pair": []}:
        yield at, "this table changes nothing", "give the keys that differ from [discs], or remove the table"
    holders: list[tuple[KeyPath, Any, Any]] = [(at, own, before)]
    holders += [((*at, grain), getattr(own, grain), getattr(before, grain)) for grain in GRAINS]
    pairs = {frozenset(pair.between): pair for pair in before.pair}
    seen = set()
    for k, pair in enumerate(own.pair):
        names, path = frozenset(pair.between), (*at, "pair", k)
        if names in seen:
            yield (*path, "between"), f"two tables for the pair {' and '.join(pair.between)}", "give each pair one table"
        seen.add(names)
        holders.append((path, pair, pairs.get(names)))
    for path, table, there in holders:
        for name, change in changes_in(table).items():
            yield from _idle_effect((*path, name), name, change, getattr(there, name, None))


def _idle_effect(at: KeyPath, name: str, change: Change, before: Any) -> Iterator[Finding]:
    if change.absent and change.given():
        yield at, "the effect is left out and changes", "give false to leave it out, or the keys that differ"
    elif change.absent and before is None:
        yield at, f"[discs] has no {name} here that could be left out", "remove the key"
    elif not change.absent and not change.given():
        yield at, "this table changes nothing", f"give the keys that differ, or {name} = false to leave the effect out"


def _finding(at: KeyPath, error: Any) -> Finding:
    """Finding of one of pydantic's errors in the discs of a window."""
    path = (*at, *error["loc"])
    if error["type"] == "missing":
        return path, "missing", "[discs] does not have this table: give all keys that it needs"
    fits = error["ctx"]["remedy"] if error["type"] == "refused" else "the values of [discs] and of the window must fit together"
    return path, *reason_and_remedy(error["msg"].removeprefix("Value error, "), fits)


def without_misfits(scene: Any, misfits: list[Finding]) -> Any:
    """The scene without the tables of windows that findings of `own_tables_fit` name: other rules can then be checked."""
    broken = {path[1] for path, *_ in misfits}
    if not broken:
        return scene
    plain = {"discs": None, "stones": None}
    return scene.model_copy(
        update={"window": [w.model_copy(update=plain) if i in broken else w for i, w in enumerate(scene.window)]}
    )
