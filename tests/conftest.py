"""Fixtures that several folders of tests share."""

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="session")
def configs():
    """Folder of the shipped scenes."""
    return ROOT / "configs"


def command(module, *arguments):
    """Command line of one of our programs."""
    return [sys.executable, "-m", module, *map(str, arguments)]


@pytest.fixture(scope="session")
def quick_run(tmp_path_factory, configs):
    """quick_slope.toml computed by two processes, as a user would: (run directory, what was printed)."""
    out = tmp_path_factory.mktemp("quick")
    done = subprocess.run(
        command("colluvium.cli", "run", configs / "quick_slope.toml", "--out", out, "--force"),
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    return out, done
