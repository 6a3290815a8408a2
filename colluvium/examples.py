"""`colluvium example NAME`: scenes that come with colluvium, written into a folder of the user."""

import tomllib
from pathlib import Path

from coupler_protocol import exits

INSTALLED = Path(__file__).resolve().parent / "scenes"  # in a wheel
CHECKOUT = INSTALLED.parents[1] / "configs"


def folder() -> Path:
    """Folder of the scenes: in the installed package, or in the checkout of an editable installation."""
    found = next((path for path in (INSTALLED, CHECKOUT) if path.is_dir()), None)
    if found is None:
        raise exits.EnvironmentFailed(f"no scenes at {INSTALLED} or {CHECKOUT}: install colluvium again")
    return found


def titles() -> dict[str, str]:
    """Title of every scene by its name."""
    return {path.stem: str(tomllib.loads(path.read_text("utf-8")).get("title", "")) for path in sorted(folder().glob("*.toml"))}


def write(name: str, out: str | Path = ".", force: bool = False) -> list[Path]:
    """Copies a scene and the files it reads, which have its name, into the folder `out`; returns the paths, the scene first.

    Raises EnvironmentFailed for an unknown name, and for files that exist unless `force` is given.
    """
    name = name.removesuffix(".toml")
    if name not in titles():
        raise exits.EnvironmentFailed(f"there is no scene {name!r}; there are {', '.join(titles())}")
    sources = sorted(folder().glob(f"{name}.*"), key=lambda path: (path.suffix != ".toml", path.name))
    targets = [Path(out) / source.name for source in sources]
    if not force and (there := [str(path) for path in targets if path.exists()]):
        raise exits.EnvironmentFailed(f"{', '.join(there)} exists already: choose another --out or use --force")
    for source, target in zip(sources, targets, strict=True):
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_bytes(source.read_bytes())
    return targets
