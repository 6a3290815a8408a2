"""Factor of safety of a slope with a calibrated window, without stones and with them, beside that of the continuum alone.

    python scripts/safety_of_window.py [--seeds N ..] [--soil FILE] [--only KIND] [--out DIR] [--set KEY=VALUE ..] [--lab]
        [--picture FILE]

soil     configs/calibrated_slope.toml without stones; its discs have the table [discs.soil] of FILE, a set that `colluvium
         calibrate` has fitted to samples without stones (default: the set in this script)
stones   configs/calibrated_slope.toml as it is: 45 % of stones, fitted as a mixture
printed  configs/paper_slope.toml: the parameters of the paper's Table 2

Each is one `colluvium fos` for each seed, in a folder of DIR (default runs/safety_of_window): the same command continues a study
that was interrupted. Prints the brackets, and the difference from the continuum in percent. --picture draws the displacements in
the lowest trial that fails, of the grid alone and of the first seed of each window.
"""

import argparse
import json
import tomllib
from pathlib import Path
from typing import Any

from colluvium import Scene, cli, open_run
from colluvium.figures import domain
from colluvium.running.processes import as_toml
from colluvium.safety import mechanism
from fdm_server.fos.verdict import FAILS

CONFIGS = Path(__file__).resolve().parents[1] / "configs"
KINDS = {"soil": "calibrated_slope.toml", "stones": "calibrated_slope.toml", "printed": "paper_slope.toml"}
SOIL = {  # colluvium calibrate, calibrate.sample = "soil", radius 0.03 m, 5 seeds: E 406 MPa, nu 0.369, c 44.2 kPa, phi 30.2 deg
    "density": 2000.0,
    "spring": {"normal": 2.62e9, "shear": 2.03e8},
    "friction": {"coefficient": 0.73},
    "bond": {"tension": 5970.0, "shear": 13930.0},
    "rolling": {"coefficient": 0.089},
}


def tables_of(kind: str, soil: dict[str, Any], seed: int, overrides: list[str]) -> dict[str, Any]:
    """Tables of a scene."""
    scene = Scene.read(CONFIGS / KINDS[kind], [*overrides, f"seed={seed}"])
    tables: dict[str, Any] = scene.drawn.model_dump(mode="json", exclude_none=True)
    if kind == "soil":
        discs = {key: value for key, value in tables["discs"].items() if key != "stone"}
        tables = {key: value for key, value in tables.items() if key != "stones"} | {"discs": discs | {"soil": soil}}
        tables["title"] = "Soil slope, with a calibrated window without stones"
    return tables


def search(kind: str, seed: int, options: argparse.Namespace, soil: dict[str, Any]) -> dict[str, Any]:
    """fos.json of one scene; computed unless it is there."""
    out = options.out / f"{kind}.seed{seed}"
    out.mkdir(parents=True, exist_ok=True)
    path = out / "scene.toml"
    path.write_text(as_toml(tables_of(kind, soil, seed, options.set)), encoding="utf-8")
    if code := cli.main(["fos", str(path), "--out", str(out), *(["--lab"] if options.lab else [])]):
        raise SystemExit(code)
    found: dict[str, Any] = json.loads((out / "fos.json").read_text(encoding="utf-8"))
    return found


def row_of(kind: str, seed: int, found: dict[str, Any]) -> str:
    """A line of the table."""
    alone, coupled = found["meshes"][-1], found["coupled"]
    change = 100.0 * (coupled["value"] / alone["value"] - 1.0)
    bracket = f"{coupled['value']:.3f} ({coupled['low']:.4f}, {coupled['high']:.4f})"
    return f"| {kind} | {seed} | {alone['value']:.3f} | {bracket} | {change:+.1f} |"


def lowest_failure(trials: list[dict[str, Any]]) -> dict[str, Any]:
    """The row of the lowest factor that fails."""
    return min((row for row in trials if row["verdict"] == FAILS), key=lambda row: row["factor"])


def draw(folders: dict[str, Path], path: Path) -> None:
    """Draws the mechanism of the grid alone and of each window beside each other."""
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 1 + len(folders), figsize=(4.0 * (1 + len(folders)), 2.9), layout="constrained")
    for place, (kind, folder) in zip(axes, [("grid alone", next(iter(folders.values()))), *folders.items()], strict=True):
        found = json.loads((folder / "fos.json").read_text(encoding="utf-8"))
        if kind == "grid alone":
            failed, value = lowest_failure(found["meshes"][-1]["trials"]), found["meshes"][-1]["value"]
            with open_run(folder / "grid" / "mesh1") as run:
                mechanism.draw_slope(place, run, run.gridpoints(failed["frame"]).displacement, failed["frame"], [])
        else:
            failed, value = lowest_failure(found["coupled"]["trials"]), found["coupled"]["value"]
            with open_run(folder / "trials" / failed["folder"]) as run:
                mechanism.draw_slope(place, run, mechanism.moved(run), len(run.frames) - 1, run.windows)
        domain.finish(place, f"{kind}: {value:.3f}, at {failed['factor']:.4g}")
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=100)
    plt.close(figure)


def main(argv: list[str] | None = None) -> int:
    """Runs the study; returns the exit code."""
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("--seeds", type=int, nargs="+", default=[1], metavar="N")
    p.add_argument("--soil", type=Path, metavar="FILE", help="TOML with the table [discs.soil]")
    p.add_argument("--only", choices=KINDS, help="one of the windows")
    p.add_argument("--out", type=Path, default=Path("runs/safety_of_window"), metavar="DIR", help="keep the runs here")
    p.add_argument("--set", action="append", default=[], metavar="KEY=VALUE", help="override a key of the scene")
    p.add_argument("--lab", action="store_true", help="c and phi of the reduced discs")
    p.add_argument("--picture", type=Path, metavar="FILE", help="draw the mechanisms")
    options = p.parse_args(argv)
    soil = tomllib.loads(options.soil.read_text(encoding="utf-8"))["discs"]["soil"] if options.soil else SOIL
    kinds = [options.only] if options.only else list(KINDS)
    rows = [row_of(kind, seed, search(kind, seed, options, soil)) for kind in kinds for seed in options.seeds]
    print("| window | seed | grid alone | grid and discs (rests, fails) | difference [%] |\n|---|---|---|---|---|")
    print("\n".join(rows))
    if options.picture:
        draw({kind: options.out / f"{kind}.seed{options.seeds[0]}" for kind in kinds}, options.picture)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
