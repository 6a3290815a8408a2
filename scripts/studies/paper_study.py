"""The paper's study over seeds: the four states of the band, and the fabric of the contacts in each beside the paper's.

    python scripts/studies/paper_study.py [SCENE] [--seeds N] [--cases NAME ..] [--fast]
        [--json FILE] [--pictures DIR] [--out DIR]

Each seed draws stones and discs of its own and is computed three times: with ("stressed") and without bringing the window to the
slope's stress, and as the paper describes it ("paper's way": discs filled from the boundary inward, stones as clusters, the
weights of its Table 2, its mapping, not brought to the slope's stress). The first seed is also computed with the paper's mapping
alone and with the light discs of Table 2 alone. Prints tables in Markdown: means ± standard deviations over the seeds. --cases:
only these, by name. With --out, runs that are there already, of the same scene and to their end, are read instead of computed.
--fast: a coarse slope without stones, in one process; shows that the script works."""

import argparse
import json
import sys
import tempfile
import time
from operator import attrgetter
from pathlib import Path
from typing import NamedTuple

import numpy as np

import colluvium
from colluvium.results import band_states, failure, window_fields
from colluvium.results.fabric import KINDS

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
FAST = ('stage.overload={name="overload", large_strain=true, gravity_factor={to=14.0, over=2000}, until={steps=2000}}',)


class Case(NamedTuple):
    """One way to compute the slope."""

    name: str
    overrides: tuple[str, ...]
    every_seed: bool

    @property
    def of_first_seed(self):
        """Whether the case is in the tables of the first seed, which compare single differences from "stressed"."""
        return self is STRESSED or not self.every_seed


STRESSED = Case("stressed", (), True)
PAPERS_WAY = (  # sections 2.1 and 4.2; stone sizes, radii and porosity, which it does not give, are those of the scene
    'discs.packing="inward"',
    "discs.density_matching=false",
    'stones.body="cluster"',
    "stage.fill.insitu=false",
    'coupling.mapping="paper"',
)
CASES = (
    STRESSED,
    Case("unstressed", ("stage.fill.insitu=false",), True),
    Case("paper's way", PAPERS_WAY, True),
    Case("paper mapping", ('coupling.mapping="paper"',), False),
    Case("light discs", ("discs.density_matching=false",), False),
)
PAPER = {  # Figures 16 and 17
    "a": (0.02, 0.0, 0.27, 18.0),
    "b": (0.06, 35.0, 0.35, 38.0),
    "c": (0.10, 60.0, 0.42, 56.5),
    "d": (0.26, 62.0, 0.56, 60.0),
}
MOMENTS = ("a", "before b", "b", "c", "d", "end")
WINDOW = ("discs", "porosity", "stone_content", "stone_content_discs", "error_yy", "projected")
QUANTITIES = ("a", "theta_a", "a_n", "theta_n")


def compute(scene, case, seed, out, fast):
    """What one run says, as plain data."""
    own = [text for text in case.overrides if not (fast and text.startswith("stones."))]  # the coarse slope has no stones
    scene = colluvium.Scene.read(scene, [f"seed={seed}", "record.every=500", *own, *(FAST if fast else ())])
    with finished(scene, out) or colluvium.run(scene, out, in_process=fast, force=True) as run:
        return measure(run) | {"seed": seed}


def finished(scene, out):
    """The run of this scene in the folder `out`, if it was computed to its end; else None."""
    if not (out / "run.json").exists():
        return None
    run = colluvium.open_run(out)
    if (run.info.get("scene_hash"), run.info.get("exit_code")) == (scene.digest(), 0):
        return run
    run.close()
    return None


def folder_name(case):
    """Name of a case as a part of a folder's name."""
    return case.name.replace(" ", "_").replace("'", "")


def measure(run):
    """States, moments and the fabric in each."""
    found = band_states.reaches(run)
    reached = band_states.states(found)
    moments = {one.letter: one.reach for one in reached}
    moments |= {"before b": band_states.last_before(found), "end": found[-1]}
    window, stages = run.info["windows"][0], {row["name"]: row for row in run.info["stages"]}
    return {
        "scene_hash": run.info["scene_hash"],
        "states": {one.letter: one.as_text() for one in reached},
        "seen": {one.letter: one.seen.gravity_factor if one.seen else None for one in reached},
        "alike": {one.letter: one.alike for one in reached},
        "band": failure.summary(run),
        "window": {key: window[key] for key in WINDOW if key in window},
        "traction_difference": stages["couple"]["traction_difference"][0],
        "bonds_broken": {name: stages[name]["bonds_broken"][0] for name in ("couple", "overload")},
        "moments": {name: moment(run, moments[name]) for name in MOMENTS},
        "course": [[one.gravity_factor, *attrgetter(*QUANTITIES)(run.fabric(one.frame, run.windows[0]))] for one in found],
    }


def moment(run, reach):
    """When it was, and the fabric of all contacts and of each kind; None for a state that was not reached."""
    if reach is None:
        return None
    kinds = {kind or "all": band_states.fabric(run, reach.frame, run.windows[0], kind) for kind in (None, *KINDS)}
    return {
        **reach._asdict(),
        **axes(run, reach.frame),
        "fabric": {
            kind: {**both[0]._asdict(), "half_width": both[1]._asdict()} if both else None for kind, both in kinds.items()
        },
    }


def axes(run, frame):
    """Axis of the largest pressure in the discs, and of the motion of those that moved more than the median [deg]."""
    rank = run.windows[0]
    bins = window_fields.bins(run, frame, rank)
    xx, yy, xy = np.nanmean(window_fields.mean_stress(run, frame, bins, rank), axis=0)
    moved = run.discs(frame, rank).displacement
    size = np.hypot(*moved.T)
    motion = moved[size >= np.median(size)].sum(axis=0)
    angles = {"stress_axis": np.arctan2(-2.0 * xy, yy - xx) / 2.0, "motion_axis": np.arctan2(motion[1], motion[0])}
    return {name: float(np.degrees(angle) % 180.0) for name, angle in angles.items()}


def mean_and_scatter(values, axial=False):
    """Mean and standard deviation (None of a single value); of directions in degrees modulo 180 if `axial`."""
    values = np.asarray(values, dtype=float)
    mean = float(values.mean())
    if axial:
        mean = float(np.degrees(np.angle(np.exp(2j * np.radians(values)).mean())) / 2.0 % 180.0)
        values = (values - mean + 90.0) % 180.0
    return mean, float(values.std(ddof=1)) if len(values) > 1 else None


def pair(rows, name, kind, size, direction):
    """A cell of a table: size and direction, mean ± scatter over the runs that reached the moment with enough contacts.

    It also says in how many runs the size cannot be told from an isotropic packing; if in all, it has no direction.
    """
    found = [row["moments"][name]["fabric"][kind] for row in rows if row["moments"][name]]
    found = [one for one in found if one]
    if not found:
        return "-"
    sizes, angles = ([one[key] for one in found] for key in (size, direction))
    isotropic = sum(one[size] <= one[f"{size}_noise"] for one in found)
    if isotropic == len(found):
        return f"{spread(sizes, '.2f')}, isotropic"
    note = f" ({isotropic} of {len(found)} isotropic)" if isotropic else ""
    return f"{spread(sizes, '.2f')}, {spread(angles, '.0f', axial=True)}°{note}"


def spread(values, form, axial=False):
    """Mean ± scatter as text, "-" without values."""
    if not values:
        return "-"
    mean, scatter = mean_and_scatter(values, axial)
    return f"{mean:{form}}" + (f" ± {scatter:{form}}" if scatter is not None else "")


def table(head, rows):
    """Markdown."""
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


def when_table(results):
    """Gravity factors [g] at which the states are reached."""
    rows = []
    for case, runs in results.items():
        cells = []
        for letter in "bcd":
            factors = [row["moments"][letter]["gravity_factor"] for row in runs if row["moments"][letter]]
            alike = sum(bool(row["alike"][letter]) for row in runs)
            note = f"; {alike} with another state" if alike else ""
            cells.append(f"{spread(factors, '.2f')} ({len(factors)} of {len(runs)}{note})")
        failed = [row["band"]["failed_at"] for row in runs if row["band"]["failed_at"] is not None]
        rows.append([case, *cells, spread([row["seen"]["c"] for row in runs if row["seen"]["c"]], ".2f"), spread(failed, ".2f")])
    return table(["run", "b enters [g]", "c through [g]", "d complete [g]", "c first seen [g]", "failed [g]"], rows)


def fabric_table(results, size, direction, paper):
    """All contacts. Rows: moments. Columns: the paper (its columns `paper` of PAPER), then each case."""
    rows = []
    for name in MOMENTS:
        own = f"{PAPER[name][paper]:.2f}, {PAPER[name][paper + 1]:g}°" if name in PAPER else ""
        rows.append([name, own, *(pair(runs, name, "all", size, direction) for runs in results.values())])
    return table(["state", "paper", *results], rows)


def axes_table(results):
    """Axes of pressure and of motion in the window [deg]."""
    rows = []
    for name in MOMENTS:
        reached = [[row["moments"][name] for row in runs if row["moments"][name]] for runs in results.values()]
        cells = [
            [f"{spread([m[key] for m in found], '.0f', True)}°" for key in ("stress_axis", "motion_axis")] for found in reached
        ]
        rows.append([name, *(cell for both in cells for cell in both)])
    return table(["state", *(f"{case}: {what}" for case in results for what in ("pressure", "motion"))], rows)


def kinds_table(results):
    """Rows: kinds of contact and moments. Columns: normals and forces of each case."""
    rows = []
    for kind in KINDS:
        for name in MOMENTS:
            cells = [pair(runs, name, kind, q, f"theta_{q[2:] or q}") for runs in results.values() for q in ("a", "a_n")]
            rows.append([kind, name, *cells])
        if all(set(row[2:]) == {"-"} for row in rows[-len(MOMENTS) :]):
            rows[-len(MOMENTS) :] = [[kind, f"fewer than {band_states.FEWEST} in every state", *cells]]
    return table(["contacts", "state", *(f"{case}: {q}" for case in results for q in ("a, θa", "a_n, θn"))], rows)


def interval_table(runs):
    """Mean half widths of the 95 % intervals within one run, and how many contacts there are."""
    rows = []
    for kind in ("all", *KINDS):
        for name in ("a", "b", "d"):
            found = [row["moments"][name]["fabric"][kind] for row in runs if row["moments"][name]]
            found = [one for one in found if one]
            if found:
                widths = [np.mean([one["half_width"][q] for one in found]) for q in QUANTITIES]
                texts = [
                    f"{width:.0f}°" if q.startswith("theta") else f"{width:.3f}"
                    for q, width in zip(QUANTITIES, widths, strict=True)
                ]
                rows.append([kind, name, f"{np.mean([one['contacts'] for one in found]):.0f}", *texts])
    return table(["contacts", "state", "number", *QUANTITIES], rows)


def report(results):
    """All tables as one text."""
    both = {case.name: results[case.name] for case in CASES if case.every_seed and case.name in results}
    first = {case.name: results[case.name][:1] for case in CASES if case.of_first_seed and case.name in results}
    intervals = next(iter(results))
    parts = [
        ("When the states are reached", when_table(results)),
        ("Contact normals, all contacts: a, θa", fabric_table(both, "a", "theta_a", 0)),
        ("Normal forces, all contacts: a_n, θn", fabric_table(both, "a_n", "theta_n", 2)),
        ("Axes of the largest pressure and of the motion in the window", axes_table(both)),
        ("By kind of contact", kinds_table(both)),
        (f"Half widths of the 95 % intervals within one run ({intervals})", interval_table(results[intervals])),
        ("First seed, normals: mapping and weight", fabric_table(first, "a", "theta_a", 0)),
        ("First seed, forces: mapping and weight", fabric_table(first, "a_n", "theta_n", 2)),
    ]
    return "\n".join(f"{title}\n\n{text}" for title, text in parts)


def draw_course(results):
    """a, a_n and their axes over gravity: every run of a seed as a thin line, the paper's states as marks at the mean factors."""
    import matplotlib.pyplot as plt

    figure, places = plt.subplots(2, 2, figsize=(8.0, 5.0), sharex=True, layout="constrained")
    both = {case.name: results[case.name] for case in CASES if case.every_seed and case.name in results}
    labels = ("a [-]", "$\\theta_a$ [°]", "$a_n$ [-]", "$\\theta_n$ [°]")
    factors = {letter: [row["moments"][letter] for row in next(iter(both.values()))] for letter in PAPER}
    when = {letter: np.mean([m["gravity_factor"] for m in found if m]) for letter, found in factors.items() if any(found)}
    for number, (place, label) in enumerate(zip(places.T.flat, labels, strict=True)):
        for (case, runs), colour in zip(both.items(), ("#1a1a1a", "#c1502e", "#5b9a54"), strict=False):
            for row in runs:
                data = np.array(row["course"])
                place.plot(data[:, 0], data[:, 1 + number], color=colour, linewidth=0.8, label=case if row is runs[0] else None)
        paper = [PAPER[letter][number] for letter in when]
        place.plot(list(when.values()), paper, "s", color="#3b6fa0", markersize=5, label="paper, a to d")
        place.set_ylabel(label)
        place.set_ylim(*((0.0, 180.0) if number % 2 else (0.0, None)))
    for place in places[-1]:
        place.set_xlabel("gravity factor [-]")
    places[0, 0].legend()
    return figure


def write_pictures(results, first_run, folder):
    """paper_states.png and paper_fabric.png."""
    import matplotlib.pyplot as plt

    from colluvium.figures import states as picture
    from colluvium.figures import style

    folder.mkdir(parents=True, exist_ok=True)
    with colluvium.open_run(first_run) as run:
        drawn = {"paper_fabric": style.styled(draw_course)(results)}
        drawn["paper_states"] = picture.draw(run)
    for name, figure in drawn.items():
        figure.savefig(folder / f"{name}.png", dpi=100)
        plt.close(figure)


def main(argv=None):
    """Run the study; returns the exit code."""
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("scene", nargs="?", type=Path, default=CONFIGS / "paper_slope.toml")
    p.add_argument("--seeds", type=int, default=5, metavar="N")
    p.add_argument("--cases", nargs="+", choices=[case.name for case in CASES], metavar="NAME", help="default: all")
    p.add_argument("--fast", action="store_true", help="the coarse slope instead")
    p.add_argument("--json", type=Path, metavar="FILE", help="every number of every run")
    p.add_argument("--pictures", type=Path, metavar="DIR", help="draw the states and the course of the fabric")
    p.add_argument("--out", type=Path, metavar="DIR", help="keep the runs here (default: none is kept)")
    options = p.parse_args(argv)
    scene = CONFIGS / "quick_slope.toml" if options.fast else options.scene
    seeds = range(1, options.seeds + 1)
    chosen = [case for case in CASES if case.name in (options.cases or [case.name])]
    results, start = {}, time.perf_counter()
    with tempfile.TemporaryDirectory() as scratch:
        folder = options.out or Path(scratch)
        for case in chosen:
            results[case.name] = []
            for seed in seeds if case.every_seed else seeds[:1]:
                results[case.name].append(compute(scene, case, seed, folder / f"{folder_name(case)}_{seed}", options.fast))
                print(f"{time.perf_counter() - start:6.0f} s  {case.name}, seed {seed}", file=sys.stderr)
        if options.pictures:
            write_pictures(results, folder / f"{folder_name(chosen[0])}_1", options.pictures)
    print(report(results))
    if options.json:
        options.json.write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
