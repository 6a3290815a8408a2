"""docs/scene.md is what the declarations say."""

from tests.commands import run_script


def test_the_page_is_up_to_date():
    done = run_script("scene_reference.py", "--check", timeout=60)
    assert done.returncode == 0, "run: python scripts/scene_reference.py"
