"""The first key in which two resolved scenes differ."""

import pytest

from coupler_protocol.scene.differences import first_difference


@pytest.mark.parametrize(
    ("a", "b", "found"),
    [
        ({"a": 1}, {"a": 1}, None),
        ({"a": [1, {"b": 2.0}]}, {"a": [1, {"b": 2.0}]}, None),
        ({"a": [1, {"b": 2.0}]}, {"a": [1, {"b": 3.0}]}, "a.1.b: 2.0"),
        ({"a": [1]}, {"a": [1, 2]}, "a: [1]"),
        ({"b": 1, "a": 1}, {"b": 2, "a": 2}, "a: 1"),
        ({"a": None}, {"a": {"b": 1}}, "a: None"),
        ({}, {"a": 1}, "a: only the continuum has it"),
    ],
)
def test_the_first_difference_is_found(a, b, found):
    difference = first_difference(a, b)
    assert difference is None if found is None else difference.startswith(found)


@pytest.mark.parametrize(("a", "b"), [(1, True), (False, 0), (0.0, -0.0), ("1", 1), (None, False)])
def test_values_that_python_takes_for_equal_are_not(a, b):
    assert first_difference({"key": a}, {"key": b}) == f"key: {a!r} on the discrete side, {b!r} on the continuum's"
    assert first_difference({"key": a}, {"key": a}) is None


def test_a_whole_number_may_be_written_without_a_point():
    assert first_difference({"key": [9, 0]}, {"key": [9.0, 0.0]}) is None
