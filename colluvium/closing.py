"""The table at the end of a run, from run.json."""

COLUMNS = (
    ("stage", "left"),
    ("steps", "right"),
    ("ended by", "left"),
    ("gravity", "right"),
    ("ratio grid", "right"),
    ("ratio discs", "right"),
    ("P/l vs stress", "right"),
    ("bonds broken", "right"),
    ("grid s", "right"),
    ("discs s", "right"),
    ("waiting s", "right"),
    ("recording s", "right"),
)


def rows(info):
    """Rows of the closing table as texts, one a stage, from the contents of run.json."""
    table = []
    for stage in info.get("stages", []):
        seconds = stage["seconds"]
        coupled = bool(stage["ratio_discrete"])
        table.append(
            [
                stage["name"],
                str(stage["steps"] or ""),
                stage["ended_by"],
                f"{stage['gravity_factor']:.2f} g" if stage["steps"] else "",
                f"{stage['ratio_continuum']:.1e}" if stage["steps"] else "",
                f"{max(stage['ratio_discrete']):.1e}" if coupled else "",
                f"{100 * max(stage['traction_difference']):.1f} %" if coupled else "",
                str(sum(stage["bonds_broken"])) if coupled else "",
                f"{seconds['continuum']:.2f}",
                f"{seconds['discrete']:.2f}",
                f"{seconds['waiting']:.2f} + {seconds['waiting_discrete']:.2f}",
                f"{seconds['recording'] + seconds['recording_discrete']:.2f}",
            ]
        )
    return table


def print_table(info, console):
    """Print the closing table and what it says in words."""
    from rich.table import Table

    table = Table(title=info.get("title") or None, title_justify="left")
    for name, side in COLUMNS:
        table.add_column(name, justify=side, no_wrap=name != "ended by")
    for row in rows(info):
        table.add_row(*row)
    console.print(table)
    console.print(
        "P/l vs stress: rms difference between the discs' forces on the rim and the stress of the zones beside it, over "
        "the rms stress. Waiting: grid + discs; recording: both."
    )
    for window in info.get("windows", []):
        parts = [f"window {window['name']}: {window.get('discs', '?')} discs, {window.get('control_discs', '?')} on the ring"]
        if "porosity" in window:
            parts.append(f"porosity {window['porosity']:.3f}")
        if "stones" in window:
            both = 100 * window["stone_content"], 100 * window["stone_content_discs"]
            parts.append(f"{window['stones']} stones: {both[0]:.1f} % of the area, {both[1]:.1f} % of the discs")
        if "error_yy" in window:
            parts.append(f"stress brought within {100 * window['error_yy']:.1f} % (rms) of the slope's vertical stress")
        if "bonds_broken_tension" in window:
            parts.append(f"bonds broken {window['bonds_broken_tension']} in tension, {window['bonds_broken_shear']} in shear")
        console.print(", ".join(parts))
    seconds = info.get("seconds")
    console.print(f"{info.get('reason', '')}; exit code {info.get('exit_code')}" + (f"; {seconds:.1f} s" if seconds else ""))
