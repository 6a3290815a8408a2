"""Fixtures that several folders of tests share."""

import pytest

from tests.commands import ROOT, run_colluvium


@pytest.fixture(scope="session")
def configs():
    """Folder of the shipped scenes."""
    return ROOT / "configs"


@pytest.fixture(scope="session")
def quick_run(tmp_path_factory, configs):
    """quick_slope.toml computed by two processes, as a user would: (run directory, what was printed)."""
    out = tmp_path_factory.mktemp("quick")
    done = run_colluvium("run", configs / "quick_slope.toml", "--out", out, "--force")
    assert done.returncode == 0, done.stderr
    return out, done
