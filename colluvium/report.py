"""`colluvium report RUN_DIR`: every figure whose data the run has recorded, as PNG, and all its frames in one page."""

import importlib
from collections.abc import Callable, Iterator
from pathlib import Path

from colluvium.html import player
from colluvium.results import Run, open_run

FIGURES = (  # file name, module of colluvium.figures, function
    ("mesostructure", "mesostructure", "draw"),
    ("stress", "stress", "draw"),
    ("displacement", "displacement", "draw"),
    ("shear_strain_rate", "shear", "draw_rate"),
    ("shear_strain", "shear", "draw_strain"),
    ("plastic_zones", "plastic", "draw"),
    ("force_chains", "chains", "draw"),
    ("fabric", "roses", "draw"),
    ("histories", "histories", "draw"),
)


def write(
    run_dir: str | Path,
    out: str | Path | None = None,
    *,
    other_path: str | Path | None = None,
    progress: Callable[[Path], None] | None = None,
) -> list[Path]:
    """Draw a run's figures and report.html into `out` (default: RUN_DIR/report), tell `progress` each path, return all."""
    folder = Path(out) if out is not None else Path(run_dir) / "report"
    with open_run(run_dir, other_path) as run:
        if not run.frames:
            raise ValueError(f"{run_dir}: no frame was recorded, there is nothing to draw")
        folder.mkdir(parents=True, exist_ok=True)
        paths = []
        for path in _files(run, folder):
            paths.append(path)
            if progress is not None:
                progress(path)
    return paths


def _files(run: Run, folder: Path) -> Iterator[Path]:
    """Each file as soon as it is written."""
    for name, module, function in FIGURES:
        path = folder / f"{name}.png"
        if _draw(run, module, function, path):
            yield path
    yield player.write(run, folder / "report.html")


def _draw(run: Run, module: str, function: str, path: Path) -> bool:
    import matplotlib.pyplot as plt

    drawing = importlib.import_module(f"colluvium.figures.{module}")
    if not drawing.applies(run):
        return False
    figure = getattr(drawing, function)(run)
    figure.savefig(path)
    plt.close(figure)
    return True
