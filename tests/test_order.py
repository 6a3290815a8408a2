"""The files that come first are there: a file that was renamed would fall back in silence."""

from tests.conftest import FIRST, TESTS


def test_files_that_come_first_exist():
    assert [name for name in FIRST if not (TESTS / name).is_file()] == []
