"""`colluvium check`: description of the computation of a scene, its effects that act and those that do not."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from colluvium.forecast import window_stiffness
from colluvium.forecast.window_stiffness import Stiffness
from coupler_protocol.files import disc_csv
from coupler_protocol.files.room import disk_free, megabytes
from coupler_protocol.geometry import polygon_area
from coupler_protocol.scene.changes import changes_anything_in, changes_in, words
from coupler_protocol.scene.local_origin import local
from coupler_protocol.scene.of_window import of_windows
from coupler_protocol.scene.rules.between_tables import listed_doubts
from coupler_protocol.scene.rules.sizes import checkpoint_of, files_of, frames_of, memory_of
from coupler_protocol.scene.rules.units import as_written
from coupler_protocol.scene.scene import declared_effects
from coupler_protocol.scene.schedule import large_strain, new_boundaries, plan
from coupler_protocol.scene.tables.grading import grading_of
from coupler_protocol.scene.tables.stages import is_real


def effects(scene: Any) -> list[dict[str, Any]]:
    """Rows of effects that could act: {"effect", "summary", "acts", "where"}; `where`: names of the tables that switch it on."""
    rows = []
    for place, cls in declared_effects().items():
        if not _concerns(scene, place):
            continue
        where = list(_tables(scene, place))
        summary = (cls.__doc__ or "").strip().splitlines()[0]
        rows.append({"effect": place, "summary": summary, "acts": bool(where), "where": where})
    return rows


def _concerns(scene: Any, place: str) -> bool:
    """Whether an effect of this place could act: those of the ground need a grid, those of discs need discs."""
    of_discs = place.startswith(("grain.", "discs."))
    return (scene.discs if of_discs else scene.grid) is not None


def _tables(scene: Any, place: str) -> list[str]:
    """Yields names of the scene's tables with the effect that is declared for `place`."""
    parent, _, key = place.rpartition(".")
    if not parent:
        holders = [("scene", scene)]
    elif parent == "material":
        holders = [(f"material {m.name!r}", m) for m in scene.material]
    elif parent == "grain":
        discs = scene.discs
        holders = [*_grains("discs", discs), ("ring", scene.ring)] if discs else [("ring", scene.ring)]
    else:
        holders = [(parent, getattr(scene, parent, None))]
    holders += _holders_in_windows(scene, parent)
    holders += _holders_in_stages(scene, parent)
    return [name for name, holder in holders if holder is not None and getattr(holder, key, None) is not None]


def _grains(name: str, discs: Any) -> list[tuple[str, Any]]:
    """(name, table) of all materials and pairs of a table of discs."""
    pairs = [(f"{name}.pair {' and '.join(pair.between)}", pair) for pair in discs.pair]
    return [(f"{name}.soil", discs.soil), (f"{name}.stone", discs.stone), *pairs]


def _holders_in_windows(scene: Any, parent: str) -> Iterator[tuple[str, Any]]:
    """Yields (name, table) of the tables of windows that give effects of this place and do not leave them out."""
    for window in scene.window:
        if window.discs is None:
            continue
        name = f"window {window.name!r} discs"
        for what, table in {"grain": _grains(name, window.discs), "discs": [(name, window.discs)]}.get(parent, []):
            yield what, SimpleNamespace(**{key: c for key, c in changes_in(table).items() if not c.absent})


def _holders_in_stages(scene: Any, parent: str) -> Iterator[tuple[str, Any]]:
    """Yields (name, table) of the tables of stages that change effects of this place and do not end them."""
    for stage in scene.stage:
        grains = [("ring", stage.ring)]
        if stage.discs is not None:
            grains += [("discs.soil", stage.discs.soil), ("discs.stone", stage.discs.stone)]
            grains += [(f"discs.pair {' and '.join(p.between)}", p) for p in stage.discs.pair]
        places = {"grain": grains, "discs": [("discs", stage.discs)]}
        places["material"] = [(f"material {table.name!r}", table) for table in stage.material]
        tables = places.get(parent, [])
        for name, table in tables:
            there = {key: change for key, change in changes_in(table).items() if not change.absent}
            if there:
                yield f"{name} from stage {stage.name!r} on", SimpleNamespace(**there)


def sizes(scene: Any) -> dict[str, Any]:
    """Numbers of zones, gridpoints, segments and discs, and sizes of windows, that follow from the scene alone."""
    if scene.grid is None:
        return {"windows": [], "stones": _plain(scene.stones)}
    from fdm_server.mesh.grid import build_grid
    from fdm_server.mesh.window_zones import window_rim, window_zones

    scene = local(scene)
    grid = build_grid(scene)
    windows, stiffness = [], {found.name: found for found in window_stiffness.of_windows(scene, grid)}
    for window, own in of_windows(scene):
        rim = window_rim(grid, window_zones(grid, window))
        outline, is_open = grid.xy[rim.outline], rim.surface is not None
        (width, height), area = np.ptp(outline, axis=0).tolist(), polygon_area(outline)
        discs = (1 - own.discs.porosity) * area / (0.7853981633974483 * grading_of(own.discs).moment(2))
        sizes = {"width": width, "height": height, "area": area, "segments": len(rim.nodes) - is_open, "discs": round(discs)}
        sizes |= {"open": True} if is_open else {}
        if window.name in stiffness:
            _, young, zones = stiffness[window.name]
            sizes |= {"young": young, "young_zones": zones}
        windows.append({"name": window.name, **sizes, **_differs(window, own)})
    counts: dict[str, Any] = {"columns": int(grid.column.max()) + 1, "rows": int(grid.row.max()) + 1}
    counts |= {"zones": len(grid.zones), "gridpoints": len(grid.xy), "materials": materials(scene, grid)}
    begins = {"begins": list(scene.origin)} if any(scene.origin) else {}
    return {**counts, **begins, "windows": windows, "stones": _plain(scene.stones)}


def _plain(table: Any) -> Any:
    """Plain data of a table; None for none."""
    return None if table is None else table.model_dump(mode="json")


def _differs(window: Any, own: Any) -> dict[str, Any]:
    """What a window has of its own: {"radius", "file" of discs, "stones"}."""
    found = {} if window.discs is None else {"radius": own.discs.radius}
    found |= file_of_discs(own) if window.discs is not None and window.discs.file is not None else {}
    return found | ({} if window.stones is None else {"stones": _plain(window.stones)})


def materials(scene: Any, grid: Any) -> list[dict[str, Any]]:
    """Rows of all materials: zones and area of the mesh, area drawn [m2], both pairs of moduli."""
    from fdm_server.checks.materials import laid_out
    from fdm_server.effects.elastic import poisson_ratio, young_modulus

    rows = []
    for material, laid in zip(scene.material, laid_out(scene, grid), strict=True):
        moduli = {"bulk": material.elastic.bulk, "shear": material.elastic.shear}
        moduli |= {"young": young_modulus(material.elastic), "poisson": poisson_ratio(material.elastic)}
        rows.append({"name": material.name, "zones": laid.zones, "area": laid.area, "drawn": laid.drawn, **moduli})
    return rows


def materials_as_text(rows: list[dict[str, Any]]) -> Iterator[str]:
    """Yields a line for every material."""
    for m in rows:
        drawn = f"{m['area']:.4g} m2 (drawn {m['drawn']:.4g})"
        pairs = f"K {as_written(m['bulk'])}, G {as_written(m['shear'])} Pa (E {as_written(m['young'])} Pa, nu {m['poisson']:.3g})"
        yield f"material {m['name']}: {m['zones']} zones, {drawn}, {pairs}"


def _stones_as_text(stones: dict[str, Any], where: str = "each window") -> str:
    if stones["file"]:
        return f"stones: as mapped in {stones['file']}, each a {stones['body']}; beyond a window: {stones['outside']}"
    words = f"stones: {100 * stones['content']:g} % of {where}, each a {stones['body']}"
    words += f", mean size {stones['size']['mean']:g} m"
    return words + (f", shaped as in {stones['shapes']}" if stones["shapes"] else "")


def stages(scene: Any) -> list[dict[str, Any]]:
    """Rows of all stages: name, kind, gravity, end and boundaries."""
    return [
        {"name": s.name, "kind": s.kind, "gravity": leg.gravity, "factor": [leg.start, leg.end], "over": leg.over}
        | {"until": s.until.model_dump(exclude_none=True) if s.until else {}, "discard": s.discard}
        | {"changes": _changes(scene, i) if changes_anything_in(s) else []}
        | {"time": s.time, "large_strain": large_strain(scene, s), "sides": [b.summary for b in new_boundaries(scene, i)]}
        for i, (s, leg) in enumerate(zip(scene.stage, plan(scene), strict=True))
    ]


def _changes(scene: Any, index: int) -> list[str]:
    """What changes from a stage on, also of the discs of windows with their own."""
    found = words(scene, index)
    own = [(window, text) for window, own in of_windows(scene) if window.discs is not None for text in words(own, index)]
    return [*found, *(f"window {window.name!r}: {text}" for window, text in own if text not in found)]


def file_of_discs(scene: Any) -> dict[str, Any]:
    """Numbers of discs and stones in the scene's file, {} without a file; raises SceneError if it cannot be read."""
    if scene.discs is None or scene.discs.file is None:
        return {}
    found = disc_csv.read(scene.discs.file)
    stones = 0 if found.stone is None else len(np.unique(found.stone[found.stone >= 0]))
    return {"file": {"path": scene.discs.file, "discs": len(found.radius), "stones": stones}}


def describe(scene: Any) -> dict[str, Any]:
    """All of the above in one dictionary."""
    found = {"title": scene.title, "hash": scene.digest(), **file_of_discs(scene), **sizes(scene)}
    found |= {"memory_MB": memory_of(local(scene)), "frames": frames_of(scene), "files_MB": files_of(local(scene))}
    found |= {"checkpoint_MB": checkpoint_of(local(scene))}
    found |= {"effects": effects(scene), "stages": stages(scene)}
    stiffness = [Stiffness(w["name"], w["young"], w["young_zones"]) for w in found["windows"] if "young" in w]
    return found | {"doubts": [*listed_doubts(scene), *window_stiffness.doubts(scene, stiffness), *lack_of_disk(scene)]}


def lack_of_disk(scene: Any, folder: str | Path = ".") -> list[dict[str, str]]:
    """A doubt, as a row of `listed_doubts`, if the disk of `folder` has no room for the files of the scene."""
    needed, free = 1e6 * files_of(local(scene)), disk_free(folder)
    if free is None or needed <= free:
        return []
    what = f"up to {frames_of(scene):,} frames and the checkpoints need about {megabytes(int(needed))} before compression, "
    remedy = f"record fewer frames: record.every = {int(scene.record.every * max(needed / max(free, 1), 2.0)) + 1}"
    return [{"key": "record.every", "what": f"{what}{megabytes(free)} are free", "remedy": remedy}]


def opening(scene: Any, folder: str | Path = ".") -> Iterator[str]:
    """What a run into `folder` says before it starts: zones and areas of materials, and doubts."""
    stiffness: list[Stiffness] = []
    if scene.grid is not None:
        from fdm_server.mesh.grid import build_grid

        here = local(scene)
        grid = build_grid(here)
        yield from [beginning(here.origin)] if any(here.origin) else []
        yield from materials_as_text(materials(here, grid))
        stiffness = list(window_stiffness.of_windows(here, grid))
    for doubt in [*listed_doubts(scene), *window_stiffness.doubts(scene, stiffness), *lack_of_disk(scene, folder)]:
        yield f"worth a second look: {doubt['key']}: {doubt['what']}; {doubt['remedy']}"


def beginning(origin: Sequence[float]) -> str:
    """A sentence for a grid that does not begin at (0, 0)."""
    x, y = origin
    return f"the grid begins at x = {x:.12g}, y = {y:.12g} m, about which the scene is computed"


def _filling(window: dict[str, Any]) -> str:
    """Discs of a window in words."""
    if "file" in window:
        return f"{window['file']['discs']} discs in {window['file']['path']}"
    return f"about {window['discs']} discs" + (f" of its own, radius {window['radius']:g} m" if "radius" in window else "")


def print_description(found: dict[str, Any], console: Any) -> None:
    """Prints a description; `found["locate"]`, `found["limits"]`: results of these modules, if they were computed."""
    from colluvium.forecast import step_limits
    from colluvium.forecast.locate import as_text

    second = f", {len(found['doubts'])} worth a second look (at the end)" if found["doubts"] else ""
    console.print(f"{found['title'] or 'scene'}: no problems found{second}", markup=False)
    if "zones" in found:
        console.print(
            f"grid of {found['zones']} zones in {found['columns']} columns and {found['rows']} rows, "
            f"{found['gridpoints']} gridpoints"
        )
        if "begins" in found:
            console.print(beginning(found["begins"]))
        for line in materials_as_text(found["materials"]):
            console.print(line, markup=False)
    else:
        console.print("no grid: discs alone")
    for w in found["windows"]:
        console.print(
            f"window {w['name']}: {w['width']:.3f} x {w['height']:.3f} m, {w['area']:.4g} m2, {w['segments']} segments, "
            + ("open at the ground surface, " if w.get("open") else "")
            + _filling(w),
            markup=False,
        )
        if "stones" in w:
            console.print(f"  {_stones_as_text(w['stones'], 'this window')}", markup=False)
        if "young" in w:
            moduli = (
                f"E of its contacts about {as_written(w['young'])} Pa, of the zones it replaces {as_written(w['young_zones'])} Pa"
            )
            console.print(f"window {w['name']}: {moduli}", markup=False)
    if "file" in found:
        file = found["file"]
        of_stones = f" in {file['path']}, {file['stones']} stones" if file["stones"] else f" in {file['path']}"
        console.print(f"{file['discs']} discs{of_stones}", markup=False)
    if any(found["memory_MB"].values()):
        parts = [f"{name} {size:.2g} MB" for name, size in found["memory_MB"].items() if size]
        console.print(f"memory, approximately: {', '.join(parts)}, beside that of the programs")
    if found["frames"]:
        console.print(
            f"files: up to {found['frames']:,} frames, about {megabytes(int(1e6 * found['files_MB']))} before compression"
        )
    if found["checkpoint_MB"]:
        size = megabytes(int(1e6 * found["checkpoint_MB"]))
        console.print(f"checkpoints inside of stages: about {size} each, as much memory while one is written; two stay")
    if found["stones"]:
        console.print(_stones_as_text(found["stones"]), markup=False)
    console.print("effects that act:")
    for row in found["effects"]:
        if row["acts"]:
            console.print(f"  {row['effect']:<24} {row['summary']} ({', '.join(row['where'])})", markup=False)
    console.print("effects that do not act (no table in the scene, no code in the kernels):")
    for row in found["effects"]:
        if not row["acts"]:
            console.print(f"  {row['effect']:<24} {row['summary']}", markup=False)
    console.print("stages:")
    for s in found["stages"]:
        until = ", ".join(f"{k} {v}" if isinstance(v, str) else f"{k} {v:g}" for k, v in s["until"].items())
        ramp = f"{s['factor'][0]:g} to {s['factor'][1]:g} g over {s['over']} steps" if s["over"] else f"{s['factor'][1]:g} g"
        more = (", real time" if is_real(s["time"]) else "") + (", large strain" if s["large_strain"] else "")
        more += f", until {until}" if until else ""
        ramp = ramp if s["gravity"] else "no gravity"
        console.print(f"  {s['name']:<14} {s['kind']:<12} {ramp}{more}", markup=False)
        if s["changes"]:
            console.print(f"    from here on: {'; '.join(s['changes'])}", markup=False)
        if s["sides"]:
            console.print(f"    sides from here on: {', '.join(s['sides'])}", markup=False)
    for sentence in as_text(found["locate"]) if found.get("locate") else ():
        console.print(sentence, markup=False)
    for sentence in step_limits.sentences(found["limits"]) if "limits" in found else ():
        console.print(sentence, markup=False)
    for doubt in found["doubts"]:
        console.print(f"worth a second look: {doubt['key']}: {doubt['what']}\n    {doubt['remedy']}", markup=False)
