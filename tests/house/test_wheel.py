"""The wheel holds every file of the packages: rooms, pages, styles, marks of types; nothing else."""

import shutil
import subprocess
import sys
import tarfile
import zipfile

import pytest

from colluvium import cli, examples
from coupler_protocol import exits
from tests.house.tree import PACKAGES, ROOT, files

METADATA = ("pyproject.toml", "README.md", "LICENSE")
DOCUMENTS = ("ARCHITECTURE.md", "CHANGELOG.md", "CITATION.cff", "CONTRIBUTING.md")


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
        metadata = next(wheel.read(name).decode() for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
        assert "\nLicense-Expression: BSD-3-Clause\n" in metadata
        return {name for name in wheel.namelist() if ".dist-info/" not in name}


@pytest.fixture
def tree(tmp_path):
    """What a wheel is made of, copied."""
    for package in PACKAGES:
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pycache__"))
    shutil.copytree(ROOT / "configs", tmp_path / "configs")
    for name in METADATA:
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def test_the_wheel_holds_every_file_of_the_packages(tree):
    (tree / "fdm_server" / "step" / "planted.bin").touch()  # of a kind that pyproject.toml does not name
    (tree / "fdm_server" / "planted_room").mkdir()
    (tree / "fdm_server" / "planted_room" / "planted.py").touch()
    there = {path.relative_to(ROOT).as_posix() for path in files(PACKAGES)}
    scenes = {f"colluvium/scenes/{path.name}" for path in files(("configs",))}
    assert "colluvium/scenes/paper_slope.toml" in scenes
    assert wheel_of(tree) == there | {"fdm_server/planted_room/planted.py"} | scenes


def test_the_source_distribution_holds_scenes_documents_and_tests(tree):
    for name in DOCUMENTS:
        shutil.copy(ROOT / name, tree)
    for folder in ("docs", "scripts", "tests"):
        shutil.copytree(ROOT / folder, tree / folder, ignore=shutil.ignore_patterns("__pycache__"))
    command = [sys.executable, "-c", "from hatchling import build; print(build.build_sdist('dist'))"]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stderr
    (path,) = (tree / "dist").glob("colluvium-*.tar.gz")
    with tarfile.open(path) as archive:
        names = {name.partition("/")[2] for name in archive.getnames()}
    there = {path.relative_to(ROOT).as_posix() for path in files()}
    assert there | {*DOCUMENTS, *METADATA} <= names


def test_a_scene_of_the_wheel_is_written_into_the_folder_of_the_user(tmp_path, monkeypatch, capsys):
    """Also without a checkout: the scenes are read from the package then."""
    monkeypatch.chdir(tmp_path)
    assert cli.main(["example"]) == 0
    listed = capsys.readouterr().out
    assert all(path.stem in listed for path in (ROOT / "configs").glob("*.toml"))
    installed = tmp_path / "site" / "scenes"
    shutil.copytree(ROOT / "configs", installed)
    monkeypatch.setattr(examples, "INSTALLED", installed)
    monkeypatch.setattr(examples, "CHECKOUT", tmp_path / "nowhere")
    assert cli.main(["example", "mapped_stones"]) == 0
    assert "colluvium run mapped_stones.toml" in capsys.readouterr().out
    for name in ("mapped_stones.toml", "mapped_stones.geojson"):
        assert (tmp_path / name).read_bytes() == (ROOT / "configs" / name).read_bytes()
    assert cli.main(["example", "mapped_stones"]) == exits.ENVIRONMENT
    assert "exists already" in capsys.readouterr().err
    assert cli.main(["example", "mapped_stones", "--force"]) == 0
    assert cli.main(["example", "paper_slop"]) == exits.ENVIRONMENT
    assert "there are" in capsys.readouterr().err
    assert cli.main(["example", "paper_slope", "--out", "new"]) == 0
    assert (tmp_path / "new" / "paper_slope.toml").is_file()


@pytest.mark.parametrize("package", PACKAGES)
def test_every_package_is_marked_as_typed(package):
    assert (ROOT / package / "py.typed").is_file()
