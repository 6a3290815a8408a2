"""docs/scene.md is what the declarations say."""

import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_page_is_up_to_date():
    done = subprocess.run([sys.executable, ROOT / "scripts" / "scene_reference.py", "--check"], timeout=60)
    assert done.returncode == 0, "run: python scripts/scene_reference.py"
