"""Writes a slope whose window is a hexagonal packing with the stiffness of its zones.

    python scripts/hexagonal_window.py [--out DIR]

Equal discs in rows, each with six neighbours: the moduli in the plane are closed forms of the contact stiffnesses kn, ks
(docs/verification.md, hexagon),

    K2 = sqrt(3)/2 kn        G = sqrt(3)/4 (kn + ks)        E2 = 4 K2 G/(K2 + G)        nu2 = (K2 - G)/(K2 + G)

so kn follows from the E2 of the zones. nu2 is at most 1/3 (ks = 0): the 0.57 of the paper's Table 1 is out of reach, and ks/kn is
`RATIO`. Contacts are bonded so that none breaks: only stiffness is matched, not strength. The slope is that of
configs/calibrated_slope.toml. The ring of control discs has another spacing than the lattice and presses it out of shape as
the window is brought to the slope's stress: four in ten contacts of the lattice would be open afterwards. So contacts with a gap
of up to `GAP` radii, which only neighbours of the lattice have, are bonded when the discs take over. Writes
DIR/hexagonal_slope.toml and DIR/hexagonal.csv (default runs/hexagonal), for

    python scripts/window_felt.py DIR/hexagonal_slope.toml configs/calibrated_slope.toml configs/paper_slope.toml --last 3
"""

import argparse
from math import sqrt
from pathlib import Path
from typing import Any

import numpy as np

from colluvium import Scene
from colluvium.running.processes import as_toml
from coupler_protocol.files.disc_csv import PLACE

SCENE = Path(__file__).resolve().parents[1] / "configs" / "calibrated_slope.toml"
RATIO = 0.05  # ks/kn
BETWEEN = 1.90  # radii from the rim to the first column of centres: control discs are on the rim
ABOVE = 1.88  # radii to the first row, whose discs lie in the gaps of the control discs
COLUMNS = range(25, 45)
GAP = 0.28  # radii: neighbours of the lattice; the next ones are (2 sqrt(3) - 2) radii apart
UNBROKEN = 1e6  # [N]


def packing(low: tuple[float, float], high: tuple[float, float]) -> np.ndarray:
    """Rows x, y, radius (n, 3) [m] of a hexagonal packing in a rectangle; its radius fits both sides best."""
    width, height = high[0] - low[0], high[1] - low[1]

    def fitted(columns: int) -> tuple[float, float, int]:
        radius = width / (2 * columns - 1 + 2.0 * BETWEEN)
        rows = round((height / radius - 2.0 * ABOVE) / sqrt(3.0))
        return abs(0.5 * (height / radius - rows * sqrt(3.0)) - ABOVE), radius, rows

    columns = min(COLUMNS, key=lambda n: fitted(n)[0])
    _, radius, rows = fitted(columns)
    above = 0.5 * (height - rows * sqrt(3.0) * radius)
    return np.array(
        [
            (low[0] + (BETWEEN + 2 * i + row % 2) * radius, low[1] + above + row * sqrt(3.0) * radius, 0.99999 * radius)
            for row in range(rows + 1)
            for i in range(columns)
        ]
    )


def stiffness(bulk: float, shear: float) -> float:
    """kn [N/m] with the E2 of zones with these moduli [Pa] in plane strain."""
    K2, G = bulk + shear / 3.0, shear
    E2 = 4.0 * K2 * G / (K2 + G)
    k2, g = sqrt(3.0) / 2.0, sqrt(3.0) / 4.0 * (1.0 + RATIO)
    return E2 / (4.0 * k2 * g / (k2 + g))


def tables(file: Path) -> tuple[dict[str, Any], np.ndarray]:
    """Tables of the scene, whose discs are in `file`, and the discs."""
    scene = Scene.read(SCENE)
    found: dict[str, Any] = scene.drawn.model_dump(mode="json", exclude_none=True)
    zone, window = scene.grid.zone_size[0], scene.window[0]
    low = (window.columns[0] * zone, window.rows[0] * zone)
    discs = packing(low, ((window.columns[1] + 1) * zone, (window.rows[1] + 1) * zone))
    kn = stiffness(scene.material[0].elastic.bulk, scene.material[0].elastic.shear)
    soil = {"density": 2000.0, "spring": {"normal": kn, "shear": RATIO * kn}, "friction": {"coefficient": 1.0}}
    soil["bond"] = {"tension": UNBROKEN, "shear": UNBROKEN}
    kept = {key: value for key, value in found["discs"].items() if key not in ("stone", "spread")}
    found["discs"] = kept | {"radius": float(discs[0, 2]), "file": str(file), "stiffness": "contact", "soil": soil}
    couple = next(stage for stage in found["stage"] if stage.get("kind", stage["name"]) == "couple")
    couple["discs"] = {"bond_gap": GAP * float(discs[0, 2])}
    found["title"] = "Soil-rock slope of the paper, with a hexagonal window"
    return {key: value for key, value in found.items() if key != "stones"}, discs


def main(argv: list[str] | None = None) -> int:
    """Writes the files; returns the exit code."""
    p = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    p.add_argument("--out", type=Path, default=Path("runs/hexagonal"), metavar="DIR")
    options = p.parse_args(argv)
    options.out.mkdir(parents=True, exist_ok=True)
    file = (options.out / "hexagonal.csv").resolve()
    found, discs = tables(file)
    np.savetxt(file, discs, delimiter=",", header=",".join(PLACE), comments="", fmt="%.17g")
    path = options.out / "hexagonal_slope.toml"
    path.write_text(as_toml(found), encoding="utf-8")
    print(f"{path}: {len(discs)} discs of radius {discs[0, 2]:.4g} m, kn {found['discs']['soil']['spring']['normal']:.4g} N/m")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
