"""The wheel holds every file of the packages: rooms, pages, styles, marks of types; nothing else."""

import shutil
import subprocess
import sys
import zipfile

import pytest

from tests.house.tree import PACKAGES, ROOT, files

METADATA = ("pyproject.toml", "README.md", "LICENSE")


def wheel_of(folder):
    """Names in the wheel that the tree in `folder` makes, but for those of its metadata; offline, nothing is installed."""
    command = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        folder,
        "--no-deps",
        "--no-build-isolation",
        "--no-index",
        "-q",
        "-w",
        folder,
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    (path,) = folder.glob("colluvium-*.whl")
    with zipfile.ZipFile(path) as wheel:
        return {name for name in wheel.namelist() if ".dist-info/" not in name}


@pytest.fixture
def tree(tmp_path):
    """What a wheel is made of, copied."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in METADATA:
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def test_the_wheel_holds_every_file_of_the_packages(tree):
    (tree / "fdm_server" / "step" / "planted.bin").touch()  # of a kind that package-data does not name
    (tree / "fdm_server" / "planted_room").mkdir()
    (tree / "fdm_server" / "planted_room" / "planted.py").touch()
    there = {path.relative_to(ROOT).as_posix() for path in files(PACKAGES)}
    assert wheel_of(tree) == there | {"fdm_server/planted_room/planted.py"}


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_is_marked_as_typed(package):
    assert (ROOT / package / "py.typed").is_file()
