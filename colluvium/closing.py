"""The tables at the end of a run, from run.json."""

from collections.abc import Iterator, Sequence
from typing import Any

Info = dict[str, Any]  # content of run.json, or of a part of it

OUTCOME = ("stage", "steps", "ended by", "gravity", "ratio\ngrid", "ratio\ndiscs", "P/l vs\nstress", "bonds\nbroken")
SECONDS = ("stage", "grid\ncomputes", "grid\nwaits", "discs\ncompute", "discs\nwait", "both\nrecord")
NOTICED = 0.05  # share of the zones' stress, or of the weight it should carry, above which a sentence is printed
LOST_SHEAR = 0.1  # share of the mobilised sine of the zones from which a loss is a warning
LONG_COMPILATION = 1.0  # [s] from which compilation is mentioned
TEXT_COLUMNS = ("stage", "ended by")


def rows(info: Info) -> list[list[str]]:
    """Rows of texts for the columns OUTCOME, one for each stage, from the content of run.json."""
    table = []
    for stage in info.get("stages", []):
        coupled = bool(stage["ratio_discrete"])
        table.append(
            [
                stage["name"],
                str(stage["steps"] or ""),
                stage["ended_by"],
                _gravity(stage) if stage["steps"] else "",
                f"{stage['ratio_continuum']:.1e}" if stage["steps"] and "ratio_continuum" in stage else "",
                f"{max(stage['ratio_discrete']):.1e}" if coupled else "",
                f"{100 * max(stage['traction_difference']):.1f} %" if coupled and "traction_difference" in stage else "",
                str(sum(stage["bonds_broken"])) if coupled else "",
            ]
        )
    return table


def _gravity(stage: Info) -> str:
    return "none" if stage.get("gravity") == 0.0 else f"{stage['gravity_factor']:.2f} g"


def times(info: Info) -> list[list[str]]:
    """Rows of texts for the columns SECONDS, one for each stage; empty for a side that the scene does not have."""
    table, stages = [], info.get("stages", [])
    grid, discs = any("ratio_continuum" in stage for stage in stages), bool(info.get("windows"))
    for stage in stages:
        s = stage["seconds"]
        recording = s["recording"] + s["recording_discrete"]
        values = (s["continuum"], s["waiting"], s["discrete"], s["waiting_discrete"], recording)
        there = (grid, grid and discs, discs, grid and discs, True)
        table.append([stage["name"], *(f"{value:.2f}" if shown else "" for value, shown in zip(values, there, strict=True))])
    return table


def sentences(info: Info) -> Iterator[str]:
    """Yields sentences about windows, failure, memory and the end of the run, which the tables do not contain."""
    for window in info.get("windows", []):
        parts = [f"window {window['name']}: {window.get('discs', '?')} discs"]
        if "control_discs" in window:
            parts.append(f"{window['control_discs']} on the ring")
        if "packing_porosity" in window and "porosity" not in window:
            parts.append(
                f"packed at {window['packing_pressure'] / 1e3:.3g} kPa with porosity {_porosity(window, 'packing_porosity')}"
            )
            parts += ["loose: they do not support each other"] if window.get("loose") else []
        if window.get("largest_overlap", 0.0) > 0.01:
            deepest, energy = window["largest_overlap"], window["overlap_energy"]
            parts.append(f"overlaps in the file up to {deepest:.2g} of the smaller radius, with {energy:.3g} J in total")
        if "overlap_left" in window:
            parts.append(
                f"pushed apart in {window['drawn_apart_steps']} steps to overlaps of {window['overlap_left']:.2g} of the radius"
            )
        if "porosity" in window:
            parts.append(f"porosity {_porosity(window, 'porosity')}")
        if "stone_content" in window:
            both = 100 * window["stone_content"], 100 * window["stone_content_discs"]
            parts.append(f"{window['stones']} stones: {both[0]:.1f} % of the area, {both[1]:.1f} % of the discs")
            if window.get("stones_without_discs"):
                parts.append(f"{window['stones_without_discs']} of them contain no disc centre: they are soil")
        if "error_yy" in window:
            parts += _stress_of(window)
            parts += _beyond_reach(window)
        if "bonds_broken_tension" in window:
            parts.append(f"bonds broken {window['bonds_broken_tension']} in tension, {window['bonds_broken_shear']} in shear")
        yield ", ".join(parts)
        yield from _lost_shear(window)
        for opened in window.get("ring_opened", []):
            x, y = opened["place"]
            yield (
                f"warning: in stage {opened['stage']} a gap of {opened['radii']:.1f} r opened in the ring of "
                f"window {window['name']} at ({x:.1f}, {y:.1f}) m (r: smallest disc radius; a gap of 2 r lets a disc escape)"
            )
    yield from changes(info)
    for doubt in info.get("doubts", []):
        yield f"worth a second look: {doubt['key']}: {doubt['what']}; {doubt['remedy']}"
    yield from stretched_rims(info)
    for warning in info.get("warnings", []):
        yield f"warning: in step {warning['step']} of stage {warning['stage']}: {warning['name']}: {warning['text']}"
    yield from step_limits(info)
    yield from _exchanges(info)
    if info.get("locate"):
        from colluvium.forecast.locate import as_text as located

        yield "; ".join(located(info["locate"]))
    if info.get("band"):
        from colluvium.results.failure import as_text

        yield as_text(info["band"])
    compiled = [part["compiled"]["seconds"] for part in (info, *info.get("windows", [])) if part.get("compiled")]
    if sum(compiled) >= LONG_COMPILATION:
        yield f"kernels were compiled for {sum(compiled):.0f} s, on both sides together; later runs find them in the cache"
    memory = [info.get("peak_memory_MB"), *(window.get("peak_memory_MB") for window in info.get("windows", []))]
    if all(memory):
        yield "peak memory: grid " + ", discs ".join(f"{value:.0f} MB" for value in memory)
    seconds = f"; {info['seconds']:.1f} s" if info.get("seconds") else ""
    yield f"{info.get('reason', '')}; exit code {info.get('exit_code')}{seconds}"


def changes(info: Info) -> Iterator[str]:
    """Yields what stages changed from their start on, and what it did to stored energy and bonds."""
    windows = [change | {"window": window["name"]} for window in info.get("windows", []) for change in window.get("changes", ())]
    for stage in info.get("stages", []):
        found = stage.get("changes") or {}
        if found:
            yield f"from stage {stage['name']} on: {'; '.join(found['what'] or ['nothing changes'])}{_consequences(found)}"
        for change in windows:
            if change["stage"] == stage["name"]:
                yield f"window {change['window']} at the start of stage {stage['name']}{_consequences(change)}"


def _consequences(change: Info) -> str:
    """Text of the energies before and after a change, and of the bonds made; "" for neither."""
    parts = []
    for key, name in (("strain_energy", "strain energy of the grid"), ("stored_energy", "energy of the contacts")):
        if change.get(key):
            before, after = change[key]
            parts.append(f"{name} {before:.4g} -> {after:.4g} J")
    parts += [f"{change['bonds_made']} bonds made"] if change.get("bonds_made") else []
    return f" ({', '.join(parts)})" if parts else ""


def _exchanges(info: Info) -> Iterator[str]:
    """Yields steps and exchanges of each stage with pauses, and the stage in which pauses ended."""
    for stage in info.get("stages", []):
        if "exchanges" in stage:
            yield f"stage {stage['name']}: {stage['steps']} steps in {stage['exchanges']} exchanges"
        if stage.get("fell_back"):
            yield f"warning: both sides exchanged in every step from stage {stage['name']} on: {stage['fell_back']}"
            return


def _stress_of(window: Info) -> Iterator[str]:
    """Yields the error of the discs' stress against that of the zones (runs before 0.2.0: against what the discs could carry)."""
    if "sine_discs" not in window:
        yield f"stress within {100 * window['error_yy']:.1f} % (rms) of the slope's vertical stress"
        return
    xx, yy, xy = (f"{100 * window[f'zones_{name}']:.1f} %" for name in ("xx", "yy", "xy"))
    yield f"stress within {xx} (xx), {yy} (yy), {xy} (xy) of that of the zones (rms, over the mean vertical stress)"
    yield f"mobilised sine {window['sine_discs']:.2f} ({window['sine_zones']:.2f} in the zones)"


def _lost_shear(window: Info) -> Iterator[str]:
    """Yields a warning about a window that carries much less shear stress than the zones that it replaces."""
    discs, zones = window.get("sine_discs", 0.0), window.get("sine_zones", 0.0)
    if zones - discs > LOST_SHEAR * zones:
        yield (
            f"warning: the discs of window {window['name']} took over {100 * discs / zones:.0f} % of the shear stress of the "
            f"zones (mobilised sine {discs:.2f}, zones {zones:.2f}): the slope around them will move until it carries the rest; "
            "more friction or stronger bonds of the discs keep more"
        )


def _beyond_reach(window: Info) -> Iterator[str]:
    """Yields sentences about the part of the zones' stress that a packing of these discs cannot carry."""
    if window.get("projected", 0.0) >= NOTICED:
        beyond = f"{100 * window['projected']:.0f} %"
        yield f"at {beyond} of its points the stress of the zones exceeded the estimated strength of the discs"
    if window.get("further_rounds"):
        yield f"{window['further_rounds']} further rounds brought the discs nearer to it, up to their own strength"
    left = [window.get(f"imbalance_{axis}", 0.0) for axis in "xy"]
    if max(map(abs, left)) >= NOTICED:
        x, y = (f"{100 * share:+.0f} %" for share in left)
        yield f"that stress does not balance the window's weight: {x} of the weight remains along x, {y} along y"


def stretched_rims(info: Info) -> Iterator[str]:
    """Yields warnings about stages in which zones on a rim were strongly stretched."""
    for stage in info.get("stages", []):
        found = stage.get("rim_stretched")
        if found:
            x, y = found["place"]
            place = (
                f"zone {found['zone']} on a rim was stretched to {found['stretch']:.1f} times its size at ({x:.1f}, {y:.1f}) m"
            )
            yield f"warning: in stage {stage['name']} {place}: use finer zones there"


def step_limits(info: Info) -> Iterator[str]:
    """Yields safe step limits at the end of each coupled stage and, if they were computed, the exact ones."""
    from coupler_protocol.criteria.stable_step import as_text

    for stage in info.get("stages", []):
        found = dict(stage.get("limits") or {})
        exact = found.pop("exact", None)
        discs = [row for window in info.get("windows", []) for row in window.get("limits", []) if row["stage"] == stage["name"]]
        found |= {"discs": min(discs, key=lambda row: row["share"])} if discs else {}
        parts = [f"safe: {', '.join(f'{name} {as_text(row)}' for name, row in found.items())}"] if found else []
        parts += [f"exact: {as_text(exact)}"] if exact else []
        if parts:
            yield f"stage {stage['name']}, step limits as multiples of the step in use; {'; '.join(parts)}"


def print_table(info: Info, console: Any) -> None:
    """Prints both tables and the sentences to the `console`."""
    console.print(info.get("title") or "", markup=False)
    columns, texts = filled(OUTCOME, rows(info))
    console.print(_table(columns, texts))
    if OUTCOME[6] in columns:
        console.print(
            "P/l vs stress: rms difference between the discs' forces on the rim and the stress of the zones beside it, over the "
            "rms stress."
        )
    console.print(_table(*filled(SECONDS, times(info))))
    for sentence in sentences(info):
        console.print(sentence, markup=False)


def filled(columns: Sequence[str], texts: Sequence[Sequence[str]]) -> tuple[list[str], list[list[str]]]:
    """Names and rows of those columns of a table that are not empty."""
    kept = [k for k in range(len(columns)) if any(row[k] for row in texts)]
    return [columns[k] for k in kept], [[row[k] for k in kept] for row in texts]


def _table(columns: Sequence[str], texts: Sequence[Sequence[str]]) -> Any:
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in columns:
        table.add_column(name, justify="left" if name in TEXT_COLUMNS else "right", no_wrap=True)
    for row in texts:
        table.add_row(*row)
    return table


def _porosity(window: dict[str, Any], key: str) -> str:
    """A porosity of discs, and with stones also without the gaps inside them."""
    discs = f"{window[key]:.3f}"
    return f"{discs} ({window[key] - window['stone_gaps']:.3f} with solid stones)" if "stone_gaps" in window else discs
