"""Adds the scenes of `configs/` to the wheel; everything else about the distribution is in pyproject.toml."""

import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py

SCENES = Path(__file__).resolve().parent / "configs"


class BuildWithScenes(build_py):
    """Copies the scenes beside the modules; an editable installation reads them from the checkout."""

    def run(self) -> None:
        """Builds, then copies."""
        super().run()
        if not self.editable_mode:
            shutil.copytree(SCENES, Path(self.build_lib) / "colluvium" / "scenes", dirs_exist_ok=True)


setup(cmdclass={"build_py": BuildWithScenes})
