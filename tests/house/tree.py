"""The files of this checkout, as the tests of the house read them."""

from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("coupler_protocol", "fdm_server", "dem_server", "colluvium")
FOLDERS = (*PACKAGES, "scripts", "tests", "configs", "docs")


def files(folders=FOLDERS, root=ROOT):
    """All files below `folders` of the tree at `root`, as paths; compiled leftovers are no files of the tree."""
    found = (path for folder in folders for path in sorted((root / folder).rglob("*")))
    return [path for path in found if path.is_file() and path.parent.name != "__pycache__"]
