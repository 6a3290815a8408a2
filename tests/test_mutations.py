"""Some thousands of the cases of tests/mutations.py; `python -m tests.mutations` runs more."""

import pytest

from tests import mutations

CASES = {
    "packets": 4000, "handshakes": 4000, "gates": 4000, "conversations": 300, "scenes": 60,
    "discs": 400, "outlines": 300, "run_json": 1000, "checkpoints": 400,
}  # fmt: skip


@pytest.mark.parametrize("kind", CASES)
def test_what_is_changed_is_refused_in_words_or_means_the_same(kind):
    assert set(CASES) == set(mutations.KINDS)
    mutations.run(kind, CASES[kind])


def test_a_case_that_fails_is_named(monkeypatch):
    monkeypatch.setitem(mutations.KINDS, "packets", lambda folder: lambda rng: 1 / 0)
    with pytest.raises(AssertionError, match="packets, case 3: ZeroDivisionError"):
        mutations.run("packets", 5, seed=3)
