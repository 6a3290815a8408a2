"""Line numbers of keys and tables, whatever else stands in a TOML text."""

import tomllib

from hypothesis import given, settings
from hypothesis import strategies as st

from coupler_protocol.scene.toml_lines import line_of, locate

TEXT = '''\
format = 1
title = """a text
[grid]
length = 7 # of several lines
"""
note = 'one with # and = and [brackets]'

  [grid]  # the mesh
length = 20.0
profile = [
  [0.0, 4.0],   # not a table
  [1.0, 4.0],
]
size = { x = 1, y = [1, 2] }
a.b = 3
"quoted key" = 4

[[material]]
name = "one ] [ two"
[material.elastic]
bulk = 1.0
[[ material ]]
name = """two \\""" [[material]] """
[[material.layer]]
top = 1
[[material.layer]]
top = 2
'''

EXPECTED = {
    ("format",): 1,
    ("title",): 2,
    ("note",): 6,
    ("grid",): 8,
    ("grid", "length"): 9,
    ("grid", "profile"): 10,
    ("grid", "size"): 14,
    ("grid", "a", "b"): 15,
    ("grid", "quoted key"): 16,
    ("material", 0): 18,
    ("material", 0, "name"): 19,
    ("material", 0, "elastic"): 20,
    ("material", 0, "elastic", "bulk"): 21,
    ("material", 1): 22,
    ("material", 1, "name"): 23,
    ("material", 1, "layer", 0): 24,
    ("material", 1, "layer", 0, "top"): 25,
    ("material", 1, "layer", 1): 26,
    ("material", 1, "layer", 1, "top"): 27,
}


def test_every_key_and_table_is_found_on_its_line():
    tomllib.loads(TEXT)
    assert locate(TEXT) == EXPECTED
    assert locate(TEXT.replace("\n", "\r\n")) == EXPECTED


def test_what_has_no_line_of_its_own_stands_where_its_surroundings_stand():
    lines = locate(TEXT)
    assert line_of(lines, ("grid", "size", "y", 1)) == 14
    assert line_of(lines, ("grid", "profile", 1, 0)) == 10
    assert line_of(lines, ("material", 0, "missing")) == 18
    assert line_of(lines, ("nowhere", "at", "all")) is None


def test_the_shipped_scenes_are_located_completely(configs):
    for path in configs.glob("*.toml"):
        text = path.read_text(encoding="utf-8")
        rows = text.splitlines()
        lines = locate(text)
        assert len(lines) == sum(1 for row in rows if row.strip().startswith("[") or (row[:1].isalpha() and "=" in row))
        for place, line in lines.items():
            assert str(next(p for p in reversed(place) if isinstance(p, str))) in rows[line - 1]


@settings(max_examples=60, deadline=None)
@given(st.text(max_size=80))
def test_no_text_is_too_strange(text):
    assert all(1 <= line <= text.count("\n") + 1 for line in locate(text).values())
