"""`colluvium report RUN_DIR`: all figures whose data the run has recorded, as PNG, and all frames in one page."""

import importlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from colluvium.html import player
from colluvium.results.run import Run, open_run
from coupler_protocol.exits import EnvironmentFailed

OF_WINDOWS = ("mesostructure", "window", "force_chains", "displacement_vectors", "fabric")  # a picture of each window
FIGURES = (  # file name, module of colluvium.figures, function
    ("mesostructure", "mesostructure", "draw"),
    ("mesh", "mesh", "draw"),
    ("window", "assembly", "draw"),
    ("stress", "stress", "draw"),
    ("displacement", "displacement", "draw"),
    ("shear_strain_rate", "shear", "draw_rate"),
    ("shear_strain", "shear", "draw_strain"),
    ("plastic_zones", "plastic", "draw"),
    ("states", "states", "draw"),
    ("force_chains", "chains", "draw"),
    ("displacement_vectors", "vectors", "draw"),
    ("fabric", "roses", "draw"),
    ("cracks", "cracks", "draw"),
    ("histories", "histories", "draw"),
    ("load_curves", "load_curves", "draw"),
    ("timeline", "timeline", "draw"),
)


def write(
    run_dir: str | Path,
    out: str | Path | None = None,
    *,
    other_path: str | Path | None = None,
    progress: Callable[[Path], None] | None = None,
    skipped: Callable[[str, str], None] | None = None,
) -> list[Path]:
    """Draws a run's figures and report.html into `out` (default: RUN_DIR/report); returns their paths.

    progress(path) is called after each file, skipped(file name, missing data) for each figure without data.
    """
    folder = Path(out) if out is not None else Path(run_dir) / "report"
    with open_run(run_dir, other_path) as run:
        if not run.frames:
            raise EnvironmentFailed(f"{run_dir}: no frame was recorded, so there is nothing to draw")
        if run.cut and skipped is not None:
            skipped(f"frames after step {run.frames[-1].step:,}", run.cut)
        folder.mkdir(parents=True, exist_ok=True)
        paths = []
        for path in _files(run, folder, skipped or (lambda name, why: None)):
            paths.append(path)
            if progress is not None:
                progress(path)
    return paths


def _files(run: Run, folder: Path, skipped: Callable[[str, str], None]) -> Iterator[Path]:
    """Yields each file as soon as it is written."""
    for name, module, function in FIGURES:
        drawing = importlib.import_module(f"colluvium.figures.{module}")
        _remove_other_windows(folder, name, run)
        for part, words in _parts(name, run):
            path = folder / f"{part}.png"
            if lacking := drawing.missing(run, *words):
                path.unlink(missing_ok=True)  # of an earlier report
                skipped(path.name, lacking)
            else:
                _save(getattr(drawing, function)(run, *words), path)
                yield path
    yield player.write(run, folder / "report.html")


def _parts(name: str, run: Run) -> list[tuple[str, tuple[int, ...]]]:
    """(name, further arguments) of the pictures of a figure: one, or one for each of several windows."""
    if name not in OF_WINDOWS or len(run.windows) < 2:
        return [(name, ())]
    return [(f"{name}.rank{rank}", (rank,)) for rank in run.windows]


def _remove_other_windows(folder: Path, name: str, run: Run) -> None:
    """Removes pictures of a figure that an earlier report made of another number of windows."""
    now = {f"{part}.png" for part, _ in _parts(name, run)}
    for path in (folder / f"{name}.png", *folder.glob(f"{name}.rank*.png")):
        if path.name not in now:
            path.unlink(missing_ok=True)


def _save(figure: Any, path: Path) -> None:
    import matplotlib.pyplot as plt

    figure.savefig(path)
    plt.close(figure)
